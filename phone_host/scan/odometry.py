"""Where the camera went, from corners and their disparities alone. Pure.

Each view is located from the points that are held; a keyframe adds points, and the newest keyframes are fitted together.
Where a view cannot be located, the motion is unknown: points are begun anew there, and it is told.

Sources: J. Shi and C. Tomasi, "Good Features to Track", 1994; J.-Y. Bouguet, "Pyramidal Implementation of the Lucas Kanade
Feature Tracker", 2000.
"""

from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.model import Image
from phone_host.scan.camera_pose import CameraPose, Observer, located
from phone_host.scan.view import View
from phone_host.scan.volume_settings import VolumeSettings
from phone_host.scan.window import WINDOW, Keyframe, fitted

Pixels = NDArray[np.float32]
Flags = NDArray[np.bool_]
Floats = NDArray[np.float64]
Numbers = NDArray[np.int64]

_QUALITY: Final = 0.005
"""Share of the strongest corner's response; below it dim images would give noise."""

_BLOCK_PX: Final = 5
_WINDOW_PX: Final = (21, 21)
_LEVELS: Final = 4
"""Halvings of the image: a corner is followed over some 150 px."""

_STOP: Final = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 30, 0.01)

_THERE_AND_BACK_PX: Final = 0.8
"""A corner that is followed back must come out this near to where it began."""

_BORDER_PX: Final = 2


def new_corners(grey: Image, held: Pixels, most: int, apart_px: int, wanted: Flags | None = None) -> Pixels:
    """Find corners where none is held yet.

    Args:
        grey: (H, W) uint8.
        held: (N, 2) those that are held, px.
        most: how many may be held in all.
        apart_px: least distance of two.
        wanted: (H, W) where corners are of use; None: everywhere.

    Returns:
        (M, 2) float32, px, the strongest first; M <= most - N.
    """
    room = most - len(held)
    if room <= 0:
        return np.zeros((0, 2), np.float32)
    mask = np.full(grey.shape, 255, np.uint8) if wanted is None else np.where(wanted, np.uint8(255), np.uint8(0))
    for x, y in np.rint(held).astype(int).tolist():
        cv2.circle(mask, (x, y), apart_px, 0, -1)
    found: object = cv2.goodFeaturesToTrack(grey, room, _QUALITY, apart_px, mask=mask, blockSize=_BLOCK_PX)
    return np.zeros((0, 2), np.float32) if found is None else np.asarray(found, np.float32).reshape(-1, 2)


def followed(before: Image, after: Image, pixels: Pixels) -> tuple[Pixels, Flags]:
    """Follow corners (N, 2), px, of one image (H, W) into the next and back again; return where they went, (N, 2), and which were followed, (N,)."""
    if len(pixels) == 0:
        return pixels, np.zeros(0, np.bool_)
    there, found = flow(before, after, pixels, None)
    back, found_back = flow(after, before, there, None)
    height, width = after.shape
    inside = (there >= _BORDER_PX).all(axis=1) & (there < (width - _BORDER_PX, height - _BORDER_PX)).all(axis=1)
    near = np.linalg.norm(back - pixels, axis=1) < _THERE_AND_BACK_PX
    return there, found & found_back & near & inside


def flow(
    one: Image,
    other: Image,
    pixels: Pixels,
    start: Pixels | None,
    *,
    window_px: tuple[int, int] = _WINDOW_PX,
    levels: int = _LEVELS,
) -> tuple[Pixels, Flags]:
    """Return where corners (N, 2) of an image are in another, looked for around a start (N, 2), None: where they were; and which were found, (N,)."""
    there, found, _ = cv2.calcOpticalFlowPyrLK(
        one,
        other,
        np.ascontiguousarray(pixels),
        np.empty_like(pixels) if start is None else np.ascontiguousarray(start),
        winSize=window_px,
        maxLevel=levels,
        criteria=_STOP,
        flags=0 if start is None else cv2.OPTFLOW_USE_INITIAL_FLOW,
    )
    return np.asarray(there, np.float32).reshape(-1, 2), np.asarray(found).reshape(-1) > 0


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


_ODOMETRY: Final = OdometrySettings(corners=400, apart_px=8, keyframe_share=0.6, keyframe_after=5)
"""The model carries the accuracy; odometry, on half the image, only has to start near it. At VGA that saves 20 of 30 ms of processor time."""

_STREET_ODOMETRY: Final = OdometrySettings(corners=400, apart_px=8, keyframe_share=0.7, keyframe_after=1)
"""In a street odometry carries the accuracy, on the whole image: a depth at 15 m has 0.3 m of noise, and what was fused soon leaves the picture. On 24 pairs
of KITTI the trajectory is 22 mm off, where half the image gives 131 mm; 1000 corners give 32 mm and take twice the time."""

_POOR_NOISE_PER_M: Final = 0.006
"""Noise of a depth 1 m away, m, from which a keyframe's new points are so far off that each view as a keyframe harms: with 0.010 (f = 400 px, b = 0.12 m) a
rendered street's trajectory is 106 mm off, with every fifth view as a keyframe 29 mm; with 0.004 (b = 0.3 m) 17 and 22 mm."""


def odometry_for(settings: VolumeSettings) -> OdometrySettings:
    """Choose how odometry follows the corners."""
    is_exact = settings.noise_per_m < _POOR_NOISE_PER_M
    return _STREET_ODOMETRY if settings.is_of_street and is_exact else _ODOMETRY


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

    Attributes:
        offset_px: by how much all disparities are too large, px, as far as the motion tells; 0 at first.
    """

    def __init__(self, settings: OdometrySettings = OdometrySettings()) -> None:
        self._settings = settings
        self._held = _Held(ids=np.zeros(0, np.int64), observed_px=np.zeros((0, 3)), points_m=np.zeros((0, 3)))
        self._grey: Image | None = None
        self._pose = SE3.identity()
        self._next_id = 0
        self._shift_px = float("nan")
        self.offset_px = 0.0
        self._window: list[Keyframe] = []
        self._poses: list[tuple[int, SE3]] = []
        self._keyframe_poses: list[SE3] = []

    def step(self, view: View) -> Moved:
        """Return how the camera has moved to the next view; all views have one size and one geometry."""
        before, last = self._grey, self._pose
        self._grey = view.grey
        observer = Observer(view.geometry, view.noise_px, self.offset_px)
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
            self._window, self.offset_px = list(fit.keyframes), fit.offset_px
            self._held = replace(held, points_m=fit.updated(held.ids, held.points_m))
            first = len(self._keyframe_poses) - len(self._window)
            self._keyframe_poses[first:] = [each.camera_world.inverse() for each in self._window]
            self._pose = self._keyframe_poses[-1]
        self._begin_points(view, replace(observer, offset_px=self.offset_px))
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
