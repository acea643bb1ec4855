"""Bundle adjustment of a stereo rig: both cameras, their relative pose and every board pose at once.

`cv2.stereoCalibrate` stops far from the optimum when the views say little. (Measured on a real rig with the board at
1.3 m: it stopped at a baseline of 78.8 mm or 79.6 mm, depending on its start; the optimum, and the published value, is
80.17 mm.) It also takes only one image size, one lens for both cameras, and gives single bad corners full weight. This
module uses Levenberg-Marquardt on the exact problem (`geometry.schur`), weighs each camera's corners by that camera's own
noise and by Huber's weights, and computes the covariance, which says how well the views determine the rig.

The weights of a fit are one thing, what is stated of it another. Stated is the covariance

    inverse . M . inverse,  M = covariance of what the views pull,

with the noise as it is: each corner on its own, and each right picture as a whole, since both cameras never expose a moving
board at one moment. What neither explains, the jackknife over the views shows.

Sources: B. Triggs et al., "Bundle Adjustment - A Modern Synthesis", 2000; P. Huber, "The behavior of maximum likelihood estimates
under nonstandard conditions", 1967 (the sandwich).
"""

from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.solve.bundle_problem import (
    GLOBALS,
    BundleState,
    RigProblem,
    Vector,
    errors_of,
    left_alone,
)
from phone_host.calibration.target.pairs import BoardPair
from phone_host.geometry.lens import LEFT, RIGHT
from phone_host.geometry.schur import Flags, inverse_of, minimise
from phone_host.geometry.se3 import rotations_of
from phone_host.model import CameraModel, Lens, Rig

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

_MOST_PASSES = 4  # each has a noise estimate that the outliers of the one before no longer inflate
_SAME_NOISE = 0.002  # relative change of the noise estimate below which another pass changes nothing
ROUGHLY = 1e-5
"""Relative decrease of the cost at which a search may end whose result is only compared."""
# A view's corners err together by about as much, whatever the detector: smaller weights would let one camera's lucky corners, and Huber's limit,
# rule. Also, with a test's exact corners it keeps the cost quadratic. What is stated does not know it.
_LEAST_SIGMA_PX = 0.02
# Where the views do not determine the principal point (all boards parallel), this prior keeps it near the middle: a
# tenth of the image width, ten times more than lenses are off. Views that do determine it outweigh the prior
# ten-thousandfold.
_PRINCIPAL_POINT_SHARE = 0.1
# Numerator and denominator of the rational lens may grow together without end; real ones' coefficients are a few units.
_RATIONAL_SIGMA = 3.0
# Coefficients of published fisheye calibrations are a few hundredths (0.1 let 1 of 20 fisheyes of 120 degrees fold back inside the image); where boards do not reach, a fit is not free to invent a lens
# that turns back.
_FISHEYE_SIGMA = 0.03


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


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BundleResult:
    """The optimum and its uncertainty.

    Attributes:
        state: the optimum.
        left_errors_px: (V, N, 2) measured minus projected; NaN where a corner was not seen.
        right_errors_px: (V, N, 2), the same.
        covariance: (30, 30) of the shared parameters: both cameras' twelve (`geometry.lens`), a small turn of the right camera about
            its own axes (rad), the translation (m); 0 for those that are not estimated.
    """

    state: BundleState
    left_errors_px: Vector
    right_errors_px: Vector
    covariance: Vector = field(default_factory=lambda: np.full((GLOBALS, GLOBALS), np.nan))

    def rms_px(self) -> float:
        """Return the root mean square distance of all corners of both cameras, px (counted like OpenCV's stereoCalibrate)."""
        return rms_px(self.left_errors_px, self.right_errors_px)

    def sigmas_px(self) -> tuple[float, float]:
        """Return the standard deviation of a coordinate that is left in the left and in the right images, px; never below what detectors reach."""
        left, right = (
            max(rms_px(errors) / 2**0.5, _LEAST_SIGMA_PX) for errors in (self.left_errors_px, self.right_errors_px)
        )
        return left, right

    def view_rms_px(self) -> tuple[Vector, Vector]:
        """Return the root mean square distance of each view, (V,) px, left and right."""
        return view_rms_px(self.left_errors_px), view_rms_px(self.right_errors_px)


def free_flags(left: Flags, right: Flags, *, pose: bool = True) -> Flags:
    """Return (30,) which shared parameters are estimated: those of the cameras, (12,) each, and whether the relative pose is."""
    return np.concatenate([left, right, np.full(6, pose)])


