"""What the host's role of a session tells its shell; with the terms of both roles (`terms`), which are importable from here, too.

The state machines (`board_session`, `host_session`) are sans-I/O: messages and `now_ns` go in, a list of outputs comes out. Shells own
the sockets and clocks. They send each `Outgoing` unchanged, except that `wire.encode_stamped` sets its send time at the last moment.
"""

from enum import Enum

from common.protocol.message import BoardCounts, BoardHello, FrameMessage, LockState, RefusalReason, Rung
from common.protocol.terms import (
    HELLO_RETRY_NS,
    MS,
    SILENCE_NS,
    STATUS_NS,
    STATUS_SLOW_NS,
    TAKEOVER_NS,
    Outgoing,
    connection_name,
)
from common.value import value

__all__ = [
    "HELLO_RETRY_NS",
    "MS",
    "SILENCE_NS",
    "STATUS_NS",
    "STATUS_SLOW_NS",
    "TAKEOVER_NS",
    "Accepted",
    "Arrived",
    "ClockVoid",
    "Counted",
    "Echo",
    "LinkDown",
    "LinkUp",
    "LocksTold",
    "OtherBoard",
    "Outgoing",
    "Output",
    "Refused",
    "Stale",
    "StaleReason",
    "Stepped",
    "Unbelievable",
    "Vanished",
    "connection_name",
]


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
