"""Measures what a pair's images say about its depth: density, consistency, vertical error, brightness, arrangement. Pure.

`phone_host.diagnostics.image_rules` judges it. All is measured at reduced size, so that a judgement of 640x480 costs about
50 ms of one core.
"""

import math
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Disparity, Evidence, Exposure, Image, OffMiddle, Processed, Search
from phone_host.stereo import filters
from phone_host.stereo.core import StereoCore
from phone_host.stereo.depth_limits import is_off_the_middle
from phone_host.stereo.evidence_features import Matches, find_features, match, on_common_rows, supports
from phone_host.stereo.evidence_points import PointMaps, ThroughRig, Unmoved
from phone_host.stereo.evidence_search import ambiguity, measure_fit, sampled_places
from phone_host.stereo.evidence_track import tracked
from phone_host.stereo.images import to_grey
from phone_host.stereo.rectifier import corrected_rectification, corrected_rig
from phone_host.stereo.working import lying, lying_pair, reduced

_TINY_PX: Final = 80
"""Width at which structure is measured: each pixel is then the mean of many, and noise is gone."""

_SMOOTH_PX: Final = 4.0
"""Vignetting and glow through a finger are wider than this at that width, and no structure."""

_SHARP_WIDTH_PX: Final = 640
_REACH_PX: Final = 5
_EDGES: Final = 20
"""Fewer edges than this say nothing about focus."""

_LEAST_RISE: Final = 12.0
_SURE_RISE: Final = 24.0
_RISE_SHARE: Final = 0.3
"""Grey levels over which an edge must rise: far above a webcam's noise, which is 3 levels after averaging along the edge.
In images of little contrast a share of their range is enough."""

_SHARPEST: Final = 20
"""Percentile of the edges' widths. Edges of shadows and round bodies are wide in the sharpest image."""


def measure_exposure(image: Image, features: int) -> Exposure:
    """Measure what an image holds.

    Args:
        image: (H, W) uint8 grey, whole.
        features: number of features found in it.
    """
    height, width = image.shape
    tiny_px = (_TINY_PX, max(8, round(_TINY_PX * height / width)))
    tiny = np.asarray(cv2.resize(image, tiny_px, interpolation=cv2.INTER_AREA), np.float32)
    detail = np.abs(tiny - cv2.GaussianBlur(tiny, (0, 0), _SMOOTH_PX))
    return Exposure(
        mean_level=float(tiny.mean()),
        bright_level=float(np.percentile(tiny, 98)),
        structure=float(np.percentile(detail, 90)),
        blur_px=_edge_width_px(image),
        features=features,
    )


def _edge_width_px(image: Image) -> float:
    """Measure the width of the sharpest edges: how far brightness would need to rise to its full height at its steepest slope.

    Returns:
        Standard deviation of the blur that makes such an edge, px of an image at most 640 px wide; NaN with too few edges.
    """
    width = image.shape[1]
    scale = _SHARP_WIDTH_PX / width
    if scale < 1:
        image = np.asarray(cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), np.uint8)
    widths = np.concatenate([_widths(image), _widths(np.ascontiguousarray(image.T))])
    if len(widths) < _EDGES:
        return float("nan")
    return float(np.percentile(widths, _SHARPEST))


def _widths(image: Image) -> NDArray[np.float32]:
    """Return the widths of the edges that cross the rows, px."""
    if min(image.shape) < 2 * _REACH_PX + 1:
        return np.zeros(0, np.float32)
    # Along the edge only. Neighbouring rows hold the same edges: every second one is enough.
    smooth = cv2.blur(image, (1, 3))[::2].astype(np.int16)
    slope = np.abs(smooth[:, 2:] - smooth[:, :-2]).astype(np.float32) / 2
    window = np.ones((1, 2 * _REACH_PX + 1), np.uint8)
    inner = smooth[:, 1:-1]
    rise = (cv2.dilate(inner, window) - cv2.erode(inner, window)).astype(np.float32)
    steepest = cv2.dilate(slope, window)
    low, high = (float(level) for level in np.percentile(smooth[::2, ::4], (2, 98)))
    least = max(_LEAST_RISE, min(_SURE_RISE, _RISE_SHARE * (high - low)))
    edges = (slope >= steepest) & (rise >= least) & (slope > 0)
    # A step blurred by sigma rises by height / (sigma * sqrt(2 pi)) a pixel at its steepest.
    return np.asarray(rise[edges] / slope[edges] / np.float32(np.sqrt(2 * np.pi)), np.float32)


_FEATURE_PX: Final = 48_000
"""Pixels of the images in which features are searched, some 253 x 190: more take longer and find no more mistakes."""

_CHECK_WIDTH_PX: Final = 480
_CHECKS: Final = 160
"""Samples of consistency: its standard error is 4 % at most."""

_PATCH_PX: Final = 9
_BACK_PX: Final = 1.5
"""A disparity is consistent if the search from right to left returns within this distance at the size of the check."""

_CHANCE_SHARE: Final = 0.005
"""A black image beside a good one is matched at 0.1 % of its pixels, a plain wall at 0.2 %; the sparsest good pair at 21 %."""

