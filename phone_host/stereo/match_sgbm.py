"""The default matcher: OpenCV's semi-global matching (Hirschmueller, PAMI 30(2), 2008), with our own checks and finishing steps.

docs/decisions/0002-sgbm-tuning.md says what each step gains:

1. the right image gets the left one's levels, and is moved vertically if it is measurably too high or low
   (match_align);
2. StereoSGBM, 3-way mode, single-pixel cost, once for the left and once for the right view, with OpenCV's own checks
   off; the left border is extended by N pixels, without which the first N columns would get no value;
3. median of the left view, left-right check, speckles dropped, rows dropped whose texture says nothing: what is left is
   trusted, the rest is NaN;
4. narrow gaps within one surface bridged, pixel locking undone, the rest of the noise averaged (filters).
"""

import cv2
import numpy as np

from common.errors import SettingsError
from phone_host.model import Disparity, Image, Matched, MatchReport, RectifiedPair
from phone_host.stereo import filters
from phone_host.stereo.match_align import LEAST_OFFSET_PX, moved_up, overall_levels, vertical_offset_px
from phone_host.stereo.match_input import check_pair, grey

COST_STEP, COST_JUMP = 12, 26
"""P1 and P2, the costs of a change of disparity by one and by more, relative to a single pixel's cost of 0 .. 125."""

COST_CAP = 31
"""preFilterCap: horizontal gradients are cut off here. Values from 15 to 63 gave results within 4 % of each other."""

MEDIAN_PX = 5
"""Edge of the median window, px: the largest that OpenCV has for int16."""

AGREEMENT_PX = 1.5
"""Left-right check. Each view rounds and locks to whole pixels on its own; 1 px would drop good slanted surfaces."""

SPECKLE_AREA_PX, SPECKLE_STEP_PX = 60, 1.0
"""Islands of up to 60 px (about 8 x 8) that differ by more than 1 px from their surroundings are mismatches more often than objects."""

GAP_PX, GAP_STEP_PX = 16, 1.0
"""Gaps to bridge: up to 16 px, three of four bridged pixels are right within 2 px; wider gaps do worse."""

LOCKING_PX = 0.12
"""Amplitude of the pixel locking that this cost and OpenCV's parabola leave: 0.05 to 0.15 on real and rendered surfaces."""

SMOOTH_WINDOW_PX, SMOOTH_STEP_PX, SMOOTH_REACH_PX = 9, 1.0, 4.0
"""The final average takes neighbours within about one pixel of disparity."""

DISPARITY_BLOCK = 16
"""StereoSGBM searches multiples of 16."""

GREATEST_SEARCH = 2032
"""The largest multiple of 16 that fits OpenCV's int16 in sixteenths."""


def _engine(**checks: int) -> cv2.StereoSGBM:
    return cv2.StereoSGBM.create(
        minDisparity=0,
        numDisparities=DISPARITY_BLOCK,
        blockSize=1,
        P1=COST_STEP,
        P2=COST_JUMP,
        preFilterCap=COST_CAP,
        mode=cv2.StereoSGBM_MODE_SGBM_3WAY,
        **checks,
    )


class SgbmMatcher:
    """Tuned StereoSGBM, as the module docstring describes it, on the grey images.

    Args:
        disparities: N >= 1, px: 0 <= d < N is searched.
    """

    def __init__(self, disparities: int) -> None:
        self._disparities = disparities
        self._fine = _engine(disp12MaxDiff=-1, uniquenessRatio=0, speckleWindowSize=0)
        # The rough pass only has to be right where it has a value, so OpenCV's own cheap checks are enough.
        self._rough = _engine(disp12MaxDiff=1, uniquenessRatio=10, speckleWindowSize=100, speckleRange=2)

    def match(self, pair: RectifiedPair) -> Disparity:
        """Match one pair; see `Matcher.match`.

        Raises:
            SettingsError: more than 2032 disparities are asked for on an image at least that wide.
        """
        return self.matched(pair).disparity

    def matched(self, pair: RectifiedPair) -> Matched:
        """Match one pair and tell what was corrected; see `ReportingMatcher.matched`."""
        check_pair(pair)
        left, right = grey(pair.left), grey(pair.right)
        levels = overall_levels(left, right)
        right = levels.of(right)
        vertical_px = self._vertical_px(left, right)
        right = right if vertical_px == 0 else moved_up(right, vertical_px)
        disparity = self._disparity(left, right)
        report = MatchReport(vertical_px=vertical_px, gain=levels.gain, offset_levels=levels.offset_levels)
        return Matched(disparity=disparity, report=report)

    def _disparity(self, left: Image, right: Image) -> Disparity:
        """Match two images that are aligned."""
        left_steps = np.asarray(cv2.medianBlur(self._compute(self._fine, left, right), MEDIAN_PX), np.int16)
        # The right view is the left view of the mirrored and swapped pair.
        right_steps = self._compute(self._fine, _mirrored(right), _mirrored(left))[:, ::-1]
        trusted = filters.confirmed(left_steps, right_steps, AGREEMENT_PX)
        trusted &= left_steps <= (self._disparities - 1) * filters.STEPS_PER_PX
        trusted &= (filters.told_rows(left) & filters.told_rows(right))[:, np.newaxis]
        steps = np.where(trusted, left_steps, np.int16(filters.NO_STEPS))
        disparity = filters.to_px(filters.without_speckles(steps, SPECKLE_AREA_PX, SPECKLE_STEP_PX))
        disparity = filters.bridged(disparity, GAP_PX, GAP_STEP_PX)
        disparity = filters.unlocked(disparity, LOCKING_PX)
        return filters.smoothed(disparity, SMOOTH_WINDOW_PX, SMOOTH_STEP_PX, SMOOTH_REACH_PX)

    def _vertical_px(self, left: Image, right: Image) -> float:
        """Measure with a rough match at half size how far too low the right image lies; 0: too little to be worth a correction."""
        height, width = left.shape
        half = (max(width // 2, 1), max(height // 2, 1))
        small_left, small_right = (
            np.asarray(cv2.resize(image, half, interpolation=cv2.INTER_AREA), np.uint8) for image in (left, right)
        )
        rough = filters.to_px(self._compute(self._rough, small_left, small_right, scale=2))
        offset_px = vertical_offset_px(small_left, small_right, rough) * height / half[1]
        return 0.0 if abs(offset_px) < LEAST_OFFSET_PX else offset_px

    def _compute(self, engine: cv2.StereoSGBM, left: Image, right: Image, scale: int = 1) -> filters.Steps:
        """Run OpenCV's matcher on images reduced by scale, with the left border extended."""
        # d <= x < width: a wider search could only find places outside the right image.
        wanted = min(-(-self._disparities // scale), left.shape[1])
        searched = -(-wanted // DISPARITY_BLOCK) * DISPARITY_BLOCK
        if searched > GREATEST_SEARCH:
            raise SettingsError(
                f"disparities = {self._disparities} is more than sgbm can hold ({GREATEST_SEARCH})",
                "use smaller images, fewer disparities, or --matcher block",
            )
        engine.setNumDisparities(searched)
        padded = (cv2.copyMakeBorder(image, 0, 0, searched, 0, cv2.BORDER_REPLICATE) for image in (left, right))
        return np.asarray(engine.compute(*padded), np.int16)[:, searched:]


def _mirrored(image: Image) -> Image:
    return np.asarray(cv2.flip(image, 1), np.uint8)
