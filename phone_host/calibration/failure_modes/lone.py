"""Each camera alone, for the search for causes: a usual lens, a pose for each view, and what they leave. Pure.

The search needs one simple lens for all of its rules, whatever lens the calibration chooses in the end. Corners that were
not seen are NaN.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from common.errors import DataError
from phone_host.calibration.solve.bundle_problem import BundleState, Vector
from phone_host.calibration.solve.calibrate_alone import (
    LoneCamera,
    calibrate_alone,
    corners_of,
    errors_px,
    prediction_errors_px,
    states_of,
    with_poses,
)
from phone_host.calibration.target.pairs import BoardPair
from phone_host.geometry.lens import parameters_of, rays_through
from phone_host.model import CameraModel, Lens, Rig, Side

LENS: Final = 9
"""Numbers of a usual lens: fx fy cx cy k1 k2 p1 p2 k3."""

_LEAST_CORNERS: Final = 6

_USUAL_TERMS: Final = 8
"""Focal lengths, principal point and k1 k2 p1 p2: the search knows them itself."""

_FARTHEST_RAD: Final = np.radians(60)
"""Beyond, two coefficients do not follow a fisheye: those corners are left out of the search."""


@dataclass(frozen=True, slots=True, eq=False)
class Lone:
    """One camera, with a pose for each view, and the squares that are left, px^2."""

    camera: LoneCamera
    squares_px2: float

    @property
    def lens(self) -> Vector:
        """Its (9,) numbers."""
        return parameters_of(self.camera.parameters)[:LENS]


def both_alone(
    pairs: list[BoardPair], points_m: Vector, sizes_px: tuple[tuple[int, int], ...]
) -> tuple[list[BoardPair], Lone, Lone] | None:
    """Calibrate each camera alone, without views that are plainly wrong.

    Returns:
        The pairs left and both cameras; None if fewer than three are left.

    Raises:
        cv2.error: no lens explains the views.
    """
    kept, cameras = list(pairs), []
    for side, size_px in zip(Side, sizes_px, strict=True):
        found = lone_camera(kept, side, points_m, size_px)
        if found is None:
            return None
        kept, camera = found
        cameras.append(camera)
    left, right = (_lone(with_poses(camera, kept, points_m), kept, points_m) for camera in cameras)
    return kept, left, right


def lone_camera(
    pairs: list[BoardPair], side: Side, points_m: Vector, size_px: tuple[int, int]
) -> tuple[list[BoardPair], LoneCamera] | None:
    """Return the pairs whose view on one side fits a lens, and its camera; None if fewer than three do.

    Raises:
        cv2.error: no lens explains the views.
    """
    usable = [pair for pair in pairs if np.isfinite(corners_of(pair, side)).all(axis=1).sum() >= _LEAST_CORNERS]
    try:
        kept, _, camera = calibrate_alone(usable, side, points_m, size_px)
    except DataError:
        return None
    return kept, camera


def apart_px(pairs: list[BoardPair], left: Lone, right: Lone, points_m: Vector) -> tuple[Vector, BundleState]:
    """Return how far each pair's right view is from where the rig that most agree on predicts it, (V,) px, and that rig."""
    states = states_of(left.camera, right.camera)
    errors = prediction_errors_px(states, [pair.right_px for pair in pairs], points_m)
    best = int(np.median(errors, axis=1).argmin())
    return errors[best], states[best]


def _lone(camera: LoneCamera, pairs: list[BoardPair], points_m: Vector) -> Lone:
    return Lone(camera, float(np.nansum(np.square(errors_px(camera, pairs, points_m)))))


def with_plain_lenses(pairs: list[BoardPair], rig: Rig) -> list[BoardPair]:
    """Return the corners (NaN: not seen) as cameras with plain lenses would have seen them; a camera whose lens is plain keeps its own.

    The search for causes knows one lens of nine numbers. Views of a fisheye fit it badly, and each view contradicts it in its own way,
    as views of a rolling shutter do. What the calibration found out about the lens takes that away: pixel -> ray -> pixel of the plain
    lens that is nearest. What the views contradict besides stays.
    """
    left = _as_plain([pair.left_px for pair in pairs], rig.left)
    right = _as_plain([pair.right_px for pair in pairs], rig.right)
    return [BoardPair(pair.name, one, other) for pair, one, other in zip(pairs, left, right, strict=True)]


def is_plain(model: CameraModel) -> bool:
    """Return whether the search for causes knows such a lens itself."""
    return model.lens is Lens.PINHOLE and not parameters_of(model)[_USUAL_TERMS:].any()


def _as_plain(views: list[Vector], model: CameraModel) -> list[Vector]:
    """Return (N, 2) corners of each view, px; NaN also where the lens bends too much."""
    if is_plain(model):
        return views
    seen = np.concatenate(views)
    slopes, known = np.full(seen.shape, np.nan), np.isfinite(seen).all(axis=1)
    rays = rays_through(seen[known], model)
    near = rays[:, 2] > np.cos(_FARTHEST_RAD) * np.linalg.norm(rays, axis=1)  # NaN is not near
    slopes[np.flatnonzero(known)[near]] = rays[near, :2] / rays[near, 2:]
    middle, focal_px = model.matrix[:2, 2], model.matrix[[0, 1], [0, 1]]
    powers = (slopes**2).sum(axis=1)[:, np.newaxis] ** np.arange(3)
    columns = slopes[:, :, np.newaxis] * powers[:, np.newaxis]  # x (1, r^2, r^4), and y
    wanted = (seen - middle) / focal_px
    used = np.isfinite(slopes).all(axis=1)
    numbers = np.linalg.lstsq(columns[used].reshape(-1, 3), wanted[used].ravel(), rcond=None)[0]
    plain = middle + focal_px * (columns @ numbers)
    return np.split(plain, np.cumsum([len(view) for view in views])[:-1])
