"""Estimates a board's bend along with the rig. Pure.

Paper that is not glued down is bent alike in all views. A rig fitted to a flat board takes the bend for focal length and depth, by
many of its stated standard deviations. So where the views tell a bend, two numbers more are estimated: how far the board's middle
stands out along its rows and along its columns (a parabola). For given bows all else is at its optimum (variable
projection: G. Golub and V. Pereyra, 2003), so Gauss-Newton has two unknowns only. What they leave open is added to the covariance.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.solve.bundle import BundleResult, BundleState
from phone_host.geometry.lens import parameters_of
from phone_host.geometry.se3 import rotations_of, vectors_of
from phone_host.model.calibration_series import BoardInSpace

Vector = NDArray[np.float64]

BENT_SIGMAS: Final = 5.0
"""A bend is believed from so many standard deviations on, by the views' scatter."""

_LEAST_VIEWS: Final = 6
_STEPS: Final = 1
"""Gauss-Newton from the bows that a flat board's rig shows; the second step is below a tenth of the noise."""

_STEP_SHARE: Final = 1e-3
"""Of the board's size: the step of the derivatives, small beside its distance and large beside the search's end."""


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
    """Return (N, 2) depth of a board that is bent along its rows, and along its columns, so that its middle stands out by 1.

    Args:
        board: (N, 3) corners about their middle.
    """
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
    for _ in range(_STEPS):
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
