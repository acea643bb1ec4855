"""delay-bench: the delays of every link and stage, measured on this machine."""

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from common.errors import SettingsError, UnavailableError
from common.program import logs
from common.program.commandline import INTERRUPTED, ExamplesFirstParser, run_command
from common.program.signals import StopSignals

if TYPE_CHECKING:
    from phone_host.bench.analysis import Analysis
    from phone_host.bench.cases import Interface
    from phone_host.bench.report import Conditions
    from phone_host.bench.runs import CaseResult, RunSettings

_EXAMPLES = """examples:
  delay-bench
  delay-bench --links tcp,ipc,serial --size 320x240,640x480 --quality 50,80 --fps 15,30 --seconds 20 --out bench
  delay-bench --emulate usb-serial,bluetooth,wifi --size 320x240 --quality 50 --fps 10 --out interfaces
  delay-bench --links tcp://192.168.7.2:5555 --seconds 30 --json
  delay-bench --size 320x240,640x480 --predict size=1280x720,fps=30 --predict link=bluetooth,processing=4
  delay-bench --emulate list

Runs a board-agent process and the host for each link, size, quality and rate, and prints each delay's p50, p95, p99 and maximum. The
first second of each run is left out of the statistics. A board elsewhere is measured with what its own camera shows: its size, quality and
rate cannot be set from here. --out gets
delay-bench.json, delay-bench.html (plots, the queueing model beside the measurement), delay-bench.svg and trace.json for Perfetto.
"""

