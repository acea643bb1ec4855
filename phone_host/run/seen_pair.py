"""Points of a matched pair, in metres with their uncertainty: for `measure` and for the page."""

from dataclasses import dataclass

import numpy as np

from phone_host.model import Disparity, Processed, RectifiedPair, StereoGeometry
from phone_host.stereo.core import StereoCore
from phone_host.stereo.images import size_px
from phone_host.stereo.measured_point import MeasuredPoint, measured_point
from phone_host.stereo.point_match import PointMatch, match_point
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.rig_errors import RigErrors, ZeroError, rig_errors
from phone_host.stereo.wide_limits import Wide, why_wide

Point = tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class FoundPoint:
    """A point that was measured, and why its limits lie far apart; None: they do not."""

    point: MeasuredPoint
    wide: Wide | None


@dataclass(frozen=True, slots=True)
class MissedPoint:
    """A point that was not, and why."""

    problem: str


Outcome = FoundPoint | MissedPoint


@dataclass(frozen=True, slots=True, eq=False)
class SeenPair:
    """A matched pair and what is known of its rig.

    Attributes:
        pair: the rectified images.
        disparity: (H, W) float32 of the left one, px, NaN = none.
        geometry: converts it to metres.
        step_px: px of the rectified images that one px of the matched ones was.
        rectifier: as the rig was calibrated; None: the images came rectified.
        errors: the rig's own.
    """

    pair: RectifiedPair
    disparity: Disparity
    geometry: StereoGeometry
    step_px: float
    rectifier: Rectifier | None
    errors: RigErrors

    def measured(self, at_px: Point) -> Outcome:
        """Measure a point.

        Args:
            at_px: x and y in the rectified left image, px.
        """
        match = match_point(self.pair, self.disparity, at_px, self.step_px)
        if not isinstance(match, PointMatch):
            return MissedPoint(match.value)
        epipolar = self.pair.epipolar
        point = measured_point(at_px, match, self.geometry, epipolar, self.errors)
        if not np.isfinite(point.point_m).all():
            return MissedPoint("cannot be told from infinity")
        return FoundPoint(point, why_wide(point, match, epipolar))


def seen_pair(core: StereoCore, processed: Processed) -> SeenPair | None:
    """Return what a pair tells of points; None without disparity or geometry.

    Args:
        core: what computed it.
        processed: the pair.
    """
    geometry, disparity, search = processed.geometry, processed.disparity, processed.search
    if geometry is None or disparity is None or search is None:
        return None
    rectifier = core.rectifier_for(size_px(processed.pair.left))
    errors = ZeroError() if rectifier is None else rig_errors(rectifier.rig, rectifier.rectification)
    return SeenPair(processed.pair, disparity, geometry, 1 / search.scale, rectifier, errors)
