"""Points of a turning thing, and which views see them: each corner is looked for where the circle so far says that it went. Pure.

A corner is compared with the view in which it was found, never with the one before, so that errors do not add up along the way.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Image, StereoGeometry
from phone_host.scan.camera_pose import Observer
from phone_host.scan.circle_bundle import Seen, TurnAxis
from phone_host.scan.odometry import flow, new_corners
from phone_host.scan.view import View

Floats = NDArray[np.float64]
Numbers = NDArray[np.int64]

_CORNERS: Final = 100
"""Of a view."""

_APART_PX: Final = 6
_REACH: Final = 0.45
"""rad: how far a thing may turn until a corner looks too different."""

_NEIGHBOURS: Final = 4
"""Views before, and as many after, in which a corner is looked for; of those of the turn before as many again."""

_WINDOW_PX: Final = (17, 17)
_LEVELS: Final = 2
_THERE_AND_BACK_PX: Final = 0.5
_CONTRAST_PX: Final = 21
_CONTRAST_FLOOR: Final = 4.0
"""Grey levels of contrast that count as none: less is noise."""

_BORDER_PX: Final = 3
_DEPTH_SIGMAS: Final = 5.0
_DEPTH_SHARE: Final = 0.02
"""Of the depth: a corner whose place in the other view is farther off than this and five standard deviations is hidden there."""


@dataclass(frozen=True, slots=True, eq=False)
class Tracks:
    """Points that several views see.

    Attributes:
        points_m: (P, 3) where the circle so far puts them, m.
        seen: what each view sees of them.
        closing: sightings of points of one turn in views of another.
    """

    points_m: Floats
    seen: tuple[Seen, ...]
    closing: int


def tracks_of(views: Sequence[View], axis: TurnAxis, angles: Floats, *, across_turns: bool = True) -> Tracks:
    """Find corners in each view, and look for them in its neighbours, also one turn later or earlier.

    Args:
        views: of the thing alone: what does not belong to it has no depth.
        axis: about which it turns, as far as is known.
        angles: (N,) how far it has turned in each view, rad, as far as is known.
        across_turns: whether views of another turn are neighbours, too.
    """
    pictures = [_evened(view.grey) for view in views]
    observer = Observer(views[0].geometry, views[0].noise_px)
    numbers: list[list[Numbers]] = [[] for _ in views]
    observed: list[list[Floats]] = [[] for _ in views]
    points, count, closing = [], 0, 0
    for here, view in enumerate(views):
        corners = _corners(view)
        seen_here = view.observed(corners)
        usable = np.isfinite(seen_here[:, 2])
        corners, seen_here = corners[usable], seen_here[usable]
        if not len(corners):
            continue
        own = axis.camera_world(float(angles[here])).inverse().apply(observer.points(seen_here))
        met = np.zeros(len(corners), np.int64)
        found_in = []
        for there in _neighbours(angles, here, across_turns=across_turns):
            pose = axis.camera_world(float(angles[there]))
            pixels, found = _looked_for(pictures[here], pictures[there], corners, pose.apply(own), views[there])
            met += found
            found_in.append((there, pixels, found))
        kept = met >= 2
        index = np.cumsum(kept) - 1 + count
        numbers[here].append(index[kept])
        observed[here].append(seen_here[kept])
        for there, pixels, found in found_in:
            both = kept & found
            numbers[there].append(index[both])
            observed[there].append(views[there].observed(pixels[both]))
            closing += int(np.count_nonzero(both)) if abs(angles[there] - angles[here]) > np.pi else 0
        points.append(own[kept])
        count += int(np.count_nonzero(kept))
    every = np.concatenate(points) if points else np.zeros((0, 3))
    return Tracks(every, tuple(_seen(ids, rows) for ids, rows in zip(numbers, observed, strict=True)), closing)


def _seen(numbers: list[Numbers], observed: list[Floats]) -> Seen:
    if not numbers:
        return Seen(np.zeros(0, np.int64), np.zeros((0, 3)))
    return Seen(np.concatenate(numbers), np.concatenate(observed))


def _neighbours(angles: Floats, here: int, *, across_turns: bool) -> list[int]:
    """Return the views that show nearly the same side: the nearest of those before and after, and of those one turn away."""
    away = angles - angles[here]
    turns = np.rint(away / (2 * np.pi))
    beside = away - turns * 2 * np.pi
    chosen: list[int] = []
    for turn in np.unique(turns) if across_turns else (0.0,):
        for sign in (-1, 1):
            side = np.flatnonzero((turns == turn) & (sign * beside >= 0) & (np.abs(beside) <= _REACH))
            side = side[side != here]
            chosen.extend(side[np.argsort(np.abs(beside[side]), kind="stable")][:_NEIGHBOURS].tolist())
    return sorted(set(chosen))


def _corners(view: View) -> NDArray[np.float32]:
    known = np.isfinite(view.depth_m).astype(np.uint8)
    inside = cv2.erode(known, np.ones((2 * _BORDER_PX + 1, 2 * _BORDER_PX + 1), np.uint8), borderValue=0)
    return new_corners(view.grey, np.zeros((0, 2), np.float32), _CORNERS, _APART_PX, inside > 0)


def _looked_for(
    here: Image, there: Image, corners: NDArray[np.float32], points_m: Floats, view: View
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Look for corners (N, 2) in another view, whose points (N, 3) are in its camera's axes; return where they are and which were found."""
    start = _projected(points_m, view.geometry)
    to, found = flow(here, there, corners, start, window_px=_WINDOW_PX, levels=_LEVELS)
    back, found_back = flow(there, here, to, corners.copy(), window_px=_WINDOW_PX, levels=_LEVELS)
    height, width = there.shape
    inside = (to >= _BORDER_PX).all(axis=1) & (to < (width - _BORDER_PX, height - _BORDER_PX)).all(axis=1)
    near = np.linalg.norm(back - corners, axis=1) < _THERE_AND_BACK_PX
    found = found & found_back & inside & near & (points_m[:, 2] > 0)
    places = np.rint(np.where(found[:, np.newaxis], to, 0)).astype(np.int64)
    depth = view.depth_m[places[:, 1], places[:, 0]].astype(np.float64)
    most = _DEPTH_SIGMAS * view.noise_per_m * points_m[:, 2] ** 2 + _DEPTH_SHARE * points_m[:, 2]
    return to, found & (np.abs(depth - points_m[:, 2]) <= most)


def _projected(points_m: Floats, geometry: StereoGeometry) -> NDArray[np.float32]:
    depth = np.maximum(points_m[:, 2:], 1e-3)
    centre = np.array([geometry.cx_px, geometry.cy_px])
    return np.asarray(geometry.focal_px * points_m[:, :2] / depth + centre, np.float32)


def _evened(grey: Image) -> Image:
    """Return a picture whose contrast and brightness are everywhere alike: the lamp stands still while the thing turns."""
    side = (_CONTRAST_PX, _CONTRAST_PX)
    values = grey.astype(np.float32)
    mean = cv2.blur(values, side)
    spread = np.sqrt(np.maximum(cv2.blur(values * values, side) - mean * mean, 0)) + _CONTRAST_FLOOR
    return np.clip(128 + 45 * (values - mean) / spread, 0, 255).astype(np.uint8)
