"""What the board's job costs a BeagleBone-class board: `python -m tests.bench.bench_board [--help]`.

The board is a booted armhf guest (512 MB, one processor, Debian's kernel and its uvcvideo driver). A webcam emulated
outside it delivers 640x480 MJPEG at 30 per second; frames go over TCP to this machine. Three programs run in turn: the
installed service with our host; a C program that does the same job (V4L2 mmap dequeue -> zmq_send,
tests/bench/board/forward.c); and Debian's ustreamer, which passes MJPEG through over HTTP. Figures to reach: CPU time
per frame at most twice the C program's; resident memory below 20 MB; each image byte copied at most once before the
link; idle (no host, camera at rest) below 1 % of the processor; start to READY below 3 s; from a host's dialling to its
first frame, with the camera at rest, below 300 ms (the emulated webcam delivers its first image at once; most real ones
take longer). For scale: 0.45 % of the time for 10^6 rounds of `x += i` would be about 10 % of a real BeagleBone.

Copies are counted in a separate run. A preloaded library (tests/bench/board/copies.c) replaces memcpy and memmove,
counts copies of 4 KiB or more, and names the object that made the call. Copies made by the kernel (driver, TCP) are not
counted. Exit 4 when a figure is missed.
"""

import argparse
import json
import statistics
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from common.errors import UnavailableError
from tests.bench.board_guest import (
    FORWARD,
    USTREAMER,
    Board,
    Cost,
    Counter,
    HttpReader,
    OurHost,
    Puller,
    booted_board,
    install_rivals,
    need_compiler,
)
from tests.bench.figures import Verdict, exit_code
from tests.bench.machine import machine
from tests.bench.payloads import write_jpegs
from tests.support.programs import until
from tests.vm.guest import UNIT
from tests.vm.uvc import Model
from tests.vm.webcam import Webcam

_SIZE_PX: Final = (640, 480)
_FPS: Final = 30
_READOUT_NS: Final = 20_000_000
_STARTS: Final = 5
_CONNECTS: Final = 5
_WARM_UP_S: Final = 12.0
"""Our host sends more echoes in the first ten seconds of a session to learn the clock; the other programs get the same time."""

_COPIES_FPS: Final = 10
"""Slow enough that no newer frame replaces an older one, even in the slow counted run: every copied frame is also sent."""

_CAMERA: Final = f"v4l2:auto?size={_SIZE_PX[0]}x{_SIZE_PX[1]}&fps="
_DEVICE: Final = "$(ls /dev/v4l/by-id/*index0)"

_RATIO: Final = 2.0
_RESIDENT_MB: Final = 20.0
_COPIES: Final = 1.0
_IDLE_SHARE: Final = 0.01
_READY_MS: Final = 3000.0
_FIRST_FRAME_MS: Final = 300.0
_ORIENTATION: Final = 0.0045

_NAMES: Final = ("board-agent", "C program", "ustreamer")
_LINK_OBJECTS: Final = ("libzmq", "/zmq/")
"""Objects that are part of the link: ZeroMQ and its binding."""


@dataclass(slots=True)
class Figures:
    """All measured figures.

    Attributes:
        quiet: whether the emulator was given priority over all other work on this machine.
        interpreter_s: time for 10^6 rounds of `x += i`.
        costs: by program, one entry per run.
        idle: CPU share without a host, the camera at rest.
        no_camera: CPU share without a camera.
        ready_ms: from process start to READY.
        first_frame_ms: from a host's dialling to its first frame, the camera at rest before.
        copies: how often each image byte was copied, by the object that copied it.
    """

    quiet: bool = False
    interpreter_s: float = float("nan")
    costs: dict[str, list[Cost]] = field(default_factory=dict)
    idle: float = float("nan")
    no_camera: float = float("nan")
    ready_ms: list[float] = field(default_factory=list)
    first_frame_ms: list[float] = field(default_factory=list)
    copies: dict[str, float] = field(default_factory=dict)

    def frame_ms(self, name: str) -> float:
        """CPU time per frame, the median over the runs, ms."""
        return statistics.median(cost.frame_ms for cost in self.costs[name])

    @property
    def resident_mb(self) -> float:
        """Peak memory of our service, MB."""
        return max(cost.resident_bytes for cost in self.costs["board-agent"]) / 1e6

    @property
    def copies_before_link(self) -> float:
        """How often anything but the link copied each image byte."""
        return sum(times for name, times in self.copies.items() if not any(part in name for part in _LINK_OBJECTS))


