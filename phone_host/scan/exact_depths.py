"""Depths made more exact where a thing is: each is moved along its ray until both images agree around it. Pure.

A matcher that sweeps an image one way only carries disparities on from row to row. Where they change along the columns it lags, by up to 0.15 px: a table
lies too far, what stands on it too near. That is the same in all views of a thing, so that no number of views averages it out. Here nothing is
carried on: the right image is laid onto the left one by the disparities that are known, and what is left between both tells the rest.

Source: B. D. Lucas and T. Kanade, "An Iterative Image Registration Technique with an Application to Stereo Vision", 1981.
"""

from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Image
from phone_host.scan.view import Depth, View
from phone_host.stereo.reproject import least_in_front_px

Floats = NDArray[np.float32]
F: Final = np.float32

_AROUND_PX: Final = 9
"""Side of the window in which both images must agree: with half of it the surface is as exact, and has more holes."""

_SMOOTH_PX: Final = 5
"""Before that, disparities are averaged in a window so wide: a matcher's sixteenths are rough."""

_SAME_SURFACE_PX: Final = 1.0
_MOST_STEP_PX, _MOST_IN_ALL_PX = 0.5, 0.7
"""One step suffices, as the start is near. What moves farther has not found the same place again, and stays where the matcher saw it."""

_NOISE_LEVELS2: Final = F(1)
"""Variance of the grey levels' slopes at which the images tell no more than the matcher did."""

_CONTRAST_LEVELS2: Final = F(4)
_MOST_CONTRAST: Final = F(4)
_RIM_PX: Final = 12


def with_exact_depths(view: View, wanted: Depth) -> View:
    """Make the depths of a view with a right image more exact around those that are wanted, (H, W), NaN = not wanted; known are those that were known before."""
    known = np.isfinite(wanted)
    if view.right is None or not known.any():
        return view
    rows, columns = (np.flatnonzero(known.any(axis=axis)) for axis in (1, 0))
    part = tuple(
        slice(max(int(at[0]) - _RIM_PX, 0), min(int(at[-1]) + _RIM_PX + 1, size))
        for at, size in zip((rows, columns), known.shape, strict=True)
    )
    of, depth = view.geometry, view.depth_m.copy()
    scale = F(of.focal_px * of.baseline_m)
    disparity = scale / depth[part] - F(of.doffs_px)
    moved = _moved(view, view.right, part, disparity) + F(of.doffs_px)
    is_before = moved > least_in_front_px(of)  # not what is so far away that it would move behind the cameras
    depth[part] = np.where(is_before, scale / np.where(is_before, moved, F(1)), depth[part])
    return replace(view, depth_m=depth)


@dataclass(frozen=True, slots=True)
class _Around:
    """Means around each pixel of those whose disparity is known."""

    known: Floats
    share: Floats

    @staticmethod
    def of(known: Floats) -> "_Around":
        """Return means over the pixels that are 1."""
        return _Around(known, np.maximum(_blurred(known, _AROUND_PX), F(1e-6)))

    def mean(self, values: Floats) -> Floats:
        """Return the mean of values."""
        return np.asarray(_blurred(values * self.known, _AROUND_PX) / self.share, F)


def _moved(view: View, right: Image, part: tuple[slice, ...], disparity: Floats) -> Floats:
    """Return a part's disparities (h, w), px, moved until both images agree; NaN stays."""
    is_known = np.isfinite(disparity)
    known, before = is_known.astype(F), np.where(is_known, disparity, F(0))
    around, left = _Around.of(known), view.grey[part].astype(F)
    left_mean = around.mean(left)
    left_spread = around.mean(left * left) - left_mean * left_mean
    along, across = (F(step) for step in view.epipolar.way)
    other = right.astype(F)
    ramp = np.array([-0.5, 0, 0.5])
    slopes = cv2.filter2D(other, -1, ramp[np.newaxis] * along if along else ramp[:, np.newaxis] * across)
    rows, columns = (at.astype(F) for at in np.mgrid[part])
    found = _smoothed(before, known)
    at = columns + along * found, rows + across * found
    seen, slope = (np.asarray(cv2.remap(each, *at, cv2.INTER_LINEAR), F) for each in (other, slopes))
    seen_mean, slope_mean = around.mean(seen), around.mean(slope)
    spread = around.mean(seen * seen) - seen_mean * seen_mean
    contrast = np.sqrt((left_spread + _CONTRAST_LEVELS2) / (spread + _CONTRAST_LEVELS2))
    contrast = np.clip(contrast, 1 / _MOST_CONTRAST, _MOST_CONTRAST)
    # Both sensors have levels of their own: what differs by a factor and a constant agrees.
    own = around.mean(slope * left) - slope_mean * left_mean
    others = around.mean(slope * seen) - slope_mean * seen_mean
    told = around.mean(slope * slope) - slope_mean * slope_mean
    step = (own - contrast * others) / (contrast * told + _NOISE_LEVELS2)
    found = found + np.clip(step, -_MOST_STEP_PX, _MOST_STEP_PX)
    stays = np.abs(found - before) > _MOST_IN_ALL_PX
    return np.where(is_known, np.where(stays, before, found), F(np.nan)).astype(F)


def _smoothed(disparity: Floats, known: Floats) -> Floats:
    """Average disparities with those around them on the same surface."""
    mean = _blurred(disparity * known, _SMOOTH_PX) / np.maximum(_blurred(known, _SMOOTH_PX), F(1e-6))
    same = known * (np.abs(disparity - mean) < _SAME_SURFACE_PX)
    total = _blurred(disparity * same, _SMOOTH_PX) / np.maximum(_blurred(same, _SMOOTH_PX), F(1e-6))
    return np.where(same > 0, total, disparity).astype(F)


def _blurred(values: Floats, side_px: int) -> Floats:
    return np.asarray(cv2.blur(values, (side_px, side_px), borderType=cv2.BORDER_CONSTANT), F)


_BRIGHT_PERCENT: Final = 80.0
"""Of a thing's pixels so many are darker. What is bright of its own, and sure, stays."""

_BRIGHT_RIM_PX: Final = 5
_SURE: Final = 128
"""Confidence, of 255: surer depths of a shiny thing are off by more than a pixel at most three times in a hundred, less sure ones eight times and more."""


def without_reflections(view: View, wanted: Depth) -> View:
    """Leave out the depths of a thing that are bright and unsure, where a lamp may be reflected: both cameras see its image, which lies behind the surface.

    What is reflected comes on top of a surface's own light, and lies elsewhere for each camera, so the matcher is not sure of it.

    Args:
        view: with the matcher's confidence; one without stays as it is.
        wanted: (H, W) its depths that show the thing, NaN elsewhere.
    """
    is_thing = np.isfinite(wanted)
    if view.confidence is None or not is_thing.any():
        return view
    blue, green, red = cv2.split(view.colours)
    darkest = np.minimum(np.minimum(blue, green), red)  # a lamp's light is white, whatever the colour of the thing
    is_bright = darkest > np.percentile(darkest[is_thing], _BRIGHT_PERCENT)
    around = cv2.dilate(is_bright.astype(np.uint8), np.ones((_BRIGHT_RIM_PX, _BRIGHT_RIM_PX), np.uint8)) > 0
    is_out = is_thing & around & (view.confidence < _SURE)
    return view.masked(~is_out)
