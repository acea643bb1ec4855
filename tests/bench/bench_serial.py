"""Serial lines: throughput over a pty, goodput and echoes on slow lines: `python -m tests.bench.bench_serial [--help]`.

Over a pty: one process sends frames of 50 KB to another. Our link and messages are compared with a bare loop that sends
the same bytes (COBS + CRC-32 where the package `cobs` is installed; length + CRC-32). All take turns; results are
medians over the runs. Figure to reach: 0.7 times the COBS loop. On an emulated line (limited byte rate, 0.3 ms of
delay, an unlimited queue in front): a real board-agent whose camera delivers 30 frames of 25 KB a second, and the
host's role of the protocol with its clock echoes, measured from the eleventh second on. Goodput is the frames' bytes
divided by what the line can carry. Figures to reach: 1.5 Mbit/s: 95 % and echo p99 20 ms; 115200 baud 8N1: 93 %.
"""

import argparse
import importlib.util
import json
import os
import pty
import statistics
import subprocess
import sys
import tempfile
import tty
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from pathlib import Path

import cv2
import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine, may_use_fifo
from tests.support.numbered import draw
from tests.support.programs import board
from tests.support.pty_line import PtyLine

_NAMES = {
    "cobs": "COBS + CRC-32, bare loop (package cobs)",
    "length": "length + CRC-32, bare loop",
    "ours": "tandemscan link and messages",
}
_FRAME_BYTES = 50_000
_FRAMES = 4000
_RATIO = 0.7
_SETTLING_NS = 11_000_000_000
"""The host sends more echoes for ten seconds to learn the skew of the clocks."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SlowLine:
    """A line to emulate, and the figures to reach on it.

    Attributes:
        name: for people.
        bytes_per_s: payload bytes that it can carry.
        goodput: share of these that must be frames.
        echo_ms: p99 of the echoes' round trip; NaN: no figure.
    """

    name: str
    bytes_per_s: float
    goodput: float
    echo_ms: float


_SLOW = (
    SlowLine(name="1.5 Mbit/s", bytes_per_s=187_500, goodput=0.95, echo_ms=20),
    SlowLine(name="115200 baud 8N1", bytes_per_s=11_520, goodput=0.93, echo_ms=float("nan")),
)
_FILM_BYTES = 25_000


def main() -> int:
    """Run and print; exit code 4 when a figure is missed."""
    options = _options()
    console = Console(stderr=True)
    framings = [name for name in _NAMES if name != "cobs" or importlib.util.find_spec("cobs")]
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("pty", total=options.runs * len(framings) + len(_SLOW))
        fast: dict[str, list[tuple[float, float, float]]] = {name: [] for name in framings}
        for _ in range(options.runs):
            for name in framings:
                fast[name].append(_over_pty(name))
                progress.advance(task)
        slow = {}
        for line in _SLOW:
            progress.update(task, description=line.name)
            slow[line.name] = _over_slow_line(line, options.seconds)
            progress.advance(task)
    if options.json:
        verdicts = [asdict(verdict) for verdict in _judge(fast, slow)]
        print(json.dumps({"machine": str(machine()), "pty": fast, "slow": slow, "verdicts": verdicts}, indent=1))
    else:
        _print(fast, slow, options)
    return exit_code(_judge(fast, slow))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser("python -m tests.bench.bench_serial", description=__doc__)
    parser.add_argument("--runs", type=int, default=5, help="runs of each framing over the pty (default 5)")
    parser.add_argument("--seconds", type=float, default=30.0, help="measured time on each slow line (default 30)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    return parser.parse_args()


def _over_pty(framing: str) -> tuple[float, float, float]:
    """MB/s, and CPU microseconds per frame of sender and receiver."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    module = [sys.executable, "-m", "tests.bench.serial_worker"]
    job = [str(_FRAMES), str(_FRAME_BYTES)]
    receiver = subprocess.Popen(
        [*module, "receive", framing, str(master), *job], stdout=subprocess.PIPE, pass_fds=(master,)
    )
    sender = subprocess.Popen([*module, "send", framing, os.ttyname(slave), *job], stdout=subprocess.PIPE)
    try:
        sent = json.loads(sender.communicate(timeout=120)[0])
        received = json.loads(receiver.communicate(timeout=120)[0])
    finally:
        for process in (sender, receiver):
            process.kill()
            process.wait()
        os.close(master)
        os.close(slave)
    return received["mb_per_s"], sent["cpu_us_per_frame"], received["cpu_us_per_frame"]


def _write_film(folder: Path) -> None:
    """Write JPEGs of exactly 25 KB: numbered images, padded with a comment (ITU-T T.81, B.2.4.5)."""
    chance = np.random.default_rng(3)
    for number in range(30):
        done, encoded = cv2.imencode(".jpg", draw(number))
        assert done
        data = encoded.tobytes()
        filling = _FILM_BYTES - len(data) - 4
        comment = b"\xff\xfe" + (filling + 2).to_bytes(2, "big") + chance.bytes(filling)
        (folder / f"{number}.jpg").write_bytes(data[:2] + comment + data[2:])


