"""The paper's matcher: sum of absolute differences over 8 x 8 windows, winner takes all on the scanline, left-right check.

Definition. Let L and R be the grey images, extended beyond their borders by their nearest pixel. For 0 <= d < N and d
<= x

    SAD(x, y, d) = sum over i, j = -4 .. 3 of |L(x + i, y + j) - R(x - d + i, y + j)|

The left pixel's disparity is the d of least SAD, the lowest such d on a tie; the right pixel's is the same over SAD(x +
d, y, d). A left pixel keeps its value only if its matching right pixel points back to within 1 px, and if its window
changes somewhere along its rows: a window of even rows looks the same wherever it is put. Otherwise it becomes NaN.
Then the value is refined below one pixel. An image smaller than the window in one direction has no whole window to
compare: all NaN.

The window has an even size and so reaches one pixel further left and up than right and down; OpenCV's StereoBM refuses
even windows.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Disparity, Image, RectifiedPair
from phone_host.stereo.matcher_protocol import check_pair, grey

WINDOW_PX = 8
"""Window edge, px: the paper's."""

BEFORE_PX, AFTER_PX = 4, 3
"""How far the window reaches left and up, right and down of its pixel: x - 4 .. x + 3."""

LEFT_RIGHT_TOLERANCE_PX = 1
"""The two views round the same true disparity on different grids, so whole-pixel results may differ by one without being wrong."""

STRIP_ROWS = 32
"""Rows matched at a time: the costs of a 640 px wide strip at N = 64 take 2.6 MB and stay in cache; a whole image's would not."""


@dataclass(frozen=True, slots=True, eq=False)
class Winners:
    """Whole-pixel result of the search, before any check.

    Attributes:
        left_px: (H, W) int32, px, the left pixels' disparity.
        right_px: (H, W) int32, px, the right pixels' disparity.
        offset_px: (H, W) float32, px, in (-0.5, 0.5]: what refinement below one pixel adds to left_px.
    """

    left_px: NDArray[np.int32]
    right_px: NDArray[np.int32]
    offset_px: NDArray[np.float32]


def search(left: Image, right: Image, disparities: int) -> Winners:
    """Winner takes all over 0 <= d < N for both views, as the module docstring defines it.

    Args:
        left: (H, W) uint8 grey.
        right: the same size.
        disparities: N >= 1, px.
    """
    height, width = left.shape
    border = (BEFORE_PX, AFTER_PX, BEFORE_PX, AFTER_PX)
    padded_left = np.asarray(cv2.copyMakeBorder(left, *border, cv2.BORDER_REPLICATE), np.uint8)
    padded_right = np.asarray(cv2.copyMakeBorder(right, *border, cv2.BORDER_REPLICATE), np.uint8)
    count = min(disparities, width)  # d <= x < width: no pixel can be further left
    winners = Winners(
        np.empty((height, width), np.int32), np.empty((height, width), np.int32), np.empty((height, width), np.float32)
    )
    for top in range(0, height, STRIP_ROWS):
        bottom = min(top + STRIP_ROWS, height)
        rows = slice(top, bottom + WINDOW_PX - 1)
        strip = _search_strip(padded_left[rows], padded_right[rows], count)
        winners.left_px[top:bottom] = strip.left_px
        winners.right_px[top:bottom] = strip.right_px
        winners.offset_px[top:bottom] = strip.offset_px
    return winners


def _search_strip(left: Image, right: Image, count: int) -> Winners:
    """Search one strip; both images are already extended by the window's reach on each side."""
    height, width = left.shape[0] - WINDOW_PX + 1, left.shape[1] - WINDOW_PX + 1
    no_cost = np.iinfo(np.int32).max
    # A SAD is at most 64 * 255 < 2^14 and d < 2^16, so cost * 2^16 + d fits int32. One minimum then finds the least
    # cost together with the lowest d that has it.
    costs = np.full((count + 2, height, width), no_cost, np.int32)
    best_left = np.full((height, width), no_cost, np.int32)
    best_right = np.full((height, width), no_cost, np.int32)
    for d in range(count):
        difference = cv2.absdiff(left[:, d:], right[:, : right.shape[1] - d])
        sums = cv2.boxFilter(difference, cv2.CV_32S, (WINDOW_PX, WINDOW_PX), anchor=(0, 0), normalize=False)
        keys = costs[d + 1, :, d:]
        np.multiply(sums[:height, : width - d], 1 << 16, out=keys)
        keys += d
        np.minimum(best_left[:, d:], keys, out=best_left[:, d:])
        np.minimum(best_right[:, : width - d], keys, out=best_right[:, : width - d])
    best = best_left & 0xFFFF
    return Winners(best, best_right & 0xFFFF, equiangular_offset(costs, best))