def view_rms_px(errors: Vector) -> Vector:
    """Return the root mean square length of each view's errors (V, N, 2), (V,) px; NaN is left out."""
    return np.asarray(np.sqrt(np.nanmean((errors**2).sum(axis=2), axis=1)), np.float64)


def rig_of(state: BundleState) -> Rig:
    """Return the rig of a state."""
    return Rig(
        left=state.left,
        right=state.right,
        R_right_left=rotations_of(state.rotation),
        t_right_left_m=state.translation_m,
    )


def rms_px(*errors: Vector) -> float:
    """Return the root mean square length of (..., 2) errors, px; NaN is left out."""
    stacked = np.concatenate([e.reshape(-1, 2) for e in errors])
    return float(np.sqrt(np.nanmean((stacked**2).sum(axis=1))))


def adjust(views: list[BoardPair], points_m: Vector, start: BundleState, free: Flags) -> BundleResult:
    """Find the rig that best explains the corners.

    Args:
        views: the pairs, V >= 1.
        points_m: (N, 3) corners in the board's axes.
        start: a state close enough: each camera calibrated alone, the relative pose of any one view.
        free: what is estimated; all else keeps its start value.
    """
    prior, state = _prior(start), start
    problem = _problem(views, points_m, state, prior)
    for _ in range(_MOST_PASSES):
        before = problem.sigmas_px
        state = minimise(problem, state, free)
        problem = _problem(views, points_m, state, prior)
        if np.allclose(problem.sigmas_px, before, rtol=_SAME_NOISE, atol=0):
            break
    left, right = errors_of(views, points_m, state)
    return BundleResult(
        state=state,
        left_errors_px=left,
        right_errors_px=right,
        covariance=covariance_of(problem, state, free),
    )


def fit_poses(views: list[BoardPair], points_m: Vector, state: BundleState) -> BundleResult:
    """Fit the boards' poses alone to views of a rig that is known."""
    problem = _problem(views, points_m, state, _prior(state))
    fitted = minimise(problem, state, np.zeros(GLOBALS, bool), ROUGHLY)
    left, right = errors_of(views, points_m, fitted)
    return BundleResult(state=fitted, left_errors_px=left, right_errors_px=right)


def adjust_alone(views: list[Vector], points_m: Vector, start: BundleState, free: NDArray[np.bool_]) -> BundleState:
    """Adjust a single camera, roughly: the left one of a rig whose right one sees nothing."""
    return adjust_roughly(left_alone(views), points_m, start, free_flags(free, np.zeros_like(free), pose=False))


def adjust_roughly(views: list[BoardPair], points_m: Vector, start: BundleState, free: Flags) -> BundleState:
    """Do what `adjust` does, where the start is close, nothing is wrong any more and no uncertainty is asked for."""
    return minimise(_problem(views, points_m, start, _prior(start)), start, free, ROUGHLY)


def alone_state(model: CameraModel, poses: Vector) -> BundleState:
    """Return a single camera as a rig whose right one sees nothing."""
    return BundleState(
        left=model, right=model, rotation=np.zeros(3), translation_m=np.array([-1.0, 0.0, 0.0]), poses=poses
    )


def _problem(views: list[BoardPair], points_m: Vector, state: BundleState, prior: tuple[Vector, Vector]) -> RigProblem:
    """Return the problem with each camera's noise as it is at a state."""
    sigmas = tuple(_sigma_px(errors) for errors in errors_of(views, points_m, state))
    return RigProblem(views, points_m, prior, (sigmas[0], sigmas[1]))


def _sigma_px(errors: Vector) -> float:
    """Return the robust standard deviation of one coordinate for the corners' weights, px."""
    return max(deviation_px(errors), _LEAST_SIGMA_PX)


def _prior(state: BundleState) -> tuple[Vector, Vector]:
    """Return the expected shared parameters and their weights: 1 / standard deviation squared."""
    expected, weight = np.zeros(GLOBALS), np.zeros(GLOBALS)
    for part, model in ((LEFT, state.left), (RIGHT, state.right)):
        at = part.start + 2
        expected[at : at + 2] = (model.width_px - 1) / 2, (model.height_px - 1) / 2
        weight[at : at + 2] = (_PRINCIPAL_POINT_SHARE * model.width_px) ** -2
        if model.lens is Lens.RATIONAL:
            weight[part.start + 8 : part.stop] = _RATIONAL_SIGMA**-2
        elif model.lens is Lens.FISHEYE:
            weight[part.start + 4 : part.start + 8] = _FISHEYE_SIGMA**-2
    return expected, weight
