"""Points of a matched pair, in metres with their uncertainty: for `measure`, whose root this is, and for the page."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from common.diagnostic import Diagnostic
from common.errors import DataError, SettingsError
from common.imagesize.head import size_text
from phone_host.model import Disparity, Processed, RectifiedPair, StereoGeometry
from phone_host.report.stereo_report import Size
from phone_host.run.file_pairs import Matching, Watcher, sound_pair
from phone_host.stereo.core import StereoCore
from phone_host.stereo.images import size_px
from phone_host.stereo.measured_point import (
    Known,
    MeasuredPoint,
    RigErrors,
    Wide,
    ZeroError,
    measured_point,
    rig_errors,
    why_wide,
)
from phone_host.stereo.point_match import PointMatch, match_point
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.rectify import rectify_points

ELSEWHERE: Final = "choose a point on a surface with texture, away from its edges and not too far"
"""What helps a point that cannot be measured."""

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
    """Return what a pair tells of points; None without disparity or geometry."""
    geometry, disparity, search = processed.geometry, processed.disparity, processed.search
    if geometry is None or disparity is None or search is None:
        return None
    rectifier = core.rectifier_for(size_px(processed.pair.left))
    errors = ZeroError() if rectifier is None else rig_errors(rectifier.rig, rectifier.rectification)
    return SeenPair(processed.pair, disparity, geometry, 1 / search.scale, rectifier, errors)


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """What was measured.

    Attributes:
        points: one for each point asked for, in their order; one at least was found.
        known: what of the rig's own uncertainty was reckoned with.
        doubts: reasons not to trust it that do not rule it out.
    """

    points: tuple[Outcome, ...]
    known: Known
    doubts: tuple[Diagnostic, ...]


def measure_points(
    matching: Matching, left: Path, right: Path, points_px: tuple[Point, ...], watcher: Watcher
) -> Measured:
    """Measure points of a pair of image files.

    Args:
        matching: how the pair is matched.
        left: file of the left image.
        right: file of the right image.
        points_px: x and y of points in the upright left image, px.
        watcher: is told how far it is.

    Raises:
        SettingsError: a point lies outside the left image.
        DataError: the pair cannot be computed, cannot be right, or none of the points can be measured.
    """

    def make_core(left_px: Size) -> StereoCore:
        for point in points_px:
            if not all(0 <= at <= size - 1 for at, size in zip(point, left_px, strict=True)):
                raise SettingsError(
                    f"--points {point_text(point)} lies outside the left image of {size_text(left_px)} px",
                    "give X,Y inside it; the centre of the first pixel is 0,0",
                )
        return matching.make_core(left_px)

    pair, concerns = sound_pair(replace(matching, make_core=make_core), left, right, watcher)
    seen = seen_pair(pair.core, pair.processed)
    assert seen is not None, "a computed pair has geometry"
    watcher.say("measuring")
    points = tuple(_measured(point, seen) for point in points_px)
    missed = [each.problem for each in points if isinstance(each, MissedPoint)]
    if len(missed) == len(points):
        said = "; ".join(f"{point_text(at_px)} {why}" for at_px, why in zip(points_px, missed, strict=True))
        raise DataError(f"--points {said}", ELSEWHERE)
    return Measured(points, seen.errors.known, concerns)


def point_text(point_px: Point) -> str:
    """Return a point as the user writes it: X,Y."""
    return f"{point_px[0]:g},{point_px[1]:g}"


def _measured(asked_px: Point, seen: SeenPair) -> Outcome:
    rectifier = seen.rectifier
    if rectifier is None:
        return seen.measured(asked_px)
    turn = rectifier.rectification.R_left
    [(x, y)] = rectify_points(np.array([asked_px]), rectifier.rig.left, turn, seen.geometry).tolist()
    return seen.measured((x, y))