def main() -> int:
    """Run and print; exit code 3 when something needed is missing, 4 when a figure is missed."""
    options = _options()
    console = Console(stderr=True)
    try:
        with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
            figures = _measure(options.seconds, options.runs, options.programs, progress)
    except UnavailableError as error:
        print(f"error: {error}", file=sys.stderr)
        return 3
    if options.json:
        verdicts = [asdict(verdict) for verdict in _judge(figures)]
        print(
            json.dumps({"machine": str(machine()), "seconds": options.seconds, **asdict(figures), "verdicts": verdicts})
        )
    else:
        scheduling = "SCHED_FIFO" if figures.quiet else "ordinary scheduling (SCHED_FIFO needs root)"
        runs = f"{options.runs} runs of {options.seconds:g} s of each program, in turns"
        print(f"{machine()}\narmhf guest in QEMU, {scheduling}; {runs}")
        _print(figures)
    return exit_code(_judge(figures))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser("python -m tests.bench.bench_board", description=__doc__)
    parser.add_argument("--seconds", type=float, default=30.0, help="measured time of each run (default 30)")
    parser.add_argument("--runs", type=int, default=2, help="runs of each program (default 2)")
    parser.add_argument("--programs", nargs="+", choices=_NAMES, default=_NAMES)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    return parser.parse_args()


def _measure(seconds: float, runs: int, programs: list[str], progress: Progress) -> Figures:
    need_compiler()
    figures = Figures()
    others = ("boot", "without camera", "starts", "idle", "first frames", "copies")
    task = progress.add_task("boot", total=runs * len(programs) + len(others))

    def next_is(what: str) -> None:
        progress.update(task, description=what, advance=1)

    with TemporaryDirectory() as folder, booted_board() as board:
        install_rivals(board)
        figures.quiet = board.be_quiet()
        write_jpegs(Path(folder))
        frames = [path.read_bytes() for path in sorted(Path(folder).iterdir())]
        figures.interpreter_s = board.interpreter_s()
        next_is("without camera")
        board.guest.configure(f"{_CAMERA}{_FPS}")
        figures.no_camera = _share(board, seconds)
        with closing(
            Webcam(frames, _FPS, _READOUT_NS, Model(sizes_px=(_SIZE_PX,), rates_hz=(_FPS, _COPIES_FPS)))
        ) as webcam:
            webcam.plug(board.guest)
            board.guest.until("StatusText", "waiting for a host", "the service has the camera")
            next_is("starts")
            figures.ready_ms = [board.start_ms() for _ in range(_STARTS)]
            next_is("idle")
            until(lambda: not webcam.streaming, "the camera rests")
            figures.idle = _share(board, seconds)
            next_is("first frames")
            figures.first_frame_ms = [first_frame_ms(board, webcam) for _ in range(_CONNECTS)]
            for name in (name for _ in range(runs) for name in programs):
                next_is(name)
                with _program(board, name) as pid, closing(_counter(name, board)) as counter:
                    board.until_frames(counter)
                    time.sleep(_WARM_UP_S)
                    figures.costs.setdefault(name, []).append(board.cost(pid, counter, seconds))
            next_is("copies")
            figures.copies = _count_copies(board, seconds)
    return figures


def first_frame_ms(board: Board, webcam: Webcam) -> float:
    """Time from a host's dialling to its first frame, the camera at rest before, ms."""
    until(lambda: not webcam.streaming, "the camera rests")
    began_ns = time.monotonic_ns()
    with closing(OurHost(board.guest.link)) as host:
        until(lambda: host.first_ns > 0, "a frame came")
    return (host.first_ns - began_ns) / 1e6


def _counter(name: str, board: Board) -> Counter:
    if name == "board-agent":
        return OurHost(board.guest.link)
    return (Puller if name == "C program" else HttpReader)(board.guest.link)


@contextmanager
def _program(board: Board, name: str) -> Iterator[int]:
    """Run one of the programs alone with the camera while the block lasts; yields its process id."""
    if name == "board-agent":
        board.guest.sh(f"systemctl start {UNIT}")
        yield board.service_pid
        return
    board.guest.sh(f"systemctl stop {UNIT}")
    command = {"C program": FORWARD, "ustreamer": USTREAMER}[name]
    with board.running(command.format(device=_DEVICE, width=_SIZE_PX[0], height=_SIZE_PX[1], fps=_FPS)) as pid:
        yield pid


