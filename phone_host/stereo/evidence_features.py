"""Matches features of a pair as it should be, turned and mirrored, and counts what fits each arrangement. Pure.

SIFT (Lowe, IJCV 2004) finds a feature whatever its direction; its direction tells by how much an image is turned. A
descriptor is four by four histograms of eight directions, so that of the mirrored patch is a permutation of it, and
mirrored images need no further search. Distances are those of RootSIFT (Arandjelovic and Zisserman, CVPR 2012).

Each arrangement undoes its mistake on the matched points and asks whether the points then lie on common rows. Rows may
be shifted, scaled and sheared a little, because a rig is never perfect and a mistake spoils its rectification.
"""

from dataclasses import dataclass
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Arrangement, Image, Side, Support
from phone_host.stereo.evidence_points import PointMaps, Points, mirrored, turned_back

_FEATURES: Final = 300
_CONTRAST: Final = 0.02
"""SIFT's own threshold is 0.04; images of plain rooms have too few features above it."""

_LEAST_SIZE_PX: Final = 16
"""SIFT's descriptors are wider than a smaller image."""

_RATIO: Final = 0.85
"""Greatest distance of a match relative to the second best. Lowe takes 0.8; the geometry sorts out the wrong ones here."""

_DIRECTION_DEG: Final = 20.0
"""Greatest difference of two matched features' directions. A rig's cameras are turned by a few degrees at most."""

_SCALE: Final = 2.0
"""Greatest ratio of two matched features' sizes: unlike lenses behind the wrong rectifier reach 1.5."""

_ROUGH: Final = 0.03
_FINE: Final = 0.008
"""Greatest distance from the common row as a share of the image's height, before and after the fit."""

_OFFSET: Final = 0.15
"""Greatest offset of the rows as a share of the height. Turning about the middle instead of the optical axis moves them."""

_STRICT: Final = 0.002
_STRICT_OFFSET: Final = 0.015
"""The same for rows that agree without a fit: 1 px of 480, a worn rig's error, and an offset of 7 px."""

_TURNED_OFFSET: Final = 0.025
"""Greatest offset of strict rows after a turn about the middle of the image: principal points lie that far beside it, 12 px of 480."""

_MOST_COLUMNS: Final = 0.5
"""Share of the features that must share columns if both cameras lie on their sides: there it was 0.72 to 0.97, in unrectified
photographs 0.27 at most."""

_LOST_ZERO: Final = 0.0016
"""Disparities above minus this share of the width count as not negative: 1 px of 640, a rig's usual error of zero."""

_SURE_SHIFT: Final = 0.004
_SURE_SPREAD: Final = 0.003
"""Exchanged features are shifted by this share of the width, 2.5 px of 640, or spread over that one. If neither, the scene
is far away and the rig's zero is lost."""

_FARTHEST: Final = 0.6
"""Greatest disparity as a share of the width; matchers search half of it at most."""

_SAME_PLACE: Final = 0.0015
"""A feature has not moved if it lies within this share of the width: one pixel of 640, three times SIFT's error."""

Matrix = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Features:
    """Features of one image.

    Attributes:
        points_px: (N, 2) float64, px of the whole image.
        directions_deg: (N,) float32, clockwise from the x axis.
        sizes_px: (N,) float32.
        descriptors: (N, 128) float32 of length 1.
    """

    points_px: Points
    directions_deg: NDArray[np.float32]
    sizes_px: NDArray[np.float32]
    descriptors: Matrix


_NONE: Final = np.zeros(0, np.float32)
_NO_FEATURES: Final = Features(np.zeros((0, 2)), _NONE, _NONE, np.zeros((0, 128), np.float32))


@dataclass(frozen=True, slots=True, eq=False)
class Matches:
    """Features of both images that belong together.

    Attributes:
        left_px: (N, 2), px of the rectified left image.
        right_px: (N, 2), px of the rectified right image.
        turns_deg: (N,) by how much the right one is turned clockwise, -180 to 180; mirrored ones: after mirroring back.
    """

    left_px: Points
    right_px: Points
    turns_deg: NDArray[np.float32]

    def turned_by(self, quarters: int) -> "Matches":
        """Return those whose directions say that the right image is turned by this many quarters clockwise."""
        off = (self.turns_deg - 90.0 * quarters + 180.0) % 360.0 - 180.0
        kept = np.abs(off) <= _DIRECTION_DEG
        return Matches(self.left_px[kept], self.right_px[kept], self.turns_deg[kept])


