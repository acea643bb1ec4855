"""What both roles of a session share: what they put out, and the times after which they act.

A session may go over several links at once. Each connection's name begins with the number of its link, so that it is unique over all of them.

The state machines (`board_session`, `host_session`) are sans-I/O: messages and `now_ns` go in, a list of outputs comes out. Shells own
sockets and clocks; they send an `Outgoing` as it is, except that `wire.encode_stamped` sets its send time at the last moment.
"""

from dataclasses import dataclass
from enum import Enum
from typing import Final

from common.protocol.message import BoardCounts, BoardHello, FrameMessage, Message, RefusalReason, Rung

MS: Final = 1_000_000

HELLO_RETRY_NS: Final = 200 * MS
"""Between two attempts to be heard; a peer that appears is met within this time."""

TAKEOVER_NS: Final = 1000 * MS
"""A host unheard for this long gives way to another one that knocks: two missed clock waves."""

SILENCE_NS: Final = 3000 * MS
"""A peer unheard for this long is taken as gone: longer than any stall seen on Wi-Fi or of a swapping phone."""

STATUS_NS: Final = 500 * MS
"""Between two accounts of the board's frames."""

STATUS_SLOW_NS: Final = 1000 * MS
"""The same where frames are further apart than this: half a percent of a line of 115200 baud is one account a second."""


@dataclass(frozen=True, slots=True)
class Outgoing:
    """Send this message on that connection.

    Attributes:
        connection: the link's own name for a byte path; opaque here.
        message: what to send.
    """

    connection: bytes
    message: Message


@dataclass(frozen=True, slots=True, kw_only=True)
class Accepted:
    """Host: the board sends its frames over that link from now on.

    `resumed` says that it is the session that we had before, of which `lost` frames never came.
    """

    hello: BoardHello
    resumed: bool
    lost: int
    link: int = 0


@dataclass(frozen=True, slots=True)
class LinkUp:
    """Host: our board answers on that link, which may carry frames now."""

    link: int
    hello: BoardHello


@dataclass(frozen=True, slots=True)
class LinkDown:
    """Host: that link is lost, or (`stuck`) leaves a hello for frames unanswered; it is greeted again and again."""

    link: int
    stuck: bool = False


@dataclass(frozen=True, slots=True)
class OtherBoard:
    """Host: that link leads to another board than the one that we talk to; nothing of it is used."""

    link: int
    hello: BoardHello


@dataclass(frozen=True, slots=True)
class Arrived:
    """Host: a frame of the running session; `lost` frames before it never came."""

    frame: FrameMessage
    lost: int
    link: int = 0


class StaleReason(Enum):
    """Why a frame that came must not be used.

    LATE: a newer one had overtaken it over another link; it has been counted as lost then and stays so.
    BEYOND_CREDIT: the board had no leave to send it; an honest one never does.
    """

    OLD_SESSION = 0
    DUPLICATE = 1
    LATE = 2
    BEYOND_CREDIT = 3


@dataclass(frozen=True, slots=True)
class Stale:
    """Host: a frame that must not be used."""

    frame: FrameMessage
    reason: StaleReason


@dataclass(frozen=True, slots=True, kw_only=True)
class Echo:
    """Host: one clock echo. t0, t3 on the host's clock, t1, t2 on the board's; ns. Waves are numbered for each link."""

    wave: int
    t0_ns: int
    t1_ns: int
    t2_ns: int
    t3_ns: int
    link: int = 0


@dataclass(frozen=True, slots=True)
class Counted:
    """Host: the board's account of the running session; `ended` when no frame will follow; `lost` frames that it tells of never came; `last` answers our goodbye."""

    counts: BoardCounts
    ended: bool
    lost: int = 0
    last: bool = False


@dataclass(frozen=True, slots=True)
class Stepped:
    """Host: the board's camera gives something else from now on."""

    rung: Rung


@dataclass(frozen=True, slots=True)
class Refused:
    """Host: the board at the end of a link does not talk to us."""

    reason: RefusalReason
    link: int = 0


@dataclass(frozen=True, slots=True)
class Unbelievable:
    """Host: the board says what cannot be; nothing of it was used."""

    problem: str


@dataclass(frozen=True, slots=True)
class ClockVoid:
    """Host: the board had forgotten us, so that one of the two clocks may have stood still: nothing learnt of them so far may be used."""


@dataclass(frozen=True, slots=True)
class Vanished:
    """Host: the board fell silent or said goodbye; frames still under way in that session are unknown."""

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
