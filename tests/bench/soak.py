"""How long everything runs well: `python -m tests.bench.soak [--help]`; `make soak` runs both parts at their full length.

board, 10 minutes: the installed service on a booted virtual board with a webcam at 30 per second. No frame that the
camera delivered may be lost, age at the host p99 must stay below 3 periods, and memory must stay flat. host, 30
minutes: board-agent and phone-host with a cheap matcher over loopback at 30 pairs a second. Memory of both must stay
flat, no delay may drift between the first minutes and the last, and every frame must be accounted for. Exit 4 when a
limit is missed.
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Final

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from common.errors import UnavailableError
from tests.bench.machine import machine
from tests.bench.soak_board import soak_board
from tests.bench.soak_checks import Check
from tests.bench.soak_host import soak_host

_Part = Callable[[Path, float, Callable[[float], None]], list[Check]]
_PARTS: Final[dict[str, tuple[_Part, float]]] = {"board": (soak_board, 10.0), "host": (soak_host, 30.0)}
"""Each part with its full length, minutes."""


def main() -> int:
    """Run and print; exit code 3 when something is missing, 4 when a limit is missed."""
    parser = argparse.ArgumentParser("python -m tests.bench.soak", description=__doc__)
    parser.add_argument("--minutes", type=float, help="length of each part (default: board 10, host 30)")
    parser.add_argument("--parts", nargs="+", choices=list(_PARTS), default=list(_PARTS))
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    console, checks, lengths = Console(stderr=True), [], {}
    try:
        with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
            for part in options.parts:
                soak, full = _PARTS[part]
                lengths[part] = full if options.minutes is None else options.minutes
                task = progress.add_task(f"{part}, {lengths[part]:g} min", total=1.0)
                with tempfile.TemporaryDirectory() as folder:
                    checks += soak(Path(folder), lengths[part], lambda share: progress.update(task, completed=share))  # noqa: B023 - called within
    except UnavailableError as error:
        print(f"error: {error}", file=sys.stderr)
        return 3
    if options.json:
        print(
            json.dumps({"machine": str(machine()), "minutes": lengths, "checks": [asdict(check) for check in checks]})
        )
    else:
        _print(checks, lengths)
    return 0 if all(check.holds for check in checks) else 4


def _print(checks: list[Check], lengths: dict[str, float]) -> None:
    print(f"{machine()}\n" + ", ".join(f"{part} {minutes:g} min" for part, minutes in lengths.items()))
    table = Table()
    for title in ("part", "what", "found", "limit", ""):
        table.add_column(title)
    for check in checks:
        table.add_row(check.part, check.what, check.found, check.limit, "holds" if check.holds else "MISSED")
    Console(width=150).print(table)


if __name__ == "__main__":
    sys.exit(main())
