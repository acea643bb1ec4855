"""Hostile bytes for every reader, guided by coverage: `python -m tests.fuzz [--bytes 1e9] [--minutes M] [TARGET …]`, or `make fuzz`.

Each target runs in its own process with limits on memory (512 MB) and on time per input (10 s). The corpus from
tests/fuzz/corpus grows in build/fuzz. Findings are stored in build/fuzz/found: copy them to tests/fuzz/corpus/TARGET,
where the test suite runs them from then on. Exit 4 when anything was found.
"""

import argparse
import os
import re
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from rich.console import Console
from rich.progress import Progress, TaskID
from rich.table import Table

from tests.bench.machine import machine
from tests.fuzz.target import Target
from tests.fuzz.targets import TARGETS

CORPUS = Path(__file__).parent / "corpus"
_BUILD = Path("build/fuzz")
_COUNTS = struct.Struct("<QQ")
_MEMORY_MB, _INPUT_S = 512, 10
_COVERAGE = re.compile(r"cov: (\d+) ft: \d+ corp: (\d+)")
_FOUND = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """The result of one target.

    Attributes:
        runs: number of inputs.
        fed_bytes: their bytes.
        seconds: duration.
        edges: branches of our code that were reached.
        inputs: of the corpus, each of which reaches something new.
        problem: the finding; empty: none.
    """

    runs: int
    fed_bytes: int
    seconds: float
    edges: str
    inputs: str
    problem: str


def main() -> int:
    """Run and print."""
    options = _options()
    console = Console(stderr=True)
    outcomes = {}
    limit_s = options.minutes * 60 / len(options.targets) if options.minutes else None
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        for name in options.targets:
            budget = round(options.bytes * TARGETS[name].share)
            task = progress.add_task(name, total=budget)
            outcomes[name] = _fuzz(name, TARGETS[name], budget, limit_s, partial(_show, progress, task))
            if outcomes[name].problem:
                console.print(f"{name}: {outcomes[name].problem}", style="red", markup=False)
    _print(outcomes)
    return _FOUND if any(outcome.problem for outcome in outcomes.values()) else 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser("python -m tests.fuzz", description=__doc__)
    parser.add_argument("targets", nargs="*", metavar="TARGET", help=f"of {', '.join(TARGETS)} (default: all)")
    parser.add_argument(
        "--bytes", type=float, default=1e9, help="deframer and wire get half of it each, the others less (default 1e9)"
    )
    parser.add_argument("--minutes", type=float, help="end after this time at the latest, shared by the targets")
    options = parser.parse_args()
    options.targets = options.targets or list(TARGETS)
    if unknown := set(options.targets) - set(TARGETS):
        parser.error(f"no target {min(unknown)!r}: give {', '.join(TARGETS)}")
    return options


def _show(progress: Progress, task: TaskID, done: int) -> None:
    progress.update(task, completed=done)


def _fuzz(name: str, target: Target, budget: int, limit_s: float | None, show: Callable[[int], None]) -> Outcome:
    corpus, found = _BUILD / "corpus" / name, _BUILD / "found"
    corpus.mkdir(parents=True, exist_ok=True)
    found.mkdir(parents=True, exist_ok=True)
    for index, seed in enumerate(target.seeds()):
        (corpus / f"seed{index}").write_bytes(seed)
    kept = [str(CORPUS / name)] if (CORPUS / name).is_dir() else []
    meter, log = _BUILD / f"{name}.meter", _BUILD / f"{name}.log"
    meter.write_bytes(bytes(_COUNTS.size))
    limits = [f"-max_len={target.most_bytes}", f"-rss_limit_mb={_MEMORY_MB}", f"-timeout={_INPUT_S}", "-len_control=0"]
    command = [sys.executable, "-m", "tests.fuzz.worker", name, str(budget), str(meter), *limits]
    began_s = time.monotonic()
    with log.open("wb") as output:
        worker = subprocess.Popen(
            [*command, f"-artifact_prefix={found}/{name}-", str(corpus), *kept],
            stdout=output,
            stderr=subprocess.STDOUT,
            env=os.environ | {"PYTHONHASHSEED": "0"},
        )
        stopped = False
        try:
            while worker.poll() is None:
                time.sleep(0.2)
                show(_COUNTS.unpack(meter.read_bytes())[1])
                if limit_s is not None and time.monotonic() - began_s > limit_s:
                    stopped = True
                    break
        finally:
            worker.kill()
            worker.wait()
    seconds = time.monotonic() - began_s
    text = log.read_text(errors="replace")
    runs, fed_bytes = _COUNTS.unpack(meter.read_bytes())
    edges, inputs = (_COVERAGE.findall(text) or [("?", "?")])[-1]
    failed = not stopped and worker.returncode != 0
    return Outcome(
        runs=runs,
        fed_bytes=fed_bytes,
        seconds=seconds,
        edges=edges,
        inputs=inputs,
        problem=_problem(text, log) if failed else "",
    )


def _problem(text: str, log: Path) -> str:
    """The lines of a worker's output that say what was wrong and where its input is stored."""
    told = re.findall(
        r"=== Uncaught Python exception: ===\n(.*)|ERROR: (libFuzzer: .*)|(Test unit written to .*)", text
    )
    return "; ".join("".join(found) for found in told) or f"the worker ended; see {log}"


def _print(outcomes: dict[str, Outcome]) -> None:
    table = Table(title="fuzzing", title_justify="left")
    for title in ("target", "what", "runs", "runs/s", "MB", "edges", "corpus", "found"):
        table.add_column(title, justify="left" if title in {"target", "what", "found"} else "right")
    for name, outcome in outcomes.items():
        figures = (f"{outcome.runs}", f"{outcome.runs / outcome.seconds:.0f}", f"{outcome.fed_bytes / 1e6:.1f}")
        table.add_row(name, TARGETS[name].what, *figures, outcome.edges, outcome.inputs, outcome.problem or "nothing")
    print(machine())
    Console(width=160).print(table)
    total = sum(outcome.fed_bytes for outcome in outcomes.values())
    print(f"{total:.3g} bytes in {sum(outcome.seconds for outcome in outcomes.values()):.0f} s")


if __name__ == "__main__":
    sys.exit(main())
