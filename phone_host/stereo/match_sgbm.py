"""The matcher where the native library is not built: OpenCV's semi-global matching (Hirschmueller, PAMI 30(2), 2008), with our own checks and finishing steps.

docs/decisions/0002-sgbm-tuning.md says what each step gains:

1. the right image gets the left one's levels (match_differences), and is moved vertically if it is measurably too high or low
   (match_align); both are measured along a rough match that needs no equal levels (match_differences);
2. StereoSGBM, 3-way mode, single-pixel cost, once for the left and once for the right view, with OpenCV's own checks
   off; the left border is extended by N pixels, without which the first N columns would get no value;
3. median of the left view, left-right check, speckles dropped, rows dropped whose texture says nothing: the rest is NaN;
4. the same at half size with eight paths and high penalties: the guide. Where the two disagree, the images decide; what is
   missing inside a surface is completed (match_support, docs/decisions/0031-levels-and-support.md);
5. narrow gaps within one surface bridged, pixel locking undone, the rest of the noise averaged (filters).
"""

import cv2
import numpy as np

from common.errors import SettingsError
from phone_host.model import Disparity, Image, Matched, RectifiedPair
from phone_host.stereo import filters
from phone_host.stereo.match_differences import differences, reduced
from phone_host.stereo.match_support import supported, without_doubtful_bridges
from phone_host.stereo.matcher_protocol import check_pair, grey

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


GUIDE_STEP, GUIDE_JUMP = 24, 240
"""P1 and P2 of the guide: smooth enough that plain areas take the depth of their edges, and that a whole board stays on one surface."""

GUIDE_AGREEMENT_PX, GUIDE_SPECKLE_PX = 1.0, 100
"""Left-right check and largest island dropped, px of the guide's size."""

GUIDE_STEPS = 40_000_000
"""Width x height x disparities of the guide at most: its eight paths keep about 4 bytes for each, so 160 MB."""


def _engine(
    step: int = COST_STEP, jump: int = COST_JUMP, mode: int = cv2.StereoSGBM_MODE_SGBM_3WAY, **checks: int
) -> cv2.StereoSGBM:
    return cv2.StereoSGBM.create(
        minDisparity=0,
        numDisparities=DISPARITY_BLOCK,
        blockSize=1,
        P1=step,
        P2=jump,
        preFilterCap=COST_CAP,
        mode=mode,
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
        self._guide = _engine(
            GUIDE_STEP, GUIDE_JUMP, cv2.StereoSGBM_MODE_HH, disp12MaxDiff=-1, uniquenessRatio=0, speckleWindowSize=0
        )
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
        found = differences(
            left, right, lambda here, there, factor: filters.to_px(self._compute(self._rough, here, there, factor))
        )
        return Matched(disparity=self._disparity(left, found.undone(right)), report=found.report())

    def _disparity(self, left: Image, right: Image) -> Disparity:
        """Match two images that are aligned."""
        steps = self._trusted(self._fine, left, right, 1, AGREEMENT_PX)
        found = filters.to_px(filters.without_speckles(steps, SPECKLE_AREA_PX, SPECKLE_STEP_PX))
        factor = 2
        while left.size * min(self._disparities, left.shape[1]) > GUIDE_STEPS * factor**3:
            factor *= 2
        guide, grain = self._guiding(left, right, factor), factor / 2
        kept = supported(left, right, found, guide, grain)
        bridged = filters.bridged(kept, GAP_PX, GAP_STEP_PX)
        disparity = without_doubtful_bridges(bridged, kept, guide, grain)
        disparity = filters.unlocked(disparity, LOCKING_PX)
        averaged = filters.smoothed(disparity, SMOOTH_WINDOW_PX, SMOOTH_STEP_PX, SMOOTH_REACH_PX)
        return filters.within_right_image(averaged)

    def _guiding(self, left: Image, right: Image, factor: int) -> Disparity:
        """Match smaller images smoothly; the result has the full size."""
        small_left, small_right = reduced(left, factor), reduced(right, factor)
        steps = self._trusted(self._guide, small_left, small_right, factor, GUIDE_AGREEMENT_PX)
        small = filters.to_px(filters.without_speckles(steps, GUIDE_SPECKLE_PX, SPECKLE_STEP_PX))
        height, width = left.shape
        full = cv2.resize(small, (width, height), interpolation=cv2.INTER_NEAREST)
        guide = np.asarray(full, np.float32) * np.float32(width / small.shape[1])
        return np.where(guide <= self._disparities - 1, guide, np.float32(np.nan))

    def _trusted(
        self, engine: cv2.StereoSGBM, left: Image, right: Image, scale: int, agreement_px: float
    ) -> filters.Steps:
        """Match both views; keep what both agree on, within the range, in rows that say something."""
        left_steps = np.asarray(cv2.medianBlur(self._compute(engine, left, right, scale), MEDIAN_PX), np.int16)
        # The right view is the left view of the mirrored and swapped pair.
        right_steps = self._compute(engine, mirrored(right), mirrored(left), scale)[:, ::-1]
        trusted = filters.confirmed(left_steps, right_steps, agreement_px)
        trusted &= left_steps <= (self._disparities - 1) * filters.STEPS_PER_PX
        trusted &= (filters.told_rows(left) & filters.told_rows(right))[:, np.newaxis]
        return np.where(trusted, left_steps, np.int16(filters.NO_STEPS))

    def _compute(self, engine: cv2.StereoSGBM, left: Image, right: Image, scale: int = 1) -> filters.Steps:
        """Run OpenCV's matcher on images reduced by scale, with the left border extended."""
        # d <= x < width: a wider search could only find places outside the right image.
        wanted = min(-(-self._disparities // scale), left.shape[1])
        searched = -(-wanted // DISPARITY_BLOCK) * DISPARITY_BLOCK
        if searched > GREATEST_SEARCH:
            raise SettingsError(
                f"--disparities {self._disparities} is more than sgbm can hold ({GREATEST_SEARCH})",
                "use smaller images, a smaller --disparities, or --matcher block",
            )
        engine.setNumDisparities(searched)
        padded = (cv2.copyMakeBorder(image, 0, 0, searched, 0, cv2.BORDER_REPLICATE) for image in (left, right))
        return np.asarray(engine.compute(*padded), np.int16)[:, searched:]


def mirrored(image: Image) -> Image:
    """Return an image with its columns in the reverse order."""
    return np.asarray(cv2.flip(image, 1), np.uint8)
