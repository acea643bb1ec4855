"""The types that the host's stages pass to each other. No behaviour, no I/O.

Conventions: camera axes x right, y down, z forward; pixel centres are integers (OpenCV); metres inside; NaN = no
    measurement.
"""

from dataclasses import dataclass
from enum import Enum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.camera.identity import CameraState
from common.camera.orientation import UPRIGHT, Orientation
from common.frame import Frame
from common.ledger import BoardMarks, PairLedger, StageTimes
from common.protocol.message import FrameMessage

Image = NDArray[np.uint8]
"""(H, W) grey or (H, W, 3) BGR, dtype uint8."""

Disparity = NDArray[np.float32]
"""(H, W) float32, px, left x - right x, NaN = none."""

CloudImage = NDArray[np.float32]
"""(H, W, 3) float32, metres: X, Y, Z of each left pixel in the left camera's axes, NaN = none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StereoGeometry:
    """Converts the disparity of a rectified pair to metres: z = focal_px * baseline_m / (disparity + doffs_px).

    Attributes:
        focal_px: focal length of both rectified images, px.
        baseline_m: distance of the two camera centres, m.
        cx_px: x of the left image's principal point, px.
        cy_px: y of both principal points, px.
        doffs_px: x of the right principal point minus that of the left, px (Middlebury's `doffs`).
    """

    focal_px: float
    baseline_m: float
    cx_px: float
    cy_px: float
    doffs_px: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Crop:
    """A rectangle of the rectified left image. Only its pixels get a depth.

    Attributes:
        x_px: its first column, px.
        y_px: its first row, px.
        width_px: its width, px.
        height_px: its height, px.
    """

    x_px: int
    y_px: int
    width_px: int
    height_px: int


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthLimits:
    """Between which depths a point is kept, and how certain its disparity is.

    Attributes:
        near_m: nearer points are cut, m; 0: none.
        far_m: points are cut that have a coordinate beyond it, m.
        disparity_error_px: the error of a disparity from which `far_m` and every depth's uncertainty follow, px of the
            rectified images.
        from_rig: whether `far_m` follows from the rig; else the user gave it.
    """

    near_m: float
    far_m: float
    disparity_error_px: float
    from_rig: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class CutCounts:
    """What became of a rectified left image's pixels. The six counts add up to all of them.

    Attributes:
        kept: have a point.
        unmatched: the matcher found no disparity.
        at_zero: their disparity is not above the noise of zero, so it is no measurement.
        too_far: beyond the far limit.
        too_near: nearer than the near limit.
        outside: outside the crop.
    """

    kept: int = 0
    unmatched: int = 0
    at_zero: int = 0
    too_far: int = 0
    too_near: int = 0
    outside: int = 0

    def __add__(self, other: "CutCounts") -> "CutCounts":
        """Return the counts of both."""
        return CutCounts(**{name: getattr(self, name) + getattr(other, name) for name in self.__slots__})


class Epipolar(Enum):
    """Where a point of the left image lies in the rectified right one, d px away: which way the epipolar lines run.

    LEFT: on the same row, at (x - d, y). The right camera stands to the right of the left one, as is usual.
    UP: in the same column, at (x, y - d). The "right" camera stands below the left one.
    DOWN: in the same column, at (x, y + d). The "right" camera stands above the left one.
    """

    LEFT = "left"
    UP = "up"
    DOWN = "down"

    @property
    def is_vertical(self) -> bool:
        """Whether the epipolar lines are columns: the cameras stand one above the other."""
        return self is not Epipolar.LEFT


@dataclass(frozen=True, slots=True)
class RectifiedPair:
    """Two images of equal size whose epipolar lines are their rows: a point at (x, y) left lies at (x - d, y) right.

    Attributes:
        left: of the reference camera.
        right: the same size.
        epipolar: other than LEFT if the cameras stand one above the other; then the lines are columns.
    """

    left: Image
    right: Image
    epipolar: Epipolar = Epipolar.LEFT


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """How a pair was matched.

    Attributes:
        scale: size of the images that were matched, as a share of the rectified ones', in (0, 1].
        disparities: N, px of the rectified images: 0 <= d < N was searched; 0: the matcher's own range, not known here.
    """

    scale: float = 1.0
    disparities: int = 0


class Side(Enum):
    """One of the two views. The left camera is the reference: the pixels of its image get a depth."""

    LEFT = "left"
    RIGHT = "right"

    @property
    def other(self) -> "Side":
        """The opposite side."""
        return Side.RIGHT if self is Side.LEFT else Side.LEFT


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CameraModel:
    """How one camera projects: OpenCV's pinhole model with its distortion polynomial.

    The device itself is `common.camera.base.Camera`.

    Attributes:
        width_px: image width, px.
        height_px: image height, px.
        matrix: (3, 3) float64 camera matrix K, px.
        distortion: (N,) float64 coefficients k1 k2 p1 p2 k3 ..., N in 4, 5, 8, 12, 14 as OpenCV takes them.
    """

    width_px: int
    height_px: int
    matrix: NDArray[np.float64]
    distortion: NDArray[np.float64]


UNMEASURED_NS: Final = 16_700_000
"""Assumed limit of the time offset until it is measured: one readout, taken as half the period of 30 frames/s."""


@dataclass(frozen=True, slots=True)
class TimeOffset:
    """The host camera's stamp minus the board camera's stamp for the same moment, both on the host's clock.

    Attributes:
        offset_ns: added to the board's stamps before frames are paired.
        uncertainty_ns: half-width around `offset_ns` that contains the true value in 99.9 % of cases.
    """

    offset_ns: int = 0
    uncertainty_ns: int = UNMEASURED_NS


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Rig:
    """Two calibrated cameras, possibly of different image size, and their relative pose.

    A point p_left in the left camera's axes is p_right = R_right_left @ p_left + t_right_left_m in the right camera's
    (OpenCV's R and T of stereoCalibrate).

    Attributes:
        left: model of the reference camera.
        right: model of the other camera.
        R_right_left: (3, 3) float64 rotation.
        t_right_left_m: (3,) float64 translation, m; its x is negative when the right camera is on the right.
        board_side: which of the two is the board's camera.
        rms_left_px: reprojection RMS of the left camera alone, px; NaN = not measured.
        rms_right_px: the same for the right camera.
        rms_stereo_px: reprojection RMS of the stereo calibration, px; NaN = not measured.
        time_offset: time offset between the two cameras' stamps.
        zero_sigma_px: standard uncertainty of the disparity of infinitely far points, px, at the size of the rig's
            images; NaN = not measured.
        verdict: how the calibration judged itself (good, usable or reject); empty: not stated.
        left_camera: which camera the left one was, and how it was set; None: not stated.
        right_camera: the same for the right one.
    """

    left: CameraModel
    right: CameraModel
    R_right_left: NDArray[np.float64]
    t_right_left_m: NDArray[np.float64]
    board_side: Side = Side.LEFT
    rms_left_px: float = float("nan")
    rms_right_px: float = float("nan")
    rms_stereo_px: float = float("nan")
    time_offset: TimeOffset = TimeOffset()
    zero_sigma_px: float = float("nan")
    verdict: str = ""
    left_camera: CameraState | None = None
    right_camera: CameraState | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Rectification:
    """How both images are rotated and cropped. `rig.yaml` holds these values beside the rig itself.

    Attributes:
        geometry: converts disparity to metres; its axes are those of the *rectified* left camera.
        width_px: width of both rectified images, px.
        height_px: height of both rectified images, px.
        R_left: (3, 3) float64, takes the left camera's axes to the rectified ones (OpenCV's R1).
        R_right: (3, 3) float64, the same for the right camera (R2).
        P_left: (3, 4) float64 projection of rectified points into the left rectified image (P1).
        P_right: (3, 4) float64, the same for the right rectified image (P2), metres.
        Q: (4, 4) float64, maps (u, v, d, 1) to homogeneous metres; d >= 0 also if the cameras stand one above the other.
        epipolar: which way the epipolar lines of the rectified images run.
    """

    geometry: StereoGeometry
    width_px: int
    height_px: int
    R_left: NDArray[np.float64]
    R_right: NDArray[np.float64]
    P_left: NDArray[np.float64]
    P_right: NDArray[np.float64]
    Q: NDArray[np.float64]
    epipolar: Epipolar = Epipolar.LEFT


@dataclass(frozen=True, slots=True, kw_only=True)
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
    """

    pair: RectifiedPair
    disparity: Disparity | None
    cloud: CloudImage | None
    stages: StageTimes
    geometry: StereoGeometry | None = None
    limits: DepthLimits | None = None
    cut: CutCounts | None = None
    search: Search | None = None


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
    """

    cut: CutCounts | None = None
    limits: DepthLimits | None = None
    search: Search | None = None


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


class Arrangement(Enum):
    """How the two images of a pair may lie to each other. All but the first are mistakes."""

    RIGHT = "right"
    TILTED = "tilted"
    SWAPPED = "swapped"
    TURNED = "turned"
    TURNED_BY_QUARTER = "turned_by_quarter"
    BOTH_TURNED = "both_turned"
    BOTH_MIRRORED = "both_mirrored"
    BOTH_TURNED_BY_QUARTER = "both_turned_by_quarter"
    MIRRORED = "mirrored"
    SAME_PLACE = "same_place"


@dataclass(frozen=True, slots=True)
class Support:
    """How many matched features agree with one arrangement of the two images.

    Attributes:
        arrangement: the arrangement.
        features: features whose positions and directions fit it.
    """

    arrangement: Arrangement
    features: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Exposure:
    """What one camera's image holds, at the size it is judged at; NaN = not measured.

    Attributes:
        mean_level: mean grey level, 0 to 255.
        bright_level: level that 2 % of the image exceed.
        structure: 90th percentile of the contrast after noise was averaged away, grey levels.
        blur_px: blur of the sharpest edges, px of an image at most 640 px wide; NaN with too few edges.
        features: number of features found, at most a few hundred.
    """

    mean_level: float
    bright_level: float
    structure: float
    blur_px: float
    features: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """What a pair's images say about its depth; NaN = not measured.

    Attributes:
        left: the left image.
        right: the right image.
        density: share of the left image's pixels that have a disparity.
        consistency: share of sampled disparities that are found again from right to left.
        vertical_px: median distance of matched features from their rows, px.
        vertical_offset_px: how far too low the right image lies, px.
        supports: how many features agree with each arrangement; empty without a core.
        disparity_px: the middle one of the disparities, px.
        matched_scale: size of the images that were matched, as a share of the full size in whose px all this is.
    """

    left: Exposure
    right: Exposure
    density: float = float("nan")
    consistency: float = float("nan")
    vertical_px: float = float("nan")
    vertical_offset_px: float = float("nan")
    supports: tuple[Support, ...] = ()
    disparity_px: float = float("nan")
    matched_scale: float = 1.0