def find_features(image: Image, scale: float) -> Features:
    """Find the features of an image.

    Args:
        image: (H, W) uint8 grey, reduced.
        scale: its size relative to the whole image.
    """
    if min(image.shape) < _LEAST_SIZE_PX:
        return _NO_FEATURES
    detector = cv2.SIFT.create(nfeatures=_FEATURES, contrastThreshold=_CONTRAST)
    found, raw = detector.detectAndCompute(image, None)
    if not found:
        return _NO_FEATURES
    points = (np.array([point.pt for point in found]) + 0.5) / scale - 0.5
    descriptors = np.asarray(raw, np.float32)
    descriptors = np.sqrt(descriptors / np.maximum(descriptors.sum(axis=1, keepdims=True), np.float32(1e-6)))
    angles = np.array([point.angle for point in found], np.float32)
    return Features(points, angles, np.array([point.size for point in found], np.float32), descriptors)


def _mirrored_bins() -> NDArray[np.intp]:
    """Return where each bin of a descriptor comes from when the patch is mirrored about its own direction."""
    row, column, direction = np.meshgrid(np.arange(4), np.arange(4), np.arange(8), indexing="ij")
    return np.asarray(((3 - row) * 4 + column) * 8 + (8 - direction) % 8).ravel()


_MIRRORED_BINS: Final = _mirrored_bins()


def match(left: Features, right: Features, *, is_mirrored: bool) -> Matches:
    """Match features that are each other's best and clearly better than the second best.

    Args:
        left: of the left image.
        right: of the right image.
        is_mirrored: whether the right image is taken for a mirror image.
    """
    if min(len(left.points_px), len(right.points_px)) < 2:
        return Matches(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0, np.float32))
    descriptors = right.descriptors[:, _MIRRORED_BINS] if is_mirrored else right.descriptors
    # Squared distance = 2 - 2 * likeness. OpenCV's product takes one thread; NumPy's wakes one on every core.
    none = np.zeros((len(left.descriptors), len(descriptors)), np.float32)
    product = cv2.gemm(left.descriptors, np.ascontiguousarray(descriptors), 1.0, none, 0.0, flags=cv2.GEMM_2_T)
    likeness = np.asarray(product, np.float32)
    best = likeness.argmax(axis=1)
    rows = np.arange(len(best))
    mutual = likeness.argmax(axis=0)[best] == rows
    first = likeness[rows, best]
    likeness[rows, best] = -1.0
    clear = (1 - first) <= _RATIO**2 * (1 - likeness.max(axis=1))
    ratio = right.sizes_px[best] / left.sizes_px
    kept = np.flatnonzero(clear & mutual & (ratio <= _SCALE) & (ratio >= 1 / _SCALE))
    there = best[kept]
    seen = (180.0 - right.directions_deg[there]) if is_mirrored else right.directions_deg[there]
    turns = (seen - left.directions_deg[kept] + 180.0) % 360.0 - 180.0
    return Matches(left.points_px[kept], right.points_px[there], np.asarray(turns, np.float32))


def on_common_rows(left_px: Points, right_px: Points, height_px: int) -> NDArray[np.bool_]:
    """Find the points that lie on common rows, up to a small shift, scale and shear of the rows.

    Args:
        left_px: (N, 2), px.
        right_px: (N, 2), px.
        height_px: height of the image.

    Returns:
        (N,) whether the point and its partner share a row.
    """
    none = np.zeros(len(left_px), np.bool_)
    if len(left_px) < 2:
        return none
    with np.errstate(invalid="ignore"):
        down = right_px[:, 1] - left_px[:, 1]
        usable = np.isfinite(left_px).all(axis=1) & (np.abs(down) <= 2 * _OFFSET * height_px)
    if not usable.any():
        return none
    middle = left_px[usable].mean(axis=0)
    slopes = np.where(usable[:, np.newaxis], (left_px - middle) / height_px, 0.0)
    design = np.column_stack([np.ones(len(down)), slopes])
    model = np.array([_mode(down[usable], _ROUGH * height_px), 0.0, 0.0])
    near = none
    for share in (_ROUGH, _ROUGH, _FINE * 2, _FINE):
        error = np.abs(np.where(usable, down, np.inf) - design @ model)
        near = error <= share * height_px
        if near.sum() >= 6 and share > _FINE:
            # A weak pull to level rows: a few points in a corner must not tilt them.
            pull = np.diag([0.0, 1.0, 1.0])
            matrix = design[near].T @ design[near] + pull
            model = np.linalg.solve(matrix, design[near].T @ down[near])
    return np.asarray(near if abs(model[0]) <= _OFFSET * height_px else none)


