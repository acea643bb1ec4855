"""Measures the figures and writes docs/figures.md: `python -m tests.docs.figures [--only NAME] [--again]`, or `make figures`.

Runs each source (tests/docs/figure_sources.py) once and keeps its output in out/figures/NAME.json with its command,
date, exit code and machine. A source with a stored result of the same command runs again only with --again. The page is
generated from all these files, never by hand. A source without a file keeps the section that an earlier run wrote into the
page, on this machine or another. Exit 4 when a figure is missed, 1 when a source failed.
"""

import argparse
import json
import os
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from rich.console import Console
from rich.progress import Progress

from common import now
from tests.bench.machine import machine
from tests.docs.figure_sources import SOURCES, Figure, Source, Topic

_ROOT: Final = Path(__file__).parents[2]
PAGE: Final = _ROOT / "docs" / "figures.md"
_RESULTS: Final = _ROOT / "out" / "figures"
_MISSED: Final = 4
_CANNOT: Final = 3
_PATIENCE_S: Final = 1800
_END_S: Final = 20
_STEP_S: Final = 0.5
_NOT_YET: Final = "nobody has run it yet: `make figures` does"

_REACHED_WORD: Final = "reached"
_MISSED_WORD: Final = "**missed**"
_JUDGED: Final = re.compile(r"^\| (.*?) \| (.*?) \| (.*?): (reached|\*\*missed\*\*)(?:; .*)? \|$", re.MULTILINE)
"""A row of a figure that has a limit: what, figure, limit, verdict."""

_INTRO: Final = """# Figures

How fast, how exact, measured how? `make figures` runs the command under each table and writes this page; nobody edits it by hand. The full results stay
in `out/figures`. Some runs take ten minutes, all of them together an hour; without their arguments the benchmarks measure longer. p50 is
the median, p95 and p99 are the 95th and 99th percentile.
"""


@dataclass(frozen=True, slots=True)
class Outcome:
    """The result of a source's run: the content of its file.

    Attributes:
        command: the command line, as a reader types it.
        date: local wall-clock time.
        machine: processor, cores, kernel, interpreter.
        exit: code of the command.
        reason: why there are no figures; empty: there are some.
        data: its JSON.
    """

    command: str
    date: str
    machine: str
    exit: int
    reason: str
    data: dict[str, Any]

    @property
    def measured(self) -> bool:
        """Whether it produced figures."""
        return not self.reason


def main() -> int:
    """Measure what has not been measured yet, and write the page."""
    parser = argparse.ArgumentParser("python -m tests.docs.figures", description=__doc__)
    parser.add_argument("--only", choices=[source.name for source in SOURCES], help="run this source alone")
    parser.add_argument("--again", action="store_true", help="run also what has a result")
    options = parser.parse_args()
    _RESULTS.mkdir(parents=True, exist_ok=True)
    outcomes = load(_RESULTS)
    due = [
        source
        for source in SOURCES
        if options.only in {None, source.name} and (options.again or not _is_current(source, outcomes.get(source.name)))
    ]
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("", total=sum(source.about_s for source in due))
        for source in due:
            progress.update(task, description=f"{source.name}, about {source.about_s} s")
            outcome = _run(source, lambda share_s: progress.advance(task, share_s))
            (_RESULTS / f"{source.name}.json").write_text(json.dumps(asdict(outcome), indent=1) + "\n", "utf-8")
            outcomes[source.name] = outcome
    before = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    PAGE.write_text(page(outcomes, before), encoding="utf-8")
    print(f"look at {PAGE.relative_to(_ROOT)}")
    failed = [name for name, outcome in outcomes.items() if outcome.reason and outcome.exit != _CANNOT]
    for name, outcome in outcomes.items():
        if outcome.reason:
            print(f"{'error: ' if name in failed else ''}{name} was not measured: {outcome.reason}", file=sys.stderr)
    missed = [figure for _, figure in _judged(outcomes) if not figure.reached]
    for figure in missed:
        print(f"missed: {figure.what}: {figure.figure} (to reach: {figure.limit})")
    return 1 if failed else _MISSED if missed else 0


def load(folder: Path) -> dict[str, Outcome]:
    """Read the results of all known sources, by name.

    Args:
        folder: with a file NAME.json for each.
    """
    found = {}
    for source in SOURCES:
        path = folder / f"{source.name}.json"
        if path.exists():
            found[source.name] = Outcome(**json.loads(path.read_text(encoding="utf-8")))
    return found


def _is_current(source: Source, outcome: Outcome | None) -> bool:
    return outcome is not None and outcome.measured and outcome.command == source.command


