"""Where the camera went, from corners and their disparities alone. Pure.

Each view is located from the points that are held; a keyframe adds points, and the newest keyframes are fitted together.
Where a view cannot be located, the motion is unknown: points are begun anew there, and it is told.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.model import Image
from phone_host.scan.camera_pose import CameraPose, located
from phone_host.scan.corners import followed, new_corners
from phone_host.scan.observation import Observer
from phone_host.scan.view import View
from phone_host.scan.window import WINDOW, Keyframe, fitted

Floats = NDArray[np.float64]
Numbers = NDArray[np.int64]

_OTHERS_SHARE, _OTHERS_TOGETHER, _OTHERS_PX = 0.2, 0.6, 2.0
"""Of the followed corners, and of those that do not agree, how many move together, and how far off they are, px of the image that odometry takes: then
something moves against the rest. In real rooms and streets, where nothing does, up to 0.17 and 0.45; before a column that goes by, 0.2 to 0.44 and 0.7 or more."""

_HELD_STILL: Final = 2
"""Keyframes of a full window that stay where they are."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OdometrySettings:
    """How odometry works.

    Attributes:
        corners: most that are held.
        apart_px: least distance of two corners.
        keyframe_share: a view is a keyframe when fewer of the last one's points are still held.
        keyframe_after: it is one after this many views in any case.
    """

    corners: int = 1000
    apart_px: int = 8
    keyframe_share: float = 0.7
    keyframe_after: int = 1


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class _Held:
    """Points that are followed: (N,) numbers, in rising order, (N, 3) u, v, d, (N, 3) place in the world, m."""

    ids: Numbers
    observed_px: Floats
    points_m: Floats

    def only(self, chosen: NDArray[np.bool_]) -> "_Held":
        """Return some of them."""
        return _Held(ids=self.ids[chosen], observed_px=self.observed_px[chosen], points_m=self.points_m[chosen])


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Moved:
    """What odometry says of a view.

    Attributes:
        world_camera: where the camera is, in odometry's own world: the first view's axes.
        before_now: takes this view's points to the view before; the identity where it is not known.
        is_known: whether the motion since the last view is known.
        followed: corners that were followed into the view.
        inliers: those that agree on the motion.
        shift_px: median way of a followed corner since the last view, px of the image that odometry takes; NaN: none was followed.
        others: corners that agree on another motion, if they are many: something moves against the rest.
    """

    world_camera: SE3
    before_now: SE3
    is_known: bool
    followed: int
    inliers: int
    shift_px: float = float("nan")
    others: int = 0


def _others(held: _Held, found: CameraPose, observer: Observer) -> int:
    """Return how many corners agree on another motion than most, if they are a good part of all; else 0."""
    left = held.only(~found.inliers)
    least = max(_OTHERS_SHARE * len(held.ids), _OTHERS_TOGETHER * len(left.ids))
    if len(left.ids) < least:
        return 0
    second = located(left.points_m, left.observed_px, observer)
    if second is None or np.count_nonzero(second.inliers) < least:
        return 0
    together = left.only(second.inliers)
    off_px = (observer.projected(found.camera_world.apply(together.points_m)) - together.observed_px)[:, :2]
    return len(together.ids) if np.median(np.linalg.norm(off_px, axis=1)) >= _OTHERS_PX else 0


