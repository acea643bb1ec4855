"""What both roles of a link's session share: what they put out, and the times after which they act.

The state machines (`board_session`, `host_session`) are sans-I/O: messages and `now_ns` go in, a list of outputs comes out. Shells own
sockets and clocks; they send an `Outgoing` as it is, except that `wire.encode_stamped` sets its send time at the last moment.
"""

from dataclasses import dataclass
from typing import Final

from common.protocol.message import BoardCounts, BoardHello, FrameMessage, Message, RefusalReason

MS: Final = 1_000_000

HELLO_RETRY_NS: Final = 200 * MS
"""Between two attempts to be heard; a peer that appears is met within this time."""

TAKEOVER_NS: Final = 1000 * MS
"""A host unheard for this long gives way to another one that knocks: two missed clock waves."""

SILENCE_NS: Final = 3000 * MS
"""A peer unheard for this long is taken as gone: longer than any stall seen on Wi-Fi or of a swapping phone."""

STATUS_NS: Final = 500 * MS
"""Between two accounts of the board's frames."""


@dataclass(frozen=True, slots=True)
class Outgoing:
    """Send this message on that connection.

    Attributes:
        connection: the link's own name for a byte path; opaque here.
        message: what to send.
    """

    connection: bytes
    message: Message


@dataclass(frozen=True, slots=True)
class Accepted:
    """Host: the board talks to us. `resumed` says that it is the session that we had before, of which `lost` frames never came."""

    hello: BoardHello
    resumed: bool
    lost: int


@dataclass(frozen=True, slots=True)
class Arrived:
    """Host: a frame of the running session; `lost` frames before it never came."""

    frame: FrameMessage
    lost: int


@dataclass(frozen=True, slots=True)
class Stale:
    """Host: a frame that a transport delivered again or of an older session. It must not be used."""

    frame: FrameMessage
    old_session: bool


@dataclass(frozen=True, slots=True)
class Echo:
    """Host: one clock echo. t0, t3 on the host's clock, t1, t2 on the board's; ns."""

    wave: int
    t0_ns: int
    t1_ns: int
    t2_ns: int
    t3_ns: int


@dataclass(frozen=True, slots=True)
class Counted:
    """Host: the board's account of the running session; `ended` when no frame will follow; `lost` frames that it tells of never came; `last` answers our goodbye."""

    counts: BoardCounts
    ended: bool
    lost: int = 0
    last: bool = False


@dataclass(frozen=True, slots=True)
class Refused:
    """Host: the board does not talk to us."""

    reason: RefusalReason


@dataclass(frozen=True, slots=True)
class Vanished:
    """Host: the board fell silent or said goodbye; frames still under way in that session are unknown."""

    orderly: bool


Output = Outgoing | Accepted | Arrived | Stale | Echo | Counted | Refused | Vanished
