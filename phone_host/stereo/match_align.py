"""Aligns the right image of a pair with the left one before matching: brightness, contrast and vertical position.

A rectified pair is never perfect: exposures differ, and in a rig that was bumped or has warmed up since its calibration
the right image sits some tenths of a pixel too high or too low. Each effect takes two numbers for the whole image. They
are measured from the pair itself, without memory, and left alone where the evidence is weak. Larger faults need a new
calibration; the matcher cannot fix them.
"""

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Disparity, Image

LEAST_CONTRAST = 2.0
"""Grey levels. An image with a lower standard deviation holds little but its own rounding; its contrast can't be measured."""

WINDOW_PX = 9
"""Edge of the windows in which the offset is measured: the smallest odd window at which the estimate stopped changing."""

LEAST_INFORMATION = 4.0
"""A window counts from this mean squared vertical gradient (grey levels^2 per px^2) on: a gradient of two levels a pixel."""

LEAST_WINDOWS = 100
"""Fewer windows than this are too few for a median."""

GREATEST_OFFSET_PX = 2.0
"""Beyond this the linearisation no longer holds, and the pair needs a new calibration, not a correction."""

LEAST_OFFSET_PX = 0.1
"""Below this, interpolating a new right image costs as much as the correction gains."""

NEWTON_STEPS = 2
"""The first step brings 0.5 px to within 0.1; the second reaches the noise."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Levels:
    """A linear change of grey levels: gain * level + offset_levels.

    Attributes:
        gain: above 0.
        offset_levels: grey levels of 0 .. 255.
    """

    gain: float = 1.0
    offset_levels: float = 0.0

    def of(self, image: Image) -> Image:
        """Return the image with changed levels, (H, W) uint8; the image itself if nothing changes."""
        if self == UNCHANGED:
            return image
        levels = np.arange(256) * self.gain + self.offset_levels
        return np.asarray(cv2.LUT(image, np.clip(np.rint(levels), 0, 255).astype(np.uint8)), np.uint8)


UNCHANGED: Final = Levels()


def overall_levels(left: Image, right: Image) -> Levels:
    """Find the change that gives the right image the left one's mean and standard deviation.

    Both see nearly the same scene, so a linear change of levels comes from the cameras (exposure, gain, black level).
    Pixels that are black in either image are not measured: rectification paints black what no camera saw.

    Args:
        left: (H, W) uint8 grey.
        right: the same size.

    Returns:
        The change; none if either image has too little contrast to measure.
    """
    seen = ((left > 0) & (right > 0)).astype(np.uint8)
    (mean_left, spread_left), (mean_right, spread_right) = (
        (float(mean[0, 0]), float(spread[0, 0]))
        for mean, spread in (cv2.meanStdDev(i, mask=seen) for i in (left, right))
    )
    if min(spread_left, spread_right) < LEAST_CONTRAST:
        return UNCHANGED
    gain = spread_left / spread_right
    return Levels(gain=gain, offset_levels=mean_left - gain * mean_right)


def with_levels_of(left: Image, right: Image) -> Image:
    """Give the right image the left one's mean and standard deviation; see `overall_levels`."""
    return overall_levels(left, right).of(right)


def vertical_offset_px(left: Image, right: Image, disparity: Disparity) -> float:
    """Measure how far too low the right image sits, by comparing it with the left one along a rough disparity.

    In each window, brightness constancy L(x, y) = R(x - d - u, y + v) is solved by least squares for the error u of the
    rough disparity and the offset v (Lucas and Kanade, IJCAI 1981). The result is the median of v, weighted by the
    information on v that remains after u is eliminated. So slanted edges, which can't tell u from v, have no say.

    Args:
        left: (H, W) uint8 grey.
        right: the same size, with the left one's levels.
        disparity: (H, W) float32, px, NaN = none; an error of a pixel does no harm.

    Returns:
        Offset v, px: row y of the left image corresponds to row y + v of the right one. 0 if fewer than LEAST_WINDOWS
        windows have texture, if less than three quarters of the evidence agrees on the direction, or if the offset
        exceeds GREATEST_OFFSET_PX.
    """
    height, width = left.shape
    column, row = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    column -= np.nan_to_num(disparity)
    used = np.isfinite(disparity) & (column >= 0)
    low = offset = high = 0.0
    for _ in range(NEWTON_STEPS):
        guesses, weights = _window_offsets(left, right, column=column, row=row + np.float32(offset), used=used)
        if guesses.size < LEAST_WINDOWS:
            return 0.0
        low, offset, high = (offset + quartile for quartile in _weighted_quartiles(guesses, weights))
    return offset if low * high > 0 and abs(offset) <= GREATEST_OFFSET_PX else 0.0


def _window_offsets(
    left: Image, right: Image, *, column: NDArray[np.float32], row: NDArray[np.float32], used: NDArray[np.bool_]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the remaining offset of each window with texture, px, and its weight; the right image is read at (column, row)."""
    there = np.asarray(cv2.remap(right, column, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.float32)
    here = left.astype(np.float32)
    middle = (here + there) / 2
    mask = used.astype(np.float32)
    # Sobel's weights add up to 8 for a slope of one level a pixel.
    across = cv2.Sobel(middle, cv2.CV_32F, 1, 0, scale=1 / 8) * mask
    down = cv2.Sobel(middle, cv2.CV_32F, 0, 1, scale=1 / 8) * mask
    difference = here - there
    difference -= cv2.blur(difference, (WINDOW_PX, WINDOW_PX))  # removes the local rest of unequal exposure

    def window_mean(values: cv2.typing.MatLike) -> NDArray[np.float32]:
        # Windows overlap; every fourth one in each direction holds the same information as all of them.
        return np.asarray(cv2.blur(values, (WINDOW_PX, WINDOW_PX))[::4, ::4], np.float32)

    xx = (
        window_mean(across * across) + 1
    )  # one level^2 of noise keeps the division meaningful where nothing varies in x
    xy, yy = window_mean(across * down), window_mean(down * down)
    xt, yt = window_mean(across * difference), window_mean(down * difference)
    information = yy - xy * xy / xx
    counted = used[::4, ::4] & (information > LEAST_INFORMATION)
    guesses = (yt - xy / xx * xt) / np.maximum(information, np.float32(1))
    return np.asarray(guesses[counted], np.float32), np.asarray(information[counted], np.float32)


def _weighted_quartiles(values: NDArray[np.float32], weights: NDArray[np.float32]) -> tuple[float, float, float]:
    """Return the three values below which a quarter, half and three quarters of the weight lie."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order], dtype=np.float64)
    low, middle, high = values[order][np.searchsorted(total, np.array([0.25, 0.5, 0.75]) * total[-1])]
    return float(low), float(middle), float(high)


def moved_up(image: Image, offset_px: float) -> Image:
    """Move the image up by a fraction of a pixel, with cubic interpolation; the border rows are repeated.

    Args:
        image: (H, W) uint8.
        offset_px: how far, px; row y of the result is row y + offset_px of the image.

    Returns:
        (H, W) uint8.
    """
    height, width = image.shape
    shift = np.array([[1, 0, 0], [0, 1, offset_px]], np.float64)
    flags = cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP
    return np.asarray(
        cv2.warpAffine(image, shift, (width, height), flags=flags, borderMode=cv2.BORDER_REPLICATE), np.uint8
    )
