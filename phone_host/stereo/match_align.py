"""Aligns the right image of a pair with the left one before matching: brightness and contrast of the whole image, and vertical position.

A rectified pair is never perfect: exposures differ, and in a rig that was bumped or has warmed up since its calibration
the right image sits some tenths of a pixel too high or too low. Levels take two numbers for the whole image here (levels
that change over the image: `match_differences`), the vertical position one. They are measured from the pair itself, without
memory, and left alone where the evidence is weak. Larger faults need a new calibration; the matcher cannot fix them.
"""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Disparity, Image

LEAST_CONTRAST = 2.0
"""Grey levels. An image with a lower standard deviation holds little but its own rounding; its contrast can't be measured."""

WINDOW_PX = 9
"""Edge of the squares in which the offset is measured: the smallest odd one at which the estimate stopped changing."""

LEAST_INFORMATION = 4.0
"""A window counts from this mean squared vertical gradient (grey levels^2 per px^2) on: a gradient of two levels a pixel."""

LEAST_SHARE = 0.5
"""Of a window's pixels that must have a disparity."""

MOST_WINDOW_ROWS = 10
"""More rows of windows than this, evenly chosen, do not change the result."""

LEAST_WINDOWS = 20
"""Fewer windows than this are too few for a median."""

GREATEST_OFFSET_PX = 2.0
"""Beyond this the linearisation no longer holds, and the pair needs a new calibration, not a correction."""

LEAST_OFFSET_PX = 0.1
"""Below this, interpolating a new right image costs as much as the correction gains."""

NEWTON_STEPS = 2
"""The first step brings 0.5 px to within 0.1; the second reaches the noise."""

CUBIC = -0.75
"""Keys's parameter of cubic interpolation (IEEE ASSP 29(6), 1981), as OpenCV has it."""

SETTLED_PX = 0.1
"""After a first step so small a second one changes nothing that matters: it would be a fifth as large."""


def with_levels_of(left: Image, right: Image) -> Image:
    """Give the right image the left one's mean and standard deviation; itself if either image has too little contrast to measure.

    Both see nearly the same scene, so a linear change of levels comes from the cameras (exposure, gain, black level).
    Pixels that are black in either image are not measured: rectification paints black what no camera saw.

    Args:
        left: (H, W) uint8 grey.
        right: the same size.
    """
    seen = ((left > 0) & (right > 0)).astype(np.uint8)
    (mean_left, spread_left), (mean_right, spread_right) = (
        (float(mean[0, 0]), float(spread[0, 0]))
        for mean, spread in (cv2.meanStdDev(i, mask=seen) for i in (left, right))
    )
    if min(spread_left, spread_right) < LEAST_CONTRAST:
        return right
    gain = spread_left / spread_right
    levels = np.arange(256) * gain + (mean_left - gain * mean_right)
    return np.asarray(cv2.LUT(right, np.clip(np.rint(levels), 0, 255).astype(np.uint8)), np.uint8)


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
    rows, columns = (size // WINDOW_PX for size in left.shape)  # whole windows
    if rows == 0 or columns == 0:
        return 0.0
    chosen = min(rows, MOST_WINDOW_ROWS)
    top = (2 * np.arange(chosen) + 1) * rows // (2 * chosen) * WINDOW_PX
    # One row more on either side of each window: slopes need it.
    row = np.clip(top[:, np.newaxis] + np.arange(-1, WINDOW_PX + 1), 0, left.shape[0] - 1).reshape(-1)
    width = columns * WINDOW_PX
    here, place = left[row, :width], np.arange(width, dtype=np.float32) - disparity[row, :width]
    used = place >= 0  # not where it is NaN
    column = np.where(used, place, np.float32(0))
    seen_row = np.broadcast_to(row[:, np.newaxis].astype(np.float32), column.shape)
    low = offset = high = 0.0
    for _ in range(NEWTON_STEPS):
        there = cv2.remap(
            right, column, seen_row + np.float32(offset), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
        guesses, weights = _window_offsets(here, np.asarray(there, np.uint8), used)
        if guesses.size < LEAST_WINDOWS:
            return 0.0
        step = _weighted_quartiles(guesses, weights)
        low, offset, high = (offset + quartile for quartile in step)
        if abs(step[1]) < SETTLED_PX:
            break
    return offset if low * high > 0 and abs(offset) <= GREATEST_OFFSET_PX else 0.0


def _window_offsets(
    here: Image, there: Image, used: NDArray[np.bool_]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Measure the remaining offset of each window with texture.

    Args:
        here: rows of windows of the left image, each with one row more above and below.
        there: the right image, seen from the left.
        used: where that is known.

    Returns:
        Offsets, px, and their weights.
    """
    total = cv2.add(here, there, dtype=cv2.CV_32F)
    mask = _inner(used.astype(np.float32))
    # Sobel's weights add up to 8 for a slope of one level a pixel; the total is twice the mean.
    across = cv2.multiply(_inner(cv2.Sobel(total, cv2.CV_32F, 1, 0, scale=1 / 16)), mask)
    down = cv2.multiply(_inner(cv2.Sobel(total, cv2.CV_32F, 0, 1, scale=1 / 16)), mask)
    difference = cv2.multiply(_inner(cv2.subtract(here, there, dtype=cv2.CV_32F)), mask)
    size = (mask.shape[1] // WINDOW_PX, mask.shape[0] // WINDOW_PX)

    def window_mean(values: "cv2.typing.MatLike") -> NDArray[np.float32]:
        return np.asarray(cv2.resize(values, size, interpolation=cv2.INTER_AREA), np.float32)

    share = window_mean(mask)
    # Of the difference counts what is not the window's mean, which is the rest of unequal exposure.
    shift = window_mean(difference) / np.maximum(share, np.float32(1e-3))
    xx = (
        window_mean(cv2.multiply(across, across)) + 1
    )  # one level^2 of noise keeps the division meaningful where nothing varies in x
    xy, yy = window_mean(cv2.multiply(across, down)), window_mean(cv2.multiply(down, down))
    xt = window_mean(cv2.multiply(across, difference)) - window_mean(across) * shift
    yt = window_mean(cv2.multiply(down, difference)) - window_mean(down) * shift
    information = yy - xy * xy / xx
    counted = (share > LEAST_SHARE) & (information > LEAST_INFORMATION)
    guesses = (yt - xy / xx * xt) / np.maximum(information, np.float32(1))
    return np.asarray(guesses[counted], np.float32), np.asarray(information[counted], np.float32)


def _inner(rows: "cv2.typing.MatLike") -> NDArray[np.float32]:
    """Return the windows' rows without those above and below them."""
    width = rows.shape[1]
    inner = rows.reshape(-1, WINDOW_PX + 2, width)[:, 1:-1]
    return np.asarray(inner, np.float32).reshape(-1, width)


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
    whole = math.floor(offset_px)
    t = offset_px - whole
    a = CUBIC
    near, far = ((a + 2) * x**3 - (a + 3) * x**2 + 1 for x in (t, 1 - t))
    before, after = (a * (x**3 - 5 * x**2 + 8 * x - 4) for x in (t + 1, 2 - t))
    first, last = min(whole - 1, 0), max(whole + 2, 0)
    taps = np.zeros((last - first + 1, 1), np.float32)
    taps[whole - 1 - first : whole + 3 - first, 0] = before, near, far, after
    return np.asarray(cv2.filter2D(image, -1, taps, anchor=(0, -first), borderType=cv2.BORDER_REPLICATE), np.uint8)
