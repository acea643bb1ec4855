"""The closed union of messages that board and host exchange. Values only; their bytes are wire.py's, their order session's.

A *connection* is one byte path between the two; a link has two of them, one for each lane, so that clock echoes and control never wait behind
image bytes. `sent_index` numbers the frames that a board's session has sent, from 0: credit is granted up to an index, so that granting
twice is harmless and every gap is a loss.
"""

from dataclasses import dataclass, field
from enum import Enum

from common.frame import Buffer, PixelFormat
from common.ledger import BoardMarks


class Lane(Enum):
    """What a connection carries."""

    FRAMES = 0
    CONTROL = 1


class Pacing(Enum):
    """Who sets a camera's pace: its own clock, or the credit that it is granted."""

    CLOCK = 0
    DEMAND = 1


class Steering(Enum):
    """How a camera can be made to expose later within its period, if at all: by moving the grid of its stamps, or by starting its stream anew."""

    NONE = 0
    GRID = 1
    RESTART = 2


class DropReason(Enum):
    """Why a grabbed frame was not sent."""

    SPOILED = "spoiled"
    NO_HOST = "no_host"
    REPLACED = "replaced"
    LINK_FULL = "link_full"
    STOPPED = "stopped"


class RefusalReason(Enum):
    """Why a board does not talk to a host."""

    BUSY = 0
    VERSION = 1


@dataclass(frozen=True, slots=True)
class BoardCounts:
    """What became of a board session's frames so far: grabbed = sent + all dropped + the one that may wait in the outbox."""

    grabbed: int = 0
    sent: int = 0
    dropped: tuple[tuple[DropReason, int], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraDescription:
    """What a host must know of the board's camera.

    Attributes:
        name: for people.
        width_px: image width as it was asked for, px; frames of a lower rung may be smaller.
        height_px: the same for the height.
        pixel_format: encoding of the frames.
        period_ns: nominal time between frames, ns.
        pacing: its own clock or the host's demand.
        steering: how its phase can be moved.
    """

    name: str
    width_px: int
    height_px: int
    pixel_format: PixelFormat
    period_ns: int
    pacing: Pacing
    steering: Steering = Steering.NONE

    @property
    def has_exact_stamps(self) -> bool:
        """Whether its stamps say by definition when its images were exposed: a replay's do, whose images have no other time."""
        return self.pacing is Pacing.DEMAND or self.steering is Steering.GRID


@dataclass(frozen=True, slots=True, kw_only=True)
class Rung:
    """How far the board has lowered what its camera gives, so that the link carries it.

    Attributes:
        index: 0: as it was asked for.
        last: the index of the lowest rung; 0: nothing can or may be lowered.
        changes: how often it went down or up in this session.
        period_ns: nominal time between frames now, ns; 0 before it is known.
        quality: of the JPEG images now, in the camera's own unit; 0 where it cannot be set.
        width_px: of the images now, px; 0 where it cannot be set.
        height_px: the same.
    """

    index: int = 0
    last: int = 0
    changes: int = 0
    period_ns: int = 0
    quality: int = 0
    width_px: int = 0
    height_px: int = 0


@dataclass(frozen=True, slots=True)
class HostHello:
    """Host: I am here, and this connection is for that lane."""

    host_id: str
    lane: Lane


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardHello:
    """Board: accepted. Frames will be numbered from `counts.sent` on."""

    session: str
    boot_id: str
    camera: CameraDescription
    counts: BoardCounts
    rung: Rung


@dataclass(frozen=True, slots=True)
class Knock:
    """Board: I don't know you (or I have just dialled you); say hello on this connection for that lane.

    `session` tells a host at once that a board's new connection is not a second board's.
    """

    lane: Lane
    session: str


@dataclass(frozen=True, slots=True)
class Refusal:
    """Board: not now (busy) or never (version)."""

    reason: RefusalReason


@dataclass(frozen=True, slots=True)
class Credit:
    """Host: you may send frames whose `sent_index` is below this one."""

    below_index: int


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameMessage:
    """Board: one frame. Marks are on the board's clock."""

    session: str
    sent_index: int
    sequence: int
    width_px: int
    height_px: int
    pixel_format: PixelFormat
    exposure_ns: int | None
    marks: BoardMarks
    payload: Buffer = field(repr=False)


@dataclass(frozen=True, slots=True)
class Ping:
    """Host: clock echo, please. `t0_ns` is the host's clock just before sending; `wave` keeps late answers out of a later estimate."""

    wave: int
    t0_ns: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Pong:
    """Board: the echo; `t1_ns` on arrival, `t2_ns` just before sending, both on the board's clock."""

    wave: int
    t0_ns: int
    t1_ns: int
    t2_ns: int


@dataclass(frozen=True, slots=True)
class Status:
    """Board: what became of my frames so far, and what the camera gives now."""

    session: str
    counts: BoardCounts
    rung: Rung


@dataclass(frozen=True, slots=True)
class End:
    """Board: the last frame has been sent (follows it on the frames' connection)."""

    session: str
    counts: BoardCounts


@dataclass(frozen=True, slots=True)
class Bye:
    """Either side: I am leaving on purpose. From a board it carries its final counts."""

    counts: BoardCounts = BoardCounts()


@dataclass(frozen=True, slots=True)
class Steer:
    """Host: let your camera expose later by so much, from now on. Less than a period; whether it did is seen in the stamps."""

    later_ns: int


Message = HostHello | BoardHello | Knock | Refusal | Credit | FrameMessage | Ping | Pong | Status | End | Bye | Steer
