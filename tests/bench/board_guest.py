"""A booted armhf board under measurement: the programs on it, what they cost, and what takes their frames on this machine.

CPU time is what the guest's kernel reports for all threads of a process (/proc/PID/task/*/schedstat, ns on a
processor). It includes the kernel's work on behalf of the process, but not work in kernel threads and interrupts.
"""

import os
import shlex
import shutil
import socket
import subprocess
import tempfile
import threading
import time
from array import array
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

import zmq

from common import now
from common.errors import UnavailableError
from common.link.factory import open_link, parse_link
from phone_host.accounts.link_account import SessionAccount
from phone_host.model import BoardFrame
from phone_host.stream.receiver import Receiver
from tests.support.unkept import Unkept
from tests.vm.guest import LINK_PORT, UNIT, Guest
from tests.vm.machine import Architecture, image_of

ROOT: Final = Path(__file__).resolve().parents[2]
SOURCES: Final = Path(__file__).resolve().parent / "board"
COMPILER: Final = "arm-linux-gnueabihf-gcc"
_LIBZMQ: Final = "/usr/lib/arm-linux-gnueabihf/libzmq.so.5"
_LEAST_FRAMES: Final = 30
_PATIENCE_S: Final = 120.0
_FIFO_PRIORITY: Final = 10


class Counter(Protocol):
    """Takes and counts frames."""

    frames: int
    bytes: int

    def close(self) -> None:
        """Close the connection."""


class OurHost:
    """Our host up to the pairing: link, session, clock echoes, credit.

    Attributes:
        ages_ns: age of each frame on arrival, since its exposure.
        first_ns: when the first frame arrived; 0 until then.

    Args:
        address: of the board's link.
    """

    def __init__(self, address: str) -> None:
        self.frames = self.bytes = self.first_ns = 0
        self.ages_ns = array("q")
        counter = self

        class Counting(Unkept):
            """A sink that counts the frames."""

            def add_board(self, frame: BoardFrame) -> None:
                counter.first_ns = counter.first_ns or frame.received_ns
                counter.frames += 1
                counter.bytes += len(frame.message.payload)
                counter.ages_ns.append(frame.received_ns - frame.marks.exposed_ns)

        link = open_link(parse_link(address, listens_by_default=False))
        self._receiver = Receiver([link], now.random_id(), Counting())
        self._receiver.start()

    def close(self) -> None:
        """Say goodbye, and receive the board's last account."""
        self._receiver.stop()

    @property
    def account(self) -> SessionAccount:
        """The account of the session so far; complete after `close`."""
        (only,) = self._receiver.account.sessions
        return only


class _Counting(threading.Thread):
    """A counter with its own thread."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.frames = self.bytes = 0
        self.stopping = threading.Event()
        self.start()

    def close(self) -> None:
        """Close the connection."""
        self.stopping.set()
        self.join()


class Puller(_Counting):
    """Receives the C program's messages."""

    def __init__(self, address: str) -> None:
        self._address = address
        super().__init__()

    def run(self) -> None:
        """Receive until told to stop."""
        with zmq.Context() as context, context.socket(zmq.PULL) as sock:
            sock.setsockopt(zmq.RCVTIMEO, 100)
            sock.setsockopt(zmq.LINGER, 0)
            sock.connect(self._address)
            while not self.stopping.is_set():
                with suppress(zmq.Again):
                    _, payload = sock.recv_multipart(copy=False)
                    self.bytes += len(payload.buffer)
                    self.frames += 1


class HttpReader(_Counting):
    """Reads ustreamer's stream: multipart over HTTP, each part with its length."""

    def __init__(self, address: str) -> None:
        host, _, port = address.removeprefix("tcp://").rpartition(":")
        self._endpoint = (host, int(port))
        super().__init__()

    def run(self) -> None:
        """Read until told to stop; keep dialling a server that is not there yet."""
        while not self.stopping.is_set():
            with suppress(OSError), socket.create_connection(self._endpoint, timeout=5) as sock:
                sock.sendall(b"GET /stream HTTP/1.0\r\n\r\n")
                with sock.makefile("rb") as stream:
                    while not self.stopping.is_set() and (line := stream.readline()):
                        if line.lower().startswith(b"content-length:"):
                            length = int(line.partition(b":")[2])
                            while stream.readline().strip():
                                pass
                            self.bytes += len(stream.read(length))
                            self.frames += 1
            time.sleep(0.2)


