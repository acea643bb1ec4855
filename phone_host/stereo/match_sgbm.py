"""The default matcher: OpenCV's semi-global block matching (Hirschmueller, PAMI 30(2), 2008), tuned."""

import cv2
import numpy as np

from phone_host.model import Disparity, RectifiedPair
from phone_host.stereo.match_input import check_pair, grey

STEPS_PER_PX = 16
"""OpenCV's disparities are int16 in sixteenths of a pixel."""


class SgbmMatcher:
    """StereoSGBM in its 3-way mode with the left border continued by N pixels, so that the first N columns get values too.

    Args:
        disparities: N >= 1, px: 0 <= d < N is searched.
    """

    def __init__(self, disparities: int) -> None:
        self._disparities = disparities

    def match(self, pair: RectifiedPair) -> Disparity:
        """Match one pair; see `Matcher.match`."""
        check_pair(pair)
        searched = -(-min(self._disparities, pair.left.shape[1]) // 16) * 16
        matcher = cv2.StereoSGBM.create(
            minDisparity=0,
            numDisparities=searched,
            blockSize=3,
            P1=72,
            P2=288,
            disp12MaxDiff=1,
            preFilterCap=31,
            uniquenessRatio=10,
            speckleWindowSize=100,
            speckleRange=2,
            mode=cv2.StereoSGBM_MODE_SGBM_3WAY,
        )
        left, right = (
            cv2.copyMakeBorder(grey(image), 0, 0, searched, 0, cv2.BORDER_REPLICATE)
            for image in (pair.left, pair.right)
        )
        steps = np.asarray(matcher.compute(left, right), np.int16)[:, searched:]
        disparity = steps.astype(np.float32) / STEPS_PER_PX
        inside = (steps >= 0) & (steps <= (self._disparities - 1) * STEPS_PER_PX)
        return np.where(inside, disparity, np.float32(np.nan))
