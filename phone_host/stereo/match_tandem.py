"""The own matcher: semi-global matching of both views in C (`native/src/match.c`), for two unlike cameras.

1. The right image gets the left one's levels and height, both measured along a rough match (match_differences).
2. The library matches: `native/src/match.c` says how. docs/decisions/0036-own-matcher.md says what each step gains and what
   was left out.
3. Of reduced images, large areas are asked whether the images tell their disparities, or whether the matcher's smoothing carried them there from elsewhere
   (`without_untold`).

On a bare wall each disparity costs the same. Noise keeps the two views of a full-size pair from agreeing there; reduced
images have lost it, so that both views take what the nearest object has, and the left-right check passes. So a value needs
evidence: along its row, brightness changes in the left image as it does in the right one, moved by the value.

1. *Clear texture*: in a window of WINDOW_PX the slopes of both images correlate. A window reaches beyond an object's edge on to
   the wall, so the mask is cut back by as much: what is left ends where the texture ends.
2. *Weak texture*: slopes of a few levels, in windows so large that noise averages out, without the pixels of (1): an object's
   edge must not speak for the wall behind it.
3. *Between*: plain parts of a surface that is told around them: without a step, three of the four ways lead to told values.
4. *Large and unsure*: what is left goes if it is wide and the matcher itself was unsure of it. Small plain parts are right more
   often than not, because their surroundings are theirs.

At full size little is wrong, and what would go is right more often (decision 0036). Each step is taken only if the ones before leave a large area. Images of
more than MOST_PIXELS are looked at in half the size. Sums are integers, so that all processors find the same.
"""

import os
from dataclasses import replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import SettingsError
from phone_host.model import Confidence, Disparity, Image, Matched, RectifiedPair
from phone_host.native.library import Library, MatchJob
from phone_host.stereo.match_differences import differences
from phone_host.stereo.matcher_protocol import check_pair, grey

GREATEST_SEARCH = 2048
"""Disparities that the library's tables hold."""

GREATEST_WIDTH = 32767
"""Columns that fit its int16."""

CLASSES = 15
"""Of the histogram of confidence: 17 levels each."""


