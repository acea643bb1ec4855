"""Measures whether a search could find the right disparity at all: is it wide enough, is there only one answer, and how unevenly are the rows off? Pure.

Features are matched over the whole image, so that they also tell disparities that were not searched. Where a pattern
repeats along the rows, a patch of the left image fits several places of the right one, and no matcher can know which.

A matcher corrects a common offset of the rows. A turned camera, another zoom or a wrong calibration moves rows more at
one edge of the image than at the other; that no offset mends. To first order it is a plane over the image; a camera that
was turned aside twists the rows, which is a product of x and y.
"""

import math
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Disparity, Image, Processed, Search
from phone_host.stereo.evidence_features import Matches, on_common_rows
from phone_host.stereo.evidence_points import Points
from phone_host.stereo.reproject import nearest_depth_m

_LOOKED_AT: Final = 50_000
"""Not all pixels are looked at: the places of all in a photograph of 50 megapixels take a gigabyte."""


def sampled_places(disparity: Disparity, count: int) -> NDArray[np.intp]:
    """Choose evenly spread pixels that have a disparity.

    Args:
        disparity: (H, W), px, NaN = none.
        count: how many.

    Returns:
        (count, 2): row, column; (0, 2) if fewer have one.
    """
    step = max(1, round(math.sqrt(disparity.size / _LOOKED_AT)))
    known = np.argwhere(np.isfinite(disparity[::step, ::step])) * step
    if len(known) < count:  # a small crop, or few disparities: then all are few
        known = np.argwhere(np.isfinite(disparity))
    if len(known) < count:
        return np.empty((0, 2), np.intp)
    return known[np.linspace(0, len(known) - 1, count).astype(np.intp)]


"""A plane through fewer features, each off by some tenths of a pixel, may be steep by chance."""

_ROUNDS: Final = 4
_OUTLIER_SIGMAS: Final = 2.5
_LEAST_PX: Final = 0.15
"""Features farther from the plane than 2.5 robust standard deviations, and than tracking's own error, are left out."""

_EXPLAINED: Final = 0.7
"""The plane must leave less than this share of the median departure: half a degree of roll leaves 0.1 to 0.4 of it. False
matches of a chessboard tilt a plane that explains nothing: four times as much is left."""

_SIGMA_OF_MEDIAN: Final = 1.48
"""Standard deviation of normal errors relative to their median absolute value."""


def row_skew_px(left_px: Points, down_px: NDArray[np.float64], size_px: tuple[int, int]) -> float:
    """Fit a twisted plane to the features' offsets from their rows, and return how far it departs from its mean.

    Args:
        left_px: (N, 2) features on common rows, px of the left image.
        down_px: (N,) how far too low each lies in the right image, px.
        size_px: width and height of the image.

    Returns:
        Root mean square over the image, px; at the edge it is some 1.7 times as much. 0 if it does not explain the
        offsets. NaN with too few features.
    """
    if len(left_px) < _FEWEST:
        return math.nan
    design = _terms((left_px + 0.5) / np.array(size_px) - 0.5)
    plane, kept = np.zeros(design.shape[1], np.float64), np.ones(len(design), np.bool_)
    for _ in range(_ROUNDS):
        plane[:] = np.linalg.lstsq(design[kept], down_px[kept], rcond=None)[0]
        rest = np.abs(down_px - design @ plane)
        kept = rest <= max(_OUTLIER_SIGMAS * _SIGMA_OF_MEDIAN * float(np.median(rest)), _LEAST_PX)
        if kept.sum() < _FEWEST // 2:
            return math.nan
    departure = np.abs(down_px - np.median(down_px))
    if np.median(np.abs(down_px - design @ plane)) > _EXPLAINED * np.median(departure) and np.median(departure) > 0:
        return 0.0
    return float((_terms(_EVENLY) @ plane).std())


def _terms(places: Points) -> NDArray[np.float64]:
    """Return the surface's terms at places of the image, -1/2 to 1/2 in both directions."""
    x, y = places.T
    return np.column_stack([np.ones(len(places)), x, y, x * y])


