"""Places that were seen, and which of them a view shows: after the camera was lost, and after a step too large to follow. Pure.

Source: E. Rublee et al., "ORB: an efficient alternative to SIFT or SURF", 2011; D. Lowe, "Distinctive Image Features", 2004 (the ratio).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.scan.camera_pose import Observer, located
from phone_host.scan.view import View

Floats = NDArray[np.float64]

LEAST_INLIERS: Final = 25
"""Fewer may agree by accident: of 276 pairs of a room's views, those with 25 and more were at most 81 mm off, which the registration mends."""

_FEATURES: Final = 1500
_CORNER_STEP: Final = 7
"""Grey levels that make a corner. With 20, and 800 features, a room seen from 11 degrees and 0.2 m away agrees with no place; with 7 and 1500 on 29."""

_RATIO: Final = 0.8
"""Of the distances to the best and to the second best descriptor."""

_PIXEL_PX: Final = 1.5
"""Standard deviation of a feature's u and v: those of the coarse levels of the image have the noise of their pixels."""

_DISPARITY_PX: Final = 0.4
"""And of its disparity at least: the matcher's is that of the pixel in the middle. So many allow a wide step; the registration mends the pose."""

_DRAWS: Final = 500
_SHORT: Final = 8
"""Places that are compared in full: those that most features vote for."""

_VOTERS: Final = 150
_VOTED: Final = 200
"""Features of a view, and of a place, that vote: the strongest."""

_ALIKE_BITS: Final = 50
"""Of 256 that may differ in a vote; of two features of different corners 5 % differ in so few."""

_MATCHED_ROWS: Final = 1 << 17
"""Descriptors that are matched at once: OpenCV's matcher raises an exception from 2^18 on, which 1311 places have."""

_UNLIKE: Final = 1.5
"""Times as many features as agree on another pose must agree on a place: with fewer, two places look alike."""

_OTHER_M, _OTHER_DEG = 0.5, 15.0
"""Poses farther apart than this contradict each other: places of one region locate a view to some centimetres, along a corridor less well."""

_AWAY_M: Final = 0.6
"""Places that were seen from so far away, or turned by 15 degrees, may be rivals: those that are nearer show the same."""

_APART_DEG: Final = 4.0
_APART_SHARE: Final = 0.05
"""Of the median depth: as far apart as this, or turned by so much, a view is a place of its own."""

_BY_DEG: Final = 15.0
_BY_SHARE: Final = 0.2
"""Of the median depth: views no farther apart share most of their features."""


@dataclass(frozen=True, slots=True, eq=False)
class _Features:
    """(N, 32) descriptors, and (N, 3) u, v, disparity, px."""

    descriptors: NDArray[np.uint8]
    observed_px: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """A place that was seen.

    Attributes:
        world_camera: where it was seen from.
        points_m: (N, 3) float64, its points in the world, m.
        descriptors: (N, 32) uint8, of these.
    """

    world_camera: SE3
    points_m: Floats
    descriptors: NDArray[np.uint8]

    def moved(self, by: SE3) -> "Place":
        """Return the place, in the axes to which a motion takes it."""
        return replace(self, world_camera=by @ self.world_camera, points_m=by.apply(self.points_m))


@dataclass(frozen=True, slots=True, eq=False)
class Recognised:
    """A place that a view shows.

    Attributes:
        world_camera: where the view was taken.
        inliers: features that agree on it.
        number: of the place, in the order in which they were remembered.
    """

    world_camera: SE3
    inliers: int
    number: int


