"""Where a rig sees a board's corners in space, and how far that is from the board: the check of one view. Pure.

Both rays of each corner are intersected (`geometry.triangulate`). What contradicts the rig in a view then falls apart into
what no error along the rays explains, and what no error across them does:

- the two rays of a corner miss each other: the images do not show one moment, or a camera stands otherwise than the rig says;
- the corners do not make the board: it comes out larger or smaller, or it is not flat.

All of it is told beside what the corners' noise makes of it, so a far board is not held to a near one's millimetres.

Paper that is not glued down is bent alike in all views. A rig fitted to a flat board takes the bend for focal length and depth, by
many of its stated standard deviations. So where the views tell a bend, two numbers more are estimated: how far the board's middle
stands out along its rows and along its columns (a parabola). For given bows all else is at its optimum (variable
projection: G. Golub and V. Pereyra, 2003), so Gauss-Newton has two unknowns only. What they leave open is added to the covariance.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from phone_host.calibration.solve.board_pose import towards
from phone_host.calibration.solve.bundle import BundleResult
from phone_host.calibration.solve.bundle_problem import BundleState, Vector
from phone_host.calibration.target.pairs import BoardPair
from phone_host.geometry.lens import parameters_of, project_linearised, rays_through
from phone_host.geometry.se3 import SE3, cross_matrices, rotations_of, vectors_of
from phone_host.geometry.triangulate import triangulate
from phone_host.model import CameraModel, Lens, Rig
from phone_host.model.calibration_series import BoardInSpace

BENT_SIGMAS: Final = 5.0
"""A bend is believed from so many standard deviations on, by the views' scatter."""

_LEAST_VIEWS: Final = 6
_ADJUSTMENTS: Final = 1
"""Gauss-Newton from the bows that a flat board's rig shows; the second step is below a tenth of the noise."""

_STEP_SHARE: Final = 1e-3
"""Of the board's size: the step of the derivatives, small beside its distance and large beside the search's end."""

_STEPS: Final = 4
"""Gauss-Newton from the rig's own pose of the board: the second step is already below the noise."""

_SIZE: Final = 6
_BOWS: Final = slice(7, 9)
_FITTED: Final = 9
"""Places in the fit, behind place and attitude; and how many numbers it has."""

_LEAST_CORNERS: Final = 12


@dataclass(frozen=True, slots=True, eq=False)
class BentFit:
    """A rig fitted to a board that is bent.

    Attributes:
        result: the optimum; its covariance includes what the bend leaves open.
        points_m: (N, 3) corners of the bent board.
    """

    result: BundleResult
    points_m: Vector


def bow_shapes(board: Vector) -> Vector:
    """Return (N, 2) depth of a board that is bent along its rows, and along its columns, so that its middle stands out by 1."""
    halves = np.ptp(board[:, :2], axis=0) / 2
    shapes: Vector = 1 - (board[:, :2] / halves) ** 2
    return shapes


def common_bows_m(boards: Sequence[BoardInSpace]) -> tuple[Vector, Vector]:
    """Return how far the board's middle stands out in all views together, (2,) m, and the standard deviations by the views' scatter; NaN: too few views."""
    known = [each for each in boards if np.isfinite(each.bows_m).all()]
    if len(known) < _LEAST_VIEWS:
        return np.full(2, np.nan), np.full(2, np.nan)
    bows, sigmas = (np.array([getattr(each, name) for each in known]) for name in ("bows_m", "bow_sigmas_m"))
    weights = sigmas**-2.0
    mean = (weights * bows).sum(axis=0) / weights.sum(axis=0)
    scatter = (weights * (bows - mean) ** 2).sum(axis=0) / (len(known) - 1)
    return mean, np.sqrt(np.maximum(scatter, 1.0) / weights.sum(axis=0))


