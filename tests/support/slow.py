"""A slow stereo core."""

import time

import numpy as np

from phone_host.model import Disparity, RectifiedPair


class SlowMatcher:
    """Finds nothing, slowly: stands in for a matcher that is far slower than the camera.

    Args:
        seconds: time per pair.
    """

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds

    def match(self, pair: RectifiedPair) -> Disparity:
        """Wait, then return an empty map."""
        time.sleep(self._seconds)
        return np.full(pair.left.shape[:2], np.nan, np.float32)
