"""A rig in which every pair may deviate from the others, in each way that a mistake makes it: the loosened rig. Pure.

First one stiff rig is fitted to all pairs. Then each pair gets twelve deviations of its own: the right camera turned, the
board moved between the two exposures, the focal length of either camera, and rows displaced in proportion to their number
(a rolling shutter before something that moves). How much they would lower the squares, and which way, is known to second
order at the stiff optimum, with lenses and board poses eliminated. So any rule about them ("turned a little more with each
pair") is weighed in closed form:

    squares(rule) = squares(stiff) - g^T A (A^T L A)^-1 A^T g

with g the gradient of the deviations, L their information, and A the rule (Gauss-Newton; the rule's numbers are small).
"""

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.failure_modes.lone import LENS
from phone_host.calibration.solve.bundle_problem import Vector
from phone_host.calibration.target.pairs import BoardPair
from phone_host.geometry.schur import NormalEquations, eliminated, minimise

TURN, MOVE, FOCUS_LEFT, FOCUS_RIGHT, ROWS_LEFT, ROWS_RIGHT = (
    slice(0, 3),
    slice(3, 6),
    slice(6, 7),
    slice(7, 8),
    slice(8, 10),
    slice(10, 12),
)
"""Places of a pair's deviations: the right camera's turn (rad, in its axes), the board's shift before the right camera
(m, in the left one's axes), the logarithms of the focal lengths' factors, and the rows' displacement from the first to the last, px."""

DEVIATIONS: Final = 12
_LENSES: Final = 2 * LENS
_POSE: Final = slice(_LENSES, _LENSES + 6)
_OWN: Final = slice(_LENSES + 6, _LENSES + 6 + DEVIATIONS)
_SHARED: Final = np.concatenate([np.arange(_LENSES), np.arange(_OWN.start, _OWN.start + 6)])
"""Places of a pair's parameters: lenses, pose, deviations; and of those that all pairs of a stiff rig share."""

_PRIOR: Final = np.array([0.03] * 3 + [0.03] * 3 + [0.05] * 2 + [10.0] * 4)
"""Mistakes are no larger: 2 degrees, 30 mm, 5 %, 10 px. It keeps what the views do not tell apart finite."""

_PRINCIPAL_POINT_SHARE: Final = 0.1
_ROUNDS: Final = 2
"""The noise that the prior is weighed by is known after the first."""

_CONVERGED: Final = 1e-5
_LEAST_SIGMA_PX: Final = 0.02


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Stiff:
    """A stiff rig.

    Attributes:
        left: (9,) the left lens.
        right: (9,) the right one.
        rotation: (3,) rotation vector, right from left.
        translation_m: (3,) right from left, m.
        poses: (V, 6) of the boards in the left camera's axes.
    """

    left: Vector
    right: Vector
    rotation: Vector
    translation_m: Vector
    poses: Vector


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Loosened:
    """One stiff rig, and what the pairs' deviations from it would change.

    Attributes:
        count: V, how many pairs there are.
        gradient: (12 V,) of the deviations, in the order above, pair by pair; px^2 per unit.
        information: (12 V, 12 V), px^2 per unit^2: lenses and poses are eliminated.
        squares_px2: the sum of squared residuals of the stiff rig, x and y of all corners.
        numbers: how many coordinates went into it.
        state: the stiff rig: lenses, poses, rotation and translation.
    """

    count: int
    gradient: Vector
    information: Vector
    squares_px2: float
    numbers: int
    state: Stiff


def loosen(
    pairs: list[BoardPair],
    points_m: Vector,
    start: Stiff,
    free_camera: NDArray[np.bool_],
    *,
    sizes_px: tuple[tuple[int, int], ...],
    given: Vector | None = None,
) -> Loosened:
    """Fit one stiff rig to all pairs, and find what each pair's deviations would change.

    Args:
        pairs: the corners, V pairs.
        points_m: (N, 3) corners in the board's axes.
        start: lenses, poses and a rig near enough.
        free_camera: (9,) which parameters of a lens are estimated.
        sizes_px: width and height of the left and of the right images.
        given: (V, 12) deviations that the pairs are known to have; None: they have none. What is found comes on top.

    Raises:
        numpy.linalg.LinAlgError: the views leave something undetermined.
    """
    free = np.concatenate([free_camera, free_camera])
    own = np.zeros((len(pairs), DEVIATIONS)) if given is None else given
    views = _Views(pairs, own, points_m, np.array([size[1] for size in sizes_px], float))
    found = views.at(start)
    for _ in range(_ROUNDS):
        problem = _Problem(views, _lens_prior(sizes_px), found.noise_px2)
        found = minimise(problem, found, np.concatenate([free, np.ones(6, bool)]), _CONVERGED)
    return _loosened(found, np.flatnonzero(free), _lens_prior(sizes_px))


