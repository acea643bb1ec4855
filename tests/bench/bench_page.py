"""What viewers of the page cost a run, and what they get: `python -m tests.bench.bench_page [--help]`.

A board-agent process and `phone-host run --serve` work on a rendered film at 15 pairs/s. Phases alternate within one run: nobody
looks, three programs read 20 KB/s, one quick viewer, three quick viewers (640 px, 10 Hz). Before them a browser opens the
page afresh seven times. Figures to reach: with the slow readers, the processing delay's median within 5 % and its 99th
percentile within 15 % of those with nobody; depth on the page within 2 s, of 450 kB at most. Exit 4 when one is missed.
"""

import argparse
import asyncio
import json
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from enum import Enum
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from rich.console import Console
from rich.table import Table

from phone_host.scene.scene import WEBCAM_LOOK, demo_scene, matched_rig
from phone_host.scene.scene_model import rig_poses
from phone_host.scene.scene_render import Renderer
from phone_host.subprocesses.board_process import board_process, socket_folder
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine
from tests.bench.page_loads import Load, loads
from tests.bench.page_viewers import Seen, dawdle, look

_FPS: Final = 15
_FRAMES: Final = 30
_SETTLE_S: Final = 1.5
_MOST_P50, _MOST_P99 = 0.05, 0.15
_MOST_LOAD_S, _MOST_KB = 2.0, 450.0
_LOADING_S: Final = 60
"""The run goes on so much longer than its phases: a browser opens the page before them."""


