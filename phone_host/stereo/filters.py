"""Filters that turn a raw disparity map into a reliable one: checks that remove values, and three steps that improve the rest.

Pure functions on (H, W) arrays. Disparity has two forms, which are never mixed: *steps*, int16 in sixteenths of a pixel
with NO_STEPS for none (OpenCV's form), and px, float32 with NaN for none (everywhere else).
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Disparity, Image

Steps = NDArray[np.int16]
"""(H, W) int16, sixteenths of a pixel, NO_STEPS = none."""

STEPS_PER_PX = 16
"""OpenCV's fixed point (StereoMatcher::DISP_SCALE)."""

NO_STEPS = -STEPS_PER_PX
"""OpenCV's mark for no value when the search starts at 0: one pixel below the least disparity."""


def confirmed(left: Steps, right: Steps, tolerance_px: float) -> NDArray[np.bool_]:
    """Left-right check: find the left pixels whose matching right pixel points back to them.

    A left pixel that points outside the right image is not confirmed: the right camera cannot have seen it.

    Args:
        left: disparities of the left pixels; the pixel at x points to x - d.
        right: disparities of the right pixels; the pixel at x points to x + d.
        tolerance_px: the largest difference allowed between the two, px.

    Returns:
        (H, W) bool.
    """
    height, width = left.shape
    column, row = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    column -= left / np.float32(STEPS_PER_PX)
    never = np.iinfo(np.int16).min
    back = cv2.remap(right, column, row, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT, borderValue=(never,))
    apart = np.abs(np.asarray(back, np.int32) - left)
    return np.asarray((left >= 0) & (apart <= tolerance_px * STEPS_PER_PX), np.bool_)


def told_rows(image: Image) -> NDArray[np.bool_]:
    """Find the rows that matching can say anything about: the row, or one above it, changes somewhere from left to right.

    Matching works along rows and from above. On any other row every disparity costs the same, and 0 would win only
    because it comes first.

    Args:
        image: (H, W) uint8 grey.

    Returns:
        (H,) bool.
    """
    return np.logical_or.accumulate((image[:, 1:] != image[:, :-1]).any(axis=1))


def without_speckles(steps: Steps, area_px: int, step_px: float) -> Steps:
    """Drop speckles: connected areas, with less than step_px between neighbours, that are too small to be an object.

    Args:
        steps: disparities.
        area_px: the largest area that is dropped, px.
        step_px: the largest difference between neighbours of one area, px.

    Returns:
        A new array.
    """
    kept = steps.copy()
    cv2.filterSpeckles(kept, NO_STEPS, area_px, round(step_px * STEPS_PER_PX))
    return kept


def to_px(steps: Steps) -> Disparity:
    """Convert steps to px.

    Args:
        steps: disparities; every negative value counts as none.

    Returns:
        (H, W) float32, px, NaN = none.
    """
    return np.where(steps >= 0, steps / np.float32(STEPS_PER_PX), np.float32(np.nan))


def bridged(disparity: Disparity, gap_px: int, step_px: float) -> Disparity:
    """Close narrow gaps whose two ends agree with a straight line between them, first along rows, then along columns.

    Ends that agree belong to one surface, and the disparity of a plane is linear in x and y. Gaps between a near and a
    far surface stay open: nothing says which of the two continues behind the other.

    Args:
        disparity: (H, W) float32, px, NaN = none.
        gap_px: the widest gap that is closed, px.
        step_px: the largest difference between the two ends, px.

    Returns:
        A new array.
    """
    rows = _bridged_rows(disparity, gap_px, step_px)
    return np.ascontiguousarray(_bridged_rows(np.ascontiguousarray(rows.T), gap_px, step_px).T)


def _bridged_rows(disparity: Disparity, gap_px: int, step_px: float) -> Disparity:
    height, width = disparity.shape
    # The fence on both sides of each row counts as known but has no value: it ends a gap, and such a gap is never
    # bridged.
    fenced = np.full((height, width + 2), np.nan, np.float32)
    fenced[:, 1:-1] = disparity
    known = np.isfinite(fenced)
    known[:, [0, -1]] = True
    values, known = fenced.reshape(-1), known.reshape(-1)
    before = np.flatnonzero(known[:-1] & ~known[1:])
    after = np.flatnonzero(~known[:-1] & known[1:]) + 1
    rise = values[after] - values[before]
    close = (after - before <= gap_px + 1) & (np.abs(rise) <= step_px)
    before, after, rise = before[close], after[close], rise[close]
    for step in range(1, gap_px + 1):
        open_still = before + step < after
        start = before[open_still]
        share = np.float32(step) / (after[open_still] - start).astype(np.float32)
        values[start + step] = values[start] + rise[open_still] * share
    return fenced[:, 1:-1]


def unlocked(disparity: Disparity, amplitude_px: float) -> Disparity:
    """Undo pixel locking: d + amplitude * sin(2 pi d).

    A parabola fitted to costs that are not parabolic pulls every value towards the nearest whole pixel. The error is a
    wave with a period of one pixel, to first order a sine (Shimizu and Okutomi, IJCV 63(3), 2005, figure 4). Whole and
    half pixels do not change.

    Args:
        disparity: (H, W) float32, px, NaN = none.
        amplitude_px: 0 to 0.15 px; above 1 / (2 pi) the order of values would change.

    Returns:
        A new array with the same order of values.
    """
    wave = np.sin(disparity * np.float32(2 * np.pi))
    return np.asarray(disparity + np.float32(amplitude_px) * wave, np.float32)


def smoothed(disparity: Disparity, window_px: int, step_px: float, reach_px: float) -> Disparity:
    """Average each value with its neighbours of similar disparity (bilateral filter: Tomasi and Manduchi, ICCV 1998).

    Pixels without a value neither contribute nor receive one.

    Args:
        disparity: (H, W) float32, px, >= 0, NaN = none.
        window_px: edge of the square of neighbours, px, odd.
        step_px: sigma of the weight over the difference in disparity, px.
        reach_px: sigma of the weight over the distance in the image, px.

    Returns:
        A new array.
    """
    known = np.isfinite(disparity)
    # 16 sigma below the least value the weight is exp(-128), practically 0. Not lower, because OpenCV tabulates the
    # weights over the range.
    outside = np.float32(-16 * step_px)
    averaged = cv2.bilateralFilter(np.where(known, disparity, outside), window_px, step_px, reach_px)
    return np.where(known, averaged, np.float32(np.nan))


def within_right_image(disparity: Disparity) -> Disparity:
    """Drop values that point out of the right image: an average with larger neighbours can carry one there.

    Args:
        disparity: (H, W) float32, px, NaN = none.

    Returns:
        A new array. A pixel of column x has less than x + 1: a whole disparity of at most x, and what refines it.
    """
    columns = np.arange(disparity.shape[1], dtype=np.float32)
    return np.where(disparity < columns + 1, disparity, np.float32(np.nan))
