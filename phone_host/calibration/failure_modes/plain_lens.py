"""Gives corners the place that a plain lens would have given them, so that a bent lens does not look like a mistake. Pure.

The search for causes knows one lens of nine numbers. Views of a fisheye fit it badly, and each view contradicts it in its own way,
as views of a rolling shutter do. What the calibration found out about the lens takes that away: pixel -> ray -> pixel of the plain
lens that is nearest. What the views contradict besides stays.
"""

from typing import Final

import numpy as np

from phone_host.calibration.failure_modes.lone import Vector
from phone_host.calibration.target.pairs import BoardPair
from phone_host.geometry.lens import parameters_of, rays_through
from phone_host.model import CameraModel, Lens, Rig

_USUAL_TERMS: Final = 8
"""Focal lengths, principal point and k1 k2 p1 p2: the search knows them itself."""

_FARTHEST_RAD: Final = np.radians(60)
"""Beyond, two coefficients do not follow a fisheye: those corners are left out of the search."""


def with_plain_lenses(pairs: list[BoardPair], rig: Rig) -> list[BoardPair]:
    """Return the corners as cameras with plain lenses would have seen them.

    Args:
        pairs: the corners; NaN: not seen.
        rig: what the calibration made of them.

    Returns:
        The pairs, in the same order. A camera whose lens is plain keeps its corners.
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
