"""The matcher where the native library is not built: OpenCV's semi-global matching (Hirschmueller, PAMI 30(2), 2008), with our own checks and finishing steps.

docs/decisions/0002-sgbm-tuning.md says what each step gains:

1. the right image gets the left one's levels (match_differences), and is moved vertically if it is measurably too high or low
   (match_align); both are measured along a rough match that needs no equal levels (match_differences);
2. StereoSGBM, 3-way mode, single-pixel cost, once for the left and once for the right view, with OpenCV's own checks
   off; the left border is extended by N pixels, without which the first N columns would get no value;
3. median of the left view, left-right check, speckles dropped, rows dropped whose texture says nothing: the rest is NaN;
4. the same at half size with eight paths and high penalties: the guide. Where the two disagree, the images decide; what is
   missing inside a surface is completed (docs/decisions/0031-levels-and-support.md);
5. narrow gaps within one surface bridged, pixel locking undone, the rest of the noise averaged (filters).

Step 4: semi-global matching invents depth on plain areas, and is one period off where a pattern repeats; both pass its left-right check. A second
match with high penalties (the *guide*) is smooth there, and wrong where the scene is rich in edges of depth. Where the two disagree, both are put to
the test on the images themselves: a value stays only where it explains them better than the guide does. Then what is missing is taken from the guide
where it is confirmed by values on all four sides.
"""

from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import SettingsError
from phone_host.model import Disparity, Image, Matched, RectifiedPair
from phone_host.stereo import filters
from phone_host.stereo.match_differences import differences, reduced
from phone_host.stereo.matcher_protocol import check_pair, grey

Mask = NDArray[np.bool_]

COST_CAP: Final = 20
"""Grey levels, of level and of slope each: more than this is another surface, no worse match."""

WINDOW_PX: Final = 5
"""Costs are sums over such squares; 9 px gave the same, 1 px let noise decide."""

APART_PX: Final = 2.0
"""Values this far from the guide are judged by whole regions: what is one period or one surface off."""

NEAR_PX: Final = 0.75
"""Values between this and APART_PX from the guide are judged one by one: what drifts on a plain area."""

NEAR_WORSE: Final = 1.0
"""Such a value stays if the guide costs more."""

FAR_PX: Final = 16.0
"""A region this far from the guide is one period off, or an object that stands clear of everything: both can be told by cost."""

INSIDE_SHARE: Final = 0.1
"""A region counts as lying within a surface of the guide if the guide is confirmed around this share of it."""

WORSE: Final = 1.1
"""A region within a surface stays if the guide costs 1.1 times as much there."""

MUCH_WORSE: Final = 0.8
"""Any region goes if the guide costs less than 0.8 of it."""

SLIDE_PX: Final = 0.7
"""The guide is tried this far to both sides, too: it was matched at half the size, and its error must not count against it."""

AGREE_PX: Final = 1.0
"""Values within this of the guide confirm it, and the guide has a break where neighbours differ by more."""

FILL_COST: Final = 8.0
"""Grey levels a pixel: where the guide costs more, it is not taken."""


