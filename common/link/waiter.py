"""Waits for links, cameras and signals in one place, with few system calls.

Each call into ZeroMQ costs two of them where there is no cheap cycle counter (ARM), and a zmq.Poller, which makes its lists anew for each
wait, asks each socket twice. Here it is once, by the rule of ZMQ_FD (zmq_getsockopt(3)): a ZeroMQ socket's descriptor tells once that there
is news, and any call of the socket may have taken it in. So ZMQ_EVENTS is asked right before waiting, and a readable descriptor says: look.
"""

import os
import select
from collections.abc import Callable, Iterable
from typing import Any, Final

import zmq

from common import now

# As plain integers: pyzmq's flags are enums, whose operators cost more than the call that takes them.
_EVENTS: Final = int(zmq.EVENTS)
_READABLE: Final = int(zmq.POLLIN)

_AWAKE_NS: Final = 200_000
"""Longer than an echo over loopback takes; twice as long gained nothing (decision 0009)."""

_ASLEEP_NS: Final = 1_000_000_000
"""A core that others want is left to them for so long: who gives it away waits for their milliseconds, who sleeps is woken before them."""


def is_readable(sock: "zmq.Socket[bytes]") -> bool:
    """Whether a ZeroMQ socket has something to receive: cheaper than the exception of one that has nothing."""
    return bool(int(sock.getsockopt(_EVENTS)) & _READABLE)


class Waiter:
    """What is waited on.

    Args:
        pollables: ZeroMQ sockets, descriptors, or objects with one.
        clock: monotonic, ns.
    """

    def __init__(self, pollables: Iterable[Any], clock: Callable[[], int] = now.monotonic_ns) -> None:
        self._poll = select.poll()
        self._sockets: list[tuple[int, zmq.Socket[bytes]]] = []
        self._clock = clock
        self._awake_until_ns = 0
        self._asleep_until_ns = 0
        for item in pollables:
            fd = item if isinstance(item, int) else item.fileno()
            self.add(fd)
            if isinstance(item, zmq.Socket):
                self._sockets.append((fd, item))

    def add(self, fd: int, events: int = select.POLLIN) -> None:
        """Wait on a descriptor, too.

        Args:
            fd: the descriptor.
            events: bits of poll(2).
        """
        self._poll.register(fd, events)

    def remove(self, fd: int) -> None:
        """Wait on a descriptor no more."""
        self._poll.unregister(fd)

    def stay_awake(self) -> None:
        """Let `wait` look again and again before it sleeps, for 200 us from now, as the other side's part of an echo is expected.

        A core that rests wakes late, and not equally late on both sides of a link (decision 0009). Where others want the core it sleeps as ever.
        """
        now_ns = self._clock()
        if now_ns >= self._asleep_until_ns:
            self._awake_until_ns = now_ns + _AWAKE_NS

    def wait(self, wait_ms: int) -> list[int]:
        """Wait until there is something to look at.

        Args:
            wait_ms: at most so long, ms, beside the time to stay awake.

        Returns:
            Descriptors, those of ZeroMQ sockets included; a socket may turn out to have nothing to receive.
        """
        ready = [fd for fd, sock in self._sockets if is_readable(sock)]
        now_ns = self._clock() if wait_ms and not ready else self._awake_until_ns
        while now_ns < self._awake_until_ns:
            os.sched_yield()  # ZeroMQ's thread may share the core
            found = self._poll.poll(0)
            before_ns, now_ns = now_ns, self._clock()
            if now_ns - before_ns > _AWAKE_NS:
                self._asleep_until_ns = now_ns + _ASLEEP_NS
            if found:
                return [fd for fd, _ in found]
        return ready + [fd for fd, _ in self._poll.poll(0 if ready else wait_ms)]
