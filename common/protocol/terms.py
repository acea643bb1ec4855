"""What both roles of a session keep to: the times after which they act, and how they name what is to be sent. No I/O.

Each connection's name begins with the number of its link, so names are unique over all links. The board imports this alone; what only a host can
be told is in `session.py`.
"""

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
