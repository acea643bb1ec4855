"""The images that are matched: the rectified ones, or a part of them, or smaller copies. Pure.

Matching costs width x height x disparities, which grows with the third power of the size. Large images are matched at
a smaller size, and the disparity is brought back to theirs. Small images are matched as they are.

Matchers search to the left along rows (`match`), so images of cameras that stand one above the other are laid on their side and back. A quarter turn
brings the direction in which a point moves from the left image to the right one to the left. No pixel is interpolated.
"""

import math
from dataclasses import dataclass
from typing import Final, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Confidence, Crop, Disparity, Epipolar, Image, RectifiedPair
from phone_host.stereo.match_sgbm import GREATEST_SEARCH

Values = TypeVar("Values", np.uint8, np.float32)

_LYING: Final = {Epipolar.UP: cv2.ROTATE_90_COUNTERCLOCKWISE, Epipolar.DOWN: cv2.ROTATE_90_CLOCKWISE}
_BACK: Final = {Epipolar.UP: cv2.ROTATE_90_CLOCKWISE, Epipolar.DOWN: cv2.ROTATE_90_COUNTERCLOCKWISE}


def lying(image: NDArray[Values], epipolar: Epipolar) -> NDArray[Values]:
    """Turn an upright image so that its epipolar lines become rows and points move to the left.

    Args:
        image: (H, W) or (H, W, 3).
        epipolar: which way the lines run in it.

    Returns:
        (W, H) or (W, H, 3); the image itself if its lines are rows.
    """
    return np.asarray(cv2.rotate(image, _LYING[epipolar]), image.dtype) if epipolar.is_vertical else image


def lying_pair(pair: RectifiedPair) -> RectifiedPair:
    """Turn both images of a pair as `lying` does; its epipolar lines become rows.

    Returns:
        The pair with points that move to the left; the pair itself if they do already.
    """
    if not pair.epipolar.is_vertical:
        return pair
    return RectifiedPair(lying(pair.left, pair.epipolar), lying(pair.right, pair.epipolar))


def upright_again(values: NDArray[Values], epipolar: Epipolar) -> NDArray[Values]:
    """Undo `lying`.

    Args:
        values: (W, H) or (W, H, 3).
        epipolar: which way the lines run in the upright image.

    Returns:
        (H, W) or (H, W, 3).
    """
    return np.asarray(cv2.rotate(values, _BACK[epipolar]), values.dtype) if epipolar.is_vertical else values


def upright_points(points_px: NDArray[np.float64], epipolar: Epipolar, size_px: tuple[int, int]) -> NDArray[np.float64]:
    """Return where points of a lying image are in the upright one.

    Args:
        points_px: (N, 2), px of the lying image.
        epipolar: which way the lines run in the upright one.
        size_px: width and height of the upright image.
    """
    if not epipolar.is_vertical:
        return points_px
    far = np.array([size_px[0] - 1.0, 0.0]) if epipolar is Epipolar.UP else np.array([0.0, size_px[1] - 1.0])
    return np.asarray(upright_steps(points_px, epipolar) + far, np.float64)


def upright_steps(steps: NDArray[np.float64], epipolar: Epipolar) -> NDArray[np.float64]:
    """Return steps of a lying image, (N, 2), as they are in the upright one."""
    if not epipolar.is_vertical:
        return steps
    x, y = steps.T
    return np.column_stack([-y, x] if epipolar is Epipolar.UP else [y, -x])


MOST_STEPS: Final = 1_200_000_000
"""Width x height x disparities of the matched images. `sgbm` takes about 2 ns for each on two cores, so 2 to 3 s."""

MOST_PIXELS: Final = 12_000_000
"""Of the matched images: what is kept for each pixel (about 40 bytes with `sgbm`) takes half a gigabyte."""

LEAST_GAIN: Final = 0.8
"""Images are not reduced by less than this: it would save less than half of the time and cost sharpness all the same."""

MARGIN_PX: Final = 32
"""Matched beyond each side of a crop: two gaps that `sgbm` bridges; its windows and its smoothing reach less far."""

_SURFACE_STEP_PX: Final = 1.0
"""Values within this belong to one surface, px of the matched images (`match_sgbm` bridges gaps by the same rule)."""

_GREATEST: Final = float(np.finfo(np.float32).max)
"""The greatest finite disparity there can be."""


def chosen_scale(width_px: int, height_px: int, disparities: int) -> float:
    """Choose the size of the images to match.

    Args:
        width_px: of the rectified images, or of their part that is matched, px.
        height_px: the same.
        disparities: N at this size, px.

    Returns:
        Share of the full size, in (0, 1].
    """
    searched = max(1, min(disparities, width_px))
    by_work = math.cbrt(MOST_STEPS / (width_px * height_px * searched))
    by_memory = math.sqrt(MOST_PIXELS / (width_px * height_px))
    scale = min(by_work, by_memory)
    by_range = GREATEST_SEARCH / searched
    return min(1.0 if scale > LEAST_GAIN else scale, by_range, 1.0)


def reduced(image: Image, scale: float) -> Image:
    """Make a smaller copy; each of its pixels is the mean of the area that it covers.

    Args:
        image: (H, W) or (H, W, 3), uint8.
        scale: share of the size, in (0, 1].

    Returns:
        The copy; the image itself at scale 1.
    """
    if scale == 1:
        return image
    height, width = image.shape[:2]
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)


