"""The axis about which a thing turns before cameras that stand still, and angles about it. Pure.

In the thing's own axes, those of the camera at the first view, the cameras go around it on a circle: one direction and one point for all views,
and an angle for each.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3, rotations_of, vectors_of

Floats = NDArray[np.float64]

_LEAST_TURN: Final = 0.03
"""rad between two views that tell an axis: with less, the noise of the poses is as large as the motion."""

_ROUNDS: Final = 20
_ROBUST: Final = 2.0
"""Times the usual error; motions that are farther off count less."""

_LEAST_SPREAD: Final = 1e-6
"""rad and m: errors below it are rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class TurnAxis:
    """A line about which a thing turns.

    Attributes:
        direction: (3,) of length 1, so that the angles grow.
        point_m: (3,) on it.
    """

    direction: Floats
    point_m: Floats

    def camera_world(self, angle: float) -> SE3:
        """Return what takes the thing's points to the camera when it has turned by an angle, rad."""
        turn = rotations_of(angle * self.direction)
        return SE3(turn, self.point_m - turn @ self.point_m)

    def angle_of(self, camera_world: SE3) -> float:
        """Return the angle, -pi to pi, whose turn is nearest to that of a pose."""
        a, r = self.direction, camera_world.R
        along = a @ r @ a
        across = a @ np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
        return float(np.arctan2(across, np.trace(r) - along))

    def nearest_to(self, middle_m: Floats) -> "TurnAxis":
        """Return the same axis, with the point that is nearest to another one."""
        return TurnAxis(self.direction, self.point_m + (middle_m - self.point_m) @ self.direction * self.direction)


def axis_of(motions: Sequence[SE3]) -> TurnAxis | None:
    """Find the axis that motions of a thing have in common; those that contradict the others count little.

    Args:
        motions: each takes the thing from one view to a later one, in the camera's axes.

    Returns:
        The axis, its point as near to the origin as it gets; None: nothing turns far enough to tell one.
    """
    vectors = np.array([vectors_of(motion.R) for motion in motions]).reshape(-1, 3)
    shifts = np.array([motion.t_m for motion in motions]).reshape(-1, 3)
    turns = np.array([motion.R for motion in motions]).reshape(-1, 3, 3)
    angles = np.linalg.norm(vectors, axis=1)
    far = angles >= _LEAST_TURN
    if not far.any():
        return None
    vectors, shifts, turns, angles = vectors[far], shifts[far], turns[far], angles[far]
    weights = np.ones(len(angles))
    direction, point = np.zeros(3), np.zeros(3)
    for _ in range(_ROUNDS):
        _, directions = np.linalg.eigh((vectors * weights[:, np.newaxis]).T @ vectors)
        direction = directions[:, 2]
        if np.median(vectors @ direction) < 0:
            direction = -direction
        # Turned about (direction, point) the point stays: (1 - R) point = shift. Nothing is told along the axis: the point lies across it.
        across = directions[:, :2]
        rows = ((np.eye(3) - turns) @ across) * weights[:, np.newaxis, np.newaxis]
        point = across @ np.linalg.lstsq(rows.reshape(-1, 2), (shifts * weights[:, np.newaxis]).ravel(), rcond=None)[0]
        off = np.linalg.norm(vectors - (vectors @ direction)[:, np.newaxis] * direction, axis=1) + np.linalg.norm(
            shifts - (np.eye(3) - turns) @ point, axis=1
        ) / max(float(np.linalg.norm(point)), _LEAST_SPREAD)
        spread = max(float(np.median(off)), _LEAST_SPREAD)
        weights = np.minimum(1.0, _ROBUST * spread / np.maximum(off, _LEAST_SPREAD)) ** 2
    return TurnAxis(direction, point)


def unwrapped(angles: Sequence[float]) -> Floats:
    """Return angles, rad, in order, each within half a turn of the one before."""
    return np.asarray(np.unwrap(np.array(angles, np.float64)), np.float64)