_BEHIND_PX: Final = 2.0
"""Cameras whose principal points are nearly equal see the sky at the edge of the search, which says nothing."""

_SCATTERED_WIDTH_PX: Final = 640
_PIECE_SHARE: Final = 0.002
_PIECE_STEP_PX: Final = 1.0
"""A piece of surface smaller than this share of the image is a speck: 600 px of 640x480, some 25 x 25."""

_FEWEST: Final = 8


def maps_of(core: StereoCore, processed: Processed) -> PointMaps:
    """Return the way of a point from the cameras' own images to a pair that this core has rectified.

    Args:
        core: the core.
        processed: one of its results.
    """
    height_px, width_px = processed.pair.left.shape[:2]
    rectifier = core.rectifier_for((width_px, height_px))
    if rectifier is not None:
        turned = processed.overlay
        return ThroughRig(
            corrected_rig(rectifier.rig, turned), corrected_rectification(rectifier.rectification, turned)
        )
    return Unmoved(width_px, height_px)


def has_depth(processed: Processed) -> bool:
    """Tell whether a pair has depth: a point, and not only the few chance matches that images without relation give."""
    cut = processed.cut
    if cut is not None:
        return cut.kept > 0 and cut.inside - cut.unmatched >= _CHANCE_SHARE * cut.inside
    return processed.disparity is not None and bool(np.isfinite(processed.disparity).any())


def density(processed: Processed) -> float:
    """Return the share of a pair's pixels that have a disparity; pixels outside a crop were never asked for.

    Args:
        processed: the pair; one without disparity has none: 0.
    """
    if processed.disparity is None:
        return 0.0
    inside = processed.disparity.size if processed.cut is None else processed.cut.inside
    return int(np.count_nonzero(np.isfinite(processed.disparity))) / max(1, inside)


@dataclass(frozen=True, slots=True, eq=False)
class Examined:
    """What was seen in one pair.

    Attributes:
        evidence: what it says about the depth.
        left: the left image, (H, W) uint8 grey, laid so that its epipolar lines are rows.
        right: the right one.
        matches: features of both that belong together and stand upright, px of these images.
    """

    evidence: Evidence
    left: Image
    right: Image
    matches: Matches


def look_at(processed: Processed, maps: PointMaps | None) -> Examined:
    """Measure the evidence in one pair.

    Args:
        processed: the pair; rectified if `maps` is given. Stacked cameras' pairs are laid on their side first, so that
            rows are rows.
        maps: the way of a point from the cameras' own images; None if the pair is not rectified. Then only brightness
            and sharpness are measured.
    """
    pair, disparity, epipolar = lying_pair(processed.pair), processed.disparity, processed.pair.epipolar
    left, right = to_grey(pair.left), to_grey(pair.right)
    if maps is None or disparity is None:
        blind = Evidence(left=measure_exposure(left, 0), right=measure_exposure(right, 0))
        return Examined(blind, left, right, Matches(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0, np.float32)))
    height_px, width_px = left.shape
    from_rig = isinstance(maps, ThroughRig)
    is_cropped = isinstance(maps, ThroughRig) and maps.rig.is_cropped
    if epipolar.is_vertical:
        # Points then take the way of images that came rectified: a turned camera's axis is taken for the image's middle.
        disparity, maps = lying(disparity, epipolar), Unmoved(width_px, height_px)
    scale = min(1.0, math.sqrt(_FEATURE_PX / left.size))
    found = [find_features(_stretched(reduced(image, scale)), scale) for image in (left, right)]
    plain, turned_over = (match(*found, is_mirrored=mirror) for mirror in (False, True))
    upright = tracked(left, right, plain.turned_by(0))
    vertical_px, offset_px = _vertical(upright, height_px)
    fit = measure_fit(upright, processed, disparity)
    check = min(1.0, _CHECK_WIDTH_PX / width_px)
    few = disparity[::8, ::8]
    evidence = Evidence(
        left=measure_exposure(left, len(found[0].points_px)),
        right=measure_exposure(right, len(found[1].points_px)),
        density=density(processed),
        behind_share=_behind(processed),
        scattered_share=_scattered(disparity),
        disparity_px=_middle(_wanted(few, processed)),
        consistency=_consistency(left, right, disparity, 0.0 if math.isnan(offset_px) else offset_px),
        vertical_px=vertical_px,
        vertical_offset_px=offset_px,
        supports=supports(upright, plain, turned_over, maps, (width_px, height_px)),
        beyond_share=fit.beyond_share,
        enough_disparities=fit.enough_disparities,
        enough_from_m=fit.enough_from_m,
        skew_px=fit.skew_px,
        ambiguous_share=ambiguity(
            reduced(left, check),
            reduced(right, check),
            disparity,
            (processed.search or Search()).disparities,
            check,
        ),
        from_rig=from_rig,
        is_cropped=is_cropped,
        off_middle=None if from_rig else _off_middle(processed),
        matched_scale=1.0 if processed.search is None else processed.search.scale,
    )
    return Examined(evidence, left, right, upright)


