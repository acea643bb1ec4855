"""ZeroMQ's sockets as a link uses them: one that listens behind a gate, and one that dials.

ZeroMQ accepts whoever dials. Without a free descriptor it cannot accept, but does not stop trying: its thread retries endlessly and takes half a
core (decision 0023). So it must not come to that. From half of the process's limit on, the gate lets the kernel drop requests for new connections,
while existing connections go on. Nothing is closed: unbinding would end every accepted connection.

ZeroMQ itself redials whenever a connection breaks, but stops once the peer has turned it away. Then `Dialled` redials, slowly: keys change,
and a link that was left open or secured by mistake may be corrected while we run.
"""

import array
import logging
import os
import select
import socket
import struct
import sys
from contextlib import suppress
from pathlib import Path
from typing import Final

import zmq

from common import now
from common.errors import UnavailableError
from common.link.waiter import Inbox
from common.program.logs import event

_LOG = logging.getLogger(__name__)

_NEVER: Final = 2**63 - 1
_REST_NS: Final = 2_000_000
"""After someone has dialled, look again after this time. In a flood, each call would otherwise wake a board that has frames to send."""

_LOOK_NS: Final = 100_000_000
"""While shut, look this often whether there is room again. A dialler's kernel retries after a second."""

_LEAST_LIMIT: Final = 128
"""A board needs some 30 descriptors itself. A smaller limit leaves none to give away."""

_ATTACH_FILTER: Final = 26
_DETACH_FILTER: Final = 27
"""SO_ATTACH_FILTER and SO_DETACH_FILTER, socket(7), asm-generic/socket.h; Python has no names for them."""

_DROP_ALL: Final = struct.pack("HBBI", 0x06, 0, 0, 0)
"""One instruction, BPF_RET | BPF_K with 0: lets no byte of any packet through (linux/filter.h)."""

_NEWS: Final = struct.Struct("=HI")
"""A monitor's event and its value, zmq_socket_monitor(3)."""

_ONCE: Final = select.EPOLLIN | select.EPOLLONESHOT

_PATIENCE_MS: Final = 1000
_NOW: Final = int(zmq.DONTWAIT)


def bind_gated(sock: "zmq.Socket[bytes]", address: str) -> "Gate | None":
    """Bind a socket and put a gate in front of it.

    Args:
        sock: a socket with its options set.
        address: `tcp://HOST:PORT` or `ipc://PATH`.

    Returns:
        The gate; None for ipc, whose path only its owner can reach, and where the system has no such filters.

    Raises:
        zmq.ZMQError: the address cannot be had.
    """
    if not address.startswith("tcp://") or sys.platform != "linux":
        sock.bind(address)
        return None
    monitor = sock.get_monitor_socket(zmq.EVENT_LISTENING)
    try:
        sock.bind(address)
        listening = _NEWS.unpack(monitor.recv_multipart(_NOW)[0])[1] if monitor.poll(_PATIENCE_MS) else None
    finally:
        sock.disable_monitor()
        monitor.close(0)
    return None if listening is None else Gate(listening)


