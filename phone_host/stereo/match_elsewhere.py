"""Asks a pair's own images whether something lies outside a range of disparities. Knows nothing of earlier pairs, nor of any matcher.

At a quarter of the size, each small window of the left image is laid over the right one at every disparity. Where it fits much better outside
the range than anywhere inside it, on a patch that moves as one, something is there. Plain areas and repeated patterns fit
as well inside, so they say nothing.
"""

import math
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Image
from phone_host.stereo.match_differences import reduced
from phone_host.stereo.match_levels import without_levels

FACTOR: Final = 4
"""The images are looked at at this fraction of their size: the work falls with its third power."""

WINDOW_PX: Final = (2, 9)
"""Width and height of the windows, px of the small images: narrow, because a pole of 10 px is only two or three wide here, and half-occluded
strips, which fit anywhere, are narrow, too. 5 x 5 missed such poles and had larger patches by chance, 3 x 9 missed one in three."""

CAP: Final = 40
"""Grey levels: more is another surface, no worse fit."""

BETTER: Final = 0.5
"""Outside must cost less than this share of the best inside: half-occluded pixels, which fit nowhere, seldom do."""

LEAST_GAIN: Final = 3.0
"""Grey levels a pixel that outside must cost less: more than the noise of webcams leaves at a quarter of the size."""

AGREE_PX: Final = 1
"""Neighbours of one patch lie within this disparity of the patch's middle, px of the small images."""

LEAST_AREA: Final = 20
"""Pixels of the small images that make a patch: an object of 18 x 18 px. Chance made up to 18 beside edges of depth; a pole of 10 px as high as
320x240 pictures made 23 to 71."""

ROUNDING: Final = 0.5
"""Whole disparities of the small images within this of the range belong to it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Range:
    """A range of disparities.

    Attributes:
        low_px: the least.
        high_px: the first one beyond it.
    """

    low_px: int
    high_px: int

    @property
    def size_px(self) -> int:
        """How many it holds."""
        return self.high_px - self.low_px


def fits_elsewhere(left: Image, right: Image, inside: Range, disparities: int) -> bool:
    """Say whether a part of the left image fits the right one much better outside a range than inside it.

    Args:
        left: (H, W) uint8 grey.
        right: the same size; its levels may differ.
        inside: the range.
        disparities: N, px: 0 <= d < N is asked.
    """
    small_left, small_right = (without_levels(reduced(image, FACTOR)) for image in (left, right))
    width = small_left.shape[1]
    scale = width / left.shape[1]
    low, high = inside.low_px * scale - ROUNDING, (inside.high_px - 1) * scale + ROUNDING
    every = range(min(round((disparities - 1) * scale) + 1, width))
    costs = _Costs(small_left, small_right)
    best = _best(costs, [d for d in every if low <= d <= high])[0]
    nearer = _much_better(costs, [d for d in every if d > high], best)
    farther = _much_better(costs, [d for d in every if d < low], best)
    # There the partner of something in the range may lie outside the right image, and anything else would fit better.
    farther[:, : min(math.ceil(high), width)] = False
    return _has_patch(nearer) or _has_patch(farther)


def _much_better(costs: "_Costs", disparities: list[int], best: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Find the pixels that fit much better at some of these disparities than `best`, and agree with their neighbours on which."""
    if not disparities:
        return np.zeros(costs.shape, np.bool_)
    other, where = _best(costs, disparities)
    better = (other < BETTER * best) & (best - other > LEAST_GAIN)
    together = np.abs(where.astype(np.int16) - cv2.medianBlur(where, 5)) <= AGREE_PX
    return np.asarray(better & together, np.bool_)


def _has_patch(mask: NDArray[np.bool_]) -> bool:
    count, _, figures, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=4)
    return count > 1 and int(figures[1:, cv2.CC_STAT_AREA].max()) >= LEAST_AREA


class _Costs:
    """How badly two images fit at each disparity: one-sided intervals (Birchfield and Tomasi, PAMI 20(4), 1998), mean over windows.

    Args:
        left: (h, w) uint8.
        right: the same size.
    """

    def __init__(self, left: Image, right: Image) -> None:
        self._left = left
        half = np.array([[0.5, 0.5, 0.0]], np.float32)
        before, after = cv2.filter2D(right, -1, half), cv2.filter2D(right, -1, half[:, ::-1])
        self._least = cv2.min(right, cv2.min(before, after))
        self._most = cv2.max(right, cv2.max(before, after))

    @property
    def shape(self) -> tuple[int, int]:
        """(h, w)."""
        return self._left.shape[0], self._left.shape[1]

    def at(self, d: int) -> NDArray[np.float32]:
        """Return (h, w - d) float32, grey levels a pixel, of the left columns from d on."""
        width = self._left.shape[1]
        left, least, most = self._left[:, d:], self._least[:, : width - d], self._most[:, : width - d]
        off = cv2.add(cv2.subtract(left, most), cv2.subtract(least, left))
        off = cv2.min(off, np.array(CAP, np.float64))
        return np.asarray(cv2.boxFilter(off, cv2.CV_32F, WINDOW_PX), np.float32)


def _best(costs: _Costs, disparities: list[int]) -> tuple[NDArray[np.float32], NDArray[np.uint16]]:
    """Return the least cost of each pixel, and at which disparity; twice CAP where the right image ends before all of them."""
    best = np.full(costs.shape, 2 * CAP, np.float32)
    where = np.zeros(costs.shape, np.uint16)
    for d in disparities:
        cost = costs.at(d)
        known, at = best[:, d:], where[:, d:]
        at[cost < known] = d
        np.minimum(known, cost, out=known)
    return best, where
