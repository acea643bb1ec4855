"""Every link in one table: ours over tcp, ipc and serial, bare pyzmq, bare TCP, imagezmq, NetGear: `python -m tests.bench.bench_link [--help]`.

Sends 640x480 frames at 30 per second over loopback, a Unix socket or a pseudo terminal. All transports take turns
within one run; results are medians over the runs: one-way latency, CPU time per frame on both sides, loss. A second
pass sends as fast as each transport can: throughput. Our own session asks for the time often at first and seldom after
the first minute, so it has two rows: the first seconds, and the steady state of everything that lasts. Figures to reach
for JPEGs of about 50 KB, in the steady state: one-way p50 at most imagezmq's; CPU time beyond bare pyzmq's at most 60
us a frame of the sender's and 120 us of the receiver's; with keys (CURVE) one-way p50 at most 1.25 times that without.
`--before CHECKOUT` measures an earlier version in the same turns.
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
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from phone_host.subprocesses.board_process import free_port
from tests.bench.figures import Verdict, exit_code
from tests.bench.link_worker import receives
from tests.bench.machine import machine, may_use_fifo
from tests.bench.payloads import write_jpegs, write_raw
from tests.support.keys import acquainted

_ROOT = Path(__file__).resolve().parents[2]
_FPS = 30
_CONNECT_S = 2.0
_LEARNING_S = 12.0
"""Left out: the time to connect and, for our own link, the first ten seconds of a session, in which it learns the clock with more echoes."""

_STEADY_S = 62.0
"""Left out of the steady state: the minute after which echoes are rare."""

_STEADY = ("tandemscan-steady", "tandemscan-before")
_FULL_SPEED_BYTES = 200_000_000
_NAMES = {
    "tandemscan": "tandemscan over tcp",
    "tandemscan-steady": "tandemscan over tcp, steady",
    "tandemscan-before": "tandemscan before, steady",
    "tandemscan-curve": "tandemscan over tcp with keys",
    "tandemscan-ipc": "tandemscan over ipc",
    "tandemscan-serial": "tandemscan over serial (pty)",
    "pyzmq": "bare pyzmq PUSH/PULL",
    "tcp": "bare TCP socket",
    "imagezmq": "imagezmq REQ/REP",
    "imagezmq-pub": "imagezmq PUB/SUB",
    "netgear": "vidgear NetGear PAIR",
    "nothing": "pacing alone, nothing sent",
}
_EXTRAS = {"imagezmq": "imagezmq", "imagezmq-pub": "imagezmq", "netgear": "vidgear"}
"""Transports that need a package of the extra `bench`."""

_SENDER_US = 60.0
_RECEIVER_US = 120.0
_CURVE_RATIO = 1.25
_PAYLOADS: dict[str, Callable[[Path], int]] = {"jpeg": write_jpegs, "raw": write_raw}


@dataclass(slots=True)
class Rows:
    """Results of the runs of one transport, one number per run.

    Attributes:
        p50_us: one-way latency, median.
        p95_us: one-way latency, 95th percentile.
        p99_us: one-way latency, 99th percentile.
        sender_us: CPU time per frame of the sender's process.
        receiver_us: CPU time per frame of the receiver's process.
        mb_per_s: throughput when frames are sent as fast as they are taken.
        lost: frames that never came at the steady rate, over all runs.
        lost_at_speed: share of frames that never came at full speed.
    """

    p50_us: list[float] = field(default_factory=list)
    p95_us: list[float] = field(default_factory=list)
    p99_us: list[float] = field(default_factory=list)
    sender_us: list[float] = field(default_factory=list)
    receiver_us: list[float] = field(default_factory=list)
    mb_per_s: list[float] = field(default_factory=list)
    lost_at_speed: list[float] = field(default_factory=list)
    lost: int = 0

    def add(self, sender: dict[str, float], receiver: dict[str, Any] | None, measured: int) -> None:
        """Add one run at the steady rate."""
        self.sender_us.append(sender["cpu_us_per_frame"])
        if receiver is None:
            return
        delays = receiver["delays_ns"]
        self.lost += measured - len(delays)
        self.receiver_us.append(receiver["cpu_us_per_frame"])
        for values, q in ((self.p50_us, 50), (self.p95_us, 95), (self.p99_us, 99)):
            values.append(float(np.percentile(delays, q)) / 1000 if delays else float("nan"))

    def add_at_speed(self, receiver: dict[str, Any], measured: int) -> None:
        """Add one run at full speed."""
        self.mb_per_s.append(receiver["mb_per_s"])
        self.lost_at_speed.append(1 - len(receiver["delays_ns"]) / measured)

    def medians(self) -> dict[str, float | int | None]:
        """Medians over the runs; None where nothing was measured."""
        names = ("p50_us", "p95_us", "p99_us", "sender_us", "receiver_us", "mb_per_s", "lost_at_speed")
        values: dict[str, list[float]] = {name: getattr(self, name) for name in names}
        return {name: _median(row) for name, row in values.items()} | {"lost_frames": self.lost}


def main() -> int:
    """Run and print; exit code 4 when a figure is missed."""
    options = _options()
    runs = range(options.runs)
    missing = _missing(options.transports)
    transports = [name for name in _NAMES if name in options.transports and name not in missing]
    if options.before is None and "tandemscan-before" in transports:
        transports.remove("tandemscan-before")
    frames = round(options.seconds * _FPS)
    results: dict[str, dict[str, Rows]] = {}
    sizes = {}
    console = Console(stderr=True)
    with (
        tempfile.TemporaryDirectory() as folder,
        Progress(console=console, transient=True, disable=not console.is_terminal) as progress,
    ):
        task = progress.add_task("frames", total=len(options.payloads) * len(runs) * len(transports))
        for payload in options.payloads:
            target = Path(folder) / payload
            target.mkdir()
            sizes[payload] = _PAYLOADS[payload](target)
            results[payload] = {name: Rows() for name in transports}
        for payload, _, name in ((p, r, t) for r in runs for p in options.payloads for t in transports):
            progress.update(task, description=f"{payload} over {name}")
            row, target = results[payload][name], Path(folder) / payload
            code = options.before if name == "tandemscan-before" else _ROOT
            row.add(*_run(name, target, _FPS, round(_warm_up_s(name) * _FPS), frames, code=code), frames)
            if receives(_worker(name)) and name not in _STEADY:
                fast = max(200, _FULL_SPEED_BYTES // sizes[payload])
                row.add_at_speed(_run(name, target, 0, fast // 10, fast, code=code)[1] or {}, fast)
            progress.advance(task)
    scheduling = "both ends SCHED_FIFO" if may_use_fifo() else "ordinary scheduling (SCHED_FIFO needs root)"
    method = (
        f"{options.runs} runs of {options.seconds:g} s each, in turns; medians over runs; {scheduling}, one core each"
    )
    verdicts = _judge(results.get("jpeg", {}))
    if options.json:
        shown = _as_json(results, sizes, missing, method) | {"verdicts": [asdict(verdict) for verdict in verdicts]}
        print(json.dumps(shown, indent=1))
        return exit_code(verdicts)
    print(f"{machine()}\n{method}")
    for payload, rows in results.items():
        _print(payload, sizes[payload], rows, missing)
    print(*verdicts, sep="\n")
    return exit_code(verdicts)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser("python -m tests.bench.bench_link", description=__doc__)
    parser.add_argument("--seconds", type=float, default=5.0, help="measured time of each run (default 5)")
    parser.add_argument("--runs", type=int, default=5, help="runs of each transport (default 5)")
    parser.add_argument("--payloads", nargs="+", choices=list(_PAYLOADS), default=list(_PAYLOADS))
    parser.add_argument("--transports", nargs="+", choices=[*_NAMES, "rfcomm"], default=[*_NAMES, "rfcomm"])
    parser.add_argument("--before", type=Path, metavar="CHECKOUT", help="a checkout of an earlier version")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    return parser.parse_args()


def _worker(transport: str) -> str:
    """What the two processes call a transport."""
    return "tandemscan" if transport in _STEADY else transport


def _warm_up_s(transport: str) -> float:
    """How long a transport runs before it is measured."""
    if transport in _STEADY:
        return _STEADY_S
    return _LEARNING_S if transport.startswith("tandemscan") else _CONNECT_S


def _missing(wanted: list[str]) -> dict[str, str]:
    """Why some of these transports cannot be measured here."""
    absent = {
        name: f"{name}: {_EXTRAS[name]} is not installed (make bench does it)" for name in wanted if name in _EXTRAS
    }
    missing = {name: why for name, why in absent.items() if importlib.util.find_spec(_EXTRAS[name]) is None}
    if "rfcomm" in wanted:
        adapters = len(list(Path("/sys/class/bluetooth").glob("hci*")))
        missing["rfcomm"] = (
            f"rfcomm: both ends on one machine need two Bluetooth adapters, here are {adapters}; bench_rfcomm has them in a virtual board"
        )
    return missing


Result = tuple[dict[str, float], dict[str, Any] | None]


def _run(transport: str, folder: Path, fps: int, warm_up: int, frames: int, *, code: Path) -> Result:
    """Run both ends in separate processes, with the code of a checkout; returns what the sender and the receiver saw."""
    with ExitStack() as stack:
        addresses, descriptors = _addresses(transport, stack)
        numbers = [str(fps), str(warm_up), str(warm_up + frames)]

        def start(role: str) -> subprocess.Popen[bytes]:
            names = [role, _worker(transport), addresses[role], str(folder)]
            module = [sys.executable, "-m", "tests.bench.link_worker", *names, *numbers]
            return subprocess.Popen(module, stdout=subprocess.PIPE, pass_fds=descriptors, cwd=code)

        receiver = start("receive") if receives(_worker(transport)) else None
        sender = start("send")
        try:
            limit_s = (warm_up + frames) / (fps or _FPS) + 60
            sent = sender.communicate(timeout=limit_s)[0]
            received = receiver.communicate(timeout=limit_s)[0] if receiver else b"null"
        finally:
            for process in (sender, *([receiver] if receiver else [])):
                process.kill()
                process.wait()
    return json.loads(sent), json.loads(received)


def _addresses(transport: str, stack: ExitStack) -> tuple[dict[str, str], tuple[int, ...]]:
    """The address of each role's end, and the descriptors that the processes inherit."""
    if transport == "tandemscan-curve":
        address = f"tcp://127.0.0.1:{free_port()}"
        board, host = acquainted(Path(stack.enter_context(tempfile.TemporaryDirectory())), address)
        # A board that listens on loopback alone asks for no keys.
        return {"send": f"{address.replace('127.0.0.1', '*')}#{board.path}", "receive": f"{address}#{host.path}"}, ()
    if transport == "tandemscan-ipc":
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        return dict.fromkeys(("send", "receive"), f"ipc://{folder}/board"), ()
    if transport == "tandemscan-serial":
        master, slave = pty.openpty()
        stack.callback(os.close, master)
        stack.callback(os.close, slave)
        tty.setraw(slave)
        return {"send": f"serial:{os.ttyname(slave)}", "receive": f"fd:{master}"}, (master,)
    return dict.fromkeys(("send", "receive"), f"tcp://127.0.0.1:{free_port()}"), ()