def matching_threads() -> int:
    """Return how many threads match: one for each processor that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class TandemMatcher:
    """Matches with the native library. The result does not depend on the threads nor on the instruction set.

    Args:
        disparities: N >= 1, px: 0 <= d < N is searched.
        library: computes.
        threads: that work on one pair; 0: one for each processor.
    """

    def __init__(self, disparities: int, library: Library, threads: int = 0) -> None:
        self._disparities, self._library, self._threads = disparities, library, threads or matching_threads()
        self._workspace: NDArray[np.uint8] = np.empty(0, np.uint8)

    def match(self, pair: RectifiedPair) -> Disparity:
        """Match one pair; see `Matcher.match`.

        Raises:
            SettingsError: more than 2048 disparities are asked for on an image at least that wide.
        """
        return self.matched(pair).disparity

    def matched(self, pair: RectifiedPair) -> Matched:
        """Match one pair and tell what was corrected; see `ReportingMatcher.matched`."""
        check_pair(pair)
        left, right = grey(pair.left), grey(pair.right)
        self._require_room(*left.shape)  # before the rough match, which needs less
        found = differences(left, right, lambda here, there, factor: self._computed(here, there, factor)[0])
        disparity, confidence = self._computed(left, found.undone(right))
        report = found.report(confidence_histogram(confidence))
        return Matched(disparity=disparity, confidence=confidence, report=report)

    def _require_room(self, height: int, width: int) -> None:
        """Refuse images that the library cannot hold.

        Args:
            height: of the image, px.
            width: of the image, px.

        Raises:
            SettingsError: the image is too wide, or N is too large for it.
        """
        if width > GREATEST_WIDTH or height > GREATEST_WIDTH:
            raise SettingsError(
                f"images of {width}x{height} px are larger than tandem can hold ({GREATEST_WIDTH} px a side)",
                "use smaller images, or --matcher block",
            )
        if min(self._disparities, width) > GREATEST_SEARCH:
            raise SettingsError(
                f"--disparities {self._disparities} is more than tandem can hold ({GREATEST_SEARCH})",
                "use smaller images, a smaller --disparities, or --matcher block",
            )

    def _computed(self, left: Image, right: Image, factor: int = 1) -> tuple[Disparity, Confidence]:
        """Match two grey images of one size; the library itself checks neither sizes nor strides.

        Args:
            left: (H, W) uint8, with any strides.
            right: the same size.
            factor: by which they were reduced; the search is, too.

        Returns:
            Disparity, (H, W) float32, px, NaN = none; and confidence, (H, W) uint8, 0 = none.
        """
        height, width = left.shape
        self._require_room(height, width)
        if right.shape != left.shape or left.dtype != np.uint8 or right.dtype != np.uint8 or left.size == 0:
            raise ValueError(f"no pair: {left.dtype} {left.shape}, {right.dtype} {right.shape}")
        left, right = (image if image.strides[1] == 1 else np.ascontiguousarray(image) for image in (left, right))
        disparity = np.empty((height, width), np.float32)
        confidence = np.empty((height, width), np.uint8)
        job = MatchJob(
            left=left.ctypes.data,
            right=right.ctypes.data,
            left_stride=left.strides[0],
            right_stride=right.strides[0],
            disparity=disparity.ctypes.data,
            confidence=confidence.ctypes.data,
            width=width,
            height=height,
            # d <= x < width: a wider search could only find places outside the right image.
            disparities=min(-(-self._disparities // factor), width),
            threads=self._threads,
            guide=int(factor == 1),  # a rough match only has to be right where it has a value
        )
        needed = self._library.match_bytes(job)
        if self._workspace.size < needed:
            self._workspace = np.empty(needed, np.uint8)
        job.workspace, job.workspace_bytes = self._workspace.ctypes.data, self._workspace.size
        self._library.run(job)
        return disparity, confidence


def confidence_histogram(confidence: Confidence) -> tuple[int, ...]:
    """Count the pixels that have a value, in 15 classes of 17 levels of confidence.

    Args:
        confidence: (H, W) uint8, 0 = no value.
    """
    counts = np.asarray(cv2.calcHist([confidence], [0], None, [256], [0, 256])).reshape(-1)[1:]
    return tuple(int(count) for count in counts.reshape(CLASSES, -1).sum(axis=1))


Mask = NDArray[np.bool_]
_Floats = NDArray[np.float32]
_Slopes = NDArray[np.int16]

MOST_PIXELS: Final = 160_000

WINDOW_PX: Final = 9
LIKENESS: Final = 4.5
"""Least correlation of clear texture times the root of the number of pixels: 0.5 in a whole window. That of noise scatters by 0.17
there: neighbouring slopes share a pixel."""

LEAST_LEVELS: Final = 0.15
"""Mean product of the slopes, squared levels per two pixels: less is rounding."""

STEEPEST: Final = 60
"""Steeper slopes count as this, grey levels per two pixels: one edge is no more than one."""

WIDE_PX: Final = 33
WIDE_CLIP: Final = 6
"""Steeper slopes count as this in the wide windows, grey levels per two pixels."""

WIDE_LEAST_LEVELS: Final = 0.02
WIDE_SHARE: Final = 0.15
"""A wide window with less of its pixels free of clear texture says nothing: specks far apart are alike by chance, and many together look sure."""

STEP_PX: Final = 1.0
"""Neighbours of one surface differ by no more, px of the images looked at."""

WAYS: Final = 3

LARGE_SHARE: Final = 0.05
"""Areas narrower than this share of the longer side stay."""

AREA_SHARE: Final = 0.01
"""Areas smaller than this share of the image stay."""

SURE: Final = 100
"""Areas of a greater mean confidence stay. Wrong walls have 5 to 82."""


def without_untold(pair: RectifiedPair, matched: Matched) -> Matched:
    """Drop the values of large areas that the images do not tell; see `untold`.

    Args:
        pair: what was matched, rows along rows.
        matched: what was found; returned as it is if it has no confidence.
    """
    if matched.confidence is None:
        return matched
    gone = untold(grey(pair.left), grey(pair.right), matched.disparity, matched.confidence)
    if gone is None:
        return matched
    confidence = np.where(gone, np.uint8(0), matched.confidence)
    report = replace(matched.report, confidence_histogram=confidence_histogram(confidence))
    return Matched(
        disparity=np.where(gone, np.float32(np.nan), matched.disparity), confidence=confidence, report=report
    )


def untold(left: Image, right: Image, disparity: Disparity, confidence: Confidence) -> Mask | None:
    """Find the large areas whose values the images do not tell.

    Args:
        left: (H, W) uint8 grey.
        right: the same, aligned with the left one in levels and rows.
        disparity: (H, W) float32, px, NaN = none.
        confidence: (H, W) uint8.

    Returns:
        (H, W) bool, True only where there is a value; None: there are none.
    """
    height, width = disparity.shape
    if disparity.size <= MOST_PIXELS:
        return _untold(left, right, disparity, confidence)
    size = (max(1, width // 2), max(1, height // 2))
    left, right = (np.asarray(cv2.resize(one, size, interpolation=cv2.INTER_AREA), np.uint8) for one in (left, right))
    small = np.asarray(cv2.resize(disparity, size, interpolation=cv2.INTER_NEAREST), np.float32)
    small *= np.float32(size[0] / width)
    sure = np.asarray(cv2.resize(confidence, size, interpolation=cv2.INTER_NEAREST), np.uint8)
    found = _untold(left, right, small, sure)
    if found is None:
        return None
    # A hole of the smaller map may hold values of the larger one: they go with their neighbours.
    grown = cv2.dilate(found.astype(np.uint8), np.ones((3, 3), np.uint8))
    gone = np.where(np.isnan(small), grown, found).astype(np.uint8)
    whole = cv2.resize(gone, (width, height), interpolation=cv2.INTER_NEAREST)
    return np.asarray(whole.astype(np.bool_) & np.isfinite(disparity), np.bool_)


def _untold(left: Image, right: Image, disparity: Disparity, confidence: Confidence) -> Mask | None:
    known = np.isfinite(disparity)
    slopes = _slopes(left), _moved(_slopes(right), disparity, known)
    near = _clear(_only(slopes[0], known), _only(slopes[1], known), known) & known
    # Beside holes nothing is cut back: there the matcher itself has ended the surface.
    cut = cv2.erode((near | ~known).astype(np.uint8), np.ones((WINDOW_PX, WINDOW_PX), np.uint8))
    told = np.asarray(cut.astype(np.bool_) & known, np.bool_)
    if not _may_go(told, known):
        return None
    free = known & ~near
    told |= _weak(_only(slopes[0], free, WIDE_CLIP), _only(slopes[1], free, WIDE_CLIP), free) & known
    if not _may_go(told, known):
        return None
    return _large(_with_between(disparity, told), known, confidence)


def _moved(slopes: _Slopes, disparity: Disparity, known: Mask) -> _Slopes:
    """Return the right image's slopes as the left camera would see them."""
    height, width = disparity.shape
    x = np.arange(width, dtype=np.float32) - np.where(known, disparity, np.float32(0))
    y = np.broadcast_to(np.arange(height, dtype=np.float32)[:, np.newaxis], x.shape)
    # OpenCV interpolates bytes in integers, all other types in floats.
    there = cv2.remap((slopes + STEEPEST).astype(np.uint8), x, np.ascontiguousarray(y), cv2.INTER_LINEAR)
    return np.asarray(there.astype(np.int16) - STEEPEST, np.int16)