def _mode(values: NDArray[np.float64], width: float) -> float:
    """Return the middle of the window of this width that holds the most values; 0 without any."""
    if not len(values):
        return 0.0
    ordered = np.sort(values)
    ends = np.searchsorted(ordered, ordered + width, side="right")
    first = int(np.argmax(ends - np.arange(len(ordered))))
    return float(np.median(ordered[first : ends[first]]))


def on_same_rows(
    left_px: Points, right_px: Points, height_px: int, offset: float = _STRICT_OFFSET
) -> NDArray[np.bool_]:
    """Find the points that lie on the same rows, up to one small offset.

    Args:
        left_px: (N, 2), px.
        right_px: (N, 2), px.
        height_px: height of the image.
        offset: greatest offset as a share of the height.

    Returns:
        (N,) whether the point and its partner share a row.
    """
    with np.errstate(invalid="ignore"):
        down = (right_px[:, 1] - left_px[:, 1]) / height_px
        usable = np.abs(down) <= offset + _STRICT
        middle = _mode(down[usable], 2 * _STRICT)
        return np.asarray(usable & (np.abs(down - middle) <= _STRICT) & (abs(middle) <= offset))


def supports(
    upright: Matches, plain: Matches, turned_over: Matches, maps: PointMaps, size_px: tuple[int, int]
) -> tuple[Support, ...]:
    """Count the features that agree with each arrangement.

    Args:
        upright: matches of features that have the same direction in both images, as exact as possible.
        plain: all matches of the two images as they are.
        turned_over: matches of the left image with the mirrored right one.
        maps: the way of a point from a camera's own image to the rectified one.
        size_px: width and height of the rectified images.
    """
    height_px = size_px[1]
    back = _Undoing(maps, size_px)
    related = on_common_rows(upright.left_px, upright.right_px, height_px)
    same = on_same_rows(upright.left_px, upright.right_px, height_px)
    in_order = _in_order(upright.left_px, upright.right_px, size_px[0], -_LOST_ZERO)
    by_quarters = {quarters: max(back.right(plain, quarters), back.left(plain, 4 - quarters)) for quarters in (1, 3)}
    quarters = max(by_quarters, key=lambda turn: by_quarters[turn])
    counts: dict[Arrangement, int] = {
        Arrangement.RIGHT: int((same & in_order).sum()),
        Arrangement.TILTED: int(related.sum()),
        Arrangement.SWAPPED: back.exchanged(upright),
        Arrangement.BOTH_TURNED: back.both_on_heads(upright),
        Arrangement.BOTH_MIRRORED: back.both_mirrored(upright),
        Arrangement.TURNED: back.right(plain, 2),
        Arrangement.TURNED_BY_QUARTER: by_quarters[quarters],
        Arrangement.BOTH_TURNED_BY_QUARTER: back.both_by_quarter(upright),
        Arrangement.MIRRORED: max(back.mirrored(turned_over, 0), back.mirrored(turned_over, 2)),
        Arrangement.SAME_PLACE: _unmoved(upright, maps),
    }
    return tuple(
        Support(arrangement, count, quarters if arrangement is Arrangement.TURNED_BY_QUARTER else 0)
        for arrangement, count in counts.items()
    )


def _in_order(left_px: Points, right_px: Points, width_px: int, least: float) -> NDArray[np.bool_]:
    """Tell which points have a disparity between `least` and the farthest, as shares of the width."""
    with np.errstate(invalid="ignore"):
        disparities = (left_px - right_px)[:, 0] / width_px
        return np.asarray((disparities >= least) & (disparities <= _FARTHEST))


