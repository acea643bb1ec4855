"""delay-bench: the delays of every link and stage, measured on this machine."""

import argparse
import json
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final, Self

from common import logs, now
from common.commandline import INTERRUPTED, ExamplesFirstParser, run_command
from common.errors import SettingsError, TandemError, UnavailableError
from common.signals import StopSignals

if TYPE_CHECKING:
    from phone_host.bench.analysis import Analysis
    from phone_host.bench.cases import Case, Interface, Size
    from phone_host.bench.report import Conditions
    from phone_host.bench.runs import CaseResult, RunSettings
    from phone_host.film import Film

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
_RENDER_S: Final = 0.06
"""An image takes about this long to render, for the progress bar's idea of the time that remains."""

_SET_UP_S: Final = 2.0
"""A run takes so much longer than its seconds: processes begin and end."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: without the program's name; None for those of the process.

    Returns:
        The exit code: 0 done, 2 wrong usage, 3 a link, a process or stdout cannot be had, 4 nothing was measured, 130 interrupted.
    """
    return run_command(_parser(), arguments, _run)


class _StoppedError(Exception):
    """Raised inside the rendering when the user wants to stop."""


@dataclass(slots=True)
class _Outcome:
    """What a matrix of cases has given so far, and what ended it before its time."""

    results: "list[CaseResult]" = field(default_factory=list)
    failure: TandemError | None = None


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
    from phone_host.bench.cases import (  # noqa: PLC0415 - only what this run needs is loaded
        cases,
        interfaces,
        parse_links,
        parse_qualities,
        parse_rates,
        parse_sizes,
    )
    from phone_host.bench.changes import parse_changes  # noqa: PLC0415
    from phone_host.bench.links import obstacle  # noqa: PLC0415
    from phone_host.bench.page import figure, page  # noqa: PLC0415
    from phone_host.bench.report import as_json, conditions  # noqa: PLC0415
    from phone_host.emulate import parse_profiles  # noqa: PLC0415
    from phone_host.trace import TracedRun, trace_json  # noqa: PLC0415

    settings, changes = _settings(options), parse_changes(options.predict)
    asked = interfaces(
        parse_links(options.links) if options.links else (), parse_profiles(options.emulate) if options.emulate else ()
    )
    matrix = parse_sizes(options.size), parse_qualities(options.quality), parse_rates(options.fps)
    not_run = [(interface, reason) for interface in asked if (reason := obstacle(interface))]
    for interface, reason in not_run:
        print(f"delay-bench: {interface} is not run: {reason}", file=sys.stderr)
    here = [interface for interface in asked if not obstacle(interface)]
    if not here:
        raise UnavailableError("none of the links can be had here", "name others with --links")
    if options.out is not None:
        _make_folder(options.out)
    logs.set_up(30)
    signals = StopSignals()
    boards = _remote_cases([interface for interface in here if interface.is_remote], signals)
    planned = (*cases([interface for interface in here if not interface.is_remote], *matrix), *boards)
    outcome = _measure(planned, settings, signals)
    under = conditions(settings, not_run)
    analysis = analyse(outcome.results, settings.fifo, changes)
    report = as_json(outcome.results, under, analysis)
    if options.json:
        print(json.dumps(report))
    else:
        _print(outcome.results, under, analysis)
    if options.out is not None:
        files = {
            "delay-bench.json": json.dumps(report, indent=1) + "\n",
            "delay-bench.html": page(outcome.results, under, analysis),
            "trace.json": trace_json([TracedRun(str(result.case), result.ledgers) for result in outcome.results]),
        }
        if any(result.ledgers for result in outcome.results):
            files["delay-bench.svg"] = figure(outcome.results, under)
        _write(options.out, files)
    if outcome.failure is not None:
        raise outcome.failure
    if signals.stop:
        how = "interrupted" if signals.interrupted else "stopped"
        print(f"delay-bench: {how} after {len(outcome.results)} of {len(planned)} runs", file=sys.stderr)
        return INTERRUPTED if signals.interrupted else 0
    return 0 if all(result.ledgers for result in outcome.results) else _NOTHING_MEASURED


def _settings(options: argparse.Namespace) -> "RunSettings":
    from phone_host.bench.runs import RunSettings  # noqa: PLC0415 - OpenCV, only now
    from phone_host.stereo.match import MatcherName  # noqa: PLC0415
    from phone_host.sync.fifo import FifoSettings  # noqa: PLC0415

    if not 0.5 <= options.seconds <= 3600:
        raise SettingsError(f"--seconds {options.seconds:g}", "give 0.5 to 3600")
    if options.matcher not in {name.value for name in MatcherName}:
        raise SettingsError(
            f"--matcher {options.matcher!r} is unknown", f"give {' or '.join(name.value for name in MatcherName)}"
        )
    return RunSettings(MatcherName(options.matcher), FifoSettings.parse(options.fifo), options.seconds)


def _remote_cases(remote: "Sequence[Interface]", signals: StopSignals) -> "list[Case]":
    """What the boards elsewhere show; an absent one is an error before anything is measured."""
    from phone_host.bench.links import ask_board  # noqa: PLC0415
    from phone_host.bench.runs import PATIENCE_NS  # noqa: PLC0415

    found = []
    for interface in remote:
        case = ask_board(interface.link, PATIENCE_NS, lambda: signals.stop)
        if case is None:
            break
        print(
            f"delay-bench: {interface.link} shows {case.images}; its camera is not set from here: "
            "--size, --quality and --fps do not count there",
            file=sys.stderr,
        )
        found.append(case)
    return found