def _share(board: Board, seconds: float) -> float:
    """The service's share of the processor while nothing happens."""
    return board.watch(board.service_pid, lambda: 0, seconds).share


def _count_copies(board: Board, seconds: float) -> dict[str, float]:
    """How often each image byte is copied, by the object that copies it."""
    board.guest.configure(f"{_CAMERA}{_COPIES_FPS}")
    board.guest.sh(f"systemctl stop {UNIT}")
    preload = "env LD_PRELOAD=/opt/bench/copies.so COPIES=/run/copies"
    command = f"{preload} board-agent run --config /etc/tandemscan/board-agent.toml"
    with board.running(command) as pid, closing(_counter("board-agent", board)) as counter:
        board.until_frames(counter)
        before, image_bytes = _copied(board, pid), counter.bytes
        board.watch(pid, lambda: counter.frames, seconds)
        after, image_bytes = _copied(board, pid), counter.bytes - image_bytes
    return {
        name: (total - before.get(name, 0)) / image_bytes
        for name, total in after.items()
        if total > before.get(name, 0)
    }


def _copied(board: Board, pid: int) -> Mapping[str, int]:
    """Bytes copied so far, by object."""
    board.guest.sh(f"rm -f /run/copies; kill -USR2 {pid}")
    totals: dict[str, int] = {}
    until(lambda: board.guest.code("test -s /run/copies") == 0, "the copies are told")
    for line in board.guest.sh("cat /run/copies").splitlines():
        name, _, size = line.rsplit(" ", 2)
        totals[name] = totals.get(name, 0) + int(size)
    return totals


def _print(figures: Figures) -> None:
    table = Table(title=f"{_SIZE_PX[0]}x{_SIZE_PX[1]} MJPEG, {_FPS} frames/s", title_justify="left")
    table.add_column("program")
    for title in ("CPU ms/frame", "of these kernel", "% of processor", "frames/s", "resident MB"):
        table.add_column(title, justify="right")
    for name, costs in figures.costs.items():
        columns: tuple[tuple[Callable[[Cost], float], int], ...] = (
            (lambda cost: cost.frame_ms, 2),
            (lambda cost: cost.system_ns / max(1, cost.frames) / 1e6, 2),
            (lambda cost: 100 * cost.share, 1),
            (lambda cost: cost.frames / cost.seconds, 1),
            (lambda cost: cost.resident_bytes / 1e6, 1),
        )
        table.add_row(name, *(f"{statistics.median(map(value, costs)):.{digits}f}" for value, digits in columns))
    Console(width=120).print(table)
    print(*_judge(figures), sep="\n")
    interpreter_ms = figures.interpreter_s * 1000
    if "board-agent" in figures.costs:
        share = figures.frame_ms("board-agent") / interpreter_ms
        print(
            f"10^6 x += i: {interpreter_ms:.0f} ms; a frame takes {share:.2%} of it (orientation: {_ORIENTATION:.2%})"
        )
    for name, times in figures.copies.items():
        print(f"copies of an image byte: {times:.3f} by {name}")
    print(f"idle, no camera: {100 * figures.no_camera:.2f} % of processor")


def _judge(figures: Figures) -> list[Verdict]:
    """Judge the figures; programs that did not run are skipped."""
    found: list[tuple[str, float, float]] = []
    if {"board-agent", "C program"} <= figures.costs.keys():
        ratio = figures.frame_ms("board-agent") / figures.frame_ms("C program")
        found.append(("CPU a frame / C program's", ratio, _RATIO))
    if "board-agent" in figures.costs:
        found.append(("resident, MB", figures.resident_mb, _RESIDENT_MB))
    firsts, starts = figures.first_frame_ms, figures.ready_ms
    found += [
        (
            "copies of an image byte before the link",
            figures.copies_before_link,
            _COPIES + 0.005,
        ),  # a header does not count as one
        ("idle, camera at rest, % of processor", 100 * figures.idle, 100 * _IDLE_SHARE),
        (f"dialling to first frame, camera at rest, ms, most of {len(firsts)}", max(firsts), _FIRST_FRAME_MS),
        (f"start to READY, ms, most of {len(starts)}", max(starts), _READY_MS),
    ]
    return [Verdict(what, value <= limit, f"{value:.2f}", f"at most {limit:g}") for what, value, limit in found]


if __name__ == "__main__":
    sys.exit(main())
