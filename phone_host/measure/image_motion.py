"""How fast a camera's image moves: a few corners, followed from one frame to the next, twice a second. Some ms each time.

Only speeds come out. Corners are followed there and back (Kalal et al., Forward-Backward Error, ICPR 2010): those that do not return are dropped.
"""

from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Image

_WIDTH_PX: Final = 320
"""Images are scaled to this width: there half a pixel is seen and 40 px a frame can be followed with 3 levels of a pyramid."""

_CORNERS: Final = 80
_FEWEST: Final = 8
_RETURN_PX: Final = 0.5
_PERIOD_NS: Final = 500_000_000
_LONGEST_NS: Final = 300_000_000
"""Frames further apart than this show too much else; nothing is measured then."""

_RECENT: Final = 4
_FAST_PERCENTILE: Final = 90


class MotionMeter:
    """Measures the speed of the fastest tenth of one camera's image; used by one thread, read by any."""

    def __init__(self) -> None:
        self._before: tuple[Image, int] | None = None
        self._due_ns = 0
        self._recent: list[float] = []
        self.width_px = 0

    @property
    def px_s(self) -> float:
        """Median of the last measurements, px/s of the image as it is; NaN before there is one."""
        recent = self._recent
        return float(np.median(recent)) if recent else float("nan")

    def add(self, image: Image, exposed_ns: int, now_ns: int) -> None:
        """Take a frame of the camera.

        Args:
            image: (H, W) or (H, W, 3), uint8; not kept longer than until the next one, and never changed.
            exposed_ns: its exposure mid-point, on any one clock.
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
    """How far the fastest tenth of the image has moved between two frames.

    Args:
        first: (H, W) or (H, W, 3), uint8.
        second: of the same shape.

    Returns:
        The 90th percentile of the corners' shifts, px; NaN where too few can be followed (a blank wall).
    """
    scale: float = min(1.0, _WIDTH_PX / first.shape[1])
    before, after = _small(first, scale), _small(second, scale)
    seen: NDArray[Any] | None = cv2.goodFeaturesToTrack(before, _CORNERS, 0.02, 6)
    if seen is None or len(seen) < _FEWEST:  # None where there is no corner at all, whatever its type says
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