def to_full_size(disparity: Disparity, width_px: int, height_px: int, epipolar: Epipolar) -> Disparity:
    """Bring the disparity of smaller images back to the size of the rectified ones.

    Values are interpolated only inside one surface. Where the neighbourhood has an edge or a hole, each pixel takes what
    the nearest matched pixel has, so nothing appears between a near and a far surface, and holes keep their size.

    Args:
        disparity: (h, w) float32, px of the smaller images, NaN = none.
        width_px: of the rectified images, px.
        height_px: the same.
        epipolar: which way the epipolar lines run: disparities grow with the size in this direction.

    Returns:
        (height_px, width_px) float32, px of the rectified images, NaN = none; the same array if the size is the same.
    """
    height, width = disparity.shape
    if (width, height) == (width_px, height_px):
        return disparity
    known = np.isfinite(disparity)
    # A hole counts as an edge: it is far above and far below every value.
    beyond = np.float32(4 * GREATEST_SEARCH)
    around = np.ones((3, 3), np.uint8)
    highest = cv2.dilate(np.where(known, disparity, beyond), around)
    lowest = cv2.erode(np.where(known, disparity, -beyond), around)
    smooth = (np.asarray(highest) - np.asarray(lowest) <= _SURFACE_STEP_PX).astype(np.uint8)
    size = (width_px, height_px)
    full = np.asarray(cv2.resize(disparity, size, interpolation=cv2.INTER_NEAREST_EXACT), np.float32)
    mask = cv2.resize(smooth, size, interpolation=cv2.INTER_NEAREST_EXACT)
    between = cv2.resize(np.nan_to_num(disparity), size, interpolation=cv2.INTER_LINEAR)
    cv2.copyTo(between, mask, full)
    full *= np.float32(height_px / height if epipolar.is_vertical else width_px / width)
    return full


def confidence_to_full_size(confidence: Confidence, width_px: int, height_px: int) -> Confidence:
    """Bring the confidence of smaller images back to the size of the rectified ones: each pixel takes the nearest one's.

    Args:
        confidence: (h, w) uint8.
        width_px: of the rectified images, px.
        height_px: the same.

    Returns:
        (height_px, width_px) uint8; the same array if the size is the same.
    """
    height, width = confidence.shape
    if (width, height) == (width_px, height_px):
        return confidence
    return np.asarray(cv2.resize(confidence, (width_px, height_px), interpolation=cv2.INTER_NEAREST_EXACT), np.uint8)


def confidence_of_known(confidence: Confidence, disparity: Disparity) -> Confidence:
    """Return the confidence with 0 wherever there is no disparity. Half the time of numpy's `isfinite` and `where`.

    Args:
        confidence: (H, W) uint8.
        disparity: (H, W) float32, px.

    Returns:
        (H, W) uint8, another array.
    """
    known = cv2.inRange(disparity, -_GREATEST, _GREATEST)
    return np.asarray(cv2.bitwise_and(confidence, known), np.uint8)


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """What is matched of the rectified images, and where the crop lies in it.

    Attributes:
        rows: of the rectified images.
        columns: of the rectified images.
        crop: of the rectified left image.
    """

    rows: slice
    columns: slice
    crop: Crop

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height, px."""
        return self.columns.stop - self.columns.start, self.rows.stop - self.rows.start

    def of(self, pair: RectifiedPair) -> RectifiedPair:
        """Return this part of both images."""
        left, right = (np.ascontiguousarray(image[self.rows, self.columns]) for image in (pair.left, pair.right))
        return RectifiedPair(left, right, pair.epipolar)

    def placed(self, values: NDArray[Values], width_px: int, height_px: int) -> NDArray[Values]:
        """Put this part's disparity or confidence into an otherwise empty map of the rectified images' size, cut to the crop."""
        empty = np.nan if values.dtype == np.float32 else 0
        placed = np.full((height_px, width_px), empty, values.dtype)
        crop = self.crop
        rows, columns = slice(crop.y_px, crop.y_px + crop.height_px), slice(crop.x_px, crop.x_px + crop.width_px)
        top, left = self.rows.start, self.columns.start
        placed[rows, columns] = values[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left]
        return placed


def part_for(
    crop: Crop, size_px: tuple[int, int], disparities: int, *, epipolar: Epipolar, margin_px: int = MARGIN_PX
) -> Part:
    """Find what has to be matched for a crop: the crop, a margin, and the reach of the search.

    Args:
        crop: inside the rectified left image.
        size_px: width and height of the rectified images, px.
        disparities: N, px; 0: not known, so the whole lines are matched.
        epipolar: which way the epipolar lines run.
        margin_px: added on each side, px.
    """
    reach = disparities or max(size_px)
    towards = {
        Epipolar.LEFT: (reach, 0, 0, 0),
        Epipolar.UP: (0, reach, 0, 0),
        Epipolar.DOWN: (0, 0, 0, reach),
    }[epipolar]
    left, top, right, bottom = (margin_px + more for more in towards)
    return Part(
        rows=slice(max(crop.y_px - top, 0), min(crop.y_px + crop.height_px + bottom, size_px[1])),
        columns=slice(max(crop.x_px - left, 0), min(crop.x_px + crop.width_px + right, size_px[0])),
        crop=crop,
    )