@dataclass(frozen=True, slots=True, eq=False)
class _Views:
    """What was seen; `given` are the deviations (V, 12) that the pairs are known to have."""

    pairs: list[BoardPair]
    given: Vector
    points_m: Vector
    heights: Vector

    def at(self, state: Stiff) -> "_Linearised":
        """Linearise at a stiff rig."""
        both = [
            _linearised(pair, self.points_m, state, np.concatenate([pose, given]), self.heights)
            for pair, pose, given in zip(self.pairs, state.poses, self.given, strict=True)
        ]
        return _Linearised(
            state=state,
            matrices=np.array([jacobian.T @ jacobian for _, jacobian in both]),
            right=np.array([jacobian.T @ error for error, jacobian in both]),
            squares_px2=float(sum(error @ error for error, _ in both)),
            numbers=sum(int(np.isfinite(view).sum()) for pair in self.pairs for view in (pair.left_px, pair.right_px)),
        )


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Linearised:
    """A stiff rig and the normal equations of each pair there, (V, 36, 36) and (V, 36): of lenses (18), pose (6), deviations (12)."""

    state: Stiff
    matrices: Vector
    right: Vector
    squares_px2: float
    numbers: int

    @property
    def lenses(self) -> Vector:
        """Both lenses, (18,)."""
        return np.concatenate([self.state.left, self.state.right])

    @property
    def noise_px2(self) -> float:
        """Variance of a coordinate, within what is sensible."""
        return min(max(self.squares_px2 / self.numbers, _LEAST_SIGMA_PX**2), 1.0)

    def parts(self, shared: NDArray[np.intp]) -> tuple[Vector, Vector, Vector, Vector, Vector]:
        """Return matrices and right sides of some parameters, their coupling with the poses, the poses' matrices and right sides."""
        of_shared = self.matrices[:, shared]
        return (
            of_shared[:, :, shared],
            self.right[:, shared],
            of_shared[:, :, _POSE],
            self.matrices[:, _POSE, _POSE],
            self.right[:, _POSE],
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """The stiff rig, see `geometry.schur.Problem`: shared are both lenses and one turn and move, alike for all pairs.

    Attributes:
        views: what was seen.
        prior: expected lenses and their weights.
        noise_px2: by which the prior is weighed against squares, px^2.
    """

    views: _Views
    prior: tuple[Vector, Vector]
    noise_px2: float

    def cost(self, state: _Linearised) -> float:
        """Return the squares and the prior's."""
        expected, weight = self.prior
        cost = state.squares_px2 + self.noise_px2 * float(weight @ (expected - state.lenses) ** 2)
        return cost if np.isfinite(cost) else float("inf")

    def linearised(self, state: _Linearised) -> NormalEquations:
        """Return the normal equations at a state."""
        matrices, right, coupling, blocks, blocks_right = state.parts(_SHARED)
        expected, weight = self.prior
        known = self.noise_px2 * np.concatenate([weight, np.zeros(6)])
        off = np.concatenate([expected - state.lenses, np.zeros(6)])
        return NormalEquations(
            shared=matrices.sum(axis=0) + np.diag(known),
            coupling=coupling,
            blocks=blocks,
            shared_right=right.sum(axis=0) + known * off,
            blocks_right=blocks_right,
        )

    def moved(self, state: _Linearised, shared: Vector, blocks: Vector) -> _Linearised:
        """Return a state after a step."""
        before = state.state
        at = _right_pose(np.zeros(6), shared[_LENSES:], before)
        after = Stiff(
            left=before.left + shared[:LENS],
            right=before.right + shared[LENS:_LENSES],
            rotation=at[:3],
            translation_m=at[3:],
            poses=before.poses + blocks,
        )
        return self.views.at(after)


def _loosened(found: _Linearised, free: NDArray[np.intp], prior: tuple[Vector, Vector]) -> Loosened:
    """Let each pair deviate on its own; eliminate the poses and the lenses that are free."""
    own, right, coupling, blocks, blocks_right = found.parts(np.concatenate([free, np.arange(_OWN.start, _OWN.stop)]))
    taken, taken_right, _ = eliminated(coupling, blocks, blocks_right)
    own, right, lenses, count = own - taken, right - taken_right, len(free), len(own)
    expected, weight = prior
    known = found.noise_px2 * weight
    of_lenses = own[:, :lenses, :lenses].sum(axis=0) + np.diag(known[free])
    lenses_right = right[:, :lenses].sum(axis=0) + (known * (expected - found.lenses))[free]
    across = own[:, lenses:, :lenses].reshape(-1, lenses)
    through = np.linalg.solve(of_lenses, across.T).T
    information = np.zeros((count, DEVIATIONS, count, DEVIATIONS))
    each = np.arange(count)
    information[each, :, each] = own[:, lenses:, lenses:] + found.noise_px2 * np.diag(_PRIOR**-2.0)
    return Loosened(
        count=count,
        gradient=np.asarray(right[:, lenses:].ravel() - through @ lenses_right, np.float64),
        information=np.asarray(information.reshape(len(across), -1) - through @ across.T, np.float64),
        squares_px2=found.squares_px2,
        numbers=found.numbers,
        state=found.state,
    )


def camera_arrays(lens: Vector) -> tuple[Vector, Vector]:
    """Return a lens as OpenCV's camera matrix (3, 3) and distortion (5,)."""
    return np.array([[lens[0], 0.0, lens[2]], [0.0, lens[1], lens[3]], [0.0, 0.0, 1.0]]), lens[4:]


def _linearised(
    pair: BoardPair, points_m: Vector, state: Stiff, own_values: Vector, heights: Vector
) -> tuple[Vector, Vector]:
    """Return errors (4 N,) of both views, and their projections' derivatives (4 N, 36), for a pair's pose and deviations (18,)."""
    pose, given = own_values[:6], own_values[6:]
    half = 2 * len(points_m)
    jacobian = np.zeros((2 * half, _OWN.stop))
    left, by_left = cv2.projectPoints(points_m, pose[:3], pose[3:], *camera_arrays(state.left))
    left_px = np.asarray(left, np.float64).reshape(-1, 2)
    jacobian[:half, :LENS], jacobian[:half, _POSE] = by_left[:, 6:], by_left[:, :6]
    at = _right_pose(pose, given, state)
    right, by_right = cv2.projectPoints(points_m, at[:3], at[3:], *camera_arrays(state.right))
    right_px = np.asarray(right, np.float64).reshape(-1, 2)
    jacobian[half:, LENS:_LENSES] = by_right[:, 6:]
    through = by_right[:, :6] @ _chain(pose, given, state)
    jacobian[half:, _POSE] = through[:, :6]
    own = jacobian[:, _OWN]
    own[half:, :6] = through[:, 6:]
    errors = []
    for rows, seen, lens, height, focus, displaced, measured in (
        (slice(0, half), left_px, state.left, heights[0], FOCUS_LEFT, ROWS_LEFT, pair.left_px),
        (slice(half, None), right_px, state.right, heights[1], FOCUS_RIGHT, ROWS_RIGHT, pair.right_px),
    ):
        from_middle = seen - lens[2:4]
        factor = float(np.exp(given[focus][0]))
        shares = from_middle[:, 1:] / height
        own[rows, focus] = (factor * from_middle).reshape(-1, 1)
        of_rows = own[rows, displaced]
        of_rows[::2, 0] = of_rows[1::2, 1] = shares[:, 0]
        # What moves a corner is scaled with it; that a scaled corner lies in another row is of second order.
        jacobian[rows, : _OWN.start] *= factor
        own[rows, :6] *= factor
        errors.append((measured - lens[2:4] - factor * from_middle - shares * given[displaced]).ravel())
    for half_rows, at_column in ((slice(0, half), 2), (slice(half, None), LENS + 2)):
        of_middle = jacobian[half_rows, at_column : at_column + 2]
        of_middle[:] = 0.0
        of_middle[::2, 0] = of_middle[1::2, 1] = 1.0
    together = np.concatenate(errors)
    unseen = np.isnan(together)  # it says nothing about anything
    jacobian[unseen], together[unseen] = 0.0, 0.0
    return together, jacobian


def _right_pose(pose: Vector, deviation: Vector, state: Stiff) -> Vector:
    """Return the board's pose (6,) in the right camera's axes: moved, then seen by the turned right camera."""
    moved = pose[3:] + deviation[MOVE]
    rotation, translation = cv2.composeRT(pose[:3], moved, state.rotation, state.translation_m)[:2]
    rotation, translation = cv2.composeRT(rotation, translation, deviation[TURN], np.zeros(3))[:2]
    return np.concatenate([np.ravel(rotation), np.ravel(translation)]).astype(np.float64)


def _chain(pose: Vector, given: Vector, state: Stiff) -> Vector:
    """Return (6, 12) derivatives of the right pose by the left one and by turn and move."""
    seen = cv2.composeRT(pose[:3], pose[3:] + given[MOVE], state.rotation, state.translation_m)
    turned = cv2.composeRT(seen[0], seen[1], given[TURN], np.zeros(3))
    # composeRT gives, in this order: d rotation by (r1 t1 r2 t2), then d translation by the same.
    by_left = np.vstack([np.hstack(seen[2:4]), np.hstack(seen[6:8])])
    by_seen = np.vstack([np.hstack(turned[2:4]), np.hstack(turned[6:8])])
    by_turn = np.vstack([turned[4], turned[8]])
    through = by_seen @ by_left
    return np.asarray(np.hstack([through, by_turn, through[:, 3:]]), np.float64)


def _lens_prior(sizes_px: tuple[tuple[int, int], ...]) -> tuple[Vector, Vector]:
    """Return the expected lenses and their weights: only the principal points, as in the bundle adjustment."""
    expected, weight = np.zeros(_LENSES), np.zeros(_LENSES)
    for side, (width, height) in enumerate(sizes_px):
        at = side * LENS + 2
        expected[at : at + 2] = (width - 1) / 2, (height - 1) / 2
        weight[at : at + 2] = (_PRINCIPAL_POINT_SHARE * width) ** -2.0
    return expected, weight
