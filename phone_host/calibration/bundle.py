"""Bundle adjustment of a stereo rig: both cameras, their relative pose and every board pose at once.

`cv2.stereoCalibrate` stops far from the optimum when the views say little. (Measured on a real rig with the board at
1.3 m: it stopped at a baseline of 78.8 mm or 79.6 mm, depending on its start; the optimum, and the published value, is
80.17 mm.) It also takes only one image size and gives single bad corners full weight. This module uses
Levenberg-Marquardt on the exact problem, eliminates the board poses by the Schur complement, uses Huber's weights, and
computes the covariance, which says how well the views determine the rig.

Source: B. Triggs et al., "Bundle Adjustment - A Modern Synthesis", 2000. Derivatives: `cv2.projectPoints`, `cv2.composeRT`.
"""

from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

CAMERA_PARAMETERS = 9
"""fx fy cx cy k1 k2 p1 p2 k3."""

_RIG = slice(2 * CAMERA_PARAMETERS, 2 * CAMERA_PARAMETERS + 6)
_GLOBALS = _RIG.stop
_MAX_STEPS = 200
_PASSES = 2  # the second pass has a noise estimate that the first one's outliers no longer inflate
_CONVERGED = 1e-9  # relative decrease of the cost; the baseline then moves by less than a micrometre
_DAMPING_START, _DAMPING_LEAST, _DAMPING_MOST = 1e-3, 1e-12, 1e12
# Huber's threshold in standard deviations: at 2.5, Gaussian noise loses 1 % of its information. The factor turns a median of
# absolute values into a standard deviation (Gaussian).
_HUBER_SIGMAS, _MEDIAN_TO_SIGMA = 2.5, 1.4826
_LEAST_SIGMA_PX = 0.02  # no corner detector is better; with a test's exact corners this keeps the cost quadratic
# Where the views do not determine the principal point (all boards parallel), this prior keeps it near the middle: a
# tenth of the image width, ten times more than lenses are off. Views that do determine it outweigh the prior
# ten-thousandfold.
_PRINCIPAL_POINT_SHARE = 0.1


@dataclass(frozen=True, slots=True, eq=False)
class BundleView:
    """One pair of board views.

    Attributes:
        left_px: (N, 2) float64 corners.
        right_px: (N, 2) float64 corners in the same order.
    """

    left_px: Vector
    right_px: Vector


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BundleState:
    """Everything that is estimated.

    Attributes:
        left: (9,) float64: fx fy cx cy k1 k2 p1 p2 k3.
        right: (9,) the same.
        rotation: (3,) rotation vector, right from left.
        translation_m: (3,) right from left, m.
        poses: (V, 6) rotation vector and translation, m, of each board in the left camera's axes.
    """

    left: Vector
    right: Vector
    rotation: Vector
    translation_m: Vector
    poses: Vector


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BundleResult:
    """The optimum and its uncertainty.

    Attributes:
        state: the optimum.
        left_errors_px: (V, N, 2) measured minus projected.
        right_errors_px: (V, N, 2), the same.
        baseline_sigma_m: standard deviation of the baseline that the corners' noise leaves, m.
        covariance: (24, 24) of the rig's parameters, in the order of `globals_of`; 0 for those that are not estimated.
    """

    state: BundleState
    left_errors_px: Vector
    right_errors_px: Vector
    baseline_sigma_m: float = field(default=float("nan"))
    covariance: Vector = field(default_factory=lambda: np.full((_GLOBALS, _GLOBALS), np.nan))

    def rms_px(self) -> float:
        """Return the root mean square distance of all corners of both cameras, px (counted like OpenCV's stereoCalibrate)."""
        return rms_px(self.left_errors_px, self.right_errors_px)

    def view_rms_px(self) -> tuple[Vector, Vector]:
        """Return the root mean square distance of each view, (V,) px, left and right."""
        left, right = ((errors**2).sum(axis=2).mean(axis=1) for errors in (self.left_errors_px, self.right_errors_px))
        return np.sqrt(left), np.sqrt(right)


def rms_px(*errors: Vector) -> float:
    """Return the root mean square length of (..., 2) errors, px."""
    stacked = np.concatenate([e.reshape(-1, 2) for e in errors])
    return float(np.sqrt((stacked**2).sum(axis=1).mean()))