def fit_bent(
    flat: BundleResult,
    points_m: Vector,
    boards: Sequence[BoardInSpace],
    adjusted: Callable[[Vector, BundleState], BundleResult],
) -> BentFit | None:
    """Estimate the bend and the rig together, if the views tell a bend.

    Args:
        flat: the rig fitted to a flat board.
        points_m: (N, 3) its corners.
        boards: each view's board, as that rig sees it.
        adjusted: fits the rig to a board (N, 3) from a state.

    Returns:
        The rig; None if no bend is told, or it explains nothing.
    """
    bows, sigmas = common_bows_m(boards)
    if not (np.abs(bows) > BENT_SIGMAS * sigmas).any():
        return None
    shapes = bow_shapes(points_m - points_m.mean(axis=0))
    step_m = _STEP_SHARE * float(np.ptp(points_m, axis=0).max())

    def bent(bows_m: Vector) -> Vector:
        return points_m + np.outer(shapes @ bows_m, [0.0, 0.0, 1.0])

    result, moves, covariance = flat, np.zeros((len(flat.covariance), 2)), np.zeros((2, 2))
    for _ in range(_ADJUSTMENTS):
        result = adjusted(bent(bows), result.state)
        aside = [adjusted(bent(bows + step_m * axis), result.state) for axis in np.eye(2)]
        moves = np.stack([_between(result.state, each.state) for each in aside], axis=1) / step_m
        slopes = np.stack([_weighed(result, each) - _weighed(result, result) for each in aside], axis=-1) / step_m
        pulls = np.einsum("vni,vn->vi", slopes, _weighed(result, result))
        known = np.linalg.inv(np.einsum("vni,vnj->ij", slopes, slopes))
        scatter = known @ (pulls.T @ pulls) @ known * len(pulls) / (len(pulls) - 1)
        covariance = np.maximum(np.linalg.eigvalsh(known).max(), np.linalg.eigvalsh(scatter).max()) * np.eye(2)
        bows = bows - known @ pulls.sum(axis=0)
    result = adjusted(bent(bows), result.state)
    if not result.rms_px() < flat.rms_px():
        return None
    return BentFit(replace(result, covariance=result.covariance + moves @ covariance @ moves.T), bent(bows))


def _weighed(noise: BundleResult, of: BundleResult) -> Vector:
    """Return (V, 4 N) errors of a fit in standard deviations of another; 0 where a corner was not seen."""
    left, right = (
        np.nan_to_num(errors / sigma)
        for errors, sigma in zip((of.left_errors_px, of.right_errors_px), noise.sigmas_px(), strict=True)
    )
    return np.concatenate([left.reshape(len(left), -1), right.reshape(len(right), -1)], axis=1)


def _between(start: BundleState, end: BundleState) -> Vector:
    """Return (30,) the step from one state's shared parameters to another's."""
    turn = vectors_of(rotations_of(end.rotation) @ rotations_of(start.rotation).T)
    return np.concatenate(
        [
            parameters_of(end.left) - parameters_of(start.left),
            parameters_of(end.right) - parameters_of(start.right),
            turn,
            end.translation_m - start.translation_m,
        ]
    )


@dataclass(frozen=True, slots=True, eq=False)
class Crossings:
    """Where both rays of M corners cross best; NaN where they do not, or a camera does not see the corner.

    Attributes:
        points_m: (M, 3) in the left camera's axes, m.
        covariance_m2: (M, 3, 3) of the points, m^2.
        chi2: (M,) how far the rays miss each other: squared, in standard deviations; its expectation is 1.
    """

    points_m: Vector
    covariance_m2: Vector
    chi2: Vector


