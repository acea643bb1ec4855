"""The own matcher: semi-global matching of both views in C (`native/src/match.c`), for two unlike cameras.

docs/decisions/0032-own-matcher.md says what each step gains and what was left out.
"""

import os

import numpy as np
from numpy.typing import NDArray

from common.errors import SettingsError
from phone_host.model import Disparity, Image, RectifiedPair
from phone_host.stereo.match_input import check_pair, grey
from phone_host.stereo.native.library import Library, MatchJob

GREATEST_SEARCH = 2048
"""Disparities that the library's tables hold."""

GREATEST_WIDTH = 32767
"""Columns that fit its int16."""


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
        self._disparities, self._library = disparities, library
        self._threads = threads or matching_threads()
        self._workspace: NDArray[np.uint8] = np.empty(0, np.uint8)

    def match(self, pair: RectifiedPair) -> Disparity:
        """Match one pair; see `Matcher.match`."""
        check_pair(pair)
        return self._computed(grey(pair.left), grey(pair.right))[0]

    def _computed(self, left: Image, right: Image) -> tuple[Disparity, NDArray[np.uint8]]:
        height, width = left.shape
        searched = min(
            self._disparities, width
        )  # d <= x < width: a wider search could only find places outside the right image
        if searched > GREATEST_SEARCH or width > GREATEST_WIDTH:
            raise SettingsError(
                f"disparities = {self._disparities} at {width} px is more than tandem can hold ({GREATEST_SEARCH})",
                "use smaller images, fewer disparities, or --matcher block",
            )
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
            disparities=searched,
            threads=self._threads,
            guide=1,
        )
        needed = self._library.match_bytes(job)
        if self._workspace.size < needed:
            self._workspace = np.empty(needed, np.uint8)
        job.workspace, job.workspace_bytes = self._workspace.ctypes.data, self._workspace.size
        self._library.match(job)
        return disparity, confidence