def _run(source: Source, tell: Callable[[float], None]) -> Outcome:
    """Run a source's command.

    Args:
        source: what to run.
        tell: receives each elapsed part of its `about_s`, s; in the end all of it.
    """
    here = machine()
    about = f"{here.cpu}, {here.cores} cores, {here.kernel}, Python {here.python}"

    def outcome(code: int, reason: str = "", data: dict[str, Any] | None = None) -> Outcome:
        return Outcome(source.command, here.date, about, code, reason, data or {})

    if "$SCAN_DATA" in source.command and not os.environ.get("SCAN_DATA"):
        tell(source.about_s)
        return outcome(_CANNOT, "SCAN_DATA does not name the folder of real images")
    words = [os.path.expandvars(word) for word in shlex.split(source.command)]
    began_ns = now.monotonic_ns()
    process = subprocess.Popen(
        [str(Path(sys.executable).parent / words[0]), *words[1:]],
        cwd=_ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,  # so that all of its processes can be ended together
    )
    told_s = 0.0
    out: str | None = None
    error = ""
    try:
        while out is None and (now.monotonic_ns() - began_ns) / 1e9 < _PATIENCE_S:
            try:
                out, error = process.communicate(timeout=_STEP_S)
            except subprocess.TimeoutExpired:
                step_s = min(_STEP_S, source.about_s - told_s)
                told_s += step_s
                tell(step_s)
    finally:
        _end(process)
        tell(source.about_s - told_s)
    if out is None:
        return outcome(1, f"it took more than {_PATIENCE_S // 60} minutes")
    if process.returncode not in {0, _MISSED}:
        said = _without_paths((error.strip().splitlines() or ["it said nothing"])[-1])
        return outcome(process.returncode, said if process.returncode == _CANNOT else f"it failed: {said}")
    try:
        return outcome(process.returncode, data=json.loads(out))
    except ValueError:
        return outcome(1, "it failed: what it printed is no JSON")


def _end(process: subprocess.Popen[str]) -> None:
    """End a process that still runs, with everything it started."""
    for number in (signal.SIGINT, signal.SIGKILL):
        if process.poll() is None:
            os.killpg(process.pid, number)
            try:
                process.wait(_END_S)
            except subprocess.TimeoutExpired:
                continue


def _without_paths(line: str) -> str:
    """Remove this machine's folders from a line."""
    for path, name in ((os.environ.get("SCAN_DATA"), "$SCAN_DATA"), (str(_ROOT), "."), (str(Path.home()), "~")):
        line = line.replace(path, name) if path and path != "/" else line
    return line.removeprefix("error: ")


def figures(source: Source, outcome: Outcome) -> list[Figure]:
    """The rows of a measured source."""
    return list(source.rows(outcome.data))


def _judged(outcomes: Mapping[str, Outcome]) -> Iterator[tuple[Source, Figure]]:
    """All figures that have a limit."""
    for source in SOURCES:
        outcome = outcomes.get(source.name)
        if outcome is not None and outcome.measured:
            yield from ((source, figure) for figure in figures(source, outcome) if figure.limit)


def page(outcomes: Mapping[str, Outcome], before: str = "") -> str:
    """The page's text.

    Args:
        outcomes: by name of the source; a source without one has not been run here.
        before: the page as an earlier run wrote it; it gives the sections of the sources that have not been run here.
    """
    sections = {
        source.name: (source.name not in outcomes and _kept(source, before))
        or _section(source, outcomes.get(source.name))
        for source in SOURCES
    }
    judged = [(source, row) for source in SOURCES for row in _JUDGED.findall(sections[source.name])]
    missed = [
        f"- {source.topic.value}: {what}: {figure} (to reach: {limit})\n"
        for source, (what, figure, limit, verdict) in judged
        if verdict == _MISSED_WORD
    ]
    summary = f"\nOf {len(judged)} figures that are to be reached, {len(judged) - len(missed)} were."
    parts = [_INTRO, summary, *([" **Missed:**\n\n", *missed] if missed else ["\n"])]
    for topic in Topic:
        parts.append(f"\n## {topic.value}\n")
        parts += [sections[source.name] for source in SOURCES if source.topic is topic]
    return "".join(parts)


def _kept(source: Source, before: str) -> str:
    """The section of a source on an earlier page; empty if there is none of the same command."""
    head = f"\n{source.title}\n\n"
    begin = before.find(head)
    origin = before.find("\n`", begin)
    end = before.find("\n", origin + 1) + 1
    is_kept = begin >= 0 and before.startswith(f"\n`{source.command}`", origin)
    return before[begin:end] if is_kept else ""


def _section(source: Source, outcome: Outcome | None) -> str:
    if outcome is None or not outcome.measured:
        why = _NOT_YET if outcome is None else _cell(outcome.reason)
        return f"\n{source.title}\n\nNot measured on this machine: {why}.\n\n{_origin(source.command)}\n"
    table = ["| what is measured | figure | to reach, or beside it |", "|---|---|---|"]
    table += [
        f"| {_cell(row.what)} | {_cell(row.figure)} | {'; '.join(filter(None, (_verdict(row), _cell(row.anchor))))} |"
        for row in figures(source, outcome)
    ]
    origin = _origin(outcome.command, outcome.machine, outcome.date.partition("T")[0])
    return "\n".join(["", source.title, "", *table, "", origin, ""])


def _verdict(figure: Figure) -> str:
    if not figure.limit:
        return ""
    return f"{_cell(figure.limit)}: {_REACHED_WORD if figure.reached else _MISSED_WORD}"


def _origin(*parts: str) -> str:
    command, *others = parts
    return ", ".join([f"`{command}`", *others])


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;").replace("\n", " ").replace("*", "\\*")


if __name__ == "__main__":
    sys.exit(main())
