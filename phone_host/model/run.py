"""Frames, pairs and results on their way through a run, what became of them, and how a time budget for each was held. No behaviour, no I/O."""

from dataclasses import dataclass
from enum import Enum

from common.frame import Frame
from common.ledger import BoardMarks, PairLedger, StageTimes
from common.orientation import UPRIGHT, Orientation
from common.protocol.message import FrameMessage
from common.value import value
from phone_host.model.evidence import AS_CALIBRATED, Departure
from phone_host.model.images import (
    CloudImage,
    Confidence,
    CutCounts,
    DepthLimits,
    Disparity,
    Epipolar,
    MatchReport,
    RectifiedPair,
    Search,
    StereoGeometry,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetStep:
    """One way to match pairs.

    Attributes:
        matcher: its name.
        scale: size of the matched images, as a share of the rectified ones', in (0, 1].
        width_px: width of the matched images, px.
        height_px: their height, px.
        disparities: N, px of the rectified images: 0 <= d < N is searched.
        nearest_m: the nearest depth that this search can find, m; NaN without metres.
    """

    matcher: str
    scale: float
    width_px: int
    height_px: int
    disparities: int
    nearest_m: float


class BudgetReason(Enum):
    """Why a run matches in another way than before."""

    TOO_SLOW = "too_slow"
    ROOM = "room"
    AS_FAST = "as_fast"
    OTHER_SIZE = "other_size"


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetChange:
    """One change.

    Attributes:
        pair: the first pair that is matched in the new way; counts the pairs that were processed, from 0.
        at_s: when it was decided, counted from the first pair, s.
        reason: why.
        processing_ns: what pairs took before it, ns; NaN: not measured.
        step: the new way.
    """

    pair: int
    at_s: float
    reason: BudgetReason
    processing_ns: float
    step: BudgetStep


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetAccount:
    """How the budget was held so far.

    Attributes:
        budget_ns: time for each pair, ns.
        now: how pairs are matched now.
        best: how they would be matched if the budget allowed it.
        processing_ns: median over the newest pairs, ns; NaN: not measured yet.
        match_ns: the part of it that matching takes, ns; NaN: not measured yet.
        pairs: pairs processed.
        held: pairs that took no longer than the budget.
        narrowed: pairs whose search was narrower than the best one.
        changed: how often the way was changed.
        changes: the newest changes, in order.
        is_missed: whether pairs take too long, and no way is expected to hold the budget.
    """

    budget_ns: int
    now: BudgetStep
    best: BudgetStep
    processing_ns: float = float("nan")
    match_ns: float = float("nan")
    pairs: int = 0
    held: int = 0
    narrowed: int = 0
    changed: int = 0
    changes: tuple[BudgetChange, ...] = ()
    is_missed: bool = False

    @property
    def is_narrowed(self) -> bool:
        """Whether near objects are not searched for now."""
        return self.now.disparities < self.best.disparities


@value(kw_only=True)
class BoardFrame:
    """A frame that came over a link, with its marks on the host's clock.

    Attributes:
        message: the frame's message.
        link: name of the link.
        marks: exposed, grabbed and sent, on the host's clock; fixed on receipt.
        received_ns: when the last byte arrived.
        offset_ns: host clock minus board clock, as estimated then.
        uncertainty_ns: uncertainty of that offset.
        asked_px: (width, height) that the camera was asked for, px. The frame itself may be smaller. Zeros: use the
            frame's own size.
        orientation: how its image becomes upright. All sizes are those before that.
    """

    message: FrameMessage
    link: str
    marks: BoardMarks
    received_ns: int
    offset_ns: int
    uncertainty_ns: int
    asked_px: tuple[int, int] = (0, 0)
    orientation: Orientation = UPRIGHT


@dataclass(frozen=True, slots=True, kw_only=True)
class FramePair:
    """Two frames that belong together, on their way to the stereo pipeline.

    Attributes:
        board: the board's frame.
        host: the host's frame.
        time_skew_ns: exposure of the board's frame minus exposure of the host's frame.
        paired_ns: when the partner was found.
        queued_ns: when the pair entered the FIFO.
        before: the board's previous frame, if available.
    """

    board: BoardFrame
    host: Frame
    time_skew_ns: int
    paired_ns: int
    queued_ns: int
    before: BoardFrame | None = None


@dataclass(frozen=True, slots=True)
class Processed:
    """The outcome of processing a pair.

    Attributes:
        pair: the rectified images; without a core, the images as received.
        disparity: px; None without a core.
        cloud: metres, cut to the limits; None without a core or geometry.
        stages: time of each stage; `write` is still 0.
        geometry: converts this disparity to metres; None without a core or geometry.
        limits: to which the cloud was cut; None without a cloud.
        cut: what became of the pixels; None without a core. Without geometry, `kept` counts disparities.
        search: how the pair was matched; None without a core.
        confidence: of each disparity; None without a core, or if the matcher has none.
        match_report: what the matcher corrected, in px of the rectified images; None without a core.
        overlay: how the right camera was taken to depart from the rig that was calibrated.
    """

    pair: RectifiedPair
    disparity: Disparity | None
    cloud: CloudImage | None
    stages: StageTimes
    geometry: StereoGeometry | None = None
    limits: DepthLimits | None = None
    cut: CutCounts | None = None
    search: Search | None = None
    confidence: Confidence | None = None
    match_report: MatchReport | None = None
    overlay: Departure = AS_CALIBRATED


@dataclass(frozen=True, slots=True)
class Result:
    """What the worker passes to the sinks of a run.

    Attributes:
        number: index of the processed pair in this run, from 0.
        pair: its two frames as received.
        processed: its images and depth.
        ledger: its marks and delays.
    """

    number: int
    pair: FramePair
    processed: Processed
    ledger: PairLedger


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthAccount:
    """What became of the pixels of all pairs of a run.

    Attributes:
        cut: the counts of all pairs together; None without a core.
        limits: of the newest pair; None without a cloud.
        search: how the newest pair was matched; None without a core.
        match_report: what the matcher corrected in the newest pair; None without a core.
        median_report: the median of what it corrected in all pairs; None if the matcher tells nothing.
        epipolar: which way the newest pair's epipolar lines run.
    """

    cut: CutCounts | None = None
    limits: DepthLimits | None = None
    search: Search | None = None
    match_report: MatchReport | None = None
    median_report: MatchReport | None = None
    epipolar: Epipolar = Epipolar.LEFT


@dataclass(frozen=True, slots=True, kw_only=True)
class PairCounts:
    """What became of the frames that reached the host, and of the pairs.

    Attributes:
        received: board frames.
        host_frames: host frames.
        paired: pairs formed.
        dropped: pairs that a full FIFO dropped.
        taken: pairs given to the worker.
        waiting: pairs in the FIFO now.
        held_board: board frames still waiting for a partner.
        held_host: host frames still waiting for a partner.
        board_orphans: board frames that found no partner, by reason.
        host_orphans: host frames that found no partner, by reason.
    """

    received: int = 0
    host_frames: int = 0
    paired: int = 0
    dropped: int = 0
    taken: int = 0
    waiting: int = 0
    held_board: int = 0
    held_host: int = 0
    board_orphans: tuple[tuple[str, int], ...] = ()
    host_orphans: tuple[tuple[str, int], ...] = ()


@dataclass(frozen=True, slots=True)
class Unwritten:
    """What could not be written.

    Attributes:
        lines: lines of delays.jsonl that are lost or still wait to be written.
        pairs: pair folders that were due but could not be written.
        cause: the operating system's error message; empty when everything was written.
    """

    lines: int = 0
    pairs: int = 0
    cause: str = ""
