"""How well a rig is known by its corners: what they scatter by, and what that leaves open. Pure.

The weights of a fit are one thing, what is stated of it another. Stated is the covariance

    inverse . M . inverse,  M = covariance of what the views pull,

with the noise as it is (P. Huber's sandwich, "The behavior of maximum likelihood estimates under nonstandard conditions", 1967): each corner on its own, and
each right picture as a whole, since both cameras never expose a moving board at one moment. What neither explains, the jackknife
over the views shows.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.solve.bundle_problem import GLOBALS, BundleState, RigProblem, Vector, errors_of
from phone_host.geometry.schur import inverse_of

_MEDIAN_TO_SIGMA: Final = 1.4826
"""Turns a median of absolute values into a standard deviation (Gaussian)."""

_LEAST_NOISE_PX: Final = 0.01
"""Corners of good pictures scatter by 0.005 to 0.01 px (docs/decisions/0053), and some of what they are off by is alike in all views: no scatter shows it. Ten
rendered rigs lie inside their 95 % with 91 % of their parameters at 0.003, with 92.5 % at this."""

_LEAST_VIEWS: Final = 3
"""From two, the turn of the cameras takes up half of what they lie aside."""

_JACKKNIFE_VIEWS: Final = 5
"""With fewer, leaving one out leaves too little. With 5 to 7 views of hand-held boards depth erred by 1.3 to 1.6 of what independent
corners say, and by 0.9 of what the jackknife says."""

_LEAST_LEFT: Final = 1e-6
"""Share of what all views know that is left without one: rounding must not make it negative."""

_TO_MEAN: Final = 0.5
"""How far a scatter that a dozen views show is drawn to its mean."""


def deviation_px(errors: Vector) -> float:
    """Return the robust standard deviation of one coordinate of errors of any shape, px; NaN is left out, 1 if nothing was seen."""
    seen = np.abs(errors[np.isfinite(errors)])
    return float(np.median(seen)) * _MEDIAN_TO_SIGMA if seen.size else 1.0


def covariance_of(problem: RigProblem, state: BundleState, free: NDArray[np.bool_]) -> Vector:
    """Return the covariance (30, 30) of a rig's parameters, 0 for those that are not estimated.

    Args:
        problem: the views, and the weights of the fit.
        state: the optimum.
        free: (30,) which parameters are estimated.
    """
    chosen = np.ix_(free, free)
    information = problem.linearised(state).reduced(0.0, free)[0]
    noise_px, shift_px = noise_of(problem, state, int(free.sum()) + 6 * len(problem.views))
    pulls = problem.scatter(state, noise_px, shift_px) + np.diag(problem.prior[1])
    result = np.zeros((GLOBALS, GLOBALS))
    if free.any():
        moves = _left_out(problem, state, information, free)
        result[chosen] = _covariance(inverse_of(information), pulls[chosen], moves)
    return result


def noise_of(problem: RigProblem, state: BundleState, unknown: int) -> tuple[tuple[float, float], float]:
    """Return by how much corners scatter in the left and in the right pictures, and by how much right pictures lie aside as a whole, px, one coordinate.

    The latter shows across the baseline alone: along it, it looks like another depth.

    Args:
        problem: the views.
        state: the optimum.
        unknown: how many numbers were estimated: errors are smaller by their share.
    """
    both, count = errors_of(problem.views, problem.points_m, state), problem.count(state)
    means = [_means(errors) for errors in both]
    lost = (count / max(count - unknown, 1)) ** 0.5
    left, right = (
        max(deviation_px(errors - mean[:, np.newaxis]) * lost, _LEAST_NOISE_PX)
        for errors, mean in zip(both, means, strict=True)
    )
    baseline = state.translation_m[:2] / max(float(np.linalg.norm(state.translation_m[:2])), np.finfo(float).tiny)
    ratio = float(
        state.right.matrix[0, 0] / state.left.matrix[0, 0]
    )  # in the right one's pixels: whatever the pose takes up drops out
    aside = (means[1] - ratio * means[0]) @ np.array([-baseline[1], baseline[0]])
    seen = np.isfinite(aside)
    if seen.sum() < _LEAST_VIEWS:
        return (left, right), 0.0
    corners = [float(np.isfinite(errors[seen, :, 0]).sum(axis=1).mean()) for errors in both]
    by_corners = (ratio * left) ** 2 / corners[0] + right**2 / corners[1]
    shift = (aside[seen] ** 2).sum() / (seen.sum() - 1) - by_corners
    return (left, right), float(np.sqrt(max(shift, 0.0)))


def _means(errors: Vector) -> Vector:
    """Return the mean error of each view, (V, 2) px; NaN where nothing was seen."""
    count = np.isfinite(errors).sum(axis=1)
    return np.asarray(np.where(count > 0, np.nansum(errors, axis=1) / np.maximum(count, 1), np.nan), np.float64)


def _left_out(problem: RigProblem, state: BundleState, information: Vector, free: NDArray[np.bool_]) -> Vector:
    """Return how far the free parameters move if each view in turn is left out, to first order, (V, F)."""
    moves = np.zeros((len(problem.views), len(information)))
    for index, (pull, known) in enumerate(zip(*problem.by_view(state), strict=True)):
        rest = information - known[np.ix_(free, free)]
        np.fill_diagonal(rest, np.maximum(np.diag(rest), _LEAST_LEFT * np.diag(information)))
        moves[index] = inverse_of(rest) @ pull[free]
    return moves


def _covariance(inverse: Vector, pulls: Vector, moves: Vector) -> Vector:
    """Return the covariance (F, F) that the noise leaves, enlarged where views scatter by more.

    Errors of a view's corners hang together: a board that is not flat, blur, a detector's bias, a lens that the formula does not
    quite meet. Then views disagree by more than the noise says. Each view in turn is left out,
    and how far the parameters move shows their real covariance (the jackknife of B. Efron, "The Jackknife, the Bootstrap and
    Other Resampling Plans", 1982). Some dozen views show it but roughly: in units of the noise's covariance, in which all
    directions are alike, it is averaged with its own mean over the directions (O. Ledoit and M. Wolf, "A well-conditioned estimator
    for large-dimensional covariance matrices", 2004), and no direction becomes better known than by the noise.

    Args:
        inverse: (F, F) of the information that the fit's weights give.
        pulls: (F, F) covariance of what the views pull.
        moves: (V, F) of the parameters, each view left out.
    """
    # Units in which the inverse is the unit matrix: there the noise is near it, too. Lenses whose terms nearly cancel leave no other way.
    sigmas = np.sqrt(np.maximum(np.diag(inverse), np.finfo(float).tiny))
    values, axes = np.linalg.eigh(inverse / np.outer(sigmas, sigmas))
    lengths = np.sqrt(np.maximum(values, _LEAST_LEFT**2))
    root, back = sigmas[:, np.newaxis] * axes * lengths, axes / lengths / sigmas[:, np.newaxis]
    values, axes = np.linalg.eigh(root.T @ pulls @ root)
    lengths = np.sqrt(np.maximum(values, _LEAST_LEFT))
    root, count = root @ axes * lengths, len(moves)
    if count < _JACKKNIFE_VIEWS:
        return np.asarray(root @ root.T, np.float64)
    whitened = moves @ back @ axes / lengths
    scatter = (count - 1) / count * whitened.T @ whitened
    scatter = (1 - _TO_MEAN) * scatter + _TO_MEAN * np.trace(scatter) / len(scatter) * np.eye(len(scatter))
    shares, directions = np.linalg.eigh(scatter)
    spread = root @ directions * np.sqrt(np.maximum(shares, 1.0))
    return np.asarray(spread @ spread.T, np.float64)
