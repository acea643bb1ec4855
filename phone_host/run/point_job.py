"""Measures points of one pair of image files. The root of `measure`."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from common.errors import DataError, SettingsError
from common.imagesize.head import size_text
from phone_host.measure.trust import Concern
from phone_host.run.one_pair import PairJob, Size, compute_pair
from phone_host.run.seen_pair import MissedPoint, Outcome, Point, SeenPair, seen_pair
from phone_host.run.stereo_job import Watcher
from phone_host.stereo.rectify import rectify_points
from phone_host.stereo.rig_errors import Known

ELSEWHERE: Final = "choose a point on a surface with texture, away from its edges and not too far"
"""What helps a point that cannot be measured."""


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
    doubts: tuple[Concern, ...]


def measure_points(job: PairJob, points_px: tuple[Point, ...], watcher: Watcher) -> Measured:
    """Measure points.

    Args:
        job: the pair.
        points_px: x and y of points in the upright left image, px.
        watcher: is told how far it is.

    Raises:
        SettingsError: a point lies outside the left image.
        DataError: the pair cannot be computed, cannot be right, or none of the points can be measured.
    """

    def check(left_px: Size) -> None:
        for point in points_px:
            if not all(0 <= at <= size - 1 for at, size in zip(point, left_px, strict=True)):
                raise SettingsError(
                    f"--points {point_text(point)} lies outside the left image of {size_text(left_px)} px",
                    "give X,Y inside it; the centre of the first pixel is 0,0",
                )

    pair = compute_pair(job, watcher, check)
    seen = seen_pair(pair.core, pair.processed)
    assert seen is not None, "a computed pair has geometry"
    watcher.say("measuring")
    points = tuple(_measured(point, seen) for point in points_px)
    _require_one(points_px, points)
    return Measured(points, seen.errors.known, pair.concerns)


def _require_one(asked_px: tuple[Point, ...], points: tuple[Outcome, ...]) -> None:
    """Raise unless a point was measured."""
    missed = [each.problem for each in points if isinstance(each, MissedPoint)]
    if len(missed) == len(points):
        said = "; ".join(f"{point_text(at_px)} {why}" for at_px, why in zip(asked_px, missed, strict=True))
        raise DataError(f"--points {said}", ELSEWHERE)


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
