"""How old frames get when the host is ten times slower than the camera: `python -m tests.bench.bench_age [--help]`.

A board-agent process replays 50 KB JPEGs at 30 per second over loopback TCP; the host's matcher takes 333 ms. Figures
to reach with a FIFO of depth 1: age at the link (received - exposed) p95 at most 35 ms; age at the pipeline (dequeued -
exposed) p95 at most 1.5 periods plus the age at the link; both the same at the end as in the first seconds; the camera
never throttled. With `block`, the host drops nothing: each pair waits one processing time for the pair before it. A
bare PUSH/PULL with high-water marks of 10 runs for comparison. Exit 4 when a figure is missed.
"""

import argparse
import json
import struct
import sys
import tempfile
import threading
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import zmq
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from common import now
from common.camera.factory import open_camera
from common.ledger import PairLedger
from common.link.factory import open_link, parse_link
from common.stamp import HOST_CLOCK
from phone_host.model import BoardFrame, Disparity, RectifiedPair, Result
from phone_host.run.host import Host
from phone_host.run.host_settings import HostSettings
from phone_host.run.sinks import FunctionSink
from phone_host.stereo.core import StereoCore
from phone_host.subprocesses.board_process import board_process, free_port
from phone_host.sync.fifo import FifoSettings
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine
from tests.bench.payloads import write_jpegs

_FPS = 30
_PERIOD_MS = 1000 / _FPS
_SLOWNESS = 10
_WINDOW_S = 5.0
_WARM_UP_S = 1.0
_LINK_MS = 35.0
_PERIODS = 1.5
_HWM = 10
_STAMP = struct.Struct("<q")


@dataclass(frozen=True, slots=True, kw_only=True)
class Window:
    """Ages within one time window, ms; NaN if no frame came."""

    frames: int
    p50_ms: float
    p95_ms: float
    max_ms: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One way of sending.

    Attributes:
        name: what it is.
        link: ages at the link, in the first window and in the last.
        pipeline: ages at the pipeline.
        camera_hz: frames grabbed per second.
        used_hz: frames processed per second.
    """

    name: str
    link: tuple[Window, Window]
    pipeline: tuple[Window, Window]
    camera_hz: float
    used_hz: float


class SlowMatcher:
    """Stands for a host ten times slower than the camera: it sleeps instead of computing."""

    def match(self, pair: RectifiedPair) -> Disparity:
        """Take ten periods, find nothing."""
        time.sleep(_SLOWNESS / _FPS)
        return np.full(pair.left.shape[:2], np.nan, dtype=np.float32)


class WatchedHost(Host):
    """Notes the age of every frame received over the link; pairs that the FIFO drops leave no ledger."""

    def __init__(self, policy: str, right: str, address: str) -> None:
        self.link_ages: list[tuple[int, int]] = []
        self.ledgers: list[PairLedger] = []
        super().__init__(
            HostSettings(fifo=FifoSettings.parse(f"1:{policy}"), save_every=0),
            open_camera(right, HOST_CLOCK, now.monotonic_ns()),
            [open_link(parse_link(address, listens_by_default=False))],
            StereoCore(SlowMatcher()),
            [FunctionSink("bench", self._keep, waits=True)],
        )
        take_in = self._queue.add_board

        def watched(frame: BoardFrame) -> None:
            """Note a frame's age on arrival."""
            take_in(frame)
            now_ns = now.monotonic_ns()
            self.link_ages.append((now_ns, now_ns - frame.marks.exposed_ns))

        self._queue.add_board = watched  # type: ignore[method-assign]

    def _keep(self, result: Result) -> None:
        self.ledgers.append(result.ledger)


def windows(ages: Sequence[tuple[int, int]]) -> tuple[Window, Window]:
    """Ages in the first seconds after the warm-up and in the last ones.

    Args:
        ages: (moment, age), ns, in order.
    """
    if not ages:
        nothing = Window(frames=0, p50_ms=float("nan"), p95_ms=float("nan"), max_ms=float("nan"))
        return nothing, nothing
    begin_ns, end_ns = ages[0][0] + round(_WARM_UP_S * 1e9), ages[-1][0]
    length_ns = round(_WINDOW_S * 1e9)
    first = [age for at, age in ages if begin_ns <= at < begin_ns + length_ns]
    return _window(first), _window([age for at, age in ages if at > end_ns - length_ns])


def ours(policy: str, folder: Path, seconds: float) -> Row:
    """Measure our board and host with one overflow policy."""
    address = f"tcp://127.0.0.1:{free_port()}"
    camera = f"replay:{folder}?fps={_FPS}&loop=1"
    with board_process(camera, address) as board:
        host = WatchedHost(policy, camera, address)

        def finished() -> bool:
            board.check()
            return bool(host.link_ages) and now.monotonic_ns() - host.link_ages[0][0] > (seconds + _WARM_UP_S) * 1e9

        host.run(finished)
        account = board.stop()
        stopped_ns = now.monotonic_ns()
    run = host.snapshot("stopped")
    before = run.link.sessions[-1].first.grabbed
    # The board counts over the whole session; the first received frame tells when frame `before` was exposed.
    grabbed, since_ns = account.grabbed - before, host.link_ages[0][0] - host.link_ages[0][1]
    pipeline = [(ledger.dequeued_ns, ledger.dequeued_ns - ledger.board.exposed_ns) for ledger in host.ledgers]
    return Row(
        name=f"FIFO 1:{policy}",
        link=windows(host.link_ages),
        pipeline=windows(pipeline),
        camera_hz=grabbed / ((stopped_ns - since_ns) / 1e9),
        used_hz=run.pairs_per_second,
    )


