"""Measures how fast a camera's image moves by tracking a few corners between two frames, twice a second.

Each measurement takes a few ms and yields only speeds. Corners are tracked forward and backward (Kalal et al.,
Forward-Backward Error, ICPR 2010). Those that do not return are dropped.
"""

from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Image

_WIDTH_PX: Final = 320
"""Images are scaled down to this width: half a pixel is visible, and 3 pyramid levels can track 40 px per frame."""

_CORNERS: Final = 80

_FEWEST: Final = 8

_RETURN_PX: Final = 0.5

_PERIOD_NS: Final = 500_000_000

_LONGEST_NS: Final = 300_000_000
"""Frames further apart than this differ too much in content and are not measured."""

_RECENT: Final = 4

_FAST_PERCENTILE: Final = 90


class MotionMeter:
    """Measures the speed of the fastest tenth of one camera's image. One thread adds frames; any thread may read."""

    def __init__(self) -> None:
        self._before: tuple[Image, int] | None = None
        self._due_ns = 0
        self._recent: list[float] = []
        self.width_px = 0

    @property
    def px_s(self) -> float:
        """Median of the last measurements, px/s at full image size; NaN before the first one."""
        recent = self._recent
        return float(np.median(recent)) if recent else float("nan")

    def add(self, image: Image, exposed_ns: int, now_ns: int) -> None:
        """Take a frame of the camera.

        Args:
            image: (H, W) or (H, W, 3), uint8; kept until the next one at most, and never changed.
            exposed_ns: its exposure mid-point; always on the same clock.
            now_ns: CLOCK_MONOTONIC now, ns.
        """
        before, self._before = self._before, None
        if before is not None:
            elapsed_ns = exposed_ns - before[1]
            if 0 < elapsed_ns <= _LONGEST_NS and before[0].shape == image.shape:
                self._measure(before[0], image, elapsed_ns)
            self._due_ns = now_ns + _PERIOD_NS
        elif now_ns >= self._due_ns:
            self._before = image, exposed_ns

    def _measure(self, first: Image, second: Image, elapsed_ns: int) -> None:
        self.width_px = first.shape[1]
        speed_px = fast_shift_px(first, second)
        if np.isfinite(speed_px):
            self._recent = [*self._recent[1 - _RECENT :], speed_px * 1e9 / elapsed_ns]


def fast_shift_px(first: Image, second: Image) -> float:
    """Measure how far the fastest tenth of the image has moved between two frames.

    Args:
        first: (H, W) or (H, W, 3), uint8.
        second: (H, W) or (H, W, 3), uint8, of the same shape.

    Returns:
        The 90th percentile of the corners' shifts, px; NaN if too few corners can be tracked (a blank wall).
    """
    scale: float = min(1.0, _WIDTH_PX / first.shape[1])
    before, after = _small(first, scale), _small(second, scale)
    seen: NDArray[Any] | None = cv2.goodFeaturesToTrack(before, _CORNERS, 0.02, 6)
    if seen is None or len(seen) < _FEWEST:  # None if there is no corner, whatever its type says
        return float("nan")
    corners = np.asarray(seen, np.float32)
    ahead, found, _ = cv2.calcOpticalFlowPyrLK(before, after, corners, np.empty_like(corners), maxLevel=3)
    back, returned, _ = cv2.calcOpticalFlowPyrLK(after, before, ahead, np.empty_like(corners), maxLevel=3)
    off_px = np.linalg.norm((back - corners).reshape(-1, 2), axis=1)
    kept = np.asarray((found.ravel() == 1) & (returned.ravel() == 1) & (off_px < _RETURN_PX))
    if kept.sum() < _FEWEST:
        return float("nan")
    shifts: NDArray[np.float64] = np.linalg.norm((ahead - corners).reshape(-1, 2)[kept], axis=1)
    return float(np.percentile(shifts, _FAST_PERCENTILE)) / scale


def _small(image: Image, scale: float) -> Image:
    grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
    if scale < 1.0:
        grey = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return np.asarray(grey, np.uint8)
