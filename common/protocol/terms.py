"""What both roles of a session keep to: the times after which they act, and how they name what is to be sent. No I/O.

Each connection's name begins with the number of its link, so names are unique over all links. The board imports this alone; what only a host can
be told is in `session.py`.

A program that was stopped or swapped out heard nobody, which says nothing about the others. It looks at its clock no later than the time at which it
asked to be called, so any time beyond that is its own absence. A machine's sleep is not seen here: its clock stood still.
"""

from collections.abc import Callable
from typing import Final

from common.protocol.message import Message
from common.value import value

MS: Final = 1_000_000

HELLO_RETRY_NS: Final = 200 * MS
"""Time between two attempts to be heard. A peer that appears is met within this time."""

TAKEOVER_NS: Final = 1000 * MS
"""After this much silence from its host, a board accepts another host. This is two missed clock waves."""

SILENCE_NS: Final = 3000 * MS
"""After this much silence a peer is considered gone. No stall seen on Wi-Fi or on a swapping phone lasted longer."""

STATUS_NS: Final = 500 * MS
"""Time between two accounts of the board's frames."""

STATUS_SLOW_NS: Final = 1000 * MS
"""The same where frames are further apart than this: one account a second takes 0.5 % of a 115200 baud line."""


@value()
class Outgoing:
    """Send this message on that connection.

    Attributes:
        connection: the link's own name for a byte path; opaque here.
        message: what to send.
    """

    connection: bytes
    message: Message


def connection_name(link: int, path: bytes) -> bytes:
    """Make a connection's name unique over all links.

    Args:
        link: number of the link, below 256.
        path: the link's own name for the connection.
    """
    return bytes((link,)) + path


LATE_NS: Final = 1_000_000_000
"""Being called this much too late is not absence but a busy machine. The process looks three times before it believes in silence."""


class Presence:
    """When a process last looked at its clock."""

    def __init__(self) -> None:
        self._looked_ns: int | None = None

    def absent_ns(self, due_ns: Callable[[], int], now_ns: int) -> int:
        """Look at the clock; return how long this process did not run before.

        Args:
            due_ns: gives when it wanted to be called, as of its last look, ns. Called only after a long gap, because this runs for each message.
            now_ns: the clock now, ns.

        Returns:
            Nanoseconds, each reported once; 0 if it was called in time or nearly so; negative if the clock went back by so much.
        """
        looked_ns, self._looked_ns = self._looked_ns, now_ns
        if looked_ns is None or abs(now_ns - looked_ns) <= LATE_NS:
            return 0
        if now_ns < looked_ns:
            return now_ns - looked_ns
        late_ns = now_ns - max(due_ns(), looked_ns)
        return late_ns if late_ns > LATE_NS else 0