def bare(folder: Path, seconds: float) -> Row:
    """Measure a PUSH/PULL pair with high-water marks and the same slow consumer."""
    payloads = [path.read_bytes() for path in sorted(folder.iterdir())]
    address = f"tcp://127.0.0.1:{free_port()}"
    stop, grabbed = threading.Event(), [0]

    def camera() -> None:
        with zmq.Context() as context, context.socket(zmq.PUSH) as sock:
            for option, value in ((zmq.SNDHWM, _HWM), (zmq.SNDTIMEO, 100), (zmq.LINGER, 0)):
                sock.setsockopt(option, value)
            sock.connect(address)
            while not stop.is_set():
                due_ns = (now.monotonic_ns() * _FPS // 1_000_000_000 + 1) * 1_000_000_000 // _FPS
                time.sleep(max(0, due_ns - now.monotonic_ns()) / 1e9)
                grabbed[0] += 1
                message = [_STAMP.pack(due_ns), payloads[grabbed[0] % len(payloads)]]
                while not stop.is_set():
                    try:
                        sock.send_multipart(message, copy=False)
                        break
                    except zmq.Again:
                        pass

    thread = threading.Thread(target=camera, daemon=True)
    ages: list[tuple[int, int]] = []
    start_ns = now.monotonic_ns()
    with zmq.Context() as context, context.socket(zmq.PULL) as sock:
        sock.setsockopt(zmq.RCVHWM, _HWM)
        sock.bind(address)
        thread.start()
        while now.monotonic_ns() - start_ns < (seconds + _WARM_UP_S) * 1e9:
            stamp, _ = sock.recv_multipart(copy=False)
            now_ns = now.monotonic_ns()
            ages.append((now_ns, now_ns - _STAMP.unpack(stamp.buffer)[0]))
            time.sleep(_SLOWNESS / _FPS)
        elapsed_s = (now.monotonic_ns() - start_ns) / 1e9
        stop.set()
        thread.join()
    both = windows(ages)
    return Row(
        name="bare PUSH/PULL", link=both, pipeline=both, camera_hz=grabbed[0] / elapsed_s, used_hz=len(ages) / elapsed_s
    )


def main() -> int:
    """Run and print; exit code 4 when a figure is missed."""
    parser = argparse.ArgumentParser("python -m tests.bench.bench_age", description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0, help="length of each run (default 60)")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    options = parser.parse_args()
    console = Console(stderr=True)
    with (
        tempfile.TemporaryDirectory() as name,
        Progress(console=console, transient=True, disable=not console.is_terminal) as progress,
    ):
        folder = Path(name)
        size = write_jpegs(folder)
        rows = [
            bare(folder, options.seconds) if run == "bare" else ours(run, folder, options.seconds)
            for run in progress.track(("drop-oldest", "drop-newest", "block", "bare"))
        ]
    verdicts = _judge(rows[0])
    if options.json:
        shown = {"rows": [asdict(row) for row in rows], "verdicts": [asdict(verdict) for verdict in verdicts]}
        print(json.dumps({"machine": str(machine()), "seconds": options.seconds, **shown}))
        return exit_code(verdicts)
    print(
        f"{machine()}\ncamera {_FPS}/s, {size / 1000:.0f} KB, host {_SLOWNESS} times slower, {options.seconds:g} s each"
    )
    _print(rows)
    print(*verdicts, sep="\n")
    print(f"camera: {rows[0].camera_hz:.2f} frames/s grabbed of {_FPS}")
    return exit_code(verdicts)


def _window(ages_ns: Sequence[int]) -> Window:
    if not ages_ns:
        return Window(frames=0, p50_ms=float("nan"), p95_ms=float("nan"), max_ms=float("nan"))
    p50, p95, longest = (float(np.percentile(ages_ns, q)) / 1e6 for q in (50, 95, 100))
    return Window(frames=len(ages_ns), p50_ms=p50, p95_ms=p95, max_ms=longest)


def _print(rows: Sequence[Row]) -> None:
    table = Table(
        title=f"age in ms, p50 / p95 / max, first and last {_WINDOW_S:g} s; bare: high-water marks of {_HWM}",
        title_justify="left",
    )
    for title in (
        "tandemscan",
        "link, first",
        "link, last",
        "pipeline, first",
        "pipeline, last",
        "camera /s",
        "used /s",
    ):
        table.add_column(title, justify="left" if title == "tandemscan" else "right")
    for row in rows:
        ages = [f"{w.p50_ms:.1f} / {w.p95_ms:.1f} / {w.max_ms:.1f}" for w in (*row.link, *row.pipeline)]
        table.add_row(row.name, *ages, f"{row.camera_hz:.2f}", f"{row.used_hz:.2f}")
    Console(width=160).print(table)


def _judge(row: Row) -> list[Verdict]:
    link_ms = max(window.p95_ms for window in row.link)
    pipeline_ms, bound_ms = max(window.p95_ms for window in row.pipeline), _PERIODS * _PERIOD_MS + link_ms
    return [
        Verdict(f"age at the {what}, p95 of the worse window", value <= limit, f"{value:.1f} ms", f"{limit:.1f} ms")
        for what, value, limit in (("link", link_ms, _LINK_MS), ("pipeline", pipeline_ms, bound_ms))
    ]


if __name__ == "__main__":
    sys.exit(main())
