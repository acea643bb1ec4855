"""Asks of each disparity whether the images support it, or whether a smoother surface would explain them as well.

Semi-global matching invents depth on plain areas, and is one period off where a pattern repeats; both pass its
left-right check. A second match with high penalties (the *guide*) is smooth there, and wrong where the scene is rich in
edges of depth. Where the two disagree, both are put to the test on the images themselves: a value stays only where it
explains them better than the guide does. Then what is missing is taken from the guide where it is confirmed by values on
all four sides.

Pure functions on (H, W) arrays, of any matchers.
"""

from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Disparity, Image

Mask = NDArray[np.bool_]

COST_CAP: Final = 20
"""Grey levels, of level and of slope each: more than this is another surface, no worse match."""

WINDOW_PX: Final = 5
"""Costs are sums over such squares; 9 px gave the same, 1 px let noise decide."""

APART_PX: Final = 2.0
"""Values this far from the guide are judged by whole regions: what is one period or one surface off."""

NEAR_PX: Final = 0.75
"""Values between this and APART_PX from the guide are judged one by one: what drifts on a plain area."""

NEAR_WORSE: Final = 1.0
"""Such a value stays if the guide costs more."""

FAR_PX: Final = 16.0
"""A region this far from the guide is one period off, or an object that stands clear of everything: both can be told by cost."""

INSIDE_SHARE: Final = 0.1
"""A region counts as lying within a surface of the guide if the guide is confirmed around this share of it."""

WORSE: Final = 1.1
"""A region within a surface stays if the guide costs 1.1 times as much there."""

MUCH_WORSE: Final = 0.8
"""Any region goes if the guide costs less than 0.8 of it."""

SLIDE_PX: Final = 0.7
"""The guide is tried this far to both sides, too: it was matched at half the size, and its error must not count against it."""

AGREE_PX: Final = 1.0
"""Values within this of the guide confirm it, and the guide has a break where neighbours differ by more."""

FILL_COST: Final = 8.0
"""Grey levels a pixel: where the guide costs more, it is not taken."""


