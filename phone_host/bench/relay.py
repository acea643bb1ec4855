"""The relay between the benchmark's two real ends, in a process of its own: moves bytes as a profile says and knows nothing of messages.

`tcp` and `ipc`: the host connects here, and each of its connections continues to the board. `serial`: two pseudo
terminals, one for each end. Root of its process. It holds little: its sockets' buffers are small, a `Way` is bounded,
and a full one is not read from.
"""

import argparse
import json
import os
import pty
import resource
import select
import socket
import subprocess
import sys
import tty
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from common import now
from common.errors import UnavailableError
from common.program.signals import StopSignals
from phone_host.bench.emulate import SEGMENT_BYTES, Profile, Way
from phone_host.subprocesses.child_process import GOODBYE_S, child_process

_SOCKET_BUFFER_BYTES: Final = 16 * 1024
"""Size of each socket's buffers. With the loopback's own segments of 64 KB, a buffer would hold a second of Bluetooth."""

_LONGEST_WAIT_S: Final = 0.5
_QUANTUM_BYTES: Final = 16 * 1024
"""Most bytes read from one connection at once. Fair enough between a link's two connections, because control messages are small."""

_DIAL_AGAIN_NS: Final = 100_000_000
"""While the board is not there, the host's connections wait unaccepted. If one were accepted and closed, the host would see a peer that hangs up."""


@dataclass(frozen=True, slots=True)
class RelayAccount:
    """What the process that emulated a line reports when it ends; bytes lost and stalls are of both directions."""

    to_host_bytes: int
    to_board_bytes: int
    lost_bytes: int
    stalls: int
    cpu_s: float


class _End:
    """One end of a connection: a descriptor, where its bytes go, and what could not be written yet."""

    def __init__(self, descriptor: int, close: Callable[[], None]) -> None:
        self.descriptor = descriptor
        self.close = close
        self.peer: _End = self
        self.way: Way[_End] | None = None
        self.pending = b""
        self.moved_bytes = 0
        self.read_out = False
        self.told_end = False
        self.broken = False

    @property
    def is_over(self) -> bool:
        """Whether everything that will ever come for it has been written, or can't be."""
        return self.broken or (self.told_end and not self.pending)

    def write(self, data: bytes) -> None:
        """Write as much as possible; the rest waits."""
        self.pending += data
        try:
            done = os.write(self.descriptor, self.pending)
        except BlockingIOError:
            return
        except OSError:
            self.broken = True
            return
        self.moved_bytes += done
        self.pending = self.pending[done:]