def _median(values: list[float]) -> float | None:
    return statistics.median(values) if values else None


def _as_json(
    results: dict[str, dict[str, Rows]], sizes: dict[str, int], missing: dict[str, str], method: str
) -> dict[str, object]:
    return {
        "machine": str(machine()),
        "method": method,
        "missing": missing,
        "payloads": {
            payload: {
                "bytes": sizes[payload],
                "transports": {name: row.medians() for name, row in rows.items()},
                "sender_us_by_run": {name: row.sender_us for name, row in rows.items()},
                "p50_us_by_run": {name: row.p50_us for name, row in rows.items()},
            }
            for payload, rows in results.items()
        },
    }


def _print(payload: str, size: int, rows: dict[str, Rows], missing: dict[str, str]) -> None:
    table = Table(title=f"{payload}, 640x480, {size / 1000:.0f} KB, {_FPS} frames/s", title_justify="left")
    table.add_column("transport")
    for title in ("p50 us", "p95 us", "p99 us", "sender us/frame", "receiver us/frame", "lost", "MB/s", "lost at that"):
        table.add_column(title, justify="right")
    for name, row in rows.items():
        values = row.medians()
        keys = ("p50_us", "p95_us", "p99_us", "sender_us", "receiver_us")
        cells = ["-" if values[key] is None else f"{values[key]:.0f}" for key in keys]
        fast = [(values["mb_per_s"], ".0f"), (values["lost_at_speed"], ".1%")]
        speed = ["-" if value is None or value != value else format(value, form) for value, form in fast]  # noqa: PLR0124 - NaN
        table.add_row(_NAMES[name], *cells, str(row.lost) if row.p50_us else "-", *speed)
    Console(width=150).print(table)
    for why in missing.values():
        print(why)


