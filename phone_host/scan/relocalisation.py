"""The one chain of checks through which every way back into a field leads: that of a lost camera, of a fragment beside the model, and of a loop. Pure.

1. Votes: features choose places. 2. PnP: at least 25 of them agree on a pose. 3. Surface: the view's depth lies on the surface there, and the surface
tells all six directions; along a corridor its walls do not tell where the camera is, there many features must. 4. Belief: the pose lies where the camera
can be since it was last in the field (`MotionBound`); a place that only looks alike is farther away. Where odometry was lost, no other place that the
camera can have reached may explain the view about as well, and after a long loss a second, independent view must agree.
5. Residuals: what contradicts the rest after the pose graph was settled is taken out again (`graph.without_outliers`).

Poses that a mat tells are measurements in the world's axes: nothing adds up in them, and they do not come through here. A thing on a turntable may turn to
anywhere while it is not followed, so step 4 is left out for it (`PoseGate.is_turned_by_others`); its axis judges all views afterwards.

Odometry drifts with the way and the turn. Where it loses the camera, that may have gone as far as a hand goes in a moment; from there odometry goes
on. So what a place says is compared with what odometry says at the moment of the loss: what was unknown there is the same for all views since.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

import numpy as np

from phone_host.geometry.se3 import SE3
from phone_host.scan.piece import Lying, Piece
from phone_host.scan.places import Recognised, are_one_pose, is_bare
from phone_host.scan.registration import ALL_DIRECTIONS
from phone_host.scan.view import View

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


_LEAST_OVERLAP: Final = 0.45
"""Of a loop: at 0.39, a room's view was 35 mm and 2 degrees worse off than tracking had it; from 0.44 on loops were better."""

_LEAST_TOLD: Final = 0.008
"""Of a loop: information about the direction that the surface tells least, as a share of the best one's. In a corridor's corners loops with 0.003 to 0.005 were up to
0.09 m and 3 degrees off, where tracking was 0.02 m off; with 0.011 and more 0.03 m and 0.7 degrees."""

_SURE_INLIERS: Final = 60
"""Features that tell a pose where the surface is a plane: they lie all over the picture then."""

_WIDE_M: Final = 1.5
"""Beyond such a bound a single view is not believed: doors and windows stand as near."""

_SIGHT_M, _SIGHT_DEG = 1.0, 45.0
"""Places that were seen from so near a pose show what a view from there shows."""

_INDEPENDENT_M, _INDEPENDENT_TURN = 0.15, 0.17
"""Two views are independent if they were taken so far apart, m, or turned by so much, rad: then most of their features are others, or lie elsewhere."""


class Evidence(Enum):
    """What a view tells of where it was taken in a field.

    NONE: it shows no place where the camera can be. AMBIGUOUS: it shows one, but so does another place, or the surface tells too little. UNCONFIRMED: it shows
    one, but the camera was lost for so long that a second view must confirm it. BELIEVED: it is there.
    """

    NONE = "none"
    AMBIGUOUS = "ambiguous"
    UNCONFIRMED = "unconfirmed"
    BELIEVED = "believed"


class PoseSupport(Enum):
    """What supports the pose of a view that fits where it is expected, while odometry does not follow the camera.

    NONE: the view does not show what was seen from there. SURFACE: it has no features, and its plain surface lies there; the camera may have moved along that.
    FEATURES: the features agree.
    """

    NONE = "none"
    SURFACE = "surface"
    FEATURES = "features"


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """A place that a view shows.

    Attributes:
        evidence: how sure it is.
        lying: where the view was taken, and how it lies there; None: no place is shown.
    """

    evidence: Evidence
    lying: Lying | None = None


def sighted(piece: Piece, view: View, belief: Belief) -> Sighting:
    """Look which place of a field a view shows, of those where the camera can be, and how sure that is."""
    places, bound, voxel_m = piece.places, belief.bound, piece.volume.settings.voxel_m
    reach_m = bound.shift_m + bound.turn * float(np.linalg.norm(belief.since.t_m)) + _SIGHT_M
    near = places.near(belief.pose, reach_m, math.degrees(bound.turn) + _SIGHT_DEG)
    agreed = places.agreed(view, range(places.count) if belief.is_open else near)
    agreed = [each for each in agreed if belief.is_open or belief.nearly_admits(each.world_camera, voxel_m)]
    if not agreed:
        return Sighting(Evidence.NONE)
    best = max(agreed, key=lambda each: each.inliers)
    lying = piece.confirmed(view, best.world_camera)
    if lying is None or not (belief.is_open or belief.admits(lying.pose, voxel_m)):
        return Sighting(Evidence.NONE)
    return Sighting(_judged(piece, view, belief, lying, best.inliers), lying)