def _measure(planned: "Sequence[Case]", settings: "RunSettings", signals: StopSignals) -> _Outcome:
    """Run all cases, until a signal comes or one fails; what was measured before stays."""
    from phone_host.bench.runs import WARM_UP_S, film_images, run_case  # noqa: PLC0415

    outcome = _Outcome()
    run_s = _SET_UP_S + WARM_UP_S + settings.seconds
    render_s = film_images() * _RENDER_S
    sizes = dict.fromkeys(case.size for case in planned)
    with (
        tempfile.TemporaryDirectory(prefix="delay-bench-") as name,
        _Bar(len(sizes) * render_s + len(planned) * run_s, signals) as bar,
    ):
        folder = Path(name)
        films: dict[tuple[Size, int], Film] = {}
        for number, case in enumerate(planned):
            try:
                if (case.size, case.quality_percent) not in films:
                    bar.begin(f"rendering {case.size}", render_s)
                    films |= _films(planned, case.size, folder, bar.rendered)
                bar.begin(f"{number + 1}/{len(planned)} {case}", run_s)
                result = run_case(
                    case,
                    films[case.size, case.quality_percent],
                    _fresh(folder / f"run{number}"),
                    settings,
                    stop=bar.stopped,
                )
            except _StoppedError:
                break
            except TandemError as error:
                outcome.failure = error
                break
            if result is not None:
                outcome.results.append(result)
            if signals.stop:
                break
    return outcome


class _Bar:
    """The progress bar over the whole matrix, in seconds of expected time; nothing where stderr is no terminal.

    Args:
        total_s: all work.
        signals: asked while work goes on.
    """

    def __init__(self, total_s: float, signals: StopSignals) -> None:
        from rich.console import Console  # noqa: PLC0415
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn  # noqa: PLC0415

        console = Console(stderr=True)
        columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("left"), TimeRemainingColumn())
        self._progress = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
        self._task = self._progress.add_task("", total=total_s)
        self._signals = signals
        self._done_s = self._length_s = 0.0
        self._begun_ns = now.monotonic_ns()

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def begin(self, what: str, length_s: float) -> None:
        """A piece of work begins, so the one before is done."""
        self._done_s += self._length_s
        self._length_s, self._begun_ns = length_s, now.monotonic_ns()
        self._progress.update(self._task, description=what, completed=self._done_s)

    def stopped(self) -> bool:
        """Show how far it is; gives whether the user wants to stop."""
        elapsed_s = (now.monotonic_ns() - self._begun_ns) / 1e9
        self._progress.update(self._task, completed=self._done_s + min(elapsed_s, self._length_s))
        return self._signals.stop

    def rendered(self) -> None:
        """An image was rendered."""
        if self.stopped():
            raise _StoppedError


def _films(
    planned: "Sequence[Case]", size: "Size", folder: Path, advance: Callable[[], None]
) -> "dict[tuple[Size, int], Film]":
    """The films of one size, in all its qualities."""
    from phone_host.bench.runs import render  # noqa: PLC0415

    qualities = tuple(dict.fromkeys(case.quality_percent for case in planned if case.size == size))
    try:
        films = render(size, qualities, folder / str(size), advance)
    except OSError as error:
        raise _no_room(folder, error) from None
    return {(size, quality): film for quality, film in films.items()}


def _fresh(folder: Path) -> Path:
    """A new folder for one run's sockets."""
    try:
        folder.mkdir()
    except OSError as error:
        raise _no_room(folder, error) from None
    return folder


def _no_room(folder: Path, error: OSError) -> UnavailableError:
    return UnavailableError(f"temporary folder {folder} cannot be used ({error.strerror})", "make room, or set TMPDIR")


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UnavailableError(
            f"results folder {folder} cannot be used ({error.strerror})", "give another with --out"
        ) from None


def _write(out: Path, files: dict[str, str]) -> None:
    from phone_host.formats.atomic import write_text  # noqa: PLC0415

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

    from phone_host.bench.report import (  # noqa: PLC0415
        PERCENTILES,
        fit_lines,
        grouped,
        prediction_lines,
        rows,
        summary_line,
    )

    console = Console(highlight=False)
    console.print(f"{under.machine}, {under.date}, matcher {under.matcher}", soft_wrap=True)
    for group in grouped(results):
        table = Table(title=f"{group[0].case.images}, delays in ms", title_justify="left")
        for name in ("stage", "link"):
            table.add_column(name)
        for name in PERCENTILES:
            table.add_column(name, justify="right")
        for row in rows(group):
            table.add_row(*row)
        console.print(table)
        for result in group:
            console.print(f"{result.case.interface}: {summary_line(result)}", soft_wrap=True)
        console.print()
    for line in (*fit_lines(analysis), *prediction_lines(analysis)):
        console.print(line, soft_wrap=True)


def _print_profiles(*, as_json: bool) -> None:
    """What `--emulate` knows."""
    from phone_host.emulate import PROFILES  # noqa: PLC0415

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