def _slopes(image: Image) -> _Slopes:
    slopes = cv2.filter2D(image, cv2.CV_16S, np.array([[-1, 0, 1]], np.float32))
    return np.asarray(np.clip(slopes, -STEEPEST, STEEPEST), np.int16)


def _only(slopes: _Slopes, where: Mask, most: int = STEEPEST) -> _Slopes:
    return np.asarray(np.clip(slopes, -most, most) * where, np.int16)


def _sums(values: NDArray[np.int16] | Image, window_px: int) -> _Floats:
    size = (window_px, window_px)
    return np.asarray(
        cv2.boxFilter(values, cv2.CV_32S, size, normalize=False, borderType=cv2.BORDER_CONSTANT), np.float32
    )


def _product_sums(one: _Slopes, other: _Slopes, window_px: int) -> _Floats:
    return _sums(np.asarray(cv2.multiply(one, other), np.int16), window_px)


def _clear(left: _Slopes, right: _Slopes, known: Mask) -> Mask:
    """The fewer pixels of a window have a value, the more alike they must be: a speck is chosen because it is alike by chance."""
    both, own, other = (_product_sums(*pair, WINDOW_PX) for pair in ((left, right), (left, left), (right, right)))
    alike = both * both * _sums(known.view(np.uint8), WINDOW_PX) > np.float32(LIKENESS * LIKENESS) * own * other
    return np.asarray(alike & (both > LEAST_LEVELS * WINDOW_PX * WINDOW_PX), np.bool_)