@dataclass(frozen=True, slots=True)
class _Undoing:
    """Undoes mistakes in the cameras' own images and counts the features that then share rows.

    Attributes:
        maps: the way of a point from a camera's own image to the rectified one.
        size_px: width and height of the rectified images.
    """

    maps: PointMaps
    size_px: tuple[int, int]

    def right(self, plain: Matches, quarters: int) -> int:
        """The right camera is turned clockwise by this many quarters."""
        chosen = plain.turned_by(quarters)
        return self._common(chosen.left_px, self._turned(chosen.right_px, Side.RIGHT, quarters))

    def left(self, plain: Matches, quarters: int) -> int:
        """The left camera is."""
        chosen = plain.turned_by(-quarters)
        return self._common(self._turned(chosen.left_px, Side.LEFT, quarters), chosen.right_px)

    def both_by_quarter(self, upright: Matches) -> int:
        """Both cameras are, by as much."""
        counts = []
        for quarters in (1, 3):
            left = self._turned(upright.left_px, Side.LEFT, quarters)
            right = self._turned(upright.right_px, Side.RIGHT, quarters)
            counts.append(int(on_same_rows(left, right, self.size_px[1], _TURNED_OFFSET).sum()))
        # In unrectified images of a far scene some columns agree by chance, behind turned cameras nearly all do.
        return max(counts) if max(counts) >= _MOST_COLUMNS * len(upright.left_px) else 0

    def both_on_heads(self, upright: Matches) -> int:
        """Both cameras are on their heads."""
        left, right = self._turned(upright.left_px, Side.LEFT, 2), self._turned(upright.right_px, Side.RIGHT, 2)
        return self._in_order(left, right)

    def both_mirrored(self, upright: Matches) -> int:
        """Both images are mirrored left to right."""
        left, right = self._flipped(upright.left_px, Side.LEFT), self._flipped(upright.right_px, Side.RIGHT)
        return self._in_order(left, right)

    def exchanged(self, upright: Matches) -> int:
        """Left and right are exchanged: each image went through the other camera's rectification."""
        maps, left_px = self.maps, np.array(self.maps.size_px(Side.LEFT))
        scale = np.array(maps.size_px(Side.RIGHT)) / left_px
        true_right = maps.rectified(maps.own(upright.left_px, Side.LEFT) * scale, Side.RIGHT)
        true_left = maps.rectified(maps.own(upright.right_px, Side.RIGHT) / scale, Side.LEFT)
        return self._in_order(true_left, true_right)

    def mirrored(self, turned_over: Matches, quarters: int) -> int:
        """The right image is mirrored left to right, then turned. Two quarters: it is mirrored top to bottom."""
        chosen = turned_over.turned_by(quarters)
        size_px = self.maps.size_px(Side.RIGHT)
        own = turned_back(mirrored(self.maps.own(chosen.right_px, Side.RIGHT), size_px), size_px, quarters)
        return self._common(chosen.left_px, self.maps.rectified(own, Side.RIGHT))

    def _turned(self, points_px: Points, side: Side, quarters: int) -> Points:
        own = turned_back(self.maps.own(points_px, side), self.maps.size_px(side), quarters)
        return self.maps.rectified(own, side)

    def _flipped(self, points_px: Points, side: Side) -> Points:
        return self.maps.rectified(mirrored(self.maps.own(points_px, side), self.maps.size_px(side)), side)

    def _common(self, left_px: Points, right_px: Points) -> int:
        return int(on_common_rows(left_px, right_px, self.size_px[1]).sum())

    def _in_order(self, left_px: Points, right_px: Points) -> int:
        same = on_same_rows(left_px, right_px, self.size_px[1])
        fits = same & _in_order(left_px, right_px, self.size_px[0], _LOST_ZERO)
        if not fits.any():
            return 0
        low, middle, high = np.percentile((left_px - right_px)[fits, 0] / self.size_px[0], (10, 50, 90))
        return int(fits.sum()) if middle >= _SURE_SHIFT or high - low >= _SURE_SPREAD else 0


def _unmoved(upright: Matches, maps: PointMaps) -> int:
    """Count the features that lie at the same place of both cameras' own images."""
    places: list[Any] = []
    for side, points in ((Side.LEFT, upright.left_px), (Side.RIGHT, upright.right_px)):
        places.append(maps.own(points, side) / maps.size_px(side)[0])
    moved = np.abs(places[0] - places[1])
    return int(np.count_nonzero((moved <= _SAME_PLACE).all(axis=1)))
