"""All attacks, for minutes: `python -m tests.system.hostile [--help]`; `make attack` runs them for ten. Exit 4 if a limit is missed.

Each attack gets an equal share of the time and is repeated within it, at least once. The tests beside this file run some of the same attacks once.
"""

import argparse
import json
import sys
import tempfile
from pathlib import Path
from typing import Any, Final

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from tests.bench.machine import machine
from tests.system.hostile import clocks, crowds, full_disks, killed, lies, lying_host
from tests.system.hostile.attack import Attack, Outcome, Rounds

ATTACKS: Final[tuple[Attack, ...]] = (
    *clocks.SHORT,
    *clocks.LONG_ONLY,
    *lies.SINGLE,
    *lying_host.LONG,
    *crowds.LONG,
    *full_disks.LONG,
    *killed.LONG,
)
_START_S: Final = 4.0
"""About this much of an attack's share goes to starting and ending the programs."""


def main() -> int:
    """Run and print; return 2 when a named attack does not exist, 4 when a limit is missed."""
    parser = argparse.ArgumentParser("python -m tests.system.hostile", description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0, help="for all attacks together (default: 10)")
    parser.add_argument("--only", metavar="WORD", help="attacks whose name contains this")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    chosen = [attack for attack in ATTACKS if options.only is None or options.only in attack.name]
    if not chosen:
        parser.error(f"no attack has {options.only!r} in its name")
    share_s = max(0.0, 60 * options.minutes / len(chosen) - _START_S)
    console = Console(stderr=True)
    found: list[tuple[Attack, Outcome]] = []
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("attacks", total=len(chosen))
        for attack in chosen:
            progress.update(task, description=attack.name)
            found.append((attack, _run(attack, share_s)))
            progress.advance(task)
    if options.json:
        print(json.dumps({"machine": str(machine()), "attacks": [_values(*one) for one in found]}))
    else:
        _print(found)
    return 4 if any(outcome.missed() for _, outcome in found) else 0


def _run(attack: Attack, share_s: float) -> Outcome:
    with tempfile.TemporaryDirectory(prefix="attack-", ignore_cleanup_errors=True) as folder:
        try:
            return attack.run(Path(folder), Rounds(share_s))
        except AssertionError as error:  # no stream came up, or a wait timed out: the other attacks go on
            return Outcome(faults=[" ".join(str(error).split())[:200]])


def _values(attack: Attack, outcome: Outcome) -> dict[str, Any]:
    median, p95 = outcome.gap_s
    return {
        "attack": attack.name,
        "load": attack.load,
        "frames": outcome.frames,
        "pairs": outcome.pairs,
        "wrong": outcome.wrong,
        "gaps": len(outcome.gaps_s),
        "gap_median_s": _number(median),
        "gap_p95_s": _number(p95),
        "memory": outcome.memory or None,
        "figures": outcome.figures,
        "missed": outcome.missed(),
    }


def _number(value: float) -> float | None:
    return None if value != value else round(value, 3)  # noqa: PLR0124 - NaN is the only value unlike itself


def _print(found: list[tuple[Attack, Outcome]]) -> None:
    print(machine())
    table = Table(show_lines=True)
    for title in ("attack", "load", "frames", "pairs", "wrong", "gap s p50 / p95 (n)", "memory x", "verdict"):
        table.add_column(title)
    for attack, outcome in found:
        median, p95 = outcome.gap_s
        gaps = f"{median:.2f} / {p95:.2f} ({len(outcome.gaps_s)})" if outcome.gaps_s else ""
        memory = f"{outcome.memory:.2f}" if outcome.memory else ""
        figures = f" ({', '.join(outcome.figures[:3])})" if outcome.figures else ""
        verdict = "MISSED: " + "; ".join(outcome.missed()) if outcome.missed() else "holds"
        counts = str(outcome.frames), str(outcome.pairs), str(outcome.wrong)
        table.add_row(attack.name, attack.load + figures, *counts, gaps, memory, verdict)
    Console(width=180).print(table)


if __name__ == "__main__":
    sys.exit(main())
