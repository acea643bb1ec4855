"""The closed union of messages that board and host exchange. Values only: `wire.py` encodes them, `session.py` orders them.

A *connection* is one byte path between the two. A link has two of them, one for each lane, so that clock echoes and control never wait
behind image bytes. `sent_index` numbers the frames that a board's session has sent, starting at 0. Credit is granted up to an index, so
granting twice is harmless and every gap is a loss.
"""

from dataclasses import field, replace
from enum import Enum

from common.camera_identity import UNKNOWN_CAMERA, CameraIdentity, Lock
from common.frame import Buffer, PixelFormat
from common.ledger import BoardMarks
from common.orientation import UPRIGHT, Orientation
from common.value import value


class Lane(Enum):
    """What a connection carries."""

    FRAMES = 0
    CONTROL = 1


class Pacing(Enum):
    """Who sets a camera's pace: its own clock, or the credit that the host grants."""

    CLOCK = 0
    DEMAND = 1


class Steering(Enum):
    """How a camera can be made to expose later within its period: not at all, by shifting the grid of its stamps, or by restarting its stream."""

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


Locks = tuple[tuple[Lock, int], ...]
"""Controls of a camera, each with its value."""


class RefusalReason(Enum):
    """Why a board does not talk to a host."""

    BUSY = 0
    VERSION = 1


@value()
class BoardCounts:
    """What became of a board session's frames so far. grabbed = sent + all dropped + the one that may wait in the outbox."""

    grabbed: int = 0
    sent: int = 0
    dropped: tuple[tuple[DropReason, int], ...] = ()


@value(kw_only=True)
class CameraDescription:
    """What a host must know about the board's camera.

    Attributes:
        name: for people.
        width_px: image width as requested, px. Frames of a lower rung may be smaller.
        height_px: image height as requested, px.
        pixel_format: encoding of the frames.
        period_ns: nominal time between frames, ns.
        pacing: whether its own clock or the host's demand sets the pace.
        steering: how its phase can be moved.
        orientation: how its images become upright. Width and height are those before that.
        identity: which camera it is; unknown for images that come from no device.
        controls: the controls that can be held, with their values when it was opened.
    """

    name: str
    width_px: int
    height_px: int
    pixel_format: PixelFormat
    period_ns: int
    pacing: Pacing
    steering: Steering = Steering.NONE
    orientation: Orientation = UPRIGHT
    identity: CameraIdentity = UNKNOWN_CAMERA
    controls: Locks = ()

    @property
    def upright_px(self) -> tuple[int, int]:
        """Width and height of its images once they are upright, px."""
        return self.orientation.turned_size((self.width_px, self.height_px))

    def in_short(self) -> "CameraDescription":
        """What a short hello says of it."""
        return replace(self, orientation=UPRIGHT, identity=UNKNOWN_CAMERA, controls=())

    @property
    def has_exact_stamps(self) -> bool:
        """Whether its stamps are the exposure times by definition. This holds for a replay: its images have no other time."""
        return self.pacing is Pacing.DEMAND or self.steering is Steering.GRID


@value(kw_only=True)
class Rung:
    """How far the board has lowered the camera's output so that the link can carry it.

    Attributes:
        index: index of the current rung; 0 is what was asked for.
        last: index of the lowest rung; 0 means that nothing can or may be lowered.
        changes: how often the rung went down or up in this session.
        period_ns: current nominal time between frames, ns; 0 before it is known.
        quality: current JPEG quality, in the camera's own unit; 0 where it cannot be set.
        width_px: current image width, px; 0 where it cannot be set.
        height_px: current image height, px; 0 where it cannot be set.
    """

    index: int = 0
    last: int = 0
    changes: int = 0
    period_ns: int = 0
    quality: int = 0
    width_px: int = 0
    height_px: int = 0


@value()
class HostHello:
    """Host: I am here, and this connection is for this lane.

    `reads_long`: the host asks for a long hello, and understands `LockState`.
    """

    host_id: str
    lane: Lane
    reads_long: bool = False


@value(kw_only=True)
class BoardHello:
    """Board: accepted. Frames will be numbered starting at `counts.sent`.

    `is_long`: it says everything about the camera, and the board understands `SetLocks`. Only hosts that ask for it get it.
    """

    session: str
    boot_id: str
    camera: CameraDescription
    counts: BoardCounts
    rung: Rung
    is_long: bool = False


@value()
class Knock:
    """Board: I do not know you (or have just dialled you). Say hello on this connection, for this lane.

    `session` tells the host at once that the new connection comes from the same board and not from a second one.
    """

    lane: Lane
    session: str


@value()
class Refusal:
    """Board: not now (busy) or never (version)."""

    reason: RefusalReason


@value()
class Credit:
    """Host: you may send frames whose `sent_index` is below this one."""

    below_index: int


@value(kw_only=True)
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


@value()
class Ping:
    """Host: clock echo, please. `t0_ns` is the host's clock just before sending; `wave` keeps late answers out of later estimates."""

    wave: int
    t0_ns: int


@value(kw_only=True)
class Pong:
    """Board: the echo. `t1_ns` is the arrival and `t2_ns` the moment just before sending, both on the board's clock."""

    wave: int
    t0_ns: int
    t1_ns: int
    t2_ns: int


@value()
class Status:
    """Board: what became of my frames so far, and what the camera delivers now."""

    session: str
    counts: BoardCounts
    rung: Rung


@value()
class End:
    """Board: the last frame has been sent. This message follows it on the frames connection."""

    session: str
    counts: BoardCounts


@value()
class Bye:
    """Either side: I am leaving on purpose. A board's goodbye carries its final counts."""

    counts: BoardCounts = BoardCounts()


@value()
class Steer:
    """Host: make your camera expose later by this much from now on. Less than one period. The stamps show whether it did."""

    later_ns: int


@value()
class SetLocks:
    """Host: hold these controls of your camera at these values. Saying it again is harmless. `LockState` answers."""

    locks: Locks


@value(kw_only=True)
class LockState:
    """Board: how my camera is held now. It answers `SetLocks`, and follows a long hello and every change.

    Attributes:
        session: the board's session.
        asked: what the last `SetLocks` asked for; empty: none has come.
        held: the controls that are held, with the values that the camera itself reports. What was asked for and is not
            here with that value was refused.
    """

    session: str
    asked: Locks = ()
    held: Locks = ()


Message = (
    HostHello
    | BoardHello
    | Knock
    | Refusal
    | Credit
    | FrameMessage
    | Ping
    | Pong
    | Status
    | End
    | Bye
    | Steer
    | SetLocks
    | LockState
)