def cost_of(left: Image, right: Image, disparity: Disparity) -> NDArray[np.float32]:
    """Say how badly the two images fit together by a disparity: capped differences of level and of slope along the row.

    Args:
        left: (H, W) uint8 grey.
        right: the same, with the left one's levels.
        disparity: (H, W) float32, px, NaN = none (taken as 0).

    Returns:
        (H, W) float32, grey levels a pixel, the mean over a square of WINDOW_PX.
    """
    height, width = left.shape
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    x -= np.nan_to_num(disparity)
    there = cv2.remap(right, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    levels = cv2.min(cv2.absdiff(left, np.asarray(there, np.uint8)), np.array(COST_CAP, np.float64))
    slopes = cv2.absdiff(cv2.Sobel(left, cv2.CV_16S, 1, 0), cv2.Sobel(there, cv2.CV_16S, 1, 0))
    # Sobel's weights add up to 8 for a slope of one level a pixel; two of its steps are as bad as one of level.
    slopes = cv2.min(cv2.convertScaleAbs(slopes, alpha=0.25), np.array(COST_CAP, np.float64))
    window = (WINDOW_PX, WINDOW_PX)
    return np.asarray(cv2.boxFilter(cv2.add(levels, slopes), cv2.CV_32F, window), np.float32)


def guide_cost(left: Image, right: Image, guide: Disparity, slide_px: float = SLIDE_PX) -> NDArray[np.float32]:
    """Return the guide's cost as `cost_of` does, the least of three: as it is, and slid to both sides."""
    costs = [cost_of(left, right, guide + np.float32(by)) for by in (-slide_px, 0.0, slide_px)]
    return np.minimum(np.minimum(costs[0], costs[1]), costs[2])


def sides(disparity: Disparity, guide: Disparity) -> tuple[Mask, Mask, Mask, Mask]:
    """Find the pixels from which, in each direction, the guide leads without a break to a value that confirms it.

    Args:
        disparity: (H, W) float32, px, NaN = none.
        guide: the same.

    Returns:
        (H, W) bool each: to the left, right, top, bottom. A pixel that confirms the guide itself counts.
    """
    left = _towards_start(disparity, guide)
    right = _towards_start(disparity[:, ::-1], guide[:, ::-1])[:, ::-1]
    top = _towards_start(disparity.T, guide.T).T
    bottom = _towards_start(disparity.T[:, ::-1], guide.T[:, ::-1])[:, ::-1].T
    return left, right, top, bottom


def _towards_start(disparity: Disparity, guide: Disparity) -> Mask:
    known = np.isfinite(guide)
    confirmed = np.abs(disparity - guide) <= AGREE_PX  # False where either has none
    broken = ~known | (np.isfinite(disparity) & ~confirmed)
    broken[:, 1:] |= np.abs(guide[:, 1:] - guide[:, :-1]) > AGREE_PX
    column = np.arange(guide.shape[1], dtype=np.int32)
    last_confirmed = np.maximum.accumulate(np.where(confirmed, column, np.int32(-1)), axis=1)
    last_broken = np.maximum.accumulate(np.where(broken, column, np.int32(-2)), axis=1)
    # A break at a confirmed pixel lies before it: the surface begins anew there.
    return np.asarray((last_confirmed >= last_broken) & (last_confirmed >= 0), np.bool_)


def supported(left: Image, right: Image, disparity: Disparity, guide: Disparity, grain: float = 1.0) -> Disparity:
    """Drop what the images do not support, and complete surfaces from the guide.

    Args:
        left: (H, W) uint8 grey.
        right: the same, aligned with the left one in levels and rows.
        disparity: (H, W) float32, px, NaN = none.
        guide: a smooth match of the same pair, (H, W) float32, px, NaN = none.
        grain: how coarse the guide is: 1 if it was matched at half the size, 2 at a quarter, and so on.

    Returns:
        A new array.
    """
    own, other = cost_of(left, right, disparity), guide_cost(left, right, guide, SLIDE_PX * grain)
    apart = np.abs(disparity - guide)
    confirmed = np.where(apart <= AGREE_PX * grain, disparity, np.float32(np.nan))
    to_left, to_right, to_top, to_bottom = sides(confirmed, guide)
    inside = (to_left & to_right) | (to_top & to_bottom)
    dropped = _unsupported_regions(apart, inside, own, other, grain)
    dropped |= inside & (apart > NEAR_PX * grain) & (apart <= APART_PX * grain) & (other < NEAR_WORSE * own)
    kept = np.where(dropped, np.float32(np.nan), disparity)
    around = np.logical_and.reduce(sides(kept, guide))
    missing = around & np.isnan(kept) & (other < FILL_COST)
    return np.where(missing, guide, kept)


def without_doubtful_bridges(bridged: Disparity, before: Disparity, guide: Disparity, grain: float = 1.0) -> Disparity:
    """Open those bridged gaps again whose bridge is not where the guide is. What has no guide stays bridged.

    Args:
        bridged: (H, W) float32, px, NaN = none: `before` with gaps closed.
        before: the same before gaps were closed.
        guide: a smooth match of the same pair.
        grain: as for `supported`.

    Returns:
        A new array.
    """
    doubtful = np.isnan(before) & (np.abs(bridged - guide) > AGREE_PX * grain)
    return np.where(doubtful, np.float32(np.nan), bridged)


def _unsupported_regions(
    apart: NDArray[np.float32],
    inside: Mask,
    own: NDArray[np.float32],
    other: NDArray[np.float32],
    grain: float,
) -> Mask:
    """Find the connected regions of values far from the guide that do not explain the images better than it does."""
    disagree = apart > APART_PX * grain
    count, region = cv2.connectedComponents(disagree.astype(np.uint8), connectivity=4)
    label = np.asarray(region, np.int32).reshape(-1)
    chosen = np.flatnonzero(label)
    label = label[chosen]

    def mean(values: NDArray[np.generic]) -> NDArray[np.float64]:
        total = np.bincount(label, values.reshape(-1)[chosen], count)
        return np.asarray(total / np.maximum(pixels, 1), np.float64)

    pixels = np.bincount(label, minlength=count)
    own_mean, other_mean = mean(own), mean(other)
    doubtful = (mean(inside) > INSIDE_SHARE) | (mean(apart) > FAR_PX)
    goes = (doubtful & (other_mean <= WORSE * own_mean)) | (other_mean < MUCH_WORSE * own_mean)
    goes[0] = False
    return np.asarray(goes[np.asarray(region, np.int32)], np.bool_)
