"""What both roles of a session share: their outputs, and the times after which they act.

A session may use several links at once. Each connection's name begins with the number of its link, so names are unique across links.

The state machines (`board_session`, `host_session`) are sans-I/O: messages and `now_ns` go in, a list of outputs comes out. Shells own
the sockets and clocks. They send each `Outgoing` unchanged, except that `wire.encode_stamped` sets its send time at the last moment.
"""

from enum import Enum
from typing import Final

from common.protocol.message import BoardCounts, BoardHello, FrameMessage, LockState, Message, RefusalReason, Rung
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


@value(kw_only=True)
class Accepted:
    """Host: from now on the board sends its frames over this link.

    `resumed` means that this is the session we had before; `lost` of its frames never came.
    """

    hello: BoardHello
    resumed: bool
    lost: int
    link: int = 0


@value()
class LinkUp:
    """Host: our board answers on this link, which may now carry frames."""

    link: int
    hello: BoardHello


@value()
class LinkDown:
    """Host: this link is lost or, if `stuck`, leaves a hello for frames unanswered. The session keeps greeting it."""

    link: int
    stuck: bool = False


@value()
class OtherBoard:
    """Host: this link leads to a different board from the one we talk to. Nothing from it is used."""

    link: int
    hello: BoardHello


@value()
class Arrived:
    """Host: a frame of the running session. `lost` frames before it never came."""

    frame: FrameMessage
    lost: int
    link: int = 0


class StaleReason(Enum):
    """Why a received frame must not be used.

    LATE: a newer frame overtook it on another link. It was counted as lost then and stays lost.
    BEYOND_CREDIT: the board had no credit for it. An honest board never does this.
    """

    OLD_SESSION = 0
    DUPLICATE = 1
    LATE = 2
    BEYOND_CREDIT = 3


@value()
class Stale:
    """Host: a frame that must not be used."""

    frame: FrameMessage
    reason: StaleReason


@value(kw_only=True)
class Echo:
    """Host: one clock echo. t0 and t3 are on the host's clock, t1 and t2 on the board's; ns. Each link numbers its own waves."""

    wave: int
    t0_ns: int
    t1_ns: int
    t2_ns: int
    t3_ns: int
    link: int = 0


@value()
class Counted:
    """Host: the board's account of the running session.

    `ended`: no frame will follow. `lost`: frames in this account that never came. `last`: this answers our goodbye.
    """

    counts: BoardCounts
    ended: bool
    lost: int = 0
    last: bool = False


@value()
class Stepped:
    """Host: the board's camera delivers something else from now on."""

    rung: Rung


@value()
class LocksTold:
    """Host: the board says how its camera is held."""

    state: LockState


@value()
class Refused:
    """Host: the board at the other end of a link refuses to talk to us."""

    reason: RefusalReason
    link: int = 0


@value()
class Unbelievable:
    """Host: the board says something that cannot be true. None of it was used."""

    problem: str


@value()
class ClockVoid:
    """Host: the board had forgotten us. One of the two clocks may have stood still, so nothing learnt about them so far may be used."""


@value()
class Vanished:
    """Host: the board fell silent or said goodbye. The fate of frames still under way in that session is unknown."""

    orderly: bool


Output = (
    Outgoing
    | Accepted
    | LinkUp
    | LinkDown
    | OtherBoard
    | Arrived
    | Stale
    | Echo
    | Counted
    | Stepped
    | LocksTold
    | Refused
    | Unbelievable
    | ClockVoid
    | Vanished
)


def connection_name(link: int, path: bytes) -> bytes:
    """Make a connection's name unique over all links.

    Args:
        link: number of the link, below 256.
        path: the link's own name for the connection.
    """
    return bytes((link,)) + path
