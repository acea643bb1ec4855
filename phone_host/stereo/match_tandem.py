"""The own matcher: semi-global matching of both views in C (`native/src/match.c`), for two unlike cameras.

1. The right image gets the left one's levels and height, both measured along a rough match (match_differences).
2. The library matches: `native/src/match.c` says how. docs/decisions/0036-own-matcher.md says what each step gains and what
   was left out.
"""

import os

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import SettingsError
from phone_host.model import Confidence, Disparity, Image, Matched, RectifiedPair
from phone_host.native.library import Library, MatchJob
from phone_host.stereo.match_differences import Differences, differences
from phone_host.stereo.match_input import check_pair, grey

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
        self._engine = _Engine(disparities, library, threads or matching_threads())

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
        self._engine.require_room(*left.shape)  # before the rough match, which needs less
        found = self._found(left, right)
        disparity, confidence = self._engine.computed(left, found.undone(right))
        report = found.report(confidence_histogram(confidence))
        return Matched(disparity=disparity, confidence=confidence, report=report)

    def _found(self, left: Image, right: Image) -> Differences:
        return differences(left, right, lambda here, there, factor: self._engine.computed(here, there, factor)[0])


def confidence_histogram(confidence: Confidence) -> tuple[int, ...]:
    """Count the pixels that have a value, in 15 classes of 17 levels of confidence.

    Args:
        confidence: (H, W) uint8, 0 = no value.
    """
    counts = np.asarray(cv2.calcHist([confidence], [0], None, [256], [0, 256])).reshape(-1)[1:]
    return tuple(int(count) for count in counts.reshape(CLASSES, -1).sum(axis=1))


class _Engine:
    """The library's matcher with its workspace.

    Args:
        disparities: N >= 1.
        library: computes.
        threads: at least 1.
    """

    def __init__(self, disparities: int, library: Library, threads: int) -> None:
        self._disparities, self._library, self._threads = disparities, library, threads
        self._workspace: NDArray[np.uint8] = np.empty(0, np.uint8)

    def require_room(self, height: int, width: int) -> None:
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

    def computed(self, left: Image, right: Image, factor: int = 1) -> tuple[Disparity, Confidence]:
        """Match two grey images of one size; the library itself checks neither sizes nor strides.

        Args:
            left: (H, W) uint8, with any strides.
            right: the same size.
            factor: by which they were reduced; the search is, too.

        Returns:
            Disparity, (H, W) float32, px, NaN = none; and confidence, (H, W) uint8, 0 = none.
        """
        height, width = left.shape
        self.require_room(height, width)
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
        self._library.match(job)
        return disparity, confidence