def _over_slow_line(line: SlowLine, seconds: float) -> dict[str, float]:
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        film = folder / "film"
        film.mkdir()
        _write_film(film)
        cable = stack.enter_context(PtyLine(folder, line.bytes_per_s, 300_000, urgent=True))
        board_uri, host_uri = cable.uris
        arguments = ["run", "--camera", f"replay:{film}?fps=30&loop=1", "--link", board_uri, "--json"]
        sender = stack.enter_context(board(arguments, folder))
        limit_s = seconds + _SETTLING_NS / 1e9 + 4
        host = [sys.executable, "-m", "tests.bench.serial_worker", "host", host_uri, str(limit_s)]
        seen = json.loads(subprocess.run(host, stdout=subprocess.PIPE, check=True).stdout)
        sender.stop()
    frames = seen["frames"]
    settled_ns = frames[0][0] + _SETTLING_NS
    counted = [(at, size) for at, size in frames if at >= settled_ns]
    took_s = (counted[-1][0] - counted[0][0]) / 1e9
    echoes_ms = [trip / 1e6 for at, trip in seen["echoes"] if at >= settled_ns]
    return {
        "goodput": sum(size for _, size in counted[1:]) / took_s / line.bytes_per_s,
        "frames_per_s": (len(counted) - 1) / took_s,
        "echoes": len(echoes_ms),
        "echo_p50_ms": float(np.percentile(echoes_ms, 50)),
        "echo_p99_ms": float(np.percentile(echoes_ms, 99)),
        "lost": seen["lost"],
    }


def _print(
    fast: dict[str, list[tuple[float, float, float]]], slow: dict[str, dict[str, float]], options: argparse.Namespace
) -> None:
    scheduling = "SCHED_FIFO" if may_use_fifo() else "ordinary scheduling"
    print(machine())
    print(f"pty: {options.runs} runs of {_FRAMES} frames in turns, one core each, {scheduling}; medians")
    table = Table(title=f"over a pty, frames of {_FRAME_BYTES // 1000} KB", title_justify="left")
    for title in ("framing", "MB/s", "sender us/frame", "receiver us/frame"):
        table.add_column(title, justify="left" if title == "framing" else "right")
    medians = {name: [statistics.median(column) for column in zip(*rows, strict=True)] for name, rows in fast.items()}
    for name, values in medians.items():
        table.add_row(_NAMES[name], f"{values[0]:.1f}", *(f"{value:.0f}" for value in values[1:]))
    Console(width=130).print(table)
    for name in [name for name in medians if name != "ours"]:
        print(f"{medians['ours'][0] / medians[name][0]:.2f} x {_NAMES[name]}")
    print(f"CPU on the board's side: {medians['ours'][1]:.0f} us a frame")
    table = Table(title="emulated lines, frames of 25 KB, board-agent", title_justify="left")
    for title in ("line", "goodput", "frames/s", "echoes", "echo p50 ms", "echo p99 ms", "lost"):
        table.add_column(title, justify="left" if title == "line" else "right")
    for name, row in slow.items():
        times = (f"{row['echo_p50_ms']:.1f}", f"{row['echo_p99_ms']:.1f}")
        table.add_row(
            name, f"{row['goodput']:.1%}", f"{row['frames_per_s']:.2f}", str(row["echoes"]), *times, str(row["lost"])
        )
    Console(width=130).print(table)
    print(*_judge(fast, slow), sep="\n")


def _judge(fast: dict[str, list[tuple[float, float, float]]], slow: dict[str, dict[str, float]]) -> list[Verdict]:
    """Judge the figures; framings that are not installed are skipped."""
    verdicts = []
    if "cobs" in fast:
        ours, theirs = (statistics.median(run[0] for run in fast[name]) for name in ("ours", "cobs"))
        verdicts.append(
            Verdict(f"throughput / {_NAMES['cobs']}", ours / theirs >= _RATIO, f"{ours / theirs:.2f}", f"{_RATIO}")
        )
    for line in _SLOW:
        goodput, echo_ms = slow[line.name]["goodput"], slow[line.name]["echo_p99_ms"]
        verdicts.append(
            Verdict(f"{line.name}: goodput", goodput >= line.goodput, f"{goodput:.1%}", f"{line.goodput:.0%}")
        )
        if line.echo_ms == line.echo_ms:
            reached = echo_ms <= line.echo_ms
            verdicts.append(Verdict(f"{line.name}: echo p99", reached, f"{echo_ms:.1f} ms", f"{line.echo_ms:.0f} ms"))
    return verdicts


if __name__ == "__main__":
    sys.exit(main())
