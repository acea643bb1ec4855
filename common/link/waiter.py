"""Waits for links, cameras and signals in one place, with few system calls.

On machines without a cheap cycle counter (ARM), each call into ZeroMQ costs two system calls. A zmq.Poller rebuilds its lists for each wait and
asks each socket twice. Here a socket is asked only if it may have news, by the rule of ZMQ_FD (zmq_getsockopt(3)): a ZeroMQ socket's descriptor
signals news only once, and any call on the socket may have consumed it. So a socket that was used is asked right before waiting; one that said
it has nothing, and was not used since, has nothing until its descriptor is readable. A readable descriptor only means: look.
"""

import os
import select
from collections.abc import Callable, Iterable
from typing import Any, Final

import zmq

from common import now

# As a plain integer: pyzmq's flags are enums, whose operators cost more than the call that takes them.
_READABLE: Final = int(zmq.POLLIN)

_AWAKE_NS: Final = 200_000
"""Longer than an echo over loopback takes. Twice as long gained nothing (decision 0009)."""

_ASLEEP_NS: Final = 1_000_000_000
"""For this long a contended core is left to others. Who yields a core waits milliseconds for it; who sleeps is woken before them."""


class Inbox:
    """A ZeroMQ socket, and whether it may have something to receive. Whoever uses the socket in any other way sets `may_have`.

    Attributes:
        socket: the socket.
        may_have: whether `has_news` may say yes.
        is_told: whether its descriptor was readable since it was last asked: hardly ever for nothing.
    """

    __slots__ = ("_asked", "_fd", "is_told", "may_have", "socket")

    def __init__(self, sock: "zmq.Socket[bytes]") -> None:
        self.socket = sock
        self.may_have = True
        self.is_told = False
        self._fd = sock.fileno()
        self._asked = [
            (sock, _READABLE)
        ]  # asked by zmq_poll: getsockopt makes two enum members, and takes half as long again

    def fileno(self) -> int:
        """The descriptor that becomes readable when there may be news."""
        return self._fd

    def has_news(self) -> bool:
        """Ask the socket whether there is something to receive."""
        self.is_told = False
        self.may_have = bool(zmq.zmq_poll(self._asked, 0))
        return self.may_have

    def invites(self) -> bool:
        """Whether to try to receive now. Right after its descriptor was readable this asks nothing, and the try may find nothing (zmq.Again)."""
        if self.is_told:
            self.is_told = False
            return True
        self.may_have = bool(zmq.zmq_poll(self._asked, 0))
        return self.may_have


class Waiter:
    """Waits on a set of pollables.

    Args:
        pollables: inboxes, descriptors, or objects that have one.
        clock: monotonic clock, ns.
    """

    def __init__(self, pollables: Iterable[Any], clock: Callable[[], int] = now.monotonic_ns) -> None:
        self._poll = select.poll()
        self._inboxes: dict[int, Inbox] = {}
        self._clock = clock
        self._awake_until_ns = 0
        self._asleep_until_ns = 0
        for item in pollables:
            fd = item if isinstance(item, int) else item.fileno()
            self.add(fd)
            if isinstance(item, Inbox):
                self._inboxes[fd] = item

    def add(self, fd: int, events: int = select.POLLIN) -> None:
        """Also wait on this descriptor.

        Args:
            fd: the descriptor.
            events: poll(2) event bits.
        """
        self._poll.register(fd, events)

    def remove(self, fd: int) -> None:
        """Stop waiting on a descriptor."""
        self._poll.unregister(fd)

    def stay_awake(self) -> None:
        """Make `wait` poll repeatedly before it sleeps, for 200 us from now, because the other side's part of an echo is expected.

        An idle core wakes late, and not equally late on both sides of a link (decision 0009). Where others want the core, `wait` sleeps as usual.
        """
        now_ns = self._clock()
        if now_ns >= self._asleep_until_ns:
            self._awake_until_ns = now_ns + _AWAKE_NS

    def wait(self, wait_ms: int) -> list[int]:
        """Wait until there is something to look at.

        Args:
            wait_ms: at most this long, ms, not counting the time to stay awake.

        Returns:
            Descriptors, including those of ZeroMQ sockets. A socket may turn out to have nothing to receive.
        """
        ready = []
        for fd, inbox in self._inboxes.items():
            if inbox.may_have and inbox.has_news():
                ready.append(fd)
        found = self._found_awake() if wait_ms and not ready and self._awake_until_ns else []
        for fd, _ in found or self._poll.poll(0 if ready else wait_ms):
            if (readable := self._inboxes.get(fd)) is not None:
                readable.may_have = readable.is_told = True
            ready.append(fd)
        return ready

    def _found_awake(self) -> list[tuple[int, int]]:
        """Poll again and again while the time to stay awake lasts; return what was found."""
        now_ns = self._clock()
        while now_ns < self._awake_until_ns:
            os.sched_yield()  # ZeroMQ's thread may share the core
            found = self._poll.poll(0)
            before_ns, now_ns = now_ns, self._clock()
            if now_ns - before_ns > _AWAKE_NS:
                self._asleep_until_ns = now_ns + _ASLEEP_NS
            if found:
                return found
        self._awake_until_ns = 0
        return []
