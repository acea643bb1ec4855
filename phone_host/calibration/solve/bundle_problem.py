"""The least-squares problem of a rig: what is estimated, how freely a lens may bend, how it predicts the corners, and the derivatives. Pure.

Shared parameters: the thirty of a rig (`geometry.lens`). Blocks: one board pose each, moved by a small turn about the left
camera's axes and a translation.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.target.pairs import BoardPair
from phone_host.geometry.lens import (
    LEFT,
    PARAMETERS,
    RIG,
    RIGHT,
    parameters_of,
    project,
    project_linearised,
    with_parameters,
)
from phone_host.geometry.schur import NormalEquations, eliminated
from phone_host.geometry.se3 import cross_matrices, rotations_of, vectors_of
from phone_host.model import RIG_PARAMETERS, CameraModel, Lens


class Bend(Enum):
    """Which coefficients are estimated, the simplest first.

    Attributes:
        USUAL: k1 k2 p1 p2, as the lenses of webcams and phones need.
        WIDE: k3 as well. Without it, a wide lens's views of the image's corners look like wrong corners.
        RATIONAL: k4 k5 k6 as well.
        FISHEYE: k1 k2 k3 k4 of the angle.
    """

    USUAL = "usual"
    WIDE = "wide"
    RATIONAL = "rational"
    FISHEYE = "fisheye"

    @property
    def lens(self) -> Lens:
        """The formula that these coefficients belong to."""
        return {Bend.RATIONAL: Lens.RATIONAL, Bend.FISHEYE: Lens.FISHEYE}.get(self, Lens.PINHOLE)

    @property
    def terms(self) -> int:
        """The number of coefficients that are estimated."""
        return _TERMS[self]

    def free(self) -> NDArray[np.bool_]:
        """Return (12,) which parameters of the camera are estimated, in the order of `geometry.lens`."""
        return np.arange(PARAMETERS) < 4 + self.terms


_TERMS: Final = {Bend.USUAL: 4, Bend.WIDE: 5, Bend.RATIONAL: 8, Bend.FISHEYE: 4}


Vector = NDArray[np.float64]

GLOBALS: Final = RIG_PARAMETERS

_Side = tuple[NDArray[np.intp], Vector, Vector, Vector]
"""What one side's corners say; see `RigProblem._sides`."""

