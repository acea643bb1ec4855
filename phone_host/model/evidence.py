"""What a pair's images say about its depth, and how a running rig departs from its calibration. No behaviour, no I/O."""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Final

Turn = tuple[float, float, float]
"""Rotation vector about a camera's own axes (x right, y down, z forward), rad."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Departure:
    """How the right camera departs from the rig that was calibrated. The left one is taken to stand as it stood.

    Attributes:
        turn_rad: the right camera's turn about its own axes: a point p in its calibrated axes is exp(turn) p in its present
            ones, as in `Rig.covariance`.
        focal: its focal length divided by the calibrated one.
    """

    turn_rad: Turn = (0.0, 0.0, 0.0)
    focal: float = 1.0

    @property
    def angle_rad(self) -> float:
        """By how much it is turned, rad."""
        return math.hypot(*self.turn_rad)


AS_CALIBRATED: Final = Departure()


class DriftState(Enum):
    """What is known of the rig now."""

    UNKNOWN = "unknown"
    """Too few features, or too badly spread, since the start or the last change."""

    STEADY = "steady"
    DEPARTED = "departed"
    """It departs by more than is left alone, and is not corrected: nobody wants that."""

    CORRECTED = "corrected"
    BEYOND = "beyond"
    """It departs by more than a correction may mend."""


class ChangeKind(Enum):
    """What happened to a rig or to its correction."""

    KNOCKED = "knocked"
    """It turned, or its focus changed, at once: between two pairs or nearly so."""

    RETURNED = "returned"
    """A camera or the board was away; whether it stands as before is measured afresh."""

    CORRECTED = "corrected"
    BEYOND = "beyond"


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """One change.

    Attributes:
        kind: what happened.
        at_s: when it was noticed, s since the start of the run.
        departure: how the rig departed from its calibration then; for `returned` as it was before.
        step: for `knocked`: by how much it turned, and its focal length changed, at once.
        away_s: for `returned`: how long no pair came, s.
    """

    kind: ChangeKind
    at_s: float
    departure: Departure = AS_CALIBRATED
    step: Departure = AS_CALIBRATED
    away_s: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Trend:
    """How the departure moves; NaN = not measured.

    Attributes:
        turn_rad_s: rate about each axis of the right camera, rad/s.
        sigma_rad_s: standard uncertainty of each.
        rows_px_s: rate of the vertical error that a correction has to undo, px/s.
        seconds: time that it was measured over, s.
    """

    turn_rad_s: Turn = (math.nan, math.nan, math.nan)
    sigma_rad_s: Turn = (math.nan, math.nan, math.nan)
    rows_px_s: float = math.nan
    seconds: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Drift:
    """How a running rig departs from its calibration; NaN = not measured.

    Attributes:
        state: what is known now.
        departure: the estimate: what is proven of it; turns and scale that the features do not prove are 0.
        turn_sigma_rad: standard uncertainty of the turn about each axis, rad.
        focal_sigma: that of the focal length's factor.
        rows_px: vertical error that the departure makes, 95th percentile over the image, px of the rectified images.
        rows_sigma_px: standard uncertainty of the rows over the image, root mean square, px.
        left_px: vertical error that remains with the correction in use, 95th percentile over the image, px.
        zero_sigma_px: standard uncertainty of the disparity of infinitely far points, by this alone, px.
        overlay: the departure that pairs are corrected for.
        features: that the estimate rests on.
        measurements: judged pairs that it rests on.
        judged: judged pairs in all.
        late_ns: by how much later than its stamp says the left image shows what moves, compared with the right one, ns.
        late_sigma_ns: standard uncertainty of it, ns.
        late_px: how far what moves lies beside its row because of it, px.
        trend: since the last change at once.
        changes: all changes, in order; the first and the latest ones if there were many.
    """

    state: DriftState = DriftState.UNKNOWN
    departure: Departure = AS_CALIBRATED
    turn_sigma_rad: Turn = (math.nan, math.nan, math.nan)
    focal_sigma: float = math.nan
    rows_px: float = math.nan
    rows_sigma_px: float = math.nan
    left_px: float = math.nan
    zero_sigma_px: float = math.nan
    overlay: Departure = AS_CALIBRATED
    features: int = 0
    measurements: int = 0
    judged: int = 0
    late_ns: float = math.nan
    late_sigma_ns: float = math.nan
    late_px: float = math.nan
    trend: Trend = Trend()
    changes: tuple[Change, ...] = ()


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
        quarters: for `turned_by_quarter`: 1 or 3, by how many quarters the right image is turned clockwise against the
            left one; else 0.
    """

    arrangement: Arrangement
    features: int
    quarters: int = 0


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
class OffMiddle:
    """A principal point that lies far from its image's middle.

    Attributes:
        cx_px: its x, px.
        cy_px: its y, px.
        width_px: width of the image, px.
        height_px: height of the image, px.
    """

    cx_px: float
    cy_px: float
    width_px: int
    height_px: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """What a pair's images say about its depth; NaN = not measured.

    Attributes:
        left: the left image.
        right: the right image.
        density: share of the left image's pixels that have a disparity.
        consistency: share of sampled disparities that are confirmed from right to left.
        vertical_px: median distance of matched features from their rows, px.
        vertical_offset_px: how far too low the right image lies, px.
        supports: how many features agree with each arrangement; empty without a core.
        disparity_px: the middle one of the disparities between the limits of depth, px.
        behind_share: share of the disparities at infinity and behind it, where no scene lies; 0 if infinity is no larger disparity.
        scattered_share: share of the disparities that lie in pieces too small for a surface.
        beyond_share: share of the image, as far as features tell, that is nearer than was searched.
        enough_disparities: a search that reaches all but a few features, px; 0: not known.
        enough_from_m: the same as a depth, m.
        ambiguous_share: share of sampled patches that fit another place of the search as well as the best one.
        skew_px: how unevenly rows are off over the image once the common offset is taken away, px of the matched images.
        from_rig: whether a rig has rectified the pair.
        is_cropped: whether the pair was taken for the middle of the images that the rig was calibrated with.
        off_middle: the given principal point, if it lies far from the middle; None: it does not, or a rig brought its own.
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
    behind_share: float = 0.0
    scattered_share: float = float("nan")
    beyond_share: float = float("nan")
    enough_disparities: int = 0
    enough_from_m: float = float("nan")
    ambiguous_share: float = float("nan")
    skew_px: float = float("nan")
    from_rig: bool = True
    is_cropped: bool = False
    off_middle: OffMiddle | None = None
    matched_scale: float = 1.0