_EVENLY: Final = np.stack(np.meshgrid(np.linspace(-0.5, 0.5, 9), np.linspace(-0.5, 0.5, 9)), axis=-1).reshape(-1, 2)
"""Places all over the image."""


_FEWEST: Final = 20
"""A share of fewer features says little: one wrong match of 20 is 5 %."""

_TILES: Final = 8
"""The image is cut into 8 by 8 tiles: a chessboard holds most of an image's features and covers little of it."""

_ASIDE: Final = 0.25
_ALIKE: Final = 0.05
"""A feature beyond the search counts if a second one within this share of the width has a disparity within that share of it. What is
near shows several; noise of a bare wall is matched by chance one by one, each in a tile that has nothing else."""

_NEAREST_PERCENTILE: Final = 98
_MARGIN: Final = 1.05
_STEP: Final = 16
"""What is asked for covers all but a fiftieth of the features (wrong matches) with a twentieth more, in the matchers' own steps."""

_PATCHES: Final = 160
_FEWEST_PATCHES: Final = 40
_PATCH_PX: Final = 15
"""Edge of a patch at the size of the check: with 9 px, twigs and letters repeat by chance; larger ones see no more."""

_LEAST_REACH: Final = 4
"""As a part of the width."""

_APART_PX: Final = 4
"""Nearer than this, a second place belongs to the same peak."""

_AS_LIKE: Final = 0.05
"""Two places fit equally well if their likeness (of at most 1) differs by less: noise of 3 grey levels changes it by 0.02."""

_SURE: Final = 0.8
"""A best place below this fits badly by itself; it says nothing about other places."""

_VALLEY: Final = 0.3
"""Between the repeats of a pattern, the likeness falls by more than this. Along a level edge it does not: nothing repeats there."""


def beyond_search(
    left_px: Points, disparities_px: NDArray[np.float64], searched: int, size_px: tuple[int, int]
) -> tuple[float, int]:
    """Tell how much of a scene is nearer than a search reaches.

    Args:
        left_px: (N, 2) features of the left image, px.
        disparities_px: (N,) of features on common rows, px of the rectified images.
        searched: N, px of the rectified images; 0: not known.
        size_px: width and height of the image.

    Returns:
        Share of the features, those of each tile of the image together weighing as much, NaN with too few of them or an unknown search; and the search that would reach them.
    """
    if searched < 1 or len(disparities_px) < _FEWEST:
        return math.nan, 0
    believed = (disparities_px < searched) | _confirmed(left_px, disparities_px, disparities_px >= searched, size_px[0])
    left_px, disparities_px = left_px[believed], disparities_px[believed]
    if not len(disparities_px):
        return math.nan, 0
    nearest = float(np.percentile(disparities_px, _NEAREST_PERCENTILE)) * _MARGIN
    column, row = np.clip(left_px / np.array(size_px) * _TILES, 0, _TILES - 1).astype(np.intp).T
    _, tile, count = np.unique(row * _TILES + column, return_inverse=True, return_counts=True)
    share = float(np.average(disparities_px >= searched, weights=1.0 / count[tile]))
    return share, _STEP * max(1, math.ceil(nearest / _STEP))


def _confirmed(
    left_px: Points, disparities_px: NDArray[np.float64], beyond: NDArray[np.bool_], width_px: int
) -> NDArray[np.bool_]:
    """Tell which of the features beyond the search have another one beside them with a like disparity."""
    found = np.flatnonzero(beyond)
    aside = np.abs(left_px[found, np.newaxis] - left_px[found]).max(axis=2) <= _ASIDE * width_px
    alike = np.abs(disparities_px[found, np.newaxis] - disparities_px[found]) <= _ALIKE * width_px
    confirmed = np.zeros(len(beyond), np.bool_)
    confirmed[found] = np.count_nonzero(aside & alike, axis=1) > 1  # each is beside itself
    return confirmed


@dataclass(frozen=True, slots=True, kw_only=True)
class Fit:
    """How a search and the rows fit the features of a pair; NaN = not measured.

    Attributes:
        beyond_share: share of the features that are nearer than was searched.
        enough_disparities: a search that reaches all but a few, px; 0: not known.
        enough_from_m: the same as a depth, m.
        skew_px: see `row_skew_px`, px of the matched images.
    """

    beyond_share: float
    enough_disparities: int
    enough_from_m: float
    skew_px: float