def equiangular_offset(costs: NDArray[np.int32], best: NDArray[np.int32]) -> NDArray[np.float32]:
    """Refine below one pixel with two lines of equal and opposite slope through the costs at d - 1, d, d + 1 (a V, not a parabola).

    A sum of absolute differences grows linearly, not quadratically, away from its minimum, so a V is the model that
    fits; a parabola pulls towards whole pixels (Shimizu and Okutomi, "Sub-Pixel Estimation Error Cancellation on
    Area-Based Matching", IJCV 63(3), 2005). Where a neighbour was not searched (d = 0, d = x, d = N - 1) the value
    stays whole.

    Args:
        costs: (N + 2, H, W) int32, cost * 2^16 + d at [d + 1]; int32's maximum where not searched.
        best: (H, W) int32, px, the winner d.

    Returns:
        (H, W) float32, px, in (-0.5, 0.5].
    """
    lower, middle, upper = (np.take_along_axis(costs, (best + step)[None], 0)[0] for step in (0, 1, 2))
    searched = (lower != np.iinfo(np.int32).max) & (upper != np.iinfo(np.int32).max)
    below, centre, above = ((c >> 16).astype(np.float32) for c in (lower, middle, upper))
    rise = np.maximum(below, above) - centre
    offset = np.zeros(best.shape, np.float32)
    np.divide(below - above, 2 * rise, out=offset, where=searched & (rise > 0))
    return offset


def points_back(left_px: NDArray[np.int32], right_px: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Left-right check: find the left pixels whose matching right pixel confirms them to within LEFT_RIGHT_TOLERANCE_PX.

    Args:
        left_px: (H, W) int32, px, 0 <= d <= x.
        right_px: (H, W) int32, px.

    Returns:
        (H, W) bool.
    """
    x_right = np.arange(left_px.shape[1], dtype=np.int32) - left_px
    apart = np.abs(np.take_along_axis(right_px, x_right, 1) - left_px)
    return np.asarray(apart <= LEFT_RIGHT_TOLERANCE_PX, np.bool_)


def varies(image: Image) -> NDArray[np.bool_]:
    """Find the pixels whose window distinguishes places along the scanline: at least one of its rows changes from left to right.

    Args:
        image: (H, W) uint8 grey.

    Returns:
        (H, W) bool.
    """
    border = (BEFORE_PX, AFTER_PX, BEFORE_PX, AFTER_PX)
    padded = np.asarray(cv2.copyMakeBorder(image, *border, cv2.BORDER_REPLICATE), np.uint8)
    steps = (padded[:, 1:] != padded[:, :-1]).astype(np.uint8)
    # A window of 8 columns has 7 steps between columns.
    counts = cv2.boxFilter(steps, cv2.CV_32S, (WINDOW_PX - 1, WINDOW_PX), anchor=(0, 0), normalize=False)
    return np.asarray(counts[: image.shape[0], : image.shape[1]] > 0, np.bool_)


class BlockMatcher:
    """The paper's 8 x 8 matcher, as the module docstring defines it, on the grey image.

    Args:
        disparities: N >= 1, px: 0 <= d < N is searched.
    """

    def __init__(self, disparities: int) -> None:
        self._disparities = disparities

    def match(self, pair: RectifiedPair) -> Disparity:
        """Match one pair; see `Matcher.match`."""
        check_pair(pair)
        if min(pair.left.shape[:2]) < WINDOW_PX:
            return np.full(pair.left.shape[:2], np.nan, np.float32)
        left = grey(pair.left)
        winners = search(left, grey(pair.right), self._disparities)
        trusted = points_back(winners.left_px, winners.right_px) & varies(left)
        disparity = winners.left_px.astype(np.float32) + winners.offset_px
        return np.where(trusted, disparity, np.float32(np.nan))
