"""How wrong a rig measures depth, where the truth is known, and what it states there by its covariance. Pure."""

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.lens import PARAMETERS, parameters_of, project, rays_through, with_parameters
from phone_host.geometry.se3 import SE3, rotations_of
from phone_host.geometry.triangulate import triangulate
from phone_host.model import CameraModel, Rig

Floats = NDArray[np.float64]

_GRID: Final = (17, 13)
_STEP: Final = 1e-6
"""Of each parameter, for its derivative: all are of the order of 1e-3 to 1e3, and depth is smooth in them."""

_WAYS: Final = ((0, 0), (-1, -1), (1, -1), (-1, 1), (1, 1))


def depth_error_m(found: Rig, truth: Rig, depth_m: float) -> float:
    """Return how wrong a rig measures what stands at a depth.

    Args:
        found: the rig that measures.
        truth: the cameras as they are.
        depth_m: of the points, m.

    Returns:
        Root mean square over all that both cameras see, m.
    """
    left, right = _seen_by_both(truth, depth_m)
    return float(np.sqrt(np.mean((_depths_m(found, left, right) - depth_m) ** 2)))


def depths_in_places(found: Rig, truth: Rig, depth_m: float) -> tuple[tuple[float, float], ...]:
    """Return error and stated standard uncertainty of depth, m, in the middle and the four corners of what both cameras see.

    Arguments as those of `depth_error_m`.
    """
    left, right = _seen_by_both(truth, depth_m)
    beside = left - (left.min(axis=0) + left.max(axis=0)) / 2
    size = np.ptp(left, axis=0)
    at = [
        int(np.abs(beside / size).sum(axis=1).argmin()) if way == (0, 0) else int((beside / size @ way).argmax())
        for way in _WAYS
    ]
    left, right = left[at], right[at]
    depths_m = _depths_m(found, left, right)
    by_values = np.column_stack(
        [(_depths_m(_moved(found, index), left, right) - depths_m) / _STEP for index in range(2 * PARAMETERS + 6)]
    )
    variances = np.einsum("ni,ij,nj->n", by_values, found.covariance, by_values)
    return tuple(
        (float(each), float(np.sqrt(max(variance, 0.0))))
        for each, variance in zip(depths_m - depth_m, variances, strict=True)
    )


def _seen_by_both(truth: Rig, depth_m: float) -> tuple[Floats, Floats]:
    """Return the pixels (N, 2) of points at a depth, left and right."""
    wide, high = truth.left.width_px - 1, truth.left.height_px - 1
    axes = np.linspace(0, wide, _GRID[0]), np.linspace(0, high, _GRID[1])
    grid = np.stack(np.meshgrid(*axes), axis=2).reshape(-1, 2)
    rays = rays_through(grid, truth.left)
    points_m = rays / rays[:, 2:] * depth_m
    there = project(SE3(truth.R_right_left, truth.t_right_left_m).apply(points_m), truth.right)
    limit = np.array([truth.right.width_px, truth.right.height_px]) - 1
    both = ((there >= 0) & (there <= limit)).all(axis=1)
    return grid[both], there[both]


def _depths_m(rig: Rig, left: Floats, right: Floats) -> Floats:
    slopes = np.array([_slopes(left, rig.left), _slopes(right, rig.right)])
    covariances = np.broadcast_to(np.eye(2) * 1e-6, (*slopes.shape, 2))
    poses = [SE3.identity(), SE3(rig.R_right_left, rig.t_right_left_m)]
    return np.asarray(triangulate(slopes, covariances, poses).points_m[:, 2])


def _moved(rig: Rig, index: int) -> Rig:
    """Return a rig of which one parameter, in the order of its covariance, is larger by `_STEP`."""
    step = np.zeros(2 * PARAMETERS + 6)
    step[index] = _STEP
    left, right, turn, shift = np.split(step, [PARAMETERS, 2 * PARAMETERS, 2 * PARAMETERS + 3])
    models = (
        with_parameters(model, parameters_of(model) + by, model.lens)
        for model, by in ((rig.left, left), (rig.right, right))
    )
    return replace(
        rig,
        left=next(models),
        right=next(models),
        R_right_left=rotations_of(turn) @ rig.R_right_left,
        t_right_left_m=rig.t_right_left_m + shift,
    )


def _slopes(pixels: Floats, model: CameraModel) -> Floats:
    rays = rays_through(pixels, model)
    return np.asarray(rays[:, :2] / rays[:, 2:])