class Gate:
    """Guards one listening TCP socket.

    Args:
        listening: its descriptor, which stays the caller's.
    """

    def __init__(self, listening: int) -> None:
        self._socket = socket.socket(fileno=os.dup(listening))
        self._filter = array.array("B", _DROP_ALL)
        self._epoll = select.epoll()
        self._epoll.register(self._socket, _ONCE)
        self._shut = False
        self._times = 0
        self.due_ns = _NEVER

    def fileno(self) -> int:
        """The descriptor to wait on: readable when someone has dialled."""
        return self._epoll.fileno()

    def watch(self) -> None:
        """Shut or open the gate according to the free descriptors. Call this when readable or due."""
        now_ns = now.monotonic_ns()
        is_due = now_ns >= self.due_ns
        if not is_due and not self._epoll.poll(0):
            return
        if self._shut:
            self._open_again()
        elif (limit := _limit()) >= _LEAST_LIMIT and _lowest_free(self._socket) >= limit // 2:
            self._close_for_now(limit)
        if self._shut:
            self.due_ns = now_ns + _LOOK_NS
        elif is_due:
            self.due_ns = _NEVER
            self._epoll.modify(self._socket, _ONCE)
        else:
            self.due_ns = now_ns + _REST_NS

    def close(self) -> None:
        """Release it."""
        self._epoll.close()
        self._socket.close()

    def _close_for_now(self, limit: int) -> None:
        program = struct.pack("@HP", len(self._filter) // len(_DROP_ALL), self._filter.buffer_info()[0])
        with suppress(OSError):  # a kernel without socket filters
            self._socket.setsockopt(socket.SOL_SOCKET, _ATTACH_FILTER, program)
            self._shut = True
            self._times += 1
            if self._times.bit_count() == 1:  # the 1st, 2nd, 4th, 8th …: a flood must not fill the log
                _LOG.warning(event("too_many_connections", count=self._times, descriptors=limit))

    def _open_again(self) -> None:
        """Open the gate once enough connections have gone. ZeroMQ hangs up on one that says nothing for three seconds."""
        if _used() < _limit() * 3 // 8:
            self._socket.setsockopt(socket.SOL_SOCKET, _DETACH_FILTER, 0)
            self._shut = False


def _limit() -> int:
    """How many descriptors this process may have."""
    return os.sysconf("SC_OPEN_MAX")


def _used() -> int:
    """How many descriptors this process has; the limit if none is left to look with."""
    try:
        return sum(1 for _ in Path("/proc/self/fd").iterdir())
    except OSError:
        return _limit()


def _lowest_free(sock: socket.socket) -> int:
    """Number of the next descriptor that this process gets, so it has at least that many. The limit if none is left."""
    try:
        number = os.dup(sock.fileno())
    except OSError:
        return _limit()
    os.close(number)
    return number


REDIAL_NS: Final = 15_000_000_000
"""Each refusal is a line in the board's log (curve.py writes one every ten seconds at most). A host that has just been paired does not wait long."""


_WATCHED: Final = int(
    zmq.EVENT_DISCONNECTED
    | zmq.EVENT_HANDSHAKE_SUCCEEDED
    | zmq.EVENT_HANDSHAKE_FAILED_AUTH
    | zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL
    | zmq.EVENT_HANDSHAKE_FAILED_NO_DETAIL
)

_MECHANISM_MISMATCH: Final = 0x11000002
"""ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH in zmq.h: one side requires keys, the other does not."""

_HANG_UPS: Final = 5
"""Handshakes that the peer may break off before this is reported: a restarting board, or a forwarded port with nothing behind it yet."""


class Dialled:
    """A socket that connects to one address.

    Args:
        sock: a socket with its options set, not connected yet.
        address: `tcp://HOST:PORT` or `ipc://PATH`.
        peer: name of the peer that must answer; empty on an open link.
        lane: its lane, for the log.

    Raises:
        zmq.ZMQError: the address makes no sense.
    """

    def __init__(self, sock: "zmq.Socket[bytes]", address: str, peer: str, lane: str) -> None:
        self.inbox = Inbox(sock)
        self.news = Inbox(sock.get_monitor_socket(_WATCHED))
        self.news.has_news()  # the descriptor signals news only after a look that found none
        self.due_ns = _NEVER
        self._address, self._peer, self._lane = address, peer, lane
        self._hang_ups = 0
        sock.connect(address)

    def redial(self) -> None:
        """Dial again; call this when it is due."""
        self.due_ns, self.inbox.may_have = _NEVER, True
        with suppress(zmq.ZMQError):  # it may have forgotten the address with the refusal
            self.inbox.socket.disconnect(self._address)
        self.inbox.socket.connect(self._address)

    def hang_up(self, now_ns: int) -> None:
        """Drop the peer that answered; redial later, when it may be a different one.

        Args:
            now_ns: CLOCK_MONOTONIC now, ns.
        """
        self.due_ns, self.inbox.may_have = now_ns + REDIAL_NS, True
        with suppress(zmq.ZMQError):
            self.inbox.socket.disconnect(self._address)

    def broke(self, now_ns: int) -> bool:
        """Handle one monitor event; return whether it says that the connection broke.

        Args:
            now_ns: CLOCK_MONOTONIC now, ns.

        Raises:
            UnavailableError: the peer has turned us away; it will be redialled later.
        """
        kind, value = _NEWS.unpack(self.news.socket.recv_multipart(_NOW)[0])
        match kind:
            case zmq.EVENT_DISCONNECTED:
                return True
            case zmq.EVENT_HANDSHAKE_SUCCEEDED:
                self._hang_ups = 0
            case zmq.EVENT_HANDSHAKE_FAILED_AUTH:
                self.due_ns = now_ns + REDIAL_NS
                raise UnavailableError(
                    f"{self._address} does not know this machine's key",
                    f"pair them: phone-host pair --link {self._address}",
                )
            case zmq.EVENT_HANDSHAKE_FAILED_PROTOCOL if value == _MECHANISM_MISMATCH:
                self.due_ns = now_ns + REDIAL_NS
                raise self._mismatch()
            case _:
                self._hang_ups += 1
                if self._hang_ups == _HANG_UPS:
                    expected = self._peer or "none"
                    _LOG.warning(event("peer_hangs_up", address=self._address, expected=expected, lane=self._lane))
        return False

    def _mismatch(self) -> UnavailableError:
        if not self._peer:
            return UnavailableError(
                f"{self._address} lets in only hosts with a key",
                f"pair with it: phone-host pair --link {self._address}",
            )
        return UnavailableError(
            f"{self._address} has no keys and is open to everybody",
            "secure it on the board, or add ?insecure=1 to --link here, too",
        )