def measure_fit(upright: Matches, processed: Processed, disparity: Disparity) -> Fit:
    """Compare matched features with the search and the rows.

    Args:
        upright: matches of features that have the same direction in both images, as exact as possible.
        processed: the pair.
        disparity: (H, W), px, its rows as `upright` has them.
    """
    height_px, width_px = disparity.shape
    search = processed.search or Search()
    rows = on_common_rows(upright.left_px, upright.right_px, height_px)
    left_px, right_px = upright.left_px[rows], upright.right_px[rows]
    wanted = _inside_the_crop(left_px, processed, disparity)
    size_px, shifts_px = (width_px, height_px), (left_px - right_px)[:, 0]
    beyond_share, enough = beyond_search(left_px[wanted], shifts_px[wanted], search.disparities, size_px)
    geometry = processed.geometry
    return Fit(
        beyond_share=beyond_share,
        enough_disparities=enough,
        enough_from_m=nearest_depth_m(geometry, enough) if geometry is not None and enough else math.nan,
        skew_px=row_skew_px(left_px, (right_px - left_px)[:, 1], size_px) * search.scale,
    )


def _inside_the_crop(points_px: Points, processed: Processed, disparity: Disparity) -> NDArray[np.bool_]:
    """Tell which points lie where depth was wanted: all of them, or with a crop those amid its disparities."""
    if processed.cut is None or not processed.cut.outside:
        return np.ones(len(points_px), np.bool_)
    known = np.isfinite(disparity)
    if not known.any():
        return np.ones(len(points_px), np.bool_)
    x, y = (np.flatnonzero(known.any(axis=axis)) for axis in (0, 1))
    low, high = np.array([x[0], y[0]]), np.array([x[-1], y[-1]])
    return np.asarray(((points_px >= low) & (points_px <= high)).all(axis=1))


def ambiguity(left: Image, right: Image, disparity: Disparity, searched: int, scale: float) -> float:
    """Tell for how many patches of the left image another place of the search fits as well as the best one.

    Args:
        left: (h, w) uint8, reduced.
        right: the same size.
        disparity: (H, W), px, of the whole images; only pixels that have one are asked.
        searched: N, px of the whole images; 0: as far as the greatest disparity. At least a quarter of the width is tried:
            whoever searches less finds one answer, which need not be the right one.
        scale: size of the reduced images relative to the whole ones.

    Returns:
        Share of the patches that fit anywhere at all; NaN with too few of them.
    """
    sample = sampled_places(disparity, _PATCHES)
    if not len(sample):
        return math.nan
    reach = max(math.ceil((searched or float(np.nanmax(disparity))) * scale), left.shape[1] // _LEAST_REACH)
    half, tried, unsure = _PATCH_PX // 2, 0, 0
    for y, x in np.rint((sample + 0.5) * scale - 0.5).astype(np.intp).tolist():
        first = max(half, x - reach)
        if y < half or x < half or x - first < 2 * _APART_PX:
            continue
        patch = left[y - half : y + half + 1, x - half : x + half + 1]
        strip = right[y - half : y + half + 1, first - half : x + half + 1]
        if patch.shape != (_PATCH_PX, _PATCH_PX) or strip.shape[0] < _PATCH_PX:
            continue
        likeness = np.asarray(cv2.matchTemplate(strip, patch, cv2.TM_CCOEFF_NORMED), np.float32).ravel()
        if likeness.max() < _SURE:
            continue
        tried += 1
        unsure += _has_rival(likeness)
    return unsure / tried if tried >= _FEWEST_PATCHES else math.nan


def _has_rival(likeness: NDArray[np.float32]) -> bool:
    """Tell whether a likeness along a row has a second peak as high as the best one, and a valley between the two."""
    best = int(likeness.argmax())
    rivals = np.flatnonzero(likeness >= likeness[best] - _AS_LIKE)
    for rival in rivals[np.abs(rivals - best) >= _APART_PX]:
        between = likeness[min(best, rival) : max(best, rival) + 1]
        if between.min() <= likeness[rival] - _VALLEY:
            return True
    return False