def _judged(piece: Piece, view: View, belief: Belief, lying: Lying, inliers: int) -> Evidence:
    """Judge a place at which the camera can be."""
    if not belief.is_broken:
        return Evidence.BELIEVED
    if not lying.fit.is_determined and inliers < _SURE_INLIERS:
        return Evidence.AMBIGUOUS
    if _has_rival(piece, view, belief, lying.pose):
        return Evidence.AMBIGUOUS
    is_close = belief.bound.shift_m <= _WIDE_M and belief.admits(lying.pose, piece.volume.settings.voxel_m)
    return Evidence.BELIEVED if is_close else Evidence.UNCONFIRMED


def pose_support(piece: Piece, view: View, belief: Belief, pose: SE3, told: int) -> PoseSupport:
    """Judge a view that odometry does not follow, and whose depth lies on the surface where the camera is expected.

    Rooms have equal corners and equal walls: the features must show what was seen from there. A view without any goes on there, but it tells nothing of where the camera is.
    """
    voxel_m = piece.volume.settings.voxel_m
    if not np.isfinite(pose.pose()).all() or not (belief.is_open or belief.admits(pose, voxel_m)):
        return PoseSupport.NONE
    if is_bare(view):
        return PoseSupport.SURFACE
    if told < ALL_DIRECTIONS:
        return PoseSupport.NONE
    agreed = piece.places.agreed(view, piece.places.near(pose, _SIGHT_M, _SIGHT_DEG))
    best = max(agreed, key=lambda each: each.inliers, default=None)
    if best is None or not are_one_pose(best.world_camera, pose):
        return PoseSupport.NONE
    is_wide = belief.bound.shift_m > _WIDE_M or belief.is_open
    return PoseSupport.NONE if is_wide and _has_rival(piece, view, belief, pose) else PoseSupport.FEATURES


def shown_place(
    piece: Piece, view: View, tracked: SE3, limits: Mapping[int, MotionBound], most: int
) -> Recognised | None:
    """Find which of some places a tracked view shows, where tracking can be so far off: what a loop begins with; None: no one."""
    reach = max(limits.values(), key=lambda each: each.shift_m, default=MotionBound())
    turn_deg = math.degrees(max((each.turn for each in limits.values()), default=0.0)) + _SIGHT_DEG
    near = [at for at in piece.places.near(tracked, reach.shift_m + _SIGHT_M, turn_deg) if at in limits]
    voxel_m = piece.volume.settings.voxel_m
    agreed = [
        each
        for each in piece.places.agreed(view, near, most)
        if limits[each.number].for_features.admits(tracked, each.world_camera, voxel_m)
    ]
    return max(agreed, key=lambda each: each.inliers, default=None)


def lies_alone(piece: Piece, view: View, starts: Sequence[SE3]) -> Lying | None:
    """Return how a view lies on the surface of an older part alone, which must tell all directions; None: it does not.

    Args:
        piece: that part.
        view: with depth.
        starts: poses from which that is tried, in turn: the features' pose may be farther off than tracking is.
    """
    tried = (piece.confirmed(view, start) for start in starts)
    lying = next((each for each in tried if each is not None), None)
    if lying is None or lying.fit.least_told < _LEAST_TOLD or lying.fit.overlap < _LEAST_OVERLAP:
        return None
    return lying


def _has_rival(piece: Piece, view: View, belief: Belief, pose: SE3) -> bool:
    """Return whether another place where the camera can be explains a view about as well as the one at a pose."""
    voxel_m = piece.volume.settings.voxel_m
    rivals = piece.places.rivals(view, pose)
    return any(belief.is_open or belief.nearly_admits(each.world_camera, voxel_m) for each in rivals)


def are_independent(one: SE3, other: SE3) -> bool:
    """Return whether views from two poses confirm each other: they do not show the same picture."""
    between = (one.inverse() @ other).pose()
    return bool(np.linalg.norm(between[3:]) >= _INDEPENDENT_M or np.linalg.norm(between[:3]) >= _INDEPENDENT_TURN)