class Relay:
    """Moves bytes between ends, each direction at the profile's rate.

    Args:
        profile: how the line behaves.
        listener: accepts the host's connections; None for a pair of pseudo terminals.
        dial: returns a socket to the board.
    """

    def __init__(self, profile: Profile, listener: socket.socket | None, dial: Callable[[], socket.socket]) -> None:
        self._to_host: Way[_End] = Way(profile, 1)
        self._to_board: Way[_End] = Way(profile, 2)
        self._listener = listener
        self._dial = dial
        self._dial_due_ns = 0
        self._ends: list[_End] = []
        self._gone_bytes = [0, 0]

    def join(self, board: _End, host: _End) -> None:
        """Connect two ends."""
        board.peer, host.peer = host, board
        board.way, host.way = self._to_host, self._to_board
        self._ends += [board, host]

    def run(self, wake: socket.socket) -> RelayAccount:
        """Move bytes until `wake` becomes readable."""
        while not select.select([wake], [], [], 0)[0]:
            self._step(wake)
        used = resource.getrusage(resource.RUSAGE_SELF)
        moved = list(self._gone_bytes)
        for end in self._ends:
            moved[end.way is self._to_host] += end.moved_bytes
        lost, stalls = (
            self._to_host.lost_bytes + self._to_board.lost_bytes,
            self._to_host.stalls + self._to_board.stalls,
        )
        return RelayAccount(
            to_host_bytes=moved[0],
            to_board_bytes=moved[1],
            lost_bytes=lost,
            stalls=stalls,
            cpu_s=used.ru_utime + used.ru_stime,
        )

    def _step(self, wake: socket.socket) -> None:
        # If an end's peer cannot be written to, do not read the end: its sender then notices.
        readers = [
            end
            for end in self._ends
            if not end.read_out and not end.peer.pending and end.way is not None and end.way.room_bytes
        ]
        writers = [end for end in self._ends if end.pending]
        now_ns = now.monotonic_ns()
        may_dial = now_ns >= self._dial_due_ns
        due_ns = min(self._to_host.due_ns, self._to_board.due_ns, *(() if may_dial else (self._dial_due_ns,)))
        wait_s = min(_LONGEST_WAIT_S, max(0.0, (due_ns - now_ns) / 1e9))
        listening = [self._listener.fileno()] if self._listener is not None and may_dial else []
        # select, not epoll: its timeout is exact to the microsecond, epoll's only to the millisecond.
        ready, writable, _ = select.select(
            [wake.fileno(), *listening, *(end.descriptor for end in readers)],
            [end.descriptor for end in writers],
            [],
            wait_s,
        )
        if self._listener is not None and self._listener.fileno() in ready:
            self._accept(self._listener)
        for end in readers:
            if end.descriptor in ready:
                self._read(end)
        for end in writers:
            if end.descriptor in writable:
                end.write(b"")
        now_ns = now.monotonic_ns()
        for way in (self._to_host, self._to_board):
            for end, data in way.take(now_ns):
                end.told_end |= not data
                if data and not end.is_over:
                    end.write(data)
        self._bury()

    def _accept(self, listener: socket.socket) -> None:
        try:
            ours = self._dial()
        except OSError:  # the board is not there yet
            self._dial_due_ns = now.monotonic_ns() + _DIAL_AGAIN_NS
            return
        try:
            theirs, _ = listener.accept()
        except OSError:  # the host has given up
            ours.close()
            return
        for sock in (theirs, ours):
            sock.setblocking(False)  # noqa: FBT003 - the standard library's own signature
            if sock.family == socket.AF_INET:
                sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.join(_End(ours.fileno(), ours.close), _End(theirs.fileno(), theirs.close))

    def _read(self, end: _End) -> None:
        assert end.way is not None
        try:
            data = os.read(end.descriptor, min(_QUANTUM_BYTES, max(1, end.way.room_bytes)))
        except BlockingIOError:
            return
        except OSError:
            data = b""
        end.read_out = not data
        end.way.put(end.peer, data, now.monotonic_ns())

    def _bury(self) -> None:
        """Close both ends of a connection that one of them has ended."""
        for end in [end for end in self._ends if end.is_over]:
            for one in (end, end.peer):
                if one in self._ends:
                    one.broken = True
                    self._gone_bytes[one.way is self._to_host] += one.moved_bytes
                    self._ends.remove(one)
                    one.close()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a relay. It prints one line with the address of the host's end (and of a serial line's board end), and at its end one with what it moved.

    Args:
        arguments: kind, the board's address (for tcp and ipc) or `-`, a folder, and the profile as JSON.
    """
    parser = argparse.ArgumentParser("relay")
    parser.add_argument("kind", choices=("tcp", "ipc", "serial"))
    parser.add_argument("board")
    parser.add_argument("folder", type=Path)
    parser.add_argument("profile")
    options = parser.parse_args(arguments)
    profile = Profile(**json.loads(options.profile))
    signals = StopSignals()
    with _opened(options.kind, options.board, options.folder, profile) as (relay, ends):
        _say(ends)
        account = relay.run(signals.reader)
    _say(asdict(account))
    return 0


def _say(what: object) -> None:
    """Write a line of this process's two-line protocol with its parent process."""
    with suppress(BrokenPipeError):
        sys.stdout.write(json.dumps(what) + "\n")
        sys.stdout.flush()


