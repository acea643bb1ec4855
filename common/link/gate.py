"""Stops listening for a moment when connections have taken half of this process's file descriptors.

ZeroMQ accepts whoever dials. Without a descriptor left it cannot accept, and cannot leave it either: its thread tries again without end and takes
half of a core (decision 0023). So it never comes to that: from half of the limit on the kernel drops what asks for a new connection, and
connections that are there go on. Nothing is closed: to unbind would end every connection that was accepted.
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
from common.program.logs import event

_LOG = logging.getLogger(__name__)

_NEVER: Final = 2**63 - 1
_REST_NS: Final = 2_000_000
"""After somebody has dialled it is looked again after this time: of a flood each call would wake a board that has frames to send."""

_LOOK_NS: Final = 100_000_000
"""While shut it is looked this often whether there is room again; a dialler's kernel asks again after a second."""

_LEAST_LIMIT: Final = 128
"""A board has some 30 descriptors of its own; of a smaller limit there is nothing to give away."""

_ATTACH_FILTER: Final = 26
_DETACH_FILTER: Final = 27
"""SO_ATTACH_FILTER and SO_DETACH_FILTER, socket(7), asm-generic/socket.h; Python has no names for them."""

_DROP_ALL: Final = struct.pack("HBBI", 0x06, 0, 0, 0)
"""One instruction, BPF_RET | BPF_K with 0: no byte of any packet is let through (linux/filter.h)."""

_NEWS: Final = struct.Struct("=HI")
"""A monitor's event and its value, zmq_socket_monitor(3)."""

_ONCE: Final = select.EPOLLIN | select.EPOLLONESHOT

_PATIENCE_MS: Final = 1000
_NOW: Final = int(zmq.DONTWAIT)


def bind(sock: "zmq.Socket[bytes]", address: str) -> "Gate | None":
    """Bind a socket, and put a gate before it.

    Args:
        sock: with its options set.
        address: `tcp://HOST:PORT` or `ipc://PATH`.

    Returns:
        The gate; None for ipc, whose path only its owner can reach, and where the system has none of this.

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
    """Watches over one listening TCP socket.

    Args:
        listening: its descriptor, which stays its owner's.
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
        """What to wait on: readable when somebody has dialled."""
        return self._epoll.fileno()

    def watch(self) -> None:
        """Shut or open, as there are descriptors; to be called when readable or due."""
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
        """Let go of it."""
        self._epoll.close()
        self._socket.close()

    def _close_for_now(self, limit: int) -> None:
        program = struct.pack("@HP", len(self._filter) // len(_DROP_ALL), self._filter.buffer_info()[0])
        with suppress(OSError):  # a kernel without socket filters
            self._socket.setsockopt(socket.SOL_SOCKET, _ATTACH_FILTER, program)
            self._shut = True
            self._times += 1
            if self._times.bit_count() == 1:  # the 1st, 2nd, 4th, 8th …: who floods must not fill the log
                _LOG.warning(event("too_many_connections", count=self._times, descriptors=limit))

    def _open_again(self) -> None:
        """Open where enough connections have gone: ZeroMQ hangs up on one that says nothing for three seconds."""
        if _used() < _limit() * 3 // 8:
            self._socket.setsockopt(socket.SOL_SOCKET, _DETACH_FILTER, 0)
            self._shut = False


def _limit() -> int:
    """Descriptors that this process may have."""
    return os.sysconf("SC_OPEN_MAX")


def _used() -> int:
    """Descriptors that it has; the limit where there is none left to look with."""
    try:
        return sum(1 for _ in Path("/proc/self/fd").iterdir())
    except OSError:
        return _limit()


def _lowest_free(sock: socket.socket) -> int:
    """Number of the next descriptor that this process gets: it has so many at least. The limit where there is none left."""
    try:
        number = os.dup(sock.fileno())
    except OSError:
        return _limit()
    os.close(number)
    return number