def ray_crossings(pairs: Sequence[BoardPair], rig: Rig, sigmas_px: tuple[float, float] = (1.0, 1.0)) -> Crossings:
    """Intersect the rays of all corners.

    Returns:
        V N crossings, pair by pair.
    """
    if Lens.FISHEYE not in {rig.left.lens, rig.right.lens} or not pairs:
        return _crossed(pairs, rig, sigmas_px, (np.eye(3), np.eye(3)))
    # A fisheye sees boards aside of its image plane, where slopes end: each camera looks towards the board instead.
    found = [
        _crossed([pair], rig, sigmas_px, (towards(pair.left_px, rig.left), towards(pair.right_px, rig.right)))
        for pair in pairs
    ]
    return Crossings(
        np.concatenate([each.points_m for each in found]),
        np.concatenate([each.covariance_m2 for each in found]),
        np.concatenate([each.chi2 for each in found]),
    )


def _crossed(
    pairs: Sequence[BoardPair], rig: Rig, sigmas_px: tuple[float, float], turns: tuple[Vector, Vector]
) -> Crossings:
    """Intersect rays in cameras that are turned."""
    left = _slopes(np.concatenate([pair.left_px for pair in pairs]), rig.left, turns[0], sigmas_px[0])
    right = _slopes(np.concatenate([pair.right_px for pair in pairs]), rig.right, turns[1], sigmas_px[1])
    slopes, noises = (np.stack(both) for both in zip(left, right, strict=True))
    ahead, aside = (SE3(turn, np.zeros(3)) for turn in turns)
    relative = SE3(rig.R_right_left, rig.t_right_left_m.reshape(3))
    found = triangulate(slopes, noises, (SE3.identity(), aside @ relative @ ahead.inverse()))
    return Crossings(found.points_m @ turns[0], turns[0].T @ found.covariance_m2 @ turns[0], found.chi2)


def misses(pairs: Sequence[BoardPair], rig: Rig, sigmas_px: tuple[float, float] = (1.0, 1.0)) -> Vector:
    """Return by how much the two rays of a corner miss each other in each pair, (V,): root mean square, in standard deviations."""
    chi2 = ray_crossings(pairs, rig, sigmas_px).chi2.reshape(len(pairs), -1)
    return np.array([_root_mean(view) for view in chi2])


def boards_in_space(
    pairs: Sequence[BoardPair], points_m: Vector, rig: Rig, poses: Vector, sigmas_px: tuple[float, float]
) -> tuple[BoardInSpace, ...]:
    """Check each view of a solved rig."""
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
    shapes = bow_shapes(board)
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


def _slopes(corners: Vector, model: CameraModel, turn: Vector, sigma_px: float) -> tuple[Vector, Vector]:
    """Return slopes of the rays of corners, and their noise.

    Noise is alike in pixels, not in slopes: off the axis a pixel of a fisheye covers many times the slope of one in the middle. So it goes
    through the inverse of the projection's derivative.

    Args:
        corners: (N, 2), NaN where one is not seen.
        model: the camera.
        turn: (3, 3) from its axes to those in which slopes are meant.
        sigma_px: standard deviation of a coordinate, px.

    Returns:
        (N, 2) x / z and y / z; NaN where one is not seen, or lies aside of the image plane. (N, 2, 2) their covariance.
    """
    slopes, noise = np.full(corners.shape, np.nan), np.tile(np.eye(2), (len(corners), 1, 1))
    seen = np.flatnonzero(np.isfinite(corners).all(axis=1))
    rays = rays_through(corners[seen], model) @ turn.T
    seen, rays = seen[rays[:, 2] > 0], rays[rays[:, 2] > 0]
    if not len(seen):
        return slopes, noise
    rays = rays / rays[:, 2:]
    slopes[seen] = rays[:, :2]
    by_slope = project_linearised(rays @ turn, model)[1] @ turn.T[:, :2]
    per_pixel = sigma_px * np.linalg.inv(by_slope)
    noise[seen] = per_pixel @ np.swapaxes(per_pixel, 1, 2)
    return slopes, noise


def _root_mean(squares: Vector) -> float:
    known = squares[np.isfinite(squares)]
    return float(np.sqrt(known.mean())) if known.size else float("nan")
