"""Points of rendered rooms, measured as `phone-host measure` does, beside the exact truth: the work of bench_measure."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from phone_host.model import Rig
from phone_host.scene.cast import cast, rays_through
from phone_host.scene.scene_model import rotation
from phone_host.stereo.core import StereoCore
from phone_host.stereo.default_matcher import default_matcher
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.measured_point import MeasuredPoint, Within, distance_between, measured_point, rig_errors
from phone_host.stereo.point_match import PointMatch, match_point
from phone_host.stereo.rectifier import Rectifier
from phone_host.stereo.rectify import rectify_points
from phone_host.stereo.reproject import disparities_for_near
from tests.bench.drawn_rigs import drawn_rig, with_covariance
from tests.bench.trust_rooms import Room, room

NEAR_M = 0.5
"""Rooms are made so that nothing is nearer."""

_FAR_OFF = 3.0
"""Three times the stated reach is six standard deviations: what no noise does."""


ZERO_SIGMA_PX = 0.15


class Off(Enum):
    """How the rig that is measured with differs from the true one, and what it states of that."""

    EXACT = "it is exact, and states nothing"
    ZERO = "turned about its vertical axis: its zero is off by a standard deviation of 0.15 px, which it states"
    DRAWN = "drawn from the covariance of a calibration, which it states"


@dataclass(frozen=True, slots=True)
class Row:
    """One length that was measured, or a point that was not.

    Attributes:
        seed: of the room.
        what: "distance" from the camera, "length" between two points, or the reason why a point was refused.
        true_m: the truth, m; NaN for a refused point.
        error_m: measured minus true, m.
        reach_m: half of the stated 95 %, m.
        inside: whether the truth lies inside the stated 95 %.
        far_off: whether it is off by three times the stated reach.
    """

    seed: int
    what: str
    true_m: float = math.nan
    error_m: float = math.nan
    reach_m: float = math.nan
    inside: bool = False
    far_off: bool = False


def room_rows(seed: int, points: int, off: Off = Off.EXACT) -> list[Row]:
    """Measure random points of a room.

    Args:
        seed: of the room and the points.
        points: how many are tried.
        off: how the rig that is measured with differs from the true one.
    """
    made = replace(room(seed), lower_px=0.0)  # an exact rig has no rows that are off
    random = np.random.default_rng([seed, 31])
    rig = made.rig
    if off is Off.ZERO:
        rig = _turned(rig, float(random.normal()) * ZERO_SIGMA_PX)
    elif off is Off.DRAWN:
        rig = drawn_rig(with_covariance(rig, seed), random)
    return list(_rows(made, rig, random, points))


def _turned(rig: Rig, zero_px: float) -> Rig:
    """Return a rig whose right camera is turned so that disparities are off by some px."""
    focal_px = float(min(rig.left.matrix[0, 0], rig.right.matrix[0, 0]))
    turn = rotation((0.0, 1.0, 0.0), zero_px / focal_px)
    return replace(
        rig, R_right_left=turn @ rig.R_right_left, t_right_left_m=turn @ rig.t_right_left_m, zero_sigma_px=ZERO_SIGMA_PX
    )


def _rows(made: Room, rig: Rig, random: np.random.Generator, points: int) -> Iterator[Row]:
    [(left, right)] = made.pairs(1)
    rectifier = Rectifier(rig)
    count = disparities_for_near(rectifier.geometry, NEAR_M, rectifier.rectification.width_px)
    core = StereoCore(MatchSettings(default_matcher(), count), rectifier)
    done = core.compute(left, right, lambda: 0)
    assert done.disparity is not None
    assert done.geometry is not None
    assert done.search is not None
    at = random.uniform(0, [rig.left.width_px - 1, rig.left.height_px - 1], (points, 2))
    rays = rays_through(rig.left, at[:, 0], at[:, 1])
    true_m = (cast(made.scene.bodies, np.zeros(3), rays).depth * rays).T
    rectified = rectify_points(at, rig.left, rectifier.rectification.R_left, done.geometry)
    errors = rig_errors(rig, rectifier.rectification)
    before: tuple[MeasuredPoint, np.ndarray[tuple[int], np.dtype[np.float64]]] | None = None
    for (x, y), point_m in zip(rectified.tolist(), true_m, strict=True):
        match = match_point(done.pair, done.disparity, (x, y), 1 / done.search.scale)
        if not isinstance(match, PointMatch):
            yield Row(made.seed, match.name.lower())
            continue
        found = measured_point((x, y), match, done.geometry, done.pair.epipolar, errors)
        if not np.isfinite(found.point_m).all():
            yield Row(made.seed, "infinite")
            continue
        yield row_of(made.seed, "distance", found.distance, float(np.linalg.norm(point_m)))
        if before is not None:
            apart_m = float(np.linalg.norm(point_m - before[1]))
            yield row_of(made.seed, "length", distance_between(before[0], found), apart_m)
            before = None
        else:
            before = found, point_m


def row_of(seed: int, what: str, found: Within, true_m: float) -> Row:
    """Compare a measured length with the truth."""
    low, high = found.low_m, found.high_m
    reach = (found.value_m - low) if true_m < found.value_m else (high - found.value_m)
    return Row(
        seed,
        what,
        true_m,
        float(found.value_m - true_m),
        float(high - low) / 2,
        inside=bool(low <= true_m <= high),
        far_off=bool(abs(found.value_m - true_m) > _FAR_OFF * reach),
    )
