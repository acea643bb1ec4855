"""Where a rig sees a board's corners in space, and how far that is from the board: the check of one view. Pure.

Both rays of each corner are intersected (`geometry.triangulate`). What contradicts the rig in a view then falls apart into
what no error along the rays explains, and what no error across them does:

- the two rays of a corner miss each other: the images do not show one moment, or a camera stands otherwise than the rig says;
- the corners do not make the board: it comes out larger or smaller, or it is not flat.

All of it is told beside what the corners' noise makes of it, so a far board is not held to a near one's millimetres.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np

from phone_host.calibration.board_pairs import BoardPair
from phone_host.calibration.bundle import Vector
from phone_host.geometry.lens import rays_through
from phone_host.geometry.se3 import SE3, cross_matrices, rotations_of
from phone_host.geometry.triangulate import Intersections, triangulate
from phone_host.model import CameraModel, Rig
from phone_host.model.calibration_series import BoardInSpace

_STEPS: Final = 4
"""Gauss-Newton from the rig's own pose of the board: the second step is already below the noise."""

_SIZE: Final = 6
_BOWS: Final = slice(7, 9)
_FITTED: Final = 9
"""Places in the fit, behind place and attitude; and how many numbers it has."""

_LEAST_CORNERS: Final = 12


def ray_crossings(pairs: Sequence[BoardPair], rig: Rig, sigmas_px: tuple[float, float] = (1.0, 1.0)) -> Intersections:
    """Intersect the rays of all corners.

    Args:
        pairs: V pairs of N corners; NaN where one is not seen.
        rig: the rig.
        sigmas_px: standard deviation of a coordinate in the left and in the right image, px.

    Returns:
        V N intersections in the left camera's axes, pair by pair; NaN where a camera does not see the corner.
    """
    left, right = (np.concatenate([pair.left_px for pair in pairs]), np.concatenate([pair.right_px for pair in pairs]))
    slopes = np.stack([_slopes(left, rig.left), _slopes(right, rig.right)])
    # Noise is alike in pixels; the finer camera's rays are surer.
    noise = np.array(
        [
            sigma**2 * np.diag(np.diag(model.matrix)[:2] ** -2.0)
            for sigma, model in zip(sigmas_px, (rig.left, rig.right), strict=True)
        ]
    )
    noises = np.broadcast_to(noise[:, np.newaxis], (*slopes.shape, 2))
    return triangulate(slopes, noises, (SE3.identity(), SE3(rig.R_right_left, rig.t_right_left_m.reshape(3))))


def misses(pairs: Sequence[BoardPair], rig: Rig, sigmas_px: tuple[float, float] = (1.0, 1.0)) -> Vector:
    """Return by how much the two rays of a corner miss each other in each pair, (V,): root mean square, in standard deviations."""
    chi2 = ray_crossings(pairs, rig, sigmas_px).chi2.reshape(len(pairs), -1)
    return np.array([_root_mean(view) for view in chi2])


def boards_in_space(
    pairs: Sequence[BoardPair], points_m: Vector, rig: Rig, poses: Vector, sigmas_px: tuple[float, float]
) -> tuple[BoardInSpace, ...]:
    """Check each view of a solved rig.

    Args:
        pairs: V pairs of N corners; NaN where one is not seen.
        points_m: (N, 3) corners in the board's axes.
        rig: the rig.
        poses: (V, 6) of the boards in the left camera's axes, roughly.
        sigmas_px: standard deviation of a coordinate in the left and in the right image, px.
    """
    found = ray_crossings(pairs, rig, sigmas_px)
    shape = (len(pairs), len(points_m))
    points, covariances = found.points_m.reshape(*shape, 3), found.covariance_m2.reshape(*shape, 3, 3)
    chi2 = found.chi2.reshape(shape)
    return tuple(
        _board(points[view], covariances[view], chi2[view], points_m, poses[view]) for view in range(len(pairs))
    )


def _board(points: Vector, covariances: Vector, chi2: Vector, points_m: Vector, pose: Vector) -> BoardInSpace:
    seen = np.isfinite(points).all(axis=1)
    found, sigmas = np.full(_FITTED, np.nan), np.full(_FITTED, np.nan)
    if seen.sum() >= _LEAST_CORNERS:
        found, sigmas = _laid_onto(points[seen], covariances[seen], points_m[seen], pose)
    return BoardInSpace(
        miss=_root_mean(chi2),
        size=float(found[_SIZE]),
        size_sigma=float(sigmas[_SIZE]),
        bows_m=found[_BOWS],
        bow_sigmas_m=sigmas[_BOWS],
    )


def _laid_onto(points: Vector, covariances: Vector, points_m: Vector, pose: Vector) -> tuple[Vector, Vector]:
    """Lay a board of any size that may be bent both ways onto points, by weighted least squares.

    Returns:
        Place, attitude (of the last step), size and bows, (9,), and their standard deviations.
    """
    weights = np.linalg.inv(covariances)
    board = points_m - points_m.mean(axis=0)
    shapes = _bow_shapes(board)
    turn, found = rotations_of(pose[:3]), np.concatenate([points.mean(axis=0), np.zeros(3), [1.0, 0.0, 0.0]])
    covariance = np.zeros((_FITTED, _FITTED))
    for _ in range(_STEPS):
        bent = board + np.outer(shapes @ found[_BOWS], [0.0, 0.0, 1.0])
        onto = found[_SIZE] * bent @ turn.T
        columns = np.empty((len(board), 3, _FITTED))
        columns[:, :, :3], columns[:, :, 3:6] = np.eye(3), -cross_matrices(onto)
        columns[:, :, _SIZE] = bent @ turn.T
        columns[:, :, _BOWS] = found[_SIZE] * turn[:, 2, np.newaxis] * shapes[:, np.newaxis]
        weighted = np.swapaxes(columns, 1, 2) @ weights
        covariance = np.linalg.inv((weighted @ columns).sum(axis=0))
        step = covariance @ np.einsum("nij,nj->i", weighted, points - found[:3] - onto)
        found, turn = found + step, rotations_of(step[3:6]) @ turn
    return found, np.sqrt(np.diag(covariance))


def _bow_shapes(board: Vector) -> Vector:
    """Return (M, 2) depth of a board that is bent along its rows, and along its columns, so that its middle stands out by 1."""
    halves = np.ptp(board[:, :2], axis=0) / 2
    shapes: Vector = 1 - (board[:, :2] / halves) ** 2
    return shapes


def _slopes(corners: Vector, model: CameraModel) -> Vector:
    """Return (N, 2) x / z and y / z of the rays of corners; NaN where one is not seen, or lies aside of the image plane."""
    slopes = np.full(corners.shape, np.nan)
    seen = np.flatnonzero(np.isfinite(corners).all(axis=1))
    rays = rays_through(corners[seen], model)
    ahead = rays[:, 2] > 0
    slopes[seen[ahead]] = rays[ahead, :2] / rays[ahead, 2:]
    return slopes


def _root_mean(squares: Vector) -> float:
    known = squares[np.isfinite(squares)]
    return float(np.sqrt(known.mean())) if known.size else float("nan")
