"""What turns before cameras that stand still: where the picture changes, and the ball in space that holds it. Pure.

A pixel is still as long as its grey stays the same from view to view. Still pixels that hang together with the picture's border are background;
those that changing ones enclose belong to the thing, however plain it is there. Depth decides between the thing and what comes to light behind it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Image, StereoGeometry
from phone_host.scan.view import Depth, View, points_of

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

_BLUR_PX: Final = 3
_LEAST_STEP: Final = 6.0
"""Grey levels of a change, after the blur: sensors and JPEG stay below 3."""

_SIGMAS: Final = 6.0
_GAP_SHARE: Final = 0.012
"""Of the picture's width: plain spots of the thing as narrow as this lie within it."""

_STILL_VIEWS: Final = 2
"""Views in a row without a change that make a pixel background: what the thing leaves free looks changed only once."""

_LEAST_SHARE: Final = 0.002
"""Of the picture that must change: a thing of 5 cm a metre away, at VGA, covers 0.003."""

_MOST_SHARE: Final = 0.6
"""Of the picture's border: where more changes, the cameras move, or the background."""

_BORDER_SHARE: Final = 0.04
_BALL_ROUNDS: Final = 8
_BALL_MARGIN: Final = 1.5
_FEW: Final = 60
"""Pixels with a depth, below which nothing is said."""


class Turning(Enum):
    """What a view shows.

    THING: something turns, and the background stands still. NOTHING: nothing changes. EVERYTHING: the background changes, too. OUTSIDE: what turns
    reaches beyond the picture.
    """

    THING = "thing"
    NOTHING = "nothing"
    EVERYTHING = "everything"
    OUTSIDE = "outside"


@dataclass(frozen=True, slots=True, eq=False)
class Ball:
    """A ball in the camera's axes: its middle (3,) and radius, m."""

    middle_m: Floats
    radius_m: float

    def holds(self, depth_m: Depth, geometry: StereoGeometry) -> Flags:
        """Return (H, W): whether a pixel's point lies inside."""
        rows, columns = np.indices(depth_m.shape, np.float32)
        x = (columns - np.float32(geometry.cx_px)) / np.float32(geometry.focal_px) * depth_m
        y = (rows - np.float32(geometry.cy_px)) / np.float32(geometry.focal_px) * depth_m
        middle = self.middle_m.astype(np.float32)
        away = (x - middle[0]) ** 2 + (y - middle[1]) ** 2 + (depth_m - middle[2]) ** 2
        return np.asarray(away <= np.float32(self.radius_m**2), np.bool_)  # NaN is outside

    def window(self, shape: tuple[int, int], geometry: StereoGeometry) -> tuple[slice, slice]:
        """Return the rows and columns of a picture (H, W) in which the ball is seen."""
        x, y, z = self.middle_m.tolist()
        half = geometry.focal_px * self.radius_m / max(z, 1e-3)
        column, row = geometry.focal_px * x / z + geometry.cx_px, geometry.focal_px * y / z + geometry.cy_px
        height, width = shape
        top, left = (max(int(at - half), 0) for at in (row, column))
        return slice(top, min(int(row + half) + 1, height)), slice(left, min(int(column + half) + 1, width))


@dataclass(frozen=True, slots=True, eq=False)
class Masked:
    """What turns in a view: a word, and (H, W) the pixels of the thing; none unless something turns."""

    turning: Turning
    mask: Flags


class TurningMask:
    """Tells the thing from the background, view by view.

    Attributes:
        ball: that holds the thing; None before it was seen to turn.
    """

    def __init__(self) -> None:
        self.ball: Ball | None = None
        self._before: NDArray[np.float32] | None = None
        self._still: NDArray[np.uint8] | None = None
        self._moving: Flags | None = None

    def before(self, depth_m: Depth, geometry: StereoGeometry) -> Flags:
        """Return (H, W), the pixels of the thing in the view before the first in which it had turned, by its depths, (H, W), m."""
        if self._moving is None or self.ball is None:
            return np.zeros(depth_m.shape, np.bool_)
        return self._moving & self.ball.holds(depth_m, geometry)

    def take(self, grey: Image, depth_m: Depth, geometry: StereoGeometry) -> Masked:
        """Take the next view.

        Args:
            grey: (H, W) uint8.
            depth_m: (H, W) float32, m, NaN = none.
            geometry: of the pair.

        Returns:
            What turns; nothing in the first view, to which nothing can be compared.
        """
        now = cv2.blur(grey, (_BLUR_PX, _BLUR_PX)).astype(np.float32)
        before, self._before = self._before, now
        nothing = np.zeros(grey.shape, np.bool_)
        if before is None or self._still is None:
            self._still = np.full(grey.shape, _STILL_VIEWS, np.uint8)
            return Masked(Turning.NOTHING, nothing)
        changed = changes(before, now)
        if changed.mean() < _LEAST_SHARE:
            self._before = before  # a slow turn adds up
            return Masked(Turning.NOTHING, nothing)
        if _border(changed).mean() > _MOST_SHARE:
            return Masked(Turning.EVERYTHING, nothing)
        self._still = np.where(changed, np.uint8(0), np.minimum(self._still + 1, _STILL_VIEWS)).astype(np.uint8)
        moving = self._moving = enclosed(self._still < _STILL_VIEWS)
        if self.ball is None:
            self.ball = ball_of(depth_m, changed, geometry)
        if self.ball is None:
            return Masked(Turning.NOTHING, nothing)
        mask = moving & self.ball.holds(depth_m, geometry)
        return Masked(Turning.OUTSIDE if _border(mask).mean() > _BORDER_SHARE else Turning.THING, mask)


