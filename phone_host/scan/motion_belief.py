"""Where a camera can be in the axes of a field, by odometry since it was last in it. Pure.

Odometry drifts with the way and the turn. Where it loses the camera, that may have gone as far as a hand goes in a moment; from there odometry goes
on. So what a place says is compared with what odometry says at the moment of the loss: what was unknown there is the same for all views since.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from phone_host.geometry.se3 import SE3

DRIFT_SHARE, DRIFT_TURN_SHARE = 0.03, 0.05
"""Of the way and of the turn by which odometry may be off at most: on a room's clip, the poorest, 0.025 and 0.005."""

_POSE_VOXELS, _POSE_TURN = 4.0, 0.024
"""Beside that a pose itself may be off, voxels and rad: four standard deviations of one that a surface tells."""

_FEATURES_M, _FEATURES_TURN = 0.16, 0.21
"""A pose that features alone tell may be off by so much, m and rad, before a surface corrects it (`Piece.confirmed`)."""

_JUMP_M, _JUMP_TURN = 0.5, 1.2
"""How far a camera may have gone and turned, m and rad, in the moment in which odometry lost it: a hand in a fifth of a second."""

_SPEEDS: Final = 2.0
"""Times its usual speed a camera may go while it is not followed."""

_USUAL: Final = 0.8
"""Weight of the steps before the last one in the usual step."""


@dataclass(frozen=True, slots=True)
class MotionBound:
    """How far a pose may be off.

    Attributes:
        shift_m: m, >= 0.
        turn: rad, >= 0.
    """

    shift_m: float = 0.0
    turn: float = 0.0

    @staticmethod
    def drift(length_m: float, turned: float) -> "MotionBound":
        """Return how far odometry may be off after a way, m, and a turn, rad."""
        return MotionBound(DRIFT_SHARE * length_m, DRIFT_TURN_SHARE * turned)

    @property
    def for_features(self) -> "MotionBound":
        """The bound of a pose that features alone tell."""
        return MotionBound(self.shift_m + _FEATURES_M, self.turn + _FEATURES_TURN)

    def admits(self, expected: SE3, found: SE3, voxel_m: float) -> bool:
        """Return whether a pose is near enough to where it is expected."""
        off = (expected.inverse() @ found).pose()
        shift_m, turn = float(np.linalg.norm(off[3:])), float(np.linalg.norm(off[:3]))
        return shift_m <= self.shift_m + _POSE_VOXELS * voxel_m and turn <= self.turn + _POSE_TURN


@dataclass(frozen=True, slots=True)
class UsualStep:
    """How far a camera goes and turns from view to view, m and rad."""

    length_m: float = 0.0
    turned: float = 0.0

    def after(self, step: SE3) -> "UsualStep":
        """Return it after another step that is known."""
        motion = step.pose()
        length_m, turned = float(np.linalg.norm(motion[3:])), float(np.linalg.norm(motion[:3]))
        return UsualStep(
            max(length_m, _USUAL * self.length_m + (1 - _USUAL) * length_m),
            max(turned, _USUAL * self.turned + (1 - _USUAL) * turned),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Belief:
    """Where a camera can be in the axes of a field, by odometry since it was last in it.

    Attributes:
        anchor: where it was when odometry lost it, or when it was last in the field.
        since: its motion from there, by odometry.
        at_anchor: how far the anchor may be off.
        length_m: of the way since, m.
        turned: since, rad.
        is_broken: whether odometry has lost it since it was last in the field.
        is_open: whether nobody knows what happened meanwhile: the program was ended and begun again.
    """

    anchor: SE3
    since: SE3
    at_anchor: MotionBound = MotionBound()  # frozen
    length_m: float = 0.0
    turned: float = 0.0
    is_broken: bool = False
    is_open: bool = False

    @staticmethod
    def at(pose: SE3) -> "Belief":
        """Return the belief of a camera whose pose was just confirmed."""
        return Belief(pose, SE3.identity())

    @property
    def pose(self) -> SE3:
        """Where it is, as far as odometry tells."""
        return (self.anchor @ self.since).exact()

    @property
    def bound(self) -> MotionBound:
        """How far the anchor may be off if a view is where it says: odometry's drift since adds to it, and turns the way since then."""
        drift = MotionBound.drift(self.length_m, self.turned)
        lever_m = drift.turn * float(np.linalg.norm(self.since.t_m))
        return MotionBound(self.at_anchor.shift_m + drift.shift_m + lever_m, self.at_anchor.turn + drift.turn)

    def moved(self, step: SE3) -> "Belief":
        """Return the belief after a motion that odometry has followed."""
        motion = step.pose()
        return replace(
            self,
            since=self.since @ step,
            length_m=self.length_m + float(np.linalg.norm(motion[3:])),
            turned=self.turned + float(np.linalg.norm(motion[:3])),
        )

    def jumped(self, usual: UsualStep, views: float = 1.0) -> "Belief":
        """Return the belief after a motion that nobody has followed."""
        bound, is_first = self.bound, self.length_m > 0 or self.turned > 0 or not self.is_broken
        lever_m = min(self.at_anchor.turn, math.pi) * float(np.linalg.norm(self.since.t_m))
        more_m = (_JUMP_M if is_first else 0.0) + _SPEEDS * views * usual.length_m
        more = (_JUMP_TURN if is_first else 0.0) + _SPEEDS * views * usual.turned
        grown = MotionBound(bound.shift_m + lever_m + more_m, min(bound.turn + more, math.pi))
        return Belief(self.pose, SE3.identity(), grown, is_broken=True, is_open=self.is_open)

    def admits(self, found: SE3, voxel_m: float) -> bool:
        """Return whether the camera can be where a place puts it."""
        return self.bound.admits(self.anchor, found @ self.since.inverse(), voxel_m)

    def nearly_admits(self, found: SE3, voxel_m: float) -> bool:
        """Return whether the camera can be where features alone put it."""
        return self.bound.for_features.admits(self.anchor, found @ self.since.inverse(), voxel_m)