_NOTHING_MEASURED = 4
_FILES = ("delay-bench.json", "delay-bench.html", "trace.json", "delay-bench.svg")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: without the program's name; None for those of the process.

    Returns:
        The exit code: 0 done, 2 wrong usage, 3 a link, a process or stdout cannot be had, 4 nothing was measured, 130 interrupted.
    """
    return run_command(_parser(), arguments, _run)


def _parser() -> argparse.ArgumentParser:
    parser = ExamplesFirstParser("delay-bench", description=_EXAMPLES)
    parser.add_argument(
        "--links",
        default="",
        metavar="NAMES",
        help="tcp, ipc, serial (over a pseudo terminal), rfcomm, or URIs of boards (default: every kind that is there)",
    )
    parser.add_argument(
        "--emulate", default="", metavar="NAMES", help="let links behave as these interfaces; `list` shows them"
    )
    parser.add_argument(
        "--size", default="320x240,640x480", metavar="SIZES", help="image sizes (default 320x240,640x480)"
    )
    parser.add_argument("--quality", default="80", metavar="PERCENTS", help="JPEG qualities (default 80)")
    parser.add_argument("--fps", default="15,30", metavar="RATES", help="frames per second (default 15,30)")
    parser.add_argument(
        "--seconds", type=float, default=4.0, metavar="S", help="length of each run after its warm-up (default 4)"
    )
    parser.add_argument(
        "--predict",
        action="append",
        default=[],
        metavar="CHANGES",
        help="predict a setting that is not run, for example fps=60,size=640x480,kB=40,fifo=4:block,processing=0.5,link=wifi",
    )
    parser.add_argument("--matcher", default="sgbm", metavar="NAME", help="stereo matcher (default sgbm)")
    parser.add_argument(
        "--fifo",
        default="1:drop-oldest",
        metavar="DEPTH:POLICY",
        help="queue before the matcher: drop-oldest, drop-newest or block (default 1:drop-oldest)",
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder for delay-bench.json, delay-bench.html and trace.json"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    parser.add_argument("--debug", action="store_true", help="show tracebacks")
    return parser


def _run(options: argparse.Namespace) -> int:
    if options.emulate == "list":
        _print_profiles(as_json=options.json)
        return 0
    from phone_host.bench.analysis import analyse  # noqa: PLC0415 - OpenCV, only now
    from phone_host.bench.cases import cases, parse_qualities, parse_rates, parse_sizes  # noqa: PLC0415
    from phone_host.bench.changes import parse_changes  # noqa: PLC0415
    from phone_host.bench.matrix import measure, remote_cases  # noqa: PLC0415
    from phone_host.bench.report import conditions  # noqa: PLC0415

    settings, changes = _settings(options), parse_changes(options.predict)
    asked = _interfaces(options)
    matrix = parse_sizes(options.size), parse_qualities(options.quality), parse_rates(options.fps)
    here, not_run = _available(asked)
    if options.out is not None:
        _make_folder(options.out)
    logs.set_up(30)
    signals = StopSignals()
    boards = remote_cases([interface for interface in here if interface.is_remote], signals)
    for case in boards:
        print(
            f"delay-bench: {case.interface} shows {case.images}; its camera is not set from here: "
            "--size, --quality and --fps do not count there",
            file=sys.stderr,
        )
    planned = (*cases([interface for interface in here if not interface.is_remote], *matrix), *boards)
    outcome = measure(planned, settings, signals)
    _tell(options, outcome.results, conditions(settings, not_run), analyse(outcome.results, settings.fifo, changes))
    if outcome.failure is not None:
        raise outcome.failure
    if signals.stop:
        how = "interrupted" if signals.interrupted else "stopped"
        print(f"delay-bench: {how} after {len(outcome.results)} of {len(planned)} runs", file=sys.stderr)
        return INTERRUPTED if signals.interrupted else 0
    return 0 if all(result.ledgers for result in outcome.results) else _NOTHING_MEASURED


def _interfaces(options: argparse.Namespace) -> "tuple[Interface, ...]":
    """What the options ask for."""
    from phone_host.bench.cases import interfaces, parse_links  # noqa: PLC0415 - OpenCV, only now
    from phone_host.bench.emulate import parse_profiles  # noqa: PLC0415

    links = parse_links(options.links) if options.links else ()
    return interfaces(links, parse_profiles(options.emulate) if options.emulate else ())


def _available(asked: "Sequence[Interface]") -> "tuple[list[Interface], list[tuple[Interface, str]]]":
    """Those that can be had here, and the others with the reason, which is said at once."""
    from phone_host.bench.links import obstacle  # noqa: PLC0415 - OpenCV, only now

    here, not_run = [], []
    for interface in asked:
        reason = obstacle(interface)
        if reason:
            print(f"delay-bench: {interface} is not run: {reason}", file=sys.stderr)
            not_run.append((interface, reason))
        else:
            here.append(interface)
    if not here:
        raise UnavailableError("none of the links can be had here", "name others with --links")
    return here, not_run


def _tell(
    options: argparse.Namespace, results: "Sequence[CaseResult]", under: "Conditions", analysis: "Analysis"
) -> None:
    """Print the table or the object, and write the files."""
    from phone_host.bench.page import figure, page  # noqa: PLC0415 - OpenCV, only now
    from phone_host.bench.report import as_json  # noqa: PLC0415
    from phone_host.bench.trace import TracedRun, trace_json  # noqa: PLC0415

    report = as_json(results, under, analysis)
    if options.json:
        print(json.dumps(report))
    else:
        _print(results, under, analysis)
    if options.out is None:
        return
    files = {
        "delay-bench.json": json.dumps(report, indent=1) + "\n",
        "delay-bench.html": page(results, under, analysis),
        "trace.json": trace_json([TracedRun(str(result.case), result.ledgers) for result in results]),
    }
    if any(result.ledgers for result in results):
        files["delay-bench.svg"] = figure(results, under)
    _write(options.out, files)


def _settings(options: argparse.Namespace) -> "RunSettings":
    from phone_host.bench.runs import RunSettings  # noqa: PLC0415 - OpenCV, only now
    from phone_host.stereo.matcher_names import MatcherName  # noqa: PLC0415
    from phone_host.sync.fifo import FifoSettings  # noqa: PLC0415

    if not 0.5 <= options.seconds <= 3600:
        raise SettingsError(f"--seconds {options.seconds:g}", "give 0.5 to 3600")
    if options.matcher not in {name.value for name in MatcherName}:
        raise SettingsError(
            f"--matcher {options.matcher!r} is unknown", f"give {' or '.join(name.value for name in MatcherName)}"
        )
    return RunSettings(MatcherName(options.matcher), FifoSettings.parse(options.fifo), options.seconds)


def _make_folder(folder: Path) -> None:
    from phone_host.output.listed import claim  # noqa: PLC0415

    try:
        claim(folder, *_FILES)
    except OSError as error:
        raise UnavailableError(
            f"results folder {folder} cannot be used ({error.strerror})", "give another with --out"
        ) from None


def _write(out: Path, files: dict[str, str]) -> None:
    from phone_host.output.atomic import write_text  # noqa: PLC0415

    try:
        for name, text in files.items():
            write_text(out / name, text)
    except OSError as error:
        raise UnavailableError(
            f"results in {out} cannot be written ({error.strerror})", "make room or give another folder with --out"
        ) from None


def _print(results: "Sequence[CaseResult]", under: "Conditions", analysis: "Analysis") -> None:
    """A table for each kind of images, stage by stage, the interfaces below each other."""
    from rich.console import Console  # noqa: PLC0415
    from rich.table import Table  # noqa: PLC0415

    from phone_host.bench.report import PERCENTILES, grouped  # noqa: PLC0415
    from phone_host.bench.tables import fit_lines, prediction_lines, regime_lines, rows, summary_line  # noqa: PLC0415

    console = Console(highlight=False)
    console.print(f"{under.machine}, {under.date}, matcher {under.matcher}", soft_wrap=True)
    for group in grouped(results):
        table = Table(title=f"{group[0].case.images}, delays in ms", title_justify="left")
        table.add_column("stage")
        table.add_column("link", overflow="fold")  # a board's URI is long, and its end is what tells it from another
        for name in PERCENTILES:
            table.add_column(name, justify="right")
        for row in rows(group):
            table.add_row(*row)
        console.print(table)
        for result in group:
            console.print(f"{result.case.interface}: {summary_line(result)}", soft_wrap=True)
            for line in regime_lines(result, under.fifo):
                console.print(f"  {line}", soft_wrap=True)
        console.print()
    for line in (*fit_lines(analysis), *prediction_lines(analysis)):
        console.print(line, soft_wrap=True)


def _print_profiles(*, as_json: bool) -> None:
    """What `--emulate` knows."""
    from phone_host.bench.emulate import PROFILES  # noqa: PLC0415

    if as_json:
        print(json.dumps({"profiles": [asdict(profile) for profile in PROFILES]}))
        return
    print(f"{'name':17} {'over':6} {'kB/s':>7} {'delay, ms':>13}  {'loss':22} from")
    for profile in PROFILES:
        least_ms, most_ms = profile.delay_ns / 1e6, (profile.delay_ns + profile.jitter_ns) / 1e6
        delay = f"{least_ms:g}" if least_ms == most_ms else f"{least_ms:g} to {most_ms:g}"
        stalls = f"1 of {1 / profile.stall_share:.0f} segments" if profile.stall_share else ""
        loss = f"1 byte of {1 / profile.byte_loss:.0f}" if profile.byte_loss else stalls
        rate = f"{profile.bytes_per_s / 1e3:g}"
        print(f"{profile.name:17} {profile.carrier:6} {rate:>7} {delay:>13}  {loss:22} {profile.source}")


if __name__ == "__main__":
    sys.exit(main())