def adjust(
    views: list[BundleView],
    points_m: Vector,
    start: BundleState,
    free_camera: NDArray[np.bool_],
    sizes_px: tuple[tuple[int, int], tuple[int, int]],
) -> BundleResult:
    """Find the rig that best explains the corners.

    Args:
        views: the pairs, V >= 1.
        points_m: (N, 3) corners in the board's axes.
        start: a state close enough: each camera calibrated alone, the relative pose of any one view.
        free_camera: (9,) which camera parameters are estimated; the others keep their start values.
        sizes_px: width and height of the left and the right images.

    Returns:
        The optimum.
    """
    free = np.concatenate([free_camera, free_camera, np.ones(6, dtype=bool)])
    expected, information = _prior(sizes_px)
    state = start
    for _ in range(_PASSES):
        sigma_px = _sigma_px(_errors(views, points_m, state))
        problem = _Problem(views, points_m, (expected, information * sigma_px**2), _HUBER_SIGMAS * sigma_px)
        state = _minimise(problem, state, free)
    errors = _errors(views, points_m, state)
    sigma_px = _sigma_px(errors)
    problem = _Problem(views, points_m, (expected, information * sigma_px**2), _HUBER_SIGMAS * sigma_px)
    covariance = np.zeros((_GLOBALS, _GLOBALS))
    reduced = problem.normal_equations(state).reduced(0.0, free)[0]
    covariance[np.ix_(free, free)] = np.linalg.pinv(reduced) * sigma_px**2
    direction = np.zeros(_GLOBALS)
    direction[_RIG.stop - 3 :] = state.translation_m / np.linalg.norm(state.translation_m)
    variance = float(direction @ covariance @ direction)
    return BundleResult(
        state=state,
        left_errors_px=errors[0],
        right_errors_px=errors[1],
        baseline_sigma_m=float(np.sqrt(max(variance, 0.0))),
        covariance=covariance,
    )


def project_view(state: BundleState, pose: Vector, points_m: Vector) -> tuple[Vector, Vector]:
    """Project a board into both cameras, (N, 2) px each.

    Args:
        state: the rig (its poses are ignored).
        pose: (6,) rotation vector and translation of the board, m.
        points_m: (N, 3) corners in the board's axes.
    """
    turned = cv2.composeRT(pose[:3], pose[3:], state.rotation, state.translation_m)
    left = cv2.projectPoints(points_m, pose[:3], pose[3:], *camera_arrays(state.left))[0]
    right = cv2.projectPoints(points_m, turned[0], turned[1], *camera_arrays(state.right))[0]
    return np.asarray(left, np.float64).reshape(-1, 2), np.asarray(right, np.float64).reshape(-1, 2)


def camera_arrays(parameters: Vector) -> tuple[Vector, Vector]:
    """Return the (3, 3) camera matrix and the (5,) distortion made of nine parameters."""
    fx, fy, cx, cy = parameters[:4]
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]), parameters[4:].copy()


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _System:
    """Normal equations in blocks: G for the globals, P_v for each pose, C_v between them; gradients g and p_v."""

    G: Vector
    C: Vector
    P: Vector
    g: Vector
    p: Vector

    def reduced(self, damping: float, free: NDArray[np.bool_]) -> tuple[Vector, Vector, Vector]:
        """Eliminate the poses; return matrix and right side for the free globals, and the inverse pose blocks."""
        poses = self.P + damping * _diagonals(self.P)
        inverse = np.linalg.inv(poses)
        coupled = self.C[:, free] @ inverse
        matrix = self.G[np.ix_(free, free)] - np.einsum("vij,vkj->ik", coupled, self.C[:, free])
        matrix = matrix + damping * np.diag(np.diag(self.G)[free])
        right = self.g[free] - np.einsum("vij,vj->i", coupled, self.p)
        return np.asarray(matrix, np.float64), np.asarray(right, np.float64), np.asarray(inverse, np.float64)

    def step(self, damping: float, free: NDArray[np.bool_]) -> tuple[Vector, Vector]:
        """Return the damped step: globals (24,), poses (V, 6)."""
        matrix, right, inverse = self.reduced(damping, free)
        step = np.zeros(_GLOBALS)
        step[free] = np.linalg.solve(matrix, right)
        poses = np.einsum("vij,vj->vi", inverse, self.p - np.einsum("vij,i->vj", self.C, step))
        return step, poses


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """What stays fixed during a minimisation. The prior is (expected globals, weight relative to squared pixels)."""

    views: list[BundleView]
    points_m: Vector
    prior: tuple[Vector, Vector]
    threshold_px: float

    def cost(self, state: BundleState) -> float:
        """Return Huber's cost of all corners plus the prior's; infinite if the state gives non-finite projections."""
        errors = _errors(self.views, self.points_m, state)
        lengths = np.concatenate([np.linalg.norm(e.reshape(-1, 2), axis=1) for e in errors])
        if not np.isfinite(lengths).all():
            return float("inf")
        inside = np.minimum(lengths, self.threshold_px)
        off = self.prior[0] - globals_of(state)
        return float((inside * (2 * lengths - inside)).sum() + (self.prior[1] * off**2).sum())

    def normal_equations(self, state: BundleState) -> "_System":
        """Linearise at a state."""
        count = len(self.views)
        matrix, gradient = np.diag(self.prior[1]), self.prior[1] * (self.prior[0] - globals_of(state))
        coupling, poses, pose_gradient = np.zeros((count, _GLOBALS, 6)), np.zeros((count, 6, 6)), np.zeros((count, 6))
        for index, view in enumerate(self.views):
            errors, by_globals, by_pose = _linearised(view, self.points_m, state, state.poses[index])
            weights = np.repeat(_huber_weights(errors, self.threshold_px), 2)[:, np.newaxis]
            flat = errors.reshape(-1)
            matrix = matrix + by_globals.T @ (weights * by_globals)
            gradient = gradient + (weights * by_globals).T @ flat
            coupling[index] = by_globals.T @ (weights * by_pose)
            poses[index] = by_pose.T @ (weights * by_pose)
            pose_gradient[index] = (weights * by_pose).T @ flat
        return _System(G=matrix, C=coupling, P=poses, g=gradient, p=pose_gradient)