class Phase(Enum):
    """Who looks."""

    NOBODY = "nobody"
    SLOW = "three that read 20 KB/s"
    ONE = "one viewer"
    THREE = "three viewers"


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One kind of phase, all of them together.

    Attributes:
        phase: who looked.
        pairs: number of processed pairs.
        p50_ms: processing delay's median.
        p99_ms: its 99th percentile.
        viewer_hz: pairs that each viewer got, 1/s.
        kilobytes: size of each, kB.
    """

    phase: str
    pairs: int
    p50_ms: float
    p99_ms: float
    viewer_hz: float
    kilobytes: float


@dataclass(slots=True)
class Slot:
    """One phase, from begin to end on CLOCK_MONOTONIC, and what its viewers saw."""

    phase: Phase
    from_ns: int
    to_ns: int
    seen: Seen


def measure(folder: Path, rounds: int, seconds: float) -> tuple[tuple[Row, ...], tuple[Load, ...]]:
    """Run it.

    Args:
        folder: an empty one.
        rounds: how often each phase comes.
        seconds: length of a phase.

    Returns:
        A row for each kind of phase, and each time that a browser opened the page.
    """
    left, right = _film(folder)
    length = rounds * len(Phase) * (seconds + 0.5) + 15 + _LOADING_S
    with socket_folder() as sockets, board_process(f"replay:{left}?fps={_FPS}&loop=1", f"ipc://{sockets}/b") as board:
        command = [
            sys.executable, "-m", "phone_host.start", "run", "--link", f"ipc://{sockets}/b", "--camera", f"replay:{right}?fps={_FPS}&loop=1",
            "--rectified", "--disparities", "64", "--focal", "525", "--baseline", "100mm", "--seconds", f"{length:.0f}", "--serve", "127.0.0.1:0", "--out", str(folder / "out"),
        ]  # fmt: skip
        run = subprocess.Popen(_started(command), stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        try:
            url = _address(run)
            opened = loads(url)
            slots = asyncio.run(_phases(url, rounds, seconds))
        finally:
            run.terminate()
            run.communicate(timeout=60)
        board.check()
    lines = (folder / "out" / "delays.jsonl").read_text().splitlines()
    done = np.array([[line["done_ns"], line["processing_ns"]] for line in map(json.loads, lines)])
    return tuple(_row(phase, slots, done) for phase in Phase), opened


def judge(rows: Sequence[Row], opened: Sequence[Load]) -> list[Verdict]:
    """Compare the slow readers with nobody, and the loads with their limits."""
    none, slow = rows[0], rows[1]
    verdicts = [
        Verdict(f"processing delay with slow readers, {name}, against nobody", there <= here * (1 + most), f"{there / here - 1:+.1%}", f"{most:+.0%}")
        for name, here, there, most in (("p50", none.p50_ms, slow.p50_ms, _MOST_P50), ("p99", none.p99_ms, slow.p99_ms, _MOST_P99))
    ]  # fmt: skip
    if opened:
        worst_s, most_kb = max(load.depth_s for load in opened), max(load.kilobytes for load in opened)
        what = f"page to first depth, longest of {len(opened)}"
        verdicts += [
            Verdict(what, worst_s <= _MOST_LOAD_S, f"{worst_s:.2f} s", f"{_MOST_LOAD_S:g} s"),
            Verdict("transferred for depth and cloud", most_kb <= _MOST_KB, f"{most_kb:.0f} kB", f"{_MOST_KB:g} kB"),
        ]
    return verdicts


def main() -> int:
    """Run the benchmark; return the exit code."""
    parser = argparse.ArgumentParser("python -m tests.bench.bench_page", description=__doc__)
    parser.add_argument("--rounds", type=int, default=6, help="how often each phase comes (default 6)")
    parser.add_argument("--seconds", type=float, default=10.0, help="length of a phase (default 10)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        rows, opened = measure(Path(folder), options.rounds, options.seconds)
    verdicts = judge(rows, opened)
    if options.json:
        print(
            json.dumps(
                {
                    "machine": str(machine()),
                    "rows": [asdict(row) for row in rows],
                    "loads": [asdict(load) for load in opened],
                    "verdicts": [asdict(each) for each in verdicts],
                }
            )
        )
    else:
        table = Table(
            "who looks",
            "pairs",
            "processing p50, ms",
            "p99, ms",
            "pairs/s of each viewer",
            "kB each",
            title=str(machine()),
        )
        for row in rows:
            table.add_row(
                row.phase,
                str(row.pairs),
                f"{row.p50_ms:.2f}",
                f"{row.p99_ms:.2f}",
                f"{row.viewer_hz:.1f}",
                f"{row.kilobytes:.0f}",
            )
        Console(width=110).print(table)
        print(*verdicts, sep="\n")
    return exit_code(verdicts)


async def _phases(url: str, rounds: int, seconds: float) -> list[Slot]:
    host, port = url.removeprefix("http://").rstrip("/").split(":")
    slots = []
    for number in range(rounds * len(Phase)):
        phase = list(Phase)[number % len(Phase)]
        slot = Slot(phase, time.monotonic_ns(), 0, Seen())
        match phase:
            case Phase.NOBODY:
                await asyncio.sleep(seconds)
            case Phase.SLOW:
                await asyncio.gather(*(dawdle(host, int(port), slot.seen, seconds) for _ in range(3)))
            case Phase.ONE | Phase.THREE:
                count = 1 if phase is Phase.ONE else 3
                await asyncio.gather(*(look(url, slot.seen, seconds) for _ in range(count)))
        slot.to_ns = time.monotonic_ns()
        slots.append(slot)
        await asyncio.sleep(0.5)
    return slots


def _row(phase: Phase, slots: Sequence[Slot], done: "np.ndarray[tuple[int, ...], np.dtype[np.int64]]") -> Row:
    mine = [slot for slot in slots if slot.phase is phase]
    inside = np.zeros(len(done), dtype=bool)
    for slot in mine:
        inside |= (done[:, 0] > slot.from_ns + _SETTLE_S * 1e9) & (done[:, 0] < slot.to_ns)
    taken = done[inside, 1] / 1e6
    viewers = {Phase.ONE: 1, Phase.THREE: 3}.get(phase, 0)
    seconds = sum(slot.to_ns - slot.from_ns for slot in mine) / 1e9
    pairs, size = sum(slot.seen.pairs for slot in mine), sum(slot.seen.bytes for slot in mine)
    return Row(
        phase=phase.value,
        pairs=len(taken),
        p50_ms=float(np.percentile(taken, 50)),
        p99_ms=float(np.percentile(taken, 99)),
        viewer_hz=pairs / seconds / viewers if viewers else 0.0,
        kilobytes=size / pairs / 1e3 if pairs else 0.0,
    )


def _film(folder: Path) -> tuple[Path, Path]:
    """Render a film of a rectified pair of cameras."""
    rig = matched_rig()
    folders = (folder / "left", folder / "right")
    for side, model, pose in zip(folders, (rig.left, rig.right), rig_poses(rig), strict=True):
        side.mkdir()
        renderer = Renderer(demo_scene(), model, pose, WEBCAM_LOOK)
        for index in range(_FRAMES):
            cv2.imwrite(str(side / f"{index:03d}.jpg"), renderer.frame(index / _FPS), [cv2.IMWRITE_JPEG_QUALITY, 90])
    return folders


def _started(command: list[str]) -> list[str]:
    """Return the command; `phone_host.start` has no main of its own."""
    code = "import sys; from phone_host.start import phone_host; sys.exit(phone_host())"
    return [command[0], "-c", code, *command[3:]]


def _address(run: "subprocess.Popen[str]") -> str:
    """Wait for the line that names the page."""
    assert run.stderr is not None
    told = []
    for line in run.stderr:
        told.append(line)
        if found := re.search(r"the page: (http://[^/]+/)", line):
            return found[1]
    raise RuntimeError("".join(told))


if __name__ == "__main__":
    sys.exit(main())