HUBER_SIGMAS: Final = 2.5
"""Huber's threshold in standard deviations: Gaussian noise loses 1 % of its information."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BundleState:
    """Everything that is estimated.

    Attributes:
        left: the left camera.
        right: the right camera.
        rotation: (3,) rotation vector, right from left.
        translation_m: (3,) right from left, m.
        poses: (V, 6) rotation vector and translation, m, of each board in the left camera's axes.
    """

    left: CameraModel
    right: CameraModel
    rotation: Vector
    translation_m: Vector
    poses: Vector


def left_alone(views: Sequence[Vector]) -> list[BoardPair]:
    """Return corners (N, 2) that one camera saw as pairs whose right camera sees nothing."""
    return [BoardPair("", corners, np.full(corners.shape, np.nan)) for corners in views]


def globals_of(state: BundleState) -> Vector:
    """Return the (30,) shared parameters of a state; the small turn is 0."""
    return np.concatenate([parameters_of(state.left), parameters_of(state.right), np.zeros(3), state.translation_m])


def project_view(state: BundleState, pose: Vector, points_m: Vector) -> tuple[Vector, Vector]:
    """Project a board into both cameras, (N, 2) px each."""
    left = points_m @ rotations_of(pose[:3]).T + pose[3:]
    right = left @ rotations_of(state.rotation).T + state.translation_m
    return project(left, state.left), project(right, state.right)


def errors_of(views: list[BoardPair], points_m: Vector, state: BundleState) -> tuple[Vector, Vector]:
    """Return measured minus projected corners, (V, N, 2) px, left and right; NaN where a corner was not seen."""
    left, right = _points(points_m, state)
    shape = (len(views), len(points_m), 2)
    seen = (np.array([view.left_px for view in views]), np.array([view.right_px for view in views]))
    return (
        seen[0] - project(left.reshape(-1, 3), state.left).reshape(shape),
        seen[1] - project(right.reshape(-1, 3), state.right).reshape(shape),
    )


def moved(state: BundleState, shared: Vector, blocks: Vector) -> BundleState:
    """Return a state after a step.

    Args:
        state: before it.
        shared: (30,) step of the shared parameters.
        blocks: (V, 6) step of the poses.
    """
    poses = state.poses.copy()
    turns = rotations_of(blocks[:, :3]) @ rotations_of(state.poses[:, :3])
    poses[:, :3] = vectors_of(turns)
    poses[:, 3:] += blocks[:, 3:]
    turn = rotations_of(shared[RIG.start : RIG.start + 3]) @ rotations_of(state.rotation)
    return replace(
        state,
        left=with_parameters(state.left, parameters_of(state.left) + shared[LEFT]),
        right=with_parameters(state.right, parameters_of(state.right) + shared[RIGHT]),
        rotation=vectors_of(turn),
        translation_m=state.translation_m + shared[RIG.start + 3 :],
        poses=poses,
    )


def _points(points_m: Vector, state: BundleState) -> tuple[Vector, Vector]:
    """Return the boards' corners in the left and in the right camera's axes, (V, N, 3)."""
    left = points_m @ np.swapaxes(rotations_of(state.poses[:, :3]), 1, 2) + state.poses[:, np.newaxis, 3:]
    return left, left @ rotations_of(state.rotation).T + state.translation_m


@dataclass(frozen=True, eq=False)
class RigProblem:
    """Corners, and what is known besides; see `geometry.schur.Problem`.

    Attributes:
        views: the pairs.
        points_m: (N, 3) corners in the board's axes.
        prior: expected shared parameters (30,) and their weights, 1 / variance.
        sigmas_px: standard deviation of one coordinate of a corner, left and right.
    """

    views: list[BoardPair]
    points_m: Vector
    prior: tuple[Vector, Vector]
    sigmas_px: tuple[float, float]

    @cached_property
    def _sees(self) -> tuple[bool, bool]:
        """Whether a side has seen anything; a camera alone is a rig whose other side sees nothing."""
        return (
            any(np.isfinite(view.left_px).any() for view in self.views),
            any(np.isfinite(view.right_px).any() for view in self.views),
        )

    def count(self, state: BundleState) -> int:
        """Return the number of measured coordinates."""
        return sum(int(np.isfinite(errors).sum()) for errors in errors_of(self.views, self.points_m, state))

    def cost(self, state: BundleState) -> float:
        """Return Huber's cost of all corners plus the prior's; infinite if the state gives non-finite projections."""
        total = 0.0
        both = zip(errors_of(self.views, self.points_m, state), self.sigmas_px, self._measured(), strict=True)
        for errors, sigma_px, measured in both:
            lengths = np.linalg.norm(errors[measured], axis=1) / sigma_px
            if not np.isfinite(lengths).all():
                return float("inf")
            inside = np.minimum(lengths, HUBER_SIGMAS)
            total += float((inside * (2 * lengths - inside)).sum())
        off = self.prior[0] - globals_of(state)
        return total + float((self.prior[1] * off**2).sum())

    def moved(self, state: BundleState, shared: Vector, blocks: Vector) -> BundleState:
        """Return a state after a step."""
        return moved(state, shared, blocks)

    def linearised(self, state: BundleState) -> NormalEquations:
        """Linearise at a state."""
        count = len(self.views)
        shared, right = np.diag(self.prior[1]), self.prior[1] * (self.prior[0] - globals_of(state))
        sides, blocks_right = self._sides(state), np.zeros((count, 6))
        coupling, blocks = _of_poses(sides)
        for at, by_shared, by_pose, errors in sides:
            turned = np.swapaxes(by_shared, 1, 2)
            # View by view: the products stay too small for the linear algebra library to wake its threads.
            shared[np.ix_(at, at)] += (turned @ by_shared).sum(axis=0)
            right[at] += (turned @ errors[..., np.newaxis]).sum(axis=0)[:, 0]
            blocks_right += (np.swapaxes(by_pose, 1, 2) @ errors[..., np.newaxis])[..., 0]
        return NormalEquations(
            shared=shared, coupling=coupling, blocks=blocks, shared_right=right, blocks_right=blocks_right
        )

    def by_view(self, state: BundleState) -> tuple[Vector, Vector]:
        """Return what each view says of the shared parameters, its own pose eliminated.

        Returns:
            (V, 30) how it pulls at them, in all 0 at the optimum (but for the prior); (V, 30, 30) what it knows of them.
        """
        count, sides = len(self.views), self._sides(state)
        pulls, known = np.zeros((count, GLOBALS)), np.zeros((count, GLOBALS, GLOBALS))
        coupling, blocks = _of_poses(sides)
        for at, by_shared, _, errors in sides:
            turned = np.swapaxes(by_shared, 1, 2)
            pulls[:, at] += (turned @ errors[..., np.newaxis])[..., 0]
            known[np.ix_(np.arange(count), at, at)] += turned @ by_shared
        return pulls, known - eliminated(coupling, blocks, np.zeros((count, 6)))[0]

    def scatter(self, state: BundleState, noise_px: tuple[float, float], shift_px: float) -> Vector:
        """Return the covariance (30, 30) of what all views together pull at the shared parameters, poses eliminated.

        Args:
            state: the optimum.
            noise_px: standard deviation of one coordinate of a corner, left and right, each corner on its own.
            shift_px: standard deviation of one coordinate by which all of a view's right corners lie aside together.
        """
        sides, result = self._sides(state), np.zeros((GLOBALS, GLOBALS))
        coupling, blocks = _of_poses(sides)
        back = np.linalg.inv(blocks) @ np.swapaxes(coupling, 1, 2)
        for at, by_shared, by_pose, _ in sides:
            own = -by_pose @ back
            own[:, :, at] += by_shared
            side = int(at[0] == RIGHT.start)
            result += (noise_px[side] / self.sigmas_px[side]) ** 2 * (np.swapaxes(own, 1, 2) @ own).sum(axis=0)
            if side:
                errors = errors_of(self.views, self.points_m, state)[side]
                by_corner = own.reshape(*errors.shape, GLOBALS) * _weights(errors, self.sigmas_px[side])
                together = by_corner.sum(axis=1).reshape(-1, GLOBALS)
                result += shift_px**2 * together.T @ together
        return result

    def _measured(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        left = np.isfinite(np.array([view.left_px for view in self.views])).all(axis=2)
        right = np.isfinite(np.array([view.right_px for view in self.views])).all(axis=2)
        return left, right

    def _sides(self, state: BundleState) -> list[_Side]:
        """Return, for each side that sees anything, what its corners say.

        Each item: which shared parameters it depends on (S,), the weighed derivatives by them (V, 2N, S) and by the poses
        (V, 2N, 6), the weighed errors (V, 2N).
        """
        points = _points(self.points_m, state)
        count, number = len(self.views), len(self.points_m)
        turned = points[0] - state.poses[:, np.newaxis, 3:]
        by_turn = -cross_matrices(turned)  # of the point in the left camera's axes, by a small turn of the board
        relative = rotations_of(state.rotation)
        sides = []
        for side, (model, part) in enumerate(((state.left, LEFT), (state.right, RIGHT))):
            if not self._sees[side]:
                continue
            at, by_point, by_values = project_linearised(points[side].reshape(-1, 3), model)
            per_point = by_point.reshape(count, number, 2, 3)
            by_shared = by_values.reshape(count, number, 2, PARAMETERS)
            index = np.arange(part.start, part.stop)
            if side:
                by_rig = np.concatenate(
                    [per_point @ -cross_matrices(points[1] - state.translation_m), per_point], axis=3
                )
                by_shared = np.concatenate([by_shared, by_rig], axis=3)
                index = np.concatenate([index, np.arange(RIG.start, RIG.stop)])
                per_point = per_point @ relative
            by_pose = np.concatenate([per_point @ by_turn, per_point], axis=3)
            seen = np.array([(view.left_px, view.right_px)[side] for view in self.views])
            errors = seen - at.reshape(count, number, 2)
            weights = _weights(errors, self.sigmas_px[side])
            sides.append(
                (
                    index,
                    (by_shared * weights).reshape(count, 2 * number, -1),
                    (by_pose * weights).reshape(count, 2 * number, 6),
                    (np.nan_to_num(errors, nan=0.0) * weights[..., 0]).reshape(count, 2 * number),
                )
            )
        return sides


def _of_poses(sides: list[_Side]) -> tuple[Vector, Vector]:
    """Return the normal equations' parts of the poses: (V, 30, 6) with the shared parameters, (V, 6, 6) their own."""
    count = len(sides[0][1])
    coupling, blocks = np.zeros((count, GLOBALS, 6)), np.zeros((count, 6, 6))
    for at, by_shared, by_pose, _ in sides:
        coupling[:, at] += np.swapaxes(by_shared, 1, 2) @ by_pose
        blocks += np.swapaxes(by_pose, 1, 2) @ by_pose
    return coupling, blocks


def _weights(errors: Vector, sigma_px: float) -> Vector:
    """Return (V, N, 1, 1) square roots of Huber's weights, 1 / px; 0 where a corner was not seen."""
    lengths = np.linalg.norm(errors, axis=2) / sigma_px
    with np.errstate(invalid="ignore"):
        weights = np.sqrt(HUBER_SIGMAS / np.maximum(lengths, HUBER_SIGMAS)) / sigma_px
    return np.where(np.isfinite(lengths), weights, 0.0)[..., np.newaxis, np.newaxis]