class Places:
    """Remembers places, and recognises them."""

    def __init__(self) -> None:
        self._places: list[Place] = []

    @property
    def count(self) -> int:
        """How many are remembered."""
        return len(self._places)

    def remember(self, view: View, world_camera: SE3) -> None:
        """Remember a view, if it was taken elsewhere than those that are remembered."""
        apart_m = _APART_SHARE * _typical_m(view)
        if any(_is_near(place.world_camera, world_camera, apart_m) for place in self._places):
            return
        seen, observer = _features(view), Observer(view.geometry, view.noise_px)
        known = np.isfinite(seen.observed_px[:, 2])
        points = world_camera.apply(observer.points(seen.observed_px[known]))
        self._places.append(Place(world_camera, points, seen.descriptors[known]))

    def since(self, count: int) -> tuple[Place, ...]:
        """Return all places but the first ones."""
        return tuple(self._places[count:])

    def add(self, places: tuple[Place, ...]) -> None:
        """Remember places that others have seen."""
        self._places.extend(places)

    def moved(self, by: SE3) -> tuple[Place, ...]:
        """Return all places, in the axes to which a motion takes them."""
        return tuple(place.moved(by) for place in self._places)

    def move(self, by: Sequence[SE3]) -> None:
        """Put the places elsewhere, each by a motion of its own.

        Args:
            by: a motion for each, in the order in which they were remembered.
        """
        self._places = [place.moved(motion) for place, motion in zip(self._places, by, strict=True)]

    def nearest(self, world_camera: SE3, first: int) -> int:
        """Return the number of the place, of the first ones, that was seen from nearest by."""
        away_m = [float(np.linalg.norm(place.world_camera.t_m - world_camera.t_m)) for place in self._places[:first]]
        return int(np.argmin(away_m))

    def near(self, world_camera: SE3, within_m: float, within_deg: float) -> list[int]:
        """Return the numbers of the places that were seen from near a pose."""
        return [
            number for number in range(self.count) if self._is_seen_from(number, world_camera, within_m, within_deg)
        ]

    def recognised(self, view: View, among: Sequence[int] | None = None, most: int = _SHORT) -> Recognised | None:
        """Find the place on which most of a view's features agree; None: none has enough."""
        agreed = self.agreed(view, range(self.count) if among is None else among, most)
        return max(agreed, key=lambda each: each.inliers, default=None)

    def rivals(self, view: View, world_camera: SE3) -> list[Recognised]:
        """Return what other places say of a view, if they explain it about as well as those around a pose do, by another pose."""
        away = [at for at in range(self.count) if not self._is_seen_from(at, world_camera, _AWAY_M, _OTHER_DEG)]
        others = [each for each in self.agreed(view, away) if not are_one_pose(each.world_camera, world_camera)]
        if not others:
            return []
        known = set(away)
        own = self.recognised(view, [at for at in range(self.count) if at not in known])
        least = 0.0 if own is None else own.inliers / _UNLIKE
        return [each for each in others if each.inliers >= least]

    def _is_seen_from(self, number: int, world_camera: SE3, within_m: float, within_deg: float) -> bool:
        return _is_near(self._places[number].world_camera, world_camera, within_m, within_deg)

    def is_by(self, view: View, world_camera: SE3, among: Sequence[int]) -> bool:
        """Return whether a view was taken near one of some places: it shows it, if they are where they are believed to be."""
        apart_m = _BY_SHARE * _typical_m(view)
        places = [self._places[number].world_camera for number in among]
        return any(_is_near(place, world_camera, apart_m, _BY_DEG) for place in places)

    def agreed(self, view: View, among: Sequence[int], most: int = _SHORT) -> list[Recognised]:
        """Return the places among some on which enough of a view's features agree."""
        if not among:
            return []
        seen = _features(view)
        observer = Observer(view.geometry, max(view.noise_px, _DISPARITY_PX), pixel_px=_PIXEL_PX)
        agreed = []
        for number in self._shortlist(seen.descriptors, among, most):
            place = self._places[number]
            here, there = _matched(seen.descriptors, place.descriptors)
            if len(here) < LEAST_INLIERS:
                continue
            found = located(place.points_m[there], seen.observed_px[here], observer, _DRAWS)
            inliers = 0 if found is None else int(np.count_nonzero(found.inliers))
            if found is not None and inliers >= LEAST_INLIERS:
                agreed.append(Recognised(found.camera_world.inverse(), inliers, number))
        return agreed

    def _shortlist(self, descriptors: NDArray[np.uint8], among: Sequence[int], most: int) -> list[int]:
        """Return the places that most of a view's features vote for, in the order in which they were seen."""
        if len(among) <= most or len(descriptors) == 0:
            return list(among)
        voted = [self._places[number].descriptors[:_VOTED] for number in among]
        whose = np.repeat(np.arange(len(voted)), [len(each) for each in voted])
        nearest = _nearest(descriptors[:_VOTERS], np.concatenate(voted))
        votes = np.bincount(whose[nearest], minlength=len(voted))
        return [among[at] for at in sorted(np.argsort(-votes, kind="stable")[:most].tolist())]


def _typical_m(view: View) -> float:
    """Return the median depth, m, of every fourth row and column: of all of them it takes 2 ms, a thirtieth of a view."""
    return float(np.nanmedian(view.depth_m[::4, ::4]))


def are_one_pose(one: SE3, other: SE3) -> bool:
    """Return whether two poses that features tell may be the same: each is off by some centimetres."""
    return _is_near(one, other, _OTHER_M, _OTHER_DEG)


def is_bare(view: View) -> bool:
    """Return whether a view has too few features to show any place."""
    return int(np.isfinite(_features(view).observed_px[:, 2]).sum()) < LEAST_INLIERS


def _is_near(one: SE3, other: SE3, apart_m: float, apart_deg: float = _APART_DEG) -> bool:
    between = (one.inverse() @ other).pose()
    turn_deg = math.degrees(float(np.linalg.norm(between[:3])))
    return turn_deg < apart_deg and float(np.linalg.norm(between[3:])) < apart_m


def _features(view: View) -> _Features:
    """Find features, the strongest first; those that lie on a pixel without a depth have no disparity."""
    points, descriptors = cv2.ORB.create(nfeatures=_FEATURES, fastThreshold=_CORNER_STEP).detectAndCompute(
        view.grey, None
    )
    if not points:
        return _Features(np.zeros((0, 32), np.uint8), np.zeros((0, 3)))
    order = np.argsort([-point.response for point in points], kind="stable")
    pixels = np.array([point.pt for point in points])[order]
    return _Features(np.asarray(descriptors, np.uint8)[order], view.observed(pixels))


def _matched(here: NDArray[np.uint8], there: NDArray[np.uint8]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the numbers of features that are each other's only likeness."""
    pairs = []
    if len(here) and len(there) > 1:
        for first, second in cv2.BFMatcher(cv2.NORM_HAMMING).knnMatch(here, there, k=2):
            if first.distance < _RATIO * second.distance:
                pairs.append((first.queryIdx, first.trainIdx))
    numbers = np.array(pairs, np.int64).reshape(-1, 2)
    return numbers[:, 0], numbers[:, 1]


def _nearest(here: NDArray[np.uint8], there: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Return, for those descriptors that have one alike, the row of the most alike: the first of several that are as alike."""
    best, bits = np.zeros(len(here), np.int64), np.full(len(here), np.inf)
    for first in range(0, len(there), _MATCHED_ROWS):
        for match in cv2.BFMatcher(cv2.NORM_HAMMING).match(here, there[first : first + _MATCHED_ROWS]):
            if match.distance < bits[match.queryIdx]:
                best[match.queryIdx], bits[match.queryIdx] = first + match.trainIdx, match.distance
    return best[bits <= _ALIKE_BITS]