@dataclass(frozen=True, slots=True, kw_only=True)
class Cost:
    """What a program used while it streamed.

    Attributes:
        frames: that arrived here in that time.
        seconds: how long it was watched.
        cpu_ns: CPU time of all its threads.
        system_ns: the kernel's share of that (at a coarser resolution).
        resident_bytes: its memory at the end.
    """

    frames: int
    seconds: float
    cpu_ns: int
    system_ns: int
    resident_bytes: int

    @property
    def frame_ms(self) -> float:
        """CPU time per frame, ms."""
        return self.cpu_ns / max(1, self.frames) / 1e6

    @property
    def share(self) -> float:
        """Share of one processor."""
        return self.cpu_ns / 1e9 / self.seconds


@dataclass(frozen=True, slots=True)
class _Meter:
    cpu_ns: int
    system_ns: int
    read_ns: int


class Board:
    """A booted board with our package.

    Args:
        guest: booted, with the package installed.
    """

    def __init__(self, guest: Guest) -> None:
        self.guest = guest

    def be_quiet(self) -> bool:
        """Give the emulator and this process priority: time in which the guest does not run counts as its programs' own.

        Returns:
            Whether that is permitted.
        """
        priority = os.sched_param(_FIFO_PRIORITY)
        try:
            for process in (self.guest.emulator_pid, os.getpid()):
                for thread in Path(f"/proc/{process}/task").iterdir():
                    os.sched_setscheduler(int(thread.name), os.SCHED_FIFO, priority)
        except PermissionError:
            return False
        return True

    def interpreter_s(self) -> float:
        """Time the guest's Python takes for 10^6 rounds of `x += i`: the best of three, s."""
        loop = (
            "import timeit; print(min(timeit.repeat('for i in range(1000000): x += i', 'x = 0', number=1, repeat=3)))"
        )
        return float(self.guest.sh(f"python3 -c {shlex.quote(loop)}"))

    def cost(self, pid: int, counter: Counter, seconds: float) -> Cost:
        """Wait for frames, then watch a process for a while."""
        self.until_frames(counter)
        return self.watch(pid, lambda: counter.frames, seconds)

    def watch(self, pid: int, frames: Callable[[], int], seconds: float) -> Cost:
        """Watch a process for a while.

        Args:
            pid: the process.
            frames: gives the number of frames received here so far.
            seconds: how long.
        """
        before, frames_before = self.meter(pid), frames()
        time.sleep(seconds)
        after, got = self.meter(pid), frames() - frames_before
        return Cost(
            frames=got,
            seconds=(after.read_ns - before.read_ns) / 1e9,
            cpu_ns=after.cpu_ns - before.cpu_ns,
            system_ns=after.system_ns - before.system_ns,
            resident_bytes=self.resident_bytes(pid),
        )

    def resident_bytes(self, pid: int) -> int:
        """Memory of a process that is in RAM now."""
        return 1024 * int(self.guest.sh(f"awk '/^VmRSS/ {{ print $2 }}' /proc/{pid}/status"))

    def until_frames(self, counter: Counter) -> None:
        """Wait for one second's worth of frames.

        Raises:
            UnavailableError: no frames came.
        """
        wanted, deadline = counter.frames + _LEAST_FRAMES, time.monotonic() + _PATIENCE_S
        while counter.frames < wanted:
            if time.monotonic() > deadline:
                raise UnavailableError(f"no frames within {_PATIENCE_S:.0f} s", "look at the guest's journal")
            time.sleep(0.05)

    def meter(self, pid: int) -> _Meter:
        """CPU time of a process so far."""
        said = self.guest.sh(
            f"cat /proc/{pid}/task/*/schedstat | awk '{{ ns += $1 }} END {{ printf \"%.0f\\n\", ns }}'; awk '{{ print $15 }}' /proc/{pid}/stat; "
            "getconf CLK_TCK"
        ).split()
        cpu_ns, system_ticks, ticks_hz = (int(word) for word in said)
        return _Meter(cpu_ns, system_ticks * 1_000_000_000 // ticks_hz, time.monotonic_ns())

    @property
    def service_pid(self) -> int:
        """Process id of the service."""
        return int(self.guest.show("MainPID"))

    def start_ms(self) -> float:
        """Restart the service; returns the time from process start to READY as measured by the guest's systemd, ms."""
        self.guest.sh(f"systemctl restart {UNIT}")
        times = [
            int(self.guest.show(name)) for name in ("ExecMainStartTimestampMonotonic", "ActiveEnterTimestampMonotonic")
        ]
        return (times[1] - times[0]) / 1000

    @contextmanager
    def running(self, command: str) -> Iterator[int]:
        """Run a command in the guest while the block lasts; yields its process id."""
        pid_file = "/run/bench.pid"
        process = self.guest.popen(f"echo $$ > {pid_file}; exec {command} >/run/bench.log 2>&1")
        try:
            while not (said := self.guest.sh(f"cat {pid_file} 2>/dev/null || true").strip()):
                time.sleep(0.1)
            yield int(said)
        finally:
            self.guest.code(f"kill $(cat {pid_file}); rm -f {pid_file}")
            with process:  # closes its pipes and waits
                pass


@contextmanager
def booted_board(architecture: Architecture = Architecture.ARMHF) -> Iterator[Board]:
    """Boot a board and install our package, while the block lasts.

    Raises:
        UnavailableError: the image or the emulator is missing.
    """
    image = image_of(architecture)
    if not image.built or not shutil.which(image.emulator):
        raise UnavailableError(f"there is no image of an {architecture.value} board", "run .ci/board as root")
    with tempfile.TemporaryDirectory(prefix="board-") as name:
        folder = Path(name)
        guest = Guest(image, folder)
        try:
            guest.start()
            package = subprocess.run(
                [ROOT / "deploy/board/build-deb", folder], capture_output=True, text=True, check=True
            )
            guest.install(Path(package.stdout.strip()))
            yield Board(guest)
        finally:
            guest.stop()


def need_compiler() -> None:
    """Check for what `install_rivals` needs before spending minutes on a boot.

    Raises:
        UnavailableError: the cross compiler is missing.
    """
    if not shutil.which(COMPILER):
        raise UnavailableError(f"{COMPILER} is missing", "apt install gcc-arm-linux-gnueabihf")


def install_rivals(board: Board) -> None:
    """Compile the rival and the copy counter for the armhf guest, link them to its own libzmq, and install them there."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        libzmq, forward, copies = folder / "libzmq.so.5", folder / "forward", folder / "copies.so"
        board.guest.get(_LIBZMQ, libzmq)
        compiler = (COMPILER, "-O2", "-Wall", "-Wextra", "-Werror")
        linked = (SOURCES / "forward.c", libzmq, "-Wl,--allow-shlib-undefined")
        subprocess.run([*compiler, "-o", forward, *linked], check=True)
        # -fno-builtin: its own loops must not be compiled into calls of the functions that they replace.
        library = ("-fno-builtin", "-shared", "-fPIC", SOURCES / "copies.c")
        subprocess.run([*compiler, "-o", copies, *library], check=True)
        for program in (forward, copies):
            board.guest.put(program, "/opt/bench")


FORWARD: Final = f"/opt/bench/forward {{device}} {{width}} {{height}} {{fps}} tcp://*:{LINK_PORT}"
USTREAMER: Final = (
    f"ustreamer --device={{device}} --resolution={{width}}x{{height}} --desired-fps={{fps}} --format=MJPEG --encoder=HW --host=0.0.0.0 --port={LINK_PORT} "
    "--tcp-nodelay"
)
