"""Rotations and rigid motions, SO(3) and SE(3). Pure.

`T_a_b` takes b-coordinates to a. Rotation vectors point along the axis; their length is the angle, rad. Small motions
act from the left: they move T_a_b in the axes of a.

Source: T. D. Barfoot, "State Estimation for Robotics", 2017, chapter 7.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_SMALL: Final = 1e-6
"""Angles, rad, below which series replace quotients of two small numbers; the next term is 1e-13 of the result."""

_NEAR_HALF_TURN: Final = -0.99
"""Cosine below which the axis is taken from R + R^T; the antisymmetric part vanishes there."""


def cross_matrices(vectors: Floats) -> Floats:
    """Return the matrices that take p to v x p.

    Args:
        vectors: (..., 3).

    Returns:
        (..., 3, 3).
    """
    result = np.zeros((*vectors.shape, 3))
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    result[..., 2, 1], result[..., 0, 2], result[..., 1, 0] = x, y, z
    result[..., 1, 2], result[..., 2, 0], result[..., 0, 1] = -x, -y, -z
    return result


def rotations_of(vectors: Floats) -> Floats:
    """Return the rotation matrices of rotation vectors (Rodrigues' formula).

    Args:
        vectors: (..., 3), rad.

    Returns:
        (..., 3, 3).
    """
    if vectors.shape == (3,):
        return _rotation_of(*vectors.tolist())
    angles = np.sqrt((vectors * vectors).sum(axis=-1))[..., np.newaxis, np.newaxis]
    safe = np.maximum(angles, _SMALL)
    # Below _SMALL the two quotients differ from their limits 1 and 1/2 by less than the last digit.
    across = cross_matrices(vectors)
    first, second = np.sin(safe) / safe, 0.5 * (np.sin(safe / 2) / (safe / 2)) ** 2
    return np.asarray(np.eye(3) + first * across + second * (across @ across), np.float64)


def _rotation_of(x: float, y: float, z: float) -> Floats:
    """Return the rotation matrix of one rotation vector, ten times as fast as many at once would be."""
    angle = max(math.sqrt(x * x + y * y + z * z), _SMALL)
    first, second = math.sin(angle) / angle, 0.5 * (math.sin(angle / 2) / (angle / 2)) ** 2
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, second * x * y, second * x * z, second * y * z
    return np.array(
        [
            [1 - second * (yy + zz), xy - first * z, xz + first * y],
            [xy + first * z, 1 - second * (xx + zz), yz - first * x],
            [xz - first * y, yz + first * x, 1 - second * (xx + yy)],
        ]
    )


def vectors_of(rotations: Floats) -> Floats:
    """Return the rotation vectors of rotation matrices, the inverse of `rotations_of` for angles up to half a turn.

    Args:
        rotations: (..., 3, 3).

    Returns:
        (..., 3), rad.
    """
    r = rotations
    turn = np.stack([r[..., 2, 1] - r[..., 1, 2], r[..., 0, 2] - r[..., 2, 0], r[..., 1, 0] - r[..., 0, 1]], axis=-1)
    sine, cosine = np.linalg.norm(turn, axis=-1) / 2, (np.trace(r, axis1=-2, axis2=-1) - 1) / 2
    angle = np.arctan2(sine, cosine)
    share = np.where(angle < _SMALL, 0.5, angle / np.maximum(2 * sine, _SMALL))
    vectors = np.asarray(turn * share[..., np.newaxis], np.float64)
    if not (cosine < _NEAR_HALF_TURN).any():
        return vectors
    # (R + R^T) / 2 = cos I + (1 - cos) a a^T: the column of the largest component gives the axis up to its sign.
    for at in zip(*np.nonzero(np.atleast_1d(cosine < _NEAR_HALF_TURN)), strict=True):
        index = at if cosine.ndim else ()
        outer = (r[index] + r[index].T) / 2 - cosine[index] * np.eye(3)
        column = outer[:, int(np.argmax(np.diag(outer)))]
        axis = column / np.linalg.norm(column)
        vectors[index] = axis * (angle[index] if turn[index] @ axis >= 0 else -angle[index])
    return vectors


@dataclass(frozen=True, slots=True, eq=False)
class SE3:
    """A rigid motion: p goes to R p + t_m.

    Attributes:
        R: (3, 3) float64 rotation.
        t_m: (3,) float64 translation, m.
    """

    R: Floats
    t_m: Floats

    @staticmethod
    def identity() -> "SE3":
        """Return the motion that moves nothing."""
        return SE3(np.eye(3), np.zeros(3))

    @staticmethod
    def of(pose: Floats) -> "SE3":
        """Return the motion of a (6,) pose: rotation vector, rad, and translation, m."""
        return SE3(rotations_of(pose[:3]), np.asarray(pose[3:], np.float64))

    def pose(self) -> Floats:
        """Return the (6,) rotation vector, rad, and translation, m: the inverse of `of`."""
        return np.concatenate([vectors_of(self.R), self.t_m])

    def __matmul__(self, other: "SE3") -> "SE3":
        return SE3(self.R @ other.R, self.R @ other.t_m + self.t_m)

    def inverse(self) -> "SE3":
        """Return the motion back."""
        return SE3(self.R.T, -self.R.T @ self.t_m)

    def exact(self) -> "SE3":
        """Return the motion with an exact rotation: products of many drift away from one."""
        return SE3(rotations_of(vectors_of(self.R)), self.t_m)

    def apply(self, points_m: Floats) -> Floats:
        """Return moved points, (..., 3), m."""
        return np.asarray(points_m @ self.R.T + self.t_m, np.float64)