def cost_of(left: Image, right: Image, disparity: Disparity) -> NDArray[np.float32]:
    """Say how badly the two images fit together by a disparity: capped differences of level and of slope along the row.

    Args:
        left: (H, W) uint8 grey.
        right: the same, with the left one's levels.
        disparity: (H, W) float32, px, NaN = none (taken as 0).

    Returns:
        (H, W) float32, grey levels a pixel, the mean over a square of WINDOW_PX.
    """
    height, width = left.shape
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    x -= np.nan_to_num(disparity)
    there = cv2.remap(right, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    levels = cv2.min(cv2.absdiff(left, np.asarray(there, np.uint8)), np.array(COST_CAP, np.float64))
    slopes = cv2.absdiff(cv2.Sobel(left, cv2.CV_16S, 1, 0), cv2.Sobel(there, cv2.CV_16S, 1, 0))
    # Sobel's weights add up to 8 for a slope of one level a pixel; two of its steps are as bad as one of level.
    slopes = cv2.min(cv2.convertScaleAbs(slopes, alpha=0.25), np.array(COST_CAP, np.float64))
    window = (WINDOW_PX, WINDOW_PX)
    return np.asarray(cv2.boxFilter(cv2.add(levels, slopes), cv2.CV_32F, window), np.float32)


def guide_cost(left: Image, right: Image, guide: Disparity, slide_px: float = SLIDE_PX) -> NDArray[np.float32]:
    """Return the guide's cost as `cost_of` does, the least of three: as it is, and slid to both sides."""
    costs = [cost_of(left, right, guide + np.float32(by)) for by in (-slide_px, 0.0, slide_px)]
    return np.minimum(np.minimum(costs[0], costs[1]), costs[2])


def sides(disparity: Disparity, guide: Disparity) -> tuple[Mask, Mask, Mask, Mask]:
    """Find the pixels from which, in each direction, the guide leads without a break to a value that confirms it.

    Args:
        disparity: (H, W) float32, px, NaN = none.
        guide: the same.

    Returns:
        (H, W) bool each: to the left, right, top, bottom. A pixel that confirms the guide itself counts.
    """
    left = _towards_start(disparity, guide)
    right = _towards_start(disparity[:, ::-1], guide[:, ::-1])[:, ::-1]
    top = _towards_start(disparity.T, guide.T).T
    bottom = _towards_start(disparity.T[:, ::-1], guide.T[:, ::-1])[:, ::-1].T
    return left, right, top, bottom


def _towards_start(disparity: Disparity, guide: Disparity) -> Mask:
    known = np.isfinite(guide)
    confirmed = np.abs(disparity - guide) <= AGREE_PX  # False where either has none
    broken = ~known | (np.isfinite(disparity) & ~confirmed)
    broken[:, 1:] |= np.abs(guide[:, 1:] - guide[:, :-1]) > AGREE_PX
    column = np.arange(guide.shape[1], dtype=np.int32)
    last_confirmed = np.maximum.accumulate(np.where(confirmed, column, np.int32(-1)), axis=1)
    last_broken = np.maximum.accumulate(np.where(broken, column, np.int32(-2)), axis=1)
    # A break at a confirmed pixel lies before it: the surface begins anew there.
    return np.asarray((last_confirmed >= last_broken) & (last_confirmed >= 0), np.bool_)


def supported(left: Image, right: Image, disparity: Disparity, guide: Disparity, grain: float = 1.0) -> Disparity:
    """Drop what the images do not support, and complete surfaces from the guide; return a new array.

    Args:
        left: (H, W) uint8 grey.
        right: the same, aligned with the left one in levels and rows.
        disparity: (H, W) float32, px, NaN = none.
        guide: a smooth match of the same pair, (H, W) float32, px, NaN = none.
        grain: how coarse the guide is: 1 if it was matched at half the size, 2 at a quarter, and so on.
    """
    own, other = cost_of(left, right, disparity), guide_cost(left, right, guide, SLIDE_PX * grain)
    apart = np.abs(disparity - guide)
    confirmed = np.where(apart <= AGREE_PX * grain, disparity, np.float32(np.nan))
    to_left, to_right, to_top, to_bottom = sides(confirmed, guide)
    inside = (to_left & to_right) | (to_top & to_bottom)
    dropped = _unsupported_regions(apart, inside, own, other, grain)
    dropped |= inside & (apart > NEAR_PX * grain) & (apart <= APART_PX * grain) & (other < NEAR_WORSE * own)
    kept = np.where(dropped, np.float32(np.nan), disparity)
    around = np.logical_and.reduce(sides(kept, guide))
    missing = around & np.isnan(kept) & (other < FILL_COST)
    return np.where(missing, guide, kept)


def without_doubtful_bridges(bridged: Disparity, before: Disparity, guide: Disparity, grain: float = 1.0) -> Disparity:
    """Open those bridged gaps again whose bridge is not where the guide is. What has no guide stays bridged. Return a new array.

    Args:
        bridged: (H, W) float32, px, NaN = none: `before` with gaps closed.
        before: the same before gaps were closed.
        guide: a smooth match of the same pair.
        grain: as for `supported`.
    """
    doubtful = np.isnan(before) & (np.abs(bridged - guide) > AGREE_PX * grain)
    return np.where(doubtful, np.float32(np.nan), bridged)


def _unsupported_regions(
    apart: NDArray[np.float32],
    inside: Mask,
    own: NDArray[np.float32],
    other: NDArray[np.float32],
    grain: float,
) -> Mask:
    """Find the connected regions of values far from the guide that do not explain the images better than it does."""
    disagree = apart > APART_PX * grain
    count, region = cv2.connectedComponents(disagree.astype(np.uint8), connectivity=4)
    label = np.asarray(region, np.int32).reshape(-1)
    chosen = np.flatnonzero(label)
    label = label[chosen]

    def mean(values: NDArray[np.generic]) -> NDArray[np.float64]:
        total = np.bincount(label, values.reshape(-1)[chosen], count)
        return np.asarray(total / np.maximum(pixels, 1), np.float64)

    pixels = np.bincount(label, minlength=count)
    own_mean, other_mean = mean(own), mean(other)
    doubtful = (mean(inside) > INSIDE_SHARE) | (mean(apart) > FAR_PX)
    goes = (doubtful & (other_mean <= WORSE * own_mean)) | (other_mean < MUCH_WORSE * own_mean)
    goes[0] = False
    return np.asarray(goes[np.asarray(region, np.int32)], np.bool_)


COST_STEP, COST_JUMP = 12, 26
"""P1 and P2, the costs of a change of disparity by one and by more, relative to a single pixel's cost of 0 .. 125."""

_PRE_FILTER_CAP = 31
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
        preFilterCap=_PRE_FILTER_CAP,
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