@contextmanager
def _opened(kind: str, board: str, folder: Path, profile: Profile) -> Iterator[tuple[Relay, dict[str, str]]]:
    """Open a relay with its ends; yield it and their addresses."""
    if kind == "serial":
        with _terminals(folder) as ((board_end, host_end), paths):
            relay = Relay(profile, None, socket.socket)
            relay.join(board_end, host_end)
            yield relay, {"board": f"serial:{paths[0]}", "host": f"serial:{paths[1]}"}
        return
    family = socket.AF_INET if kind == "tcp" else socket.AF_UNIX
    with _small_socket(family) as listener:
        path = str(folder / "relay")
        listener.bind(("127.0.0.1", 0) if kind == "tcp" else path)
        listener.listen()
        listener.setblocking(False)  # noqa: FBT003 - the standard library's own signature
        host = f"tcp://127.0.0.1:{listener.getsockname()[1]}" if kind == "tcp" else f"ipc://{path}"
        yield Relay(profile, listener, lambda: _dialled(family, board)), {"board": board, "host": host}


def _dialled(family: socket.AddressFamily, address: str) -> socket.socket:
    sock = _small_socket(family)
    place = address.partition("://")[2]
    name, _, port = place.rpartition(":")
    try:
        sock.connect((name, int(port)) if family == socket.AF_INET else place)
    except OSError:
        sock.close()
        raise
    return sock


def _small_socket(family: socket.AddressFamily) -> socket.socket:
    """Make a socket that holds little. It uses Ethernet's segment size: a small buffer would not take even one of the loopback's own segments."""
    sock = socket.socket(family)
    for option in (socket.SO_RCVBUF, socket.SO_SNDBUF):
        sock.setsockopt(socket.SOL_SOCKET, option, _SOCKET_BUFFER_BYTES)
    if family == socket.AF_INET:
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_MAXSEG, SEGMENT_BYTES)
    return sock


@contextmanager
def _terminals(folder: Path) -> Iterator[tuple[tuple[_End, _End], tuple[Path, Path]]]:
    """Open two raw pseudo terminals. Both stay open here, so that an end that nobody has opened yet is silent and not an error."""
    paths = (folder / "ttyBoard", folder / "ttyHost")
    pairs = [pty.openpty() for _ in paths]
    ends = []
    for path, (master, slave) in zip(paths, pairs, strict=True):
        tty.setraw(slave)
        os.set_blocking(master, False)
        path.unlink(missing_ok=True)
        path.symlink_to(os.ttyname(slave))
        ends.append(_End(master, lambda: None))
    try:
        yield (ends[0], ends[1]), paths
    finally:
        for pair in pairs:
            for descriptor in pair:
                os.close(descriptor)


class RelayProcess:
    """A running relay.

    Attributes:
        board: link URI for the board's end.
        host: link URI for the host's end.
    """

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        self._process = process
        assert process.stdout is not None
        try:
            said = json.loads(process.stdout.readline())
        except ValueError:
            raise UnavailableError("the two programs did not connect", "run it by hand to see why") from None
        self.board: str = said["board"]
        self.host: str = said["host"]

    def stop(self) -> RelayAccount:
        """Ask it to end; return its account."""
        self._process.terminate()
        try:
            return RelayAccount(**json.loads(self._process.communicate(timeout=GOODBYE_S)[0]))
        except (subprocess.TimeoutExpired, ValueError):
            raise UnavailableError("the connection between the two programs broke", "run it again") from None


@contextmanager
def relay_process(kind: str, board: str, folder: Path, profile: Profile) -> Iterator[RelayProcess]:
    """Run a relay in a process of its own while a block runs.

    Args:
        kind: `tcp`, `ipc` or `serial`.
        board: address of the board's own end; ignored for `serial`.
        folder: for sockets and names of terminals.
        profile: how the line behaves.
    """
    arguments = [kind, board, str(folder), json.dumps(asdict(profile))]
    with child_process("phone_host.bench.relay", arguments) as process:
        yield RelayProcess(process)


if __name__ == "__main__":
    sys.exit(main())