def _weak(left: _Slopes, right: _Slopes, free: Mask) -> Mask:
    """Light that falls off is no texture, so each window's mean slope is taken off."""
    pixels = _sums(free.view(np.uint8), WIDE_PX)
    count = np.maximum(pixels, np.float32(1))
    left_sum, right_sum = _sums(left, WIDE_PX), _sums(right, WIDE_PX)
    both = _product_sums(left, right, WIDE_PX) - left_sum * right_sum / count
    own = _product_sums(left, left, WIDE_PX) - left_sum * left_sum / count
    other = _product_sums(right, right, WIDE_PX) - right_sum * right_sum / count
    alike = both * both * count > np.float32(LIKENESS * LIKENESS) * own * other
    enough = (both > np.float32(WIDE_LEAST_LEVELS) * count) & (pixels > WIDE_SHARE * WIDE_PX * WIDE_PX)
    return np.asarray(alike & enough, np.bool_)


def _with_between(disparity: Disparity, told: Mask) -> Mask:
    """Add the values from which WAYS of the four ways lead, without a step or a hole, to told ones."""
    broken = np.isnan(disparity)
    ways = np.zeros(disparity.shape, np.uint8)
    for axis in (0, 1):
        here, there = (slice(1, None), slice(None)), (slice(None, -1), slice(None))
        one, other = (here, there) if axis == 0 else (here[::-1], there[::-1])
        steps = ~(np.abs(disparity[one] - disparity[other]) <= STEP_PX)
        for way, after in ((1, one), (-1, other)):
            stops = broken.copy()
            stops[after] |= steps
            ways += _reached(told, stops, axis, way)
    return np.asarray(told | (ways >= WAYS), np.bool_)


def _reached(told: Mask, stops: Mask, axis: int, way: int) -> Mask:
    """Tell which pixels have a told one before them, in a direction, after the last one that stops."""
    along = slice(None, None, way)
    turned = along if axis == 0 else (slice(None), along)
    number = np.arange(1, told.shape[axis] + 1, dtype=np.int16)
    number = number[:, np.newaxis] if axis == 0 else number
    last_told = np.maximum.accumulate(number * told[turned], axis=axis)
    last_stop = np.maximum.accumulate(number * stops[turned], axis=axis)
    return np.asarray(((last_told >= last_stop) & (last_told > 0))[turned], np.bool_)


def _wide(told: Mask) -> Image:
    """Return 1 in the areas without told values that are wide, 0 elsewhere."""
    edge = round(LARGE_SHARE * max(told.shape)) | 1  # of even squares the opening would move the areas by a pixel
    return np.asarray(cv2.morphologyEx((~told).astype(np.uint8), cv2.MORPH_OPEN, np.ones((edge, edge), np.uint8)))


def _may_go(told: Mask, known: Mask) -> bool:
    """Tell whether wide areas without told values hold enough values at all."""
    return bool((_wide(told).astype(np.bool_) & known).any())


def _large(told: Mask, known: Mask, confidence: Confidence) -> Mask | None:
    """Return the values in large areas, of little confidence, without told ones; None: there are none."""
    wide = _wide(told)
    count, area_of, stats, _ = cv2.connectedComponentsWithStats(wide, connectivity=4)
    area_of = np.asarray(area_of)[known]
    values = np.bincount(area_of, minlength=count)
    confidences = np.bincount(area_of, confidence[known], count)
    goes = (np.asarray(stats)[:, cv2.CC_STAT_AREA] >= AREA_SHARE * told.size) & (confidences < SURE * values)
    goes[0] = False  # what is told
    if not goes.any():
        return None
    found = np.zeros(told.shape, np.bool_)
    found[known] = goes[area_of]
    return found