class Odometry:
    """Follows a camera from view to view.

    Args:
        settings: how.
    """

    def __init__(self, settings: OdometrySettings = OdometrySettings()) -> None:
        self._settings = settings
        self._held = _Held(ids=np.zeros(0, np.int64), observed_px=np.zeros((0, 3)), points_m=np.zeros((0, 3)))
        self._grey: Image | None = None
        self._pose = SE3.identity()
        self._next_id = 0
        self._shift_px = float("nan")
        self._offset_px = 0.0
        self._window: list[Keyframe] = []
        self._poses: list[tuple[int, SE3]] = []
        self._keyframe_poses: list[SE3] = []

    @property
    def offset_px(self) -> float:
        """By how much all disparities are too large, px, as far as the motion tells; 0 at first."""
        return self._offset_px

    def step(self, view: View) -> Moved:
        """Take the next view; all views have one size and one geometry.

        Returns:
            How the camera moved.
        """
        before, last = self._grey, self._pose
        self._grey = view.grey
        observer = Observer(view.geometry, view.noise_px, self._offset_px)
        if before is None:
            self._keyframe(view, observer)
            return self._told(last, is_known=True, followed_count=0)
        count = self._follow(before, view)
        found = located(self._held.points_m, self._held.observed_px, observer)
        if found is None:
            self._held = self._held.only(np.zeros(len(self._held.ids), np.bool_))
            self._window = []
            self._keyframe(view, observer)
            return self._told(last, is_known=False, followed_count=count)
        others = _others(self._held, found, observer)
        self._held, self._pose = self._held.only(found.inliers), found.camera_world.inverse()
        inliers = len(self._held.ids)
        if self._is_keyframe():
            self._keyframe(view, observer)
        else:
            self._note()
        return replace(self._told(last, is_known=True, followed_count=count), inliers=inliers, others=others)

    def poses(self) -> tuple[SE3, ...]:
        """Return where the camera was at each view, as the newest keyframes have it."""
        return tuple(self._keyframe_poses[keyframe] @ since for keyframe, since in self._poses)

    def _told(self, last: SE3, *, is_known: bool, followed_count: int) -> Moved:
        return Moved(
            world_camera=self._pose,
            before_now=last.inverse() @ self._pose,
            is_known=is_known,
            followed=followed_count,
            inliers=0,
            shift_px=self._shift_px,
        )

    def _follow(self, before: Image, view: View) -> int:
        """Follow the held points into the view; return how many were."""
        pixels, found = followed(before, view.grey, self._held.observed_px[:, :2].astype(np.float32))
        held = self._held.only(found)
        ways = np.linalg.norm(pixels[found] - held.observed_px[:, :2], axis=1)
        self._shift_px = float(np.median(ways)) if len(ways) else float("nan")
        self._held = replace(held, observed_px=view.observed(pixels[found]))
        return len(held.ids)

    def _is_keyframe(self) -> bool:
        newest, settings = self._window[-1], self._settings
        kept = np.isin(self._held.ids, newest.ids, assume_unique=True).sum()
        return len(self._poses) - newest.index >= settings.keyframe_after or bool(
            kept < settings.keyframe_share * len(newest.ids)
        )

    def _note(self) -> None:
        """Remember where the view is, as seen from the newest keyframe."""
        newest = len(self._keyframe_poses) - 1
        self._poses.append((newest, self._keyframe_poses[newest].inverse() @ self._pose))

    def _keyframe(self, view: View, observer: Observer) -> None:
        """Fit the window, and begin new points from where that puts the view: the fit leaves out what one keyframe alone sees."""
        held = self._held
        self._keyframe_poses.append(self._pose)
        newest = Keyframe(
            index=len(self._poses), camera_world=self._pose.inverse(), ids=held.ids, observed_px=held.observed_px
        )
        self._window = [*self._window, newest][-WINDOW:]
        if len(self._window) > 1:
            still = _HELD_STILL if len(self._window) == WINDOW else 1
            fit = fitted(self._window, held.ids, held.points_m, observer, still)
            self._window, self._offset_px = list(fit.keyframes), fit.offset_px
            self._held = replace(held, points_m=fit.updated(held.ids, held.points_m))
            first = len(self._keyframe_poses) - len(self._window)
            self._keyframe_poses[first:] = [each.camera_world.inverse() for each in self._window]
            self._pose = self._keyframe_poses[-1]
        self._begin_points(view, replace(observer, offset_px=self._offset_px))
        self._window[-1] = replace(self._window[-1], ids=self._held.ids, observed_px=self._held.observed_px)
        self._note()

    def _begin_points(self, view: View, observer: Observer) -> None:
        """Hold new corners where there are few, each put where its disparity says; those without one are left out."""
        held, settings = self._held, self._settings
        pixels = new_corners(
            view.grey,
            held.observed_px[:, :2].astype(np.float32),
            settings.corners,
            settings.apart_px,
            np.isfinite(view.depth_m),
        )
        observations = view.observed(pixels)
        observations = observations[np.isfinite(observations[:, 2])]
        ids = np.arange(self._next_id, self._next_id + len(observations))
        self._next_id += len(observations)
        self._held = _Held(
            ids=np.concatenate([held.ids, ids]),
            observed_px=np.concatenate([held.observed_px, observations]),
            points_m=np.concatenate([held.points_m, self._pose.apply(observer.points(observations))]),
        )
