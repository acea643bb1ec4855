"""A link over one byte stream that may lose and corrupt bytes. Both lanes share it, as `common.protocol.duplex` describes.

A wire has no dialler. Both sides open their end, one plays the dialler, and they meet by an exchange of contact words. So a peer's restart
makes new connections here, as on other links. The pollable is an epoll descriptor. It stays the same when the device goes and comes back,
and it wakes for room to write only while bytes are waiting. Nothing here blocks. A link moves only when its owner calls it: `receive`,
`send`, and whatever is due at `due_ns`.
"""

import os
import select
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Final, Protocol

from common import now
from common.errors import UnavailableError
from common.frame import Buffer
from common.link.base import Broken, Garbage, Incoming, Packet, SendResult
from common.protocol.chunking import Whole
from common.protocol.duplex import Change, Duplex, DuplexCounts
from common.protocol.framing import LinkEnd
from common.protocol.message import Lane
from common.protocol.wire import MAX_HEADER_BYTES, MAX_PAYLOAD_BYTES

_MS: Final = 1_000_000
_NEVER: Final = 2**63 - 1

_READ_BYTES: Final = 64 * 1024
_READS: Final = 16
"""Reads in one go. A pty delivers pages of 4 KB, which thus cost only one acknowledgement, and other links get their turn."""

_REOPEN_NS: Final = 100 * _MS
"""A device that comes back is found within this time. Looking for a missing node costs 20 us."""

_LINGER_NS: Final = 500 * _MS
_LINGER_STEP_S: Final = 0.01


class Line(Protocol):
    """One opened end of a byte stream."""

    def fileno(self) -> int:
        """Its descriptor, non-blocking. A read returns b"" only when the line is lost."""

    def is_drained(self) -> bool:
        """Whether the system has passed on everything that was written, as far as it knows."""

    def discard_output(self) -> None:
        """Discard what was written and has not left yet."""

    def close(self) -> None:
        """Release it without waiting."""


@dataclass(frozen=True, slots=True)
class Opening:
    """A line that is not open yet.

    Attributes:
        descriptor: when this is ready, call `open_line` again; -1: call it again after a while.
        events: epoll events to wait for.
    """

    descriptor: int = -1
    events: int = select.EPOLLOUT


