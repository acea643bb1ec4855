"""Points measured with a rig of their own for each case, drawn from the covariance of its calibration: part of bench_measure.

The points are projected by the true rig, so nothing is rendered and nothing matched; the match's noise is Gaussian and known.
"""

from typing import Final

import numpy as np

from phone_host.geometry.lens import project, rays_through
from phone_host.model import CameraModel, Rig
from phone_host.stereo.measured_point import MeasuredPoint, distance_between, measured_point, rig_errors
from phone_host.stereo.point_match import PointMatch
from phone_host.stereo.rectify import rectify_points, rectify_rig
from tests.bench.drawn_rigs import Floats, drawn_rig, with_covariance
from tests.bench.measured_rooms import Row, row_of
from tests.bench.trust_rooms import room

_DEPTHS_M: Final = (0.5, 4.0)
_PIXELS: Final = 400


def draw_rows(seed: int, cases: int) -> list[Row]:
    """Measure two points and their distance with each of many rigs that are off in their own way.

    Args:
        seed: of the true rig and the cases.
        cases: how many rigs are drawn.
    """
    random = np.random.default_rng([seed, 37])
    true = with_covariance(room(seed).rig, seed)
    rows = []
    for _ in range(cases):
        rig = drawn_rig(true, random)
        points_m = [_seen_by_both(true, random) for _ in range(2)]
        found = [_measured(point_m, true, rig, random) for point_m in points_m]
        if not all(np.isfinite(one.point_m).all() for one in found):
            rows.append(Row(seed, "infinite"))
            continue
        lengths_m = [float(np.linalg.norm(point_m)) for point_m in points_m]
        rows += [row_of(seed, "distance", one.distance, exact) for one, exact in zip(found, lengths_m, strict=True)]
        apart_m = float(np.linalg.norm(points_m[0] - points_m[1]))
        rows.append(row_of(seed, "length", distance_between(found[0], found[1]), apart_m))
    return rows


def _seen_by_both(rig: Rig, random: np.random.Generator) -> Floats:
    while True:
        at = random.uniform(0, [rig.left.width_px - 1, rig.left.height_px - 1])
        point = rays_through(at[np.newaxis], rig.left) * random.uniform(*_DEPTHS_M)
        if _inside(project(point @ rig.R_right_left.T + rig.t_right_left_m, rig.right)[0], rig.right):
            return np.asarray(point[0], np.float64)


def _inside(at_px: Floats, model: CameraModel) -> bool:
    return bool((at_px >= 0).all() and (at_px <= [model.width_px - 1, model.height_px - 1]).all())


def _measured(point_m: Floats, true: Rig, rig: Rig, random: np.random.Generator) -> MeasuredPoint:
    made = rectify_rig(rig)
    left = rectify_points(project(point_m[np.newaxis], true.left), rig.left, made.R_left, made.geometry)[0]
    beside = (point_m @ true.R_right_left.T + true.t_right_left_m)[np.newaxis]
    right = rectify_points(project(beside, true.right), rig.right, made.R_right, made.geometry)[0]
    root = np.diag(random.uniform(0.02, 0.2, 2)) @ np.array([[1.0, 0.0], [random.uniform(-0.5, 0.5), 1.0]])
    off = right + root @ random.normal(size=2)
    match = PointMatch(off, root @ root.T, float(left[0] - off[0]), float(left[1] - off[1]), _PIXELS)
    return measured_point((left[0], left[1]), match, made.geometry, made.epipolar, rig_errors(rig, made))