def _wanted(disparity: Disparity, processed: Processed) -> Disparity:
    """Return the disparities that lie between the limits of depth; all, if that leaves none."""
    limits, geometry = processed.limits, processed.geometry
    if limits is None or geometry is None:
        return disparity
    depth_m = np.float32(geometry.focal_px * geometry.baseline_m) / np.maximum(
        disparity + np.float32(geometry.doffs_px), np.float32(1e-6)
    )
    kept = np.where((depth_m >= limits.near_m) & (depth_m <= limits.far_m), disparity, np.float32(np.nan))
    return kept if np.isfinite(kept).any() else disparity


def _behind(processed: Processed) -> float:
    """Return the share of the disparities at infinity and behind it, if infinity is no edge of the search; else 0."""
    cut, geometry = processed.cut, processed.geometry
    if cut is None or geometry is None or geometry.doffs_px > -_BEHIND_PX:
        return 0.0
    return cut.at_zero / max(1, cut.inside - cut.unmatched)


def _off_middle(processed: Processed) -> OffMiddle | None:
    """Return the principal point, if it lies far from the middle of images that came rectified."""
    geometry, (height_px, width_px) = processed.geometry, processed.pair.left.shape[:2]
    if geometry is None or not is_off_the_middle(geometry, (width_px, height_px)):
        return None
    return OffMiddle(cx_px=geometry.cx_px, cy_px=geometry.cy_px, width_px=width_px, height_px=height_px)


def _scattered(disparity: Disparity) -> float:
    """Return the share of the disparities that lie in pieces too small for a surface; NaN without any."""
    height_px, width_px = disparity.shape
    scale = min(1.0, _SCATTERED_WIDTH_PX / width_px)
    if scale < 1:
        size = (max(1, round(width_px * scale)), max(1, round(height_px * scale)))
        disparity = np.asarray(cv2.resize(disparity, size, interpolation=cv2.INTER_NEAREST)) * np.float32(scale)
    known = np.isfinite(disparity)
    if not known.any():
        return math.nan
    whole = np.where(known, np.rint(disparity * filters.STEPS_PER_PX), filters.NO_STEPS).astype(np.int16)
    kept = filters.without_speckles(whole, round(_PIECE_SHARE * whole.size), _PIECE_STEP_PX)
    return 1.0 - np.count_nonzero(kept >= 0) / np.count_nonzero(known)


def _middle(disparity: Disparity) -> float:
    """Return the median, px; NaN without any."""
    known = disparity[np.isfinite(disparity)]
    return float(np.median(known)) if known.size else math.nan


def _stretched(image: Image) -> Image:
    """Stretch the levels to the full range, or SIFT finds nothing in a dim image."""
    low, high = (float(level) for level in np.percentile(image, (1, 99)))
    gain = min(255.0 / max(high - low, 1.0), 8.0)
    levels = np.clip((np.arange(256) - low) * gain, 0, 255).astype(np.uint8)
    return np.asarray(cv2.LUT(image, levels), np.uint8)


def _vertical(upright: Matches, height_px: int) -> tuple[float, float]:
    """Return the median distance from the rows and the median offset, px; NaN with too few features."""
    rows = on_common_rows(upright.left_px, upright.right_px, height_px)
    if rows.sum() < _FEWEST:
        return math.nan, math.nan
    down = (upright.right_px - upright.left_px)[rows, 1]
    return float(np.median(np.abs(down))), float(np.median(down))


def _consistency(left: Image, right: Image, disparity: Disparity, offset_px: float) -> float:
    """Search sampled points of the right image in the left one and count those that lead back.

    Args:
        left: (H, W) uint8.
        right: the same size.
        disparity: (H, W), px.
        offset_px: how far too low the right image lies: matchers correct that.

    Returns:
        Share of the samples; NaN with too few disparities.
    """
    width = left.shape[1]
    scale = min(1.0, _CHECK_WIDTH_PX / width)
    small = reduced(left, scale), reduced(right, scale)
    half = _PATCH_PX // 2
    sample = sampled_places(disparity, _CHECKS)
    if not len(sample):
        return math.nan
    values = disparity[sample[:, 0], sample[:, 1]] * scale
    reach = math.ceil(float(np.nanmax(disparity)) * scale) + 2
    found = tried = 0
    for (row, column), shift in zip(((sample + 0.5) * scale - 0.5).tolist(), values.tolist(), strict=True):
        y, x = round(row), round(column - shift)
        expected = column - shift - x  # the rest that rounding took
        lower = y + round(offset_px * scale)
        if min(y, lower, x) < half:
            continue
        patch = small[1][lower - half : lower + half + 1, x - half : x + half + 1]
        strip = small[0][y - half : y + half + 1, x - half : x + reach + half + 1]
        if patch.shape != (_PATCH_PX, _PATCH_PX) or strip.shape[0] < _PATCH_PX or strip.shape[1] < _PATCH_PX + shift:
            continue
        tried += 1
        likeness: NDArray[np.float32] = np.asarray(cv2.matchTemplate(strip, patch, cv2.TM_CCOEFF_NORMED), np.float32)
        found += abs(int(likeness.argmax()) - shift - expected) <= _BACK_PX
    return found / tried if tried >= _CHECKS // 4 else math.nan
