"""delay-bench: the delays of every link and stage, measured on this machine."""

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from common import logs
from common.commandline import INTERRUPTED, ExamplesFirstParser, run_command
from common.errors import SettingsError, UnavailableError
from common.signals import StopSignals

if TYPE_CHECKING:
    from phone_host.bench import Case, CaseResult, Size
    from phone_host.bench_report import Conditions
    from phone_host.film import Film
    from phone_host.stereo.match import MatcherName

_EXAMPLES = """examples:
  delay-bench
  delay-bench --links tcp,ipc --size 640x480 --fps 30 --seconds 20 --out bench
  delay-bench --links ipc --size 320x240 --fps 15 --json

Runs a board-agent process and the host for each link, size and rate, and prints each delay's p50, p95, p99 and maximum.
The first second of each run is left out of the statistics. --out gets delay-bench.json and delay-bench.html.
"""


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


def _parser() -> argparse.ArgumentParser:
    parser = ExamplesFirstParser("delay-bench", description=_EXAMPLES)
    parser.add_argument("--links", default="tcp,ipc", metavar="NAMES", help="links to measure (default tcp,ipc)")
    parser.add_argument(
        "--size", default="320x240,640x480", metavar="SIZES", help="image sizes (default 320x240,640x480)"
    )
    parser.add_argument("--fps", default="15,30", metavar="RATES", help="frames per second (default 15,30)")
    parser.add_argument(
        "--seconds", type=float, default=4.0, metavar="S", help="length of each run after its warm-up (default 4)"
    )
    parser.add_argument("--matcher", default="sgbm", metavar="NAME", help="stereo matcher (default sgbm)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for delay-bench.json and delay-bench.html")
    parser.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    parser.add_argument("--debug", action="store_true", help="show tracebacks")
    return parser


def _run(options: argparse.Namespace) -> int:
    from phone_host.bench import cases, parse_links, parse_rates, parse_sizes  # noqa: PLC0415 - OpenCV, only now
    from phone_host.bench_report import as_json, conditions  # noqa: PLC0415
    from phone_host.stereo.match import MatcherName  # noqa: PLC0415

    if not 0.5 <= options.seconds <= 3600:
        raise SettingsError(f"--seconds {options.seconds:g}", "give 0.5 to 3600")
    if options.matcher not in {name.value for name in MatcherName}:
        raise SettingsError(
            f"--matcher {options.matcher!r} is unknown", f"give {' or '.join(name.value for name in MatcherName)}"
        )
    planned = cases(parse_links(options.links), parse_sizes(options.size), parse_rates(options.fps))
    if options.out is not None:
        _make_folder(options.out)
    logs.set_up(30)
    signals = StopSignals()
    results = _measure(planned, MatcherName(options.matcher), options.seconds, signals)
    under = conditions(options.matcher, options.seconds)
    report = as_json(results, under)
    if options.out is not None:
        _write(options.out, report, results, under)
    if options.json:
        print(json.dumps(report))
    else:
        _print(results, under)
    if signals.stop:
        how = "interrupted" if signals.interrupted else "stopped"
        print(f"delay-bench: {how} after {len(results)} of {len(planned)} runs", file=sys.stderr)
        return INTERRUPTED if signals.interrupted else 0
    return 0 if all(result.ledgers for result in results) else 4


def _measure(
    planned: "Sequence[Case]", matcher: "MatcherName", seconds: float, signals: StopSignals
) -> "list[CaseResult]":
    """Run all cases; those that were done before a signal came."""
    from rich.console import Console  # noqa: PLC0415
    from rich.progress import Progress  # noqa: PLC0415

    from phone_host.bench import film_images, render, run_case  # noqa: PLC0415

    console = Console(stderr=True)
    films: dict[Size, Film] = {}
    results: list[CaseResult] = []
    with (
        tempfile.TemporaryDirectory(prefix="delay-bench-") as name,
        Progress(console=console, transient=True, disable=not console.is_terminal) as progress,
    ):
        folder = Path(name)
        sizes = {case.size for case in planned}
        task = progress.add_task("rendering", total=len(sizes) * film_images() + len(planned) * film_images())

        def advance() -> None:
            progress.advance(task)
            if signals.stop:
                raise _StoppedError

        for case in planned:
            try:
                if case.size not in films:
                    progress.update(task, description=f"rendering {case.size}")
                    films[case.size] = render(case.size, folder / str(case.size), advance)
            except _StoppedError:
                break
            except OSError as error:
                raise UnavailableError(
                    f"temporary folder {folder} cannot be used ({error.strerror})", "make room, or set TMPDIR"
                ) from None
            progress.update(task, description=str(case))
            result = run_case(case, films[case.size], folder, matcher, seconds=seconds, stop=lambda: signals.stop)
            if result is None:
                break
            results.append(result)
            progress.advance(task, film_images())
    return results


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UnavailableError(
            f"results folder {folder} cannot be used ({error.strerror})", "give another with --out"
        ) from None


def _write(out: Path, report: dict[str, object], results: "Sequence[CaseResult]", under: "Conditions") -> None:
    from phone_host.bench_report import page  # noqa: PLC0415
    from phone_host.formats.atomic import write_text  # noqa: PLC0415

    try:
        write_text(out / "delay-bench.json", json.dumps(report, indent=1) + "\n")
        write_text(out / "delay-bench.html", page(results, under))
    except OSError as error:
        raise UnavailableError(
            f"results in {out} cannot be written ({error.strerror})", "make room or give another folder with --out"
        ) from None


def _print(results: "Sequence[CaseResult]", under: "Conditions") -> None:
    """A table for each size and rate, stage by stage, the links below each other."""
    from rich.console import Console  # noqa: PLC0415
    from rich.table import Table  # noqa: PLC0415

    from phone_host.bench_report import PERCENTILES, grouped, rows, summary_line  # noqa: PLC0415

    console = Console(highlight=False)
    console.print(f"{under.machine}, {under.date}, matcher {under.matcher}", soft_wrap=True)
    for group in grouped(results):
        case = group[0].case
        table = Table(title=f"{case.size} at {case.rate_hz} frames/s, delays in ms", title_justify="left")
        for name in ("stage", "link"):
            table.add_column(name)
        for name in PERCENTILES:
            table.add_column(name, justify="right")
        for row in rows(group):
            table.add_row(*row)
        console.print(table)
        for result in group:
            console.print(f"{result.case.link}: {summary_line(result)}", soft_wrap=True)
        console.print()


if __name__ == "__main__":
    sys.exit(main())