def _minimise(problem: _Problem, state: BundleState, free: NDArray[np.bool_]) -> BundleState:
    """Run Levenberg-Marquardt until the cost stops falling."""
    damping, cost, system = _DAMPING_START, problem.cost(state), problem.normal_equations(state)
    for _ in range(_MAX_STEPS):
        try:
            tried = _moved(state, *system.step(damping, free))
            tried_cost = problem.cost(tried)
        except (np.linalg.LinAlgError, cv2.error):  # the step led to invalid numbers
            tried, tried_cost = state, np.inf
        if tried_cost < cost:
            gain, state, cost = (cost - tried_cost) / cost, tried, tried_cost
            damping = max(damping / 5, _DAMPING_LEAST)
            if gain < _CONVERGED:
                break
            system = problem.normal_equations(state)
        else:
            damping *= 10
            if damping > _DAMPING_MOST:
                break
    return state


def _linearised(view: BundleView, points_m: Vector, state: BundleState, pose: Vector) -> tuple[Vector, Vector, Vector]:
    """Return errors (2N, 2) of both cameras, and the derivatives of the projections (4N,) by the globals (24) and by the pose (6)."""
    rotation, translation, *parts = cv2.composeRT(pose[:3], pose[3:], state.rotation, state.translation_m)
    left, by_left = cv2.projectPoints(points_m, pose[:3], pose[3:], *camera_arrays(state.left))
    right, by_right = cv2.projectPoints(points_m, rotation, translation, *camera_arrays(state.right))
    # composeRT gives, in this order: d rotation by (r1 t1 r2 t2), then d translation by the same.
    chain = np.vstack([np.hstack(parts[:4]), np.hstack(parts[4:])])
    half = 2 * len(points_m)
    by_globals, by_pose = np.zeros((2 * half, _GLOBALS)), np.zeros((2 * half, 6))
    by_pose[:half] = by_left[:, :6]
    by_globals[:half, :CAMERA_PARAMETERS] = by_left[:, 6:]
    through = by_right[:, :6] @ chain
    by_pose[half:] = through[:, :6]
    by_globals[half:, _RIG] = through[:, 6:]
    by_globals[half:, CAMERA_PARAMETERS : 2 * CAMERA_PARAMETERS] = by_right[:, 6:]
    projected = np.concatenate([np.asarray(left).reshape(-1, 2), np.asarray(right).reshape(-1, 2)])
    return np.concatenate([view.left_px, view.right_px]) - projected, by_globals, by_pose


def _errors(views: list[BundleView], points_m: Vector, state: BundleState) -> tuple[Vector, Vector]:
    projected = [project_view(state, pose, points_m) for pose in state.poses]
    left = np.array([view.left_px - seen[0] for view, seen in zip(views, projected, strict=True)])
    right = np.array([view.right_px - seen[1] for view, seen in zip(views, projected, strict=True)])
    return left, right


def _huber_weights(errors: Vector, threshold_px: float) -> Vector:
    lengths = np.linalg.norm(errors, axis=1)
    return np.asarray(threshold_px / np.maximum(lengths, threshold_px), dtype=np.float64)


def _sigma_px(errors: tuple[Vector, Vector]) -> float:
    """Return the robust standard deviation of one coordinate, px."""
    values = np.abs(np.concatenate([e.reshape(-1) for e in errors]))
    return max(float(np.median(values)) * _MEDIAN_TO_SIGMA, _LEAST_SIGMA_PX)


def _prior(sizes_px: tuple[tuple[int, int], tuple[int, int]]) -> tuple[Vector, Vector]:
    """Return the expected globals and their weights: 1 / standard deviation squared."""
    expected, weight = np.zeros(_GLOBALS), np.zeros(_GLOBALS)
    for side, (width, height) in enumerate(sizes_px):
        at = side * CAMERA_PARAMETERS + 2
        expected[at : at + 2] = (width - 1) / 2, (height - 1) / 2
        weight[at : at + 2] = (_PRINCIPAL_POINT_SHARE * width) ** -2
    return expected, weight


def globals_of(state: BundleState) -> Vector:
    """Return the 24 parameters of a rig: left camera, right camera, rotation, translation."""
    return np.concatenate([state.left, state.right, state.rotation, state.translation_m])


def _moved(state: BundleState, step: Vector, poses: Vector) -> BundleState:
    n = CAMERA_PARAMETERS
    return replace(
        state,
        left=state.left + step[:n],
        right=state.right + step[n : 2 * n],
        rotation=state.rotation + step[2 * n : 2 * n + 3],
        translation_m=state.translation_m + step[2 * n + 3 :],
        poses=state.poses + poses,
    )


def _diagonals(blocks: Vector) -> Vector:
    """Return (V, 6, 6) blocks with everything except their diagonals set to 0."""
    return np.asarray(blocks * np.eye(blocks.shape[1]), dtype=np.float64)
