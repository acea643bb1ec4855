"""How long the stream pauses when the carrier is lost and when the better link returns: `python -m tests.bench.bench_links [--help]`.

Both programs run over a serial cable (a pseudo terminal, 3 MB/s) and tcp or ipc. JPEGs of 5 KB at 30 per second make
the cable the better link. The cable is pulled, or falls silent without notice, several times. A pause is the time
between the last frame over one link and the first frame over the other, as received by the host (delays.jsonl); it
includes 33 ms, the camera's period. The way back is a choice: the cable must prove itself for a second, and for twice
as long after each loss. Its pause is what the change costs. Figures to reach for a pulled cable (DESIGN, section 7):
median 1 s, p95 2 s; a silent cable is known as lost after 1.5 s. Exit 4 when one is missed.
"""

import argparse
import json
import statistics
import sys
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import Progress

from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine
from tests.support.numbered import write_film
from tests.support.programs import board, free_port, host, ledgers, lines, until
from tests.support.pty_line import PtyLine

_FPS = 30


@dataclass(frozen=True, slots=True)
class Row:
    """One way of losing the cable, with one other link.

    Attributes:
        way: `pulled` or `silent`.
        other: kind of the other link.
        there_ms: pause of each change to the other link.
        back_ms: pause of each return.
        lost: frames lost per switch.
    """

    way: str
    other: str
    there_ms: list[float]
    back_ms: list[float]
    lost: float


def main() -> int:
    """Measure and print a table; exit code 4 when a figure is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--losses", type=int, default=3, help="how often the cable is lost in each way (default 3)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    console, rows = Console(stderr=True), []
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        for way, other in progress.track([(way, other) for way in ("pulled", "silent") for other in ("tcp", "ipc")]):
            with tempfile.TemporaryDirectory() as folder:
                rows.append(Row(way, other, *measure(Path(folder), way, other, options.losses)))
    verdicts = _judge(rows)
    if options.json:
        shown = {"rows": [asdict(row) for row in rows], "verdicts": [asdict(verdict) for verdict in verdicts]}
        print(json.dumps({"machine": str(machine()), "losses": options.losses, **shown}))
        return exit_code(verdicts)
    print(machine())
    print(
        f"{'cable':>8} {'other':>6} {'to the other, ms: p50':>22} {'max':>8} {'back, ms: p50':>14} {'max':>8} {'lost a switch':>14}"
    )
    for row in rows:
        there, back = ((statistics.median(pauses), max(pauses)) for pauses in (row.there_ms, row.back_ms))
        print(
            f"{row.way:>8} {row.other:>6} {there[0]:22.0f} {there[1]:8.0f} {back[0]:14.0f} {back[1]:8.0f} {row.lost:14.1f}"
        )
    print(*verdicts, sep="\n")
    return exit_code(verdicts)


def _judge(rows: list[Row]) -> list[Verdict]:
    pauses_ms = [pause for row in rows if row.way == "pulled" for pause in row.there_ms]
    found = (("median", statistics.median(pauses_ms), 1000), ("p95", float(np.percentile(pauses_ms, 95)), 2000))
    return [
        Verdict(f"pause when the cable is pulled, {name}", value <= limit, f"{value:.0f} ms", f"{limit} ms")
        for name, value, limit in found
    ]


def measure(folder: Path, way: str, other: str, losses: int) -> tuple[list[float], list[float], float]:
    """Lose the cable and bring it back.

    Args:
        folder: for the run's files.
        way: `pulled` or `silent`.
        other: kind of the other link.
        losses: how often.

    Returns:
        Pauses at the loss and at the return, ms, and frames lost per switch.
    """
    film = write_film(folder / "film", 300)
    camera = ["--camera", f"replay:{film}?fps={_FPS}&loop=1"]
    address = f"tcp://127.0.0.1:{free_port()}" if other == "tcp" else f"ipc://{folder}/link"
    out = folder / "out"
    with PtyLine(folder, bytes_per_s=3e6, delay_ns=300_000) as cable:
        links = [["--link", uri, "--link", address] for uri in cable.uris]
        run = ["run", *camera, "--json"]
        with (
            board([*run, *links[0]], folder),
            host([*run, *links[1], "--out", str(out), "--save-every", "0"], folder) as receiver,
        ):
            _wait(out, "serial", 30)
            for _ in range(losses):
                mend = _lose(cable, way)
                _wait(out, other, 30)
                mend()
                _wait(out, "serial", 30)
            receiver.stop()
        report = receiver.json()
        kept = ledgers(out)
    changes = [(a, b) for a, b in pairwise(kept) if a["link"] != b["link"]]
    there = [_pause_ms(a, b) for a, b in changes if b["link"] == other]
    back = [_pause_ms(a, b) for a, b in changes if b["link"] == "serial"]
    lost = sum(session["lost"] for session in report["sessions"]) / max(1, report["switches"])
    return there, back, lost


def _pause_ms(before: dict[str, Any], after: dict[str, Any]) -> float:
    return float(after["received_ns"] - before["received_ns"]) / 1e6


def _lose(cable: PtyLine, way: str) -> Callable[[], None]:
    """Lose the cable; returns a function that brings it back."""
    if way == "pulled":
        cable.pull()
        return cable.plug
    for direction in cable.ways:
        direction.spoil = lambda _: b""

    def mend() -> None:
        for direction in cable.ways:
            direction.spoil = bytes

    return mend


def _wait(out: Path, link: str, pairs: int) -> None:
    """Wait for this many pairs in a row over a link."""

    def came() -> bool:
        if lines(out / "delays.jsonl") < pairs:
            return False
        return all(ledger["link"] == link for ledger in ledgers(out)[-pairs:])

    until(came, f"{pairs} pairs over {link}")


if __name__ == "__main__":
    sys.exit(main())
