"""Finds how the two cameras of a pair differ, levels and vertical position, and undoes it: what our semi-global matchers do first.

Both are measured at half size, along a rough match that needs no equal levels and works at half size or a quarter; each
matcher makes that match itself.
"""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from phone_host.model import Disparity, Image, MatchReport
from phone_host.stereo.match_align import LEAST_OFFSET_PX, moved_up, vertical_offset_px
from phone_host.stereo.match_levels import LevelField, levels_between, without_levels

FACTOR = 2
"""Levels and vertical position are measured at half size."""

LEAST_ROUGH_PX = 15_000
"""The rough match works at half of that size again while this many pixels are left: at a quarter it costs an eighth."""

RoughMatch = Callable[[Image, Image, int], Disparity]
"""Matches two grey images that are reduced by the given factor; px of that size, NaN where the match is not trusted."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Differences:
    """How the right image differs from the left one.

    Attributes:
        levels: the change that gives it the left one's levels.
        vertical_px: how far too low it lies, px; 0 where that is too little to be worth a correction.
    """

    levels: LevelField
    vertical_px: float

    def undone(self, right: Image) -> Image:
        """Return the right image with the left one's levels and at its height, (H, W) uint8."""
        right = self.levels.of(right)
        return right if self.vertical_px == 0 else moved_up(right, self.vertical_px)

    def report(self, confidence_histogram: tuple[int, ...] | None = None) -> MatchReport:
        """Return what is told of them; see `MatchReport`."""
        return MatchReport(
            vertical_px=self.vertical_px,
            gain=self.levels.gain,
            offset_levels=self.levels.offset_levels,
            vignetting_percent=self.levels.vignetting_percent,
            shading_percent=self.levels.shading_percent,
            confidence_histogram=confidence_histogram,
        )


def differences(left: Image, right: Image, rough_match: RoughMatch) -> Differences:
    """Measure how the right image differs from the left one.

    Args:
        left: (H, W) uint8 grey.
        right: the same size.
        rough_match: only has to be right where it has a value.
    """
    small_left, small_right = halved(left), halved(right)
    rough = _rough(small_left, small_right, rough_match)
    height, width = rough.shape
    small_left, small_right = small_left[:height, :width], small_right[:height, :width]
    levels = levels_between(small_left, small_right, rough)
    vertical_px = FACTOR * vertical_offset_px(small_left, levels.of(small_right), rough)
    return Differences(levels=levels, vertical_px=0.0 if abs(vertical_px) < LEAST_OFFSET_PX else vertical_px)


def _rough(left: Image, right: Image, rough_match: RoughMatch) -> Disparity:
    """Match two images of half size, smaller where they are large; the result lacks the last column or row if those are odd."""
    if left.size < 4 * LEAST_ROUGH_PX:
        return rough_match(without_levels(left), without_levels(right), FACTOR)
    rough = 2 * rough_match(without_levels(halved(left)), without_levels(halved(right)), 2 * FACTOR)
    size = (2 * rough.shape[1], 2 * rough.shape[0])
    return np.asarray(cv2.resize(rough, size, interpolation=cv2.INTER_NEAREST), np.float32)


def halved(image: Image) -> Image:
    """Return the image at half size without an odd last column or row: whole squares of four pixels are averaged, which is fast."""
    height, width = (size // 2 * 2 or 1 for size in image.shape)
    return reduced(image[:height, :width], 2)


def reduced(image: Image, factor: int) -> Image:
    """Return the image at a fraction of its size, at least one pixel wide and high; each pixel is the mean of what it covers."""
    height, width = image.shape
    size = (max(width // factor, 1), max(height // factor, 1))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
