"""How a running rig departs from its calibration. No behaviour, no I/O."""

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