def _judge(rows: dict[str, Rows]) -> list[Verdict]:
    """Judge the JPEG rows; transports that did not run are skipped."""
    verdicts = []
    if {"tandemscan-steady", "imagezmq"} <= rows.keys():
        ours_us, theirs_us = (statistics.median(rows[name].p50_us) for name in ("tandemscan-steady", "imagezmq"))
        verdicts.append(
            Verdict("one-way p50, steady; imagezmq's", ours_us <= theirs_us, f"{ours_us:.0f} us", f"{theirs_us:.0f} us")
        )
    if {"tandemscan-steady", "pyzmq"} <= rows.keys():
        ours, bare = rows["tandemscan-steady"], rows["pyzmq"]
        for side, mine, theirs, most_us in (
            ("sender", ours.sender_us, bare.sender_us, _SENDER_US),
            ("receiver", ours.receiver_us, bare.receiver_us, _RECEIVER_US),
        ):
            more_us = statistics.median(mine) - statistics.median(theirs)
            name = f"{side}'s CPU beyond bare pyzmq's, steady, us/frame"
            verdicts.append(Verdict(name, more_us <= most_us, f"{more_us:+.0f}", f"{most_us:.0f}"))
    if {"tandemscan", "tandemscan-curve"} <= rows.keys():
        without_us, with_us = (statistics.median(rows[name].p50_us) for name in ("tandemscan", "tandemscan-curve"))
        ratio = with_us / without_us
        verdicts.append(
            Verdict("one-way p50 with keys / without", ratio <= _CURVE_RATIO, f"{ratio:.2f}", f"{_CURVE_RATIO}")
        )
    return verdicts


if __name__ == "__main__":
    sys.exit(main())