def changes(before: NDArray[np.float32], now: NDArray[np.float32]) -> Flags:
    """Return where a picture has changed, (H, W), with what lies between; both are blurred grey levels, (H, W)."""
    step = np.abs(now - before)
    usual = 1.4826 * float(np.median(step))
    changed = (step > max(_LEAST_STEP, min(_SIGMAS * usual, 4 * _LEAST_STEP))).astype(np.uint8)
    changed = cv2.medianBlur(changed, 3)  # single pixels are noise
    side = 2 * round(_GAP_SHARE * before.shape[1]) + 1
    around = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
    return np.asarray(cv2.morphologyEx(changed, cv2.MORPH_CLOSE, around) > 0, np.bool_)


def enclosed(mask: Flags) -> Flags:
    """Return a mask with everything that it encloses: what does not hang together with the picture's border outside of it."""
    padded = np.pad((~mask).astype(np.uint8), 1, constant_values=1)
    _, labels = cv2.connectedComponents(padded, connectivity=4)
    return np.asarray(labels[1:-1, 1:-1] != labels[0, 0], np.bool_)


def ball_of(depth_m: Depth, changed: Flags, geometry: StereoGeometry) -> Ball | None:
    """Find the ball that holds what turns: the nearest heap of the pixels that change, for what comes to light lies behind it.

    Args:
        depth_m: (H, W) float32, m.
        changed: (H, W) where the picture changes.
        geometry: of the pair.

    Returns:
        The ball; None: too few of these have a depth.
    """
    seen = changed & np.isfinite(depth_m)
    if np.count_nonzero(seen) < _FEW:
        return None
    points = points_of(np.where(seen, depth_m, np.float32(np.nan)), geometry)
    middle = np.median(points, axis=0)
    radius = float(np.quantile(np.linalg.norm(points[:, :2] - middle[:2], axis=1), 0.9))
    for _ in range(_BALL_ROUNDS):
        near = points[np.linalg.norm(points - middle, axis=1) <= _BALL_MARGIN * radius]
        if len(near) < _FEW:
            return None
        middle = (near.min(axis=0) + near.max(axis=0)) / 2 * 0.5 + np.median(near, axis=0) * 0.5
        radius = float(np.quantile(np.linalg.norm(near - middle, axis=1), 0.95))
    return Ball(middle, _BALL_MARGIN * radius)


def _border(mask: Flags) -> Flags:
    return np.concatenate([mask[:2].ravel(), mask[-2:].ravel(), mask[2:-2, :2].ravel(), mask[2:-2, -2:].ravel()])


_SAMPLES: Final = 24
"""Views that are compared with each other, spread over all."""

_ALIKE: Final = 8.0
"""Grey levels between two views of the same background, after a blur of 3 px."""

_LEAST_SHOWN: Final = 0.25
"""Of the views that must show it: the spots of a turning texture are alike by chance in one of ten."""

_DEPTH_SHARE: Final = 0.015
"""Of the depth, by which two views of the same background differ at most."""

_RIM_PX: Final = 5
"""Across which the background beside the thing may be the thing."""


class Background:
    """What the cameras see where the thing is not, learnt from all views together: of each pixel the grey that comes back most often.

    In a view, pixels that show it and hang together with the picture's border are background; those inside of the thing are not, even if it is plain there.

    Attributes:
        depth_m: (H, W) float32, m, NaN = not known.

    Args:
        greys: (H, W) uint8 of each view.
        depths_m: (H, W) float32 of each, m, NaN = none.
    """

    def __init__(self, greys: Sequence[Image], depths_m: Sequence[Depth]) -> None:
        chosen = np.unique(np.linspace(0, len(greys) - 1, _SAMPLES).round().astype(np.int64))
        stack = np.array([_blurred(greys[at]) for at in chosen])
        depths = np.array([depths_m[at] for at in chosen])
        alike = np.zeros(stack.shape, np.uint8)
        for number in range(len(chosen)):
            alike[number] = (np.abs(stack - stack[number]) <= _ALIKE).sum(axis=0)
        best = alike.argmax(axis=0)[np.newaxis]
        self._grey = np.take_along_axis(stack, best, axis=0)[0]
        self._known = np.take_along_axis(alike, best, axis=0)[0] >= max(_LEAST_SHOWN * len(chosen), 3)
        same = np.abs(stack - self._grey) <= _ALIKE
        known = np.isfinite(depths) & same
        # A mean, because medians of so many NaN are slow; what shows the background by chance is cut by `same`.
        count = known.sum(axis=0)
        total = np.where(known, depths, np.float32(0)).sum(axis=0)
        self.depth_m = np.where(self._known & (count > 0), total / np.maximum(count, 1), np.float32(np.nan)).astype(
            np.float32
        )

    def is_seen(self, grey: Image, depth_m: Depth) -> Flags:
        """Return (H, W): which pixels of a view show the background."""
        alike = self._known & (np.abs(_blurred(grey) - self._grey) <= _ALIKE)
        nearer = depth_m < self.depth_m * np.float32(1 - _DEPTH_SHARE)  # False without a depth
        still = cv2.medianBlur((alike & ~nearer).astype(np.uint8), 5) > 0
        return ~enclosed(~still)

    def opened(self, view: View) -> View:
        """Return a view with infinite depths where it shows the background: nothing of the thing is there, however near the table is."""
        still = self.is_seen(view.grey, view.depth_m).astype(np.uint8)
        sure = cv2.erode(still, np.ones((_RIM_PX, _RIM_PX), np.uint8)) > 0
        return replace(view, depth_m=np.where(sure, np.float32(np.inf), view.depth_m))


def _blurred(grey: Image) -> NDArray[np.float32]:
    return np.asarray(cv2.blur(grey, (3, 3)), np.float32)