class StreamLink:
    """Talks over a line, and reopens it whenever it is lost.

    Args:
        kind: the transport's name.
        side: which of the two this side plays.
        open_line: opens the line or returns an Opening if that takes time; raises UnavailableError.
        frame_bytes: size of the frames in which the transport carries bytes; 1 if it has none.
        waits: whether to wait for a line that cannot be had now.

    Raises:
        UnavailableError: the line cannot be had now.
    """

    self_paced: Final = True

    def __init__(
        self,
        kind: str,
        side: LinkEnd,
        open_line: Callable[[], Line | Opening],
        frame_bytes: int = 1,
        *,
        waits: bool = False,
    ) -> None:
        self.kind = kind
        self._dials = side is LinkEnd.DIALLER
        self.dialled = {lane: lane.name.encode() for lane in Lane} if self._dials else {}
        self.open_line = open_line
        self._line: Line | None = None
        self._opening = Opening()
        self._reopen_ns = 0
        self._events = select.EPOLLIN
        opened = Opening() if waits else open_line()
        self._epoll = select.epoll()
        self._duplex = Duplex(side, int.from_bytes(os.urandom(4), "little"), frame_bytes)
        self._begin(opened)
        self._incoming: deque[Incoming] = deque()
        self._pending = memoryview(b"")
        self._names = dict(self.dialled)

    @property
    def pollables(self) -> Sequence[select.epoll]:
        """One epoll descriptor."""
        return (self._epoll,)

    @property
    def due_ns(self) -> int:
        """When `receive` must be called next even if nothing is readable, by this machine's steady clock, ns."""
        if self._incoming:
            return 0
        if self._line is None:
            return self._reopen_ns if self._opening.descriptor < 0 else _NEVER
        return _NEVER if self._pending else self._duplex.due_ns

    @property
    def is_open(self) -> bool:
        """Whether the line is there now."""
        return self._line is not None

    @property
    def bytes_per_s(self) -> float:
        """The line's measured rate in the direction of sending; 0 while unknown."""
        return self._duplex.bytes_per_s

    @property
    def counts(self) -> DuplexCounts:
        """What went wrong so far."""
        return self._duplex.counts

    def ready(self, connection: bytes) -> bool:
        """Whether to send a frame now: it would be accepted, or the connection is gone and `send` will say so."""
        lane = self._lane(connection)
        return lane is None or (not self._pending and self._duplex.ready(lane))

    def receive(self) -> Iterator[Incoming]:
        """Return all packets that have arrived, write what waits, and look for a lost device."""
        if self._line is None:
            self._reopen()
        self._read(_READS)
        self._write()
        while self._incoming:
            yield self._incoming.popleft()

    def send(self, connection: bytes, header: bytes, payload: Buffer) -> SendResult:
        """Send a packet. A frame is FULL while the previous one is still being written; everything is FULL until the peer was met."""
        lane = self._lane(connection)
        if lane is None or (self._line is None and not self._dials):
            return SendResult.UNREACHABLE
        if self._line is None:
            return SendResult.FULL  # the link redials by itself
        if len(header) > MAX_HEADER_BYTES or len(payload) > MAX_PAYLOAD_BYTES:
            self._duplex.leave()
            self._tell_broken()
            return SendResult.SENT  # and lost, as with any transport that refuses it on the way
        taken = self._takes(lane, header, payload)
        if not taken and not self._incoming:
            self._read(1)  # acknowledgements may have come meanwhile
            self._write()
            taken = self._lane(connection) is lane and self._takes(lane, header, payload)
        self._write()
        return SendResult.SENT if taken else SendResult.FULL

    def close(self) -> None:
        """Give accepted packets half a second to leave, say goodbye, then release the device."""
        deadline_ns = now.monotonic_ns() + _LINGER_NS
        while not self._has_left() and now.monotonic_ns() < deadline_ns:
            self._epoll.poll(_LINGER_STEP_S)
        if self._line is not None and self._pending:
            self._line.discard_output()
            self._pending = memoryview(b"")
        self._duplex.leave()
        self._write()
        if self._line is not None:
            self._line.close()
            self._line = None
        self._epoll.close()

    def _has_left(self) -> bool:
        self._read(_READS)
        self._write()
        return self._line is None or (not self._pending and self._duplex.is_idle and self._line.is_drained())

    def _lane(self, connection: bytes) -> Lane | None:
        return next((lane for lane, name in self._names.items() if name == connection), None)

    def _takes(self, lane: Lane, header: bytes, payload: Buffer) -> bool:
        return not (len(payload) and self._pending) and self._duplex.put(lane, header, payload)

    def _reopen(self) -> None:
        now_ns = now.monotonic_ns()
        if self._opening.descriptor >= 0:
            with suppress(OSError):  # `open_line` may have closed it
                self._epoll.unregister(self._opening.descriptor)
            self._opening = Opening()
        elif now_ns < self._reopen_ns:
            return
        self._reopen_ns = now_ns + _REOPEN_NS
        with suppress(UnavailableError):
            self._begin(self.open_line())

    def _begin(self, opened: Line | Opening) -> None:
        """Register the open line, or the descriptor on which the opening one waits."""
        if isinstance(opened, Opening):
            self._opening = opened
            if opened.descriptor >= 0:
                self._epoll.register(opened.descriptor, opened.events)
            return
        self._line, self._events = opened, select.EPOLLIN
        self._epoll.register(opened.fileno(), self._events)

    def _lose(self) -> None:
        """Close a device that is gone, or that was pulled and must be reopened."""
        assert self._line is not None
        self._epoll.unregister(self._line.fileno())
        self._line.close()
        self._line = None
        self._pending = memoryview(b"")
        self._reopen_ns = now.monotonic_ns() + _REOPEN_NS
        if self._duplex.interrupt():
            self._tell_broken()

    def _tell_broken(self) -> None:
        self._incoming.extend(Broken(self._names[lane]) for lane in (Lane.CONTROL, Lane.FRAMES))
        self._names = dict(self.dialled)

    def _read(self, reads: int) -> None:
        for _ in range(reads):
            if self._line is None:
                return
            try:
                data = os.read(self._line.fileno(), _READ_BYTES)
            except BlockingIOError:
                self._accept(self._duplex.silence(now.monotonic_ns()))
                return
            except OSError:
                data = b""
            if not data:
                self._lose()
                return
            self._accept(self._duplex.feed(data, now.monotonic_ns()))

    def _accept(self, events: list[Whole | Change]) -> None:
        for event in events:
            match event:
                case Whole(lane, header, payload):
                    self._incoming.append(Packet(self._names[lane], header, payload))
                case Change.MET:
                    tag = b"" if self._dials else b" %08x" % self._duplex.number
                    self._names = {lane: lane.name.encode() + tag for lane in Lane}
                case Change.PARTED:
                    self._tell_broken()
                case Change.GARBAGE:
                    self._incoming.append(Garbage(Lane.CONTROL.name.encode()))

    def _write(self) -> None:
        """Write as much as the line and the bound on unacknowledged bytes allow."""
        while self._line is not None:
            if not self._pending:
                self._pending = memoryview(self._duplex.take(now.monotonic_ns()))
                if not self._pending:
                    break
            try:
                written = os.write(self._line.fileno(), self._pending)
            except BlockingIOError:
                break
            except OSError:
                self._read(_READS)  # the peer's last words, if it was the peer who closed
                if self._line is not None:
                    self._lose()
                return
            self._pending = self._pending[written:]
            if self._pending:
                break
        events = select.EPOLLIN | (select.EPOLLOUT if self._pending else 0)
        if self._line is not None and events != self._events:
            self._events = events
            self._epoll.modify(self._line.fileno(), events)
