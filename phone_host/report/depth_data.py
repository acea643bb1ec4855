"""Makes a pair's depth small enough to lie inside a page: reduced pictures, a grid of depths, a cloud of few points. Pure.

Nothing here is for measuring. The exact values are in the files beside the page.
"""

import base64
import math
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import CloudImage, DepthLimits, Disparity, Image, Processed
from phone_host.output.preview import colour_disparity

MOST_PICTURE_PX: Final = 1280
"""Width or height of an embedded picture. Larger ones only make the page heavy: no window shows half a page wider."""

MOST_CELLS: Final = 320_000
"""Cells of the grid that a pointer reads: every pixel of 640 x 480, 0.8 MB in the page."""

MOST_POINTS: Final = 60_000
"""Points of the cloud in the page, 0.7 MB; a browser turns them without a graphics processor 60 times a second."""

NONE, CUT, FIRST = 0, 1, 2
"""Cells without disparity, cells whose point was cut, and the least value."""

_STEPS: Final = 65535 - FIRST
_FARTHEST_MEDIANS: Final = 10.0
"""Where no far limit is known, the picture of the cloud ends at this many median depths; else it would be one dot."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Grid:
    """What a pointer reads: one value for each cell.

    Attributes:
        cells: (rows, columns) uint16: NONE, CUT, or FIRST and above, even steps from `low` to `high`.
        step_px: cell (row, column) holds the value of the left pixel (column * step_px, row * step_px).
        low: value of FIRST: inverse depth, 1/m, or disparity, px.
        high: value of 65535.
        metric: whether the values are inverse depths.
    """

    cells: NDArray[np.uint16]
    step_px: int
    low: float
    high: float
    metric: bool


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Points:
    """A cloud of few points.

    Attributes:
        places: (N, 3) uint16, even steps from `low_m` to `high_m`, axis by axis.
        colours: (N, 3) uint8, red, green, blue.
        low_m: (3,) float64, m.
        high_m: (3,) float64, m.
        pivot_m: (3,) float64: around which the cloud is turned, its median, m.
        step_px: distance of two neighbours in the left image, px.
        total: number of points that the whole cloud has.
    """

    places: NDArray[np.uint16]
    colours: NDArray[np.uint8]
    low_m: NDArray[np.float64]
    high_m: NDArray[np.float64]
    pivot_m: NDArray[np.float64]
    step_px: float
    total: int


def grid(disparity: Disparity, cloud: CloudImage | None) -> Grid:
    """Reduce depth to a grid, by leaving out rows and columns: every value is a measured one.

    Args:
        disparity: (H, W) float32, px, NaN = none.
        cloud: (H, W, 3) float32, m, NaN = none; None if there is no geometry.
    """
    height, width = disparity.shape
    step = max(1, math.ceil(math.sqrt(width * height / MOST_CELLS)))
    known = np.isfinite(disparity[::step, ::step])
    if cloud is None:
        values = disparity[::step, ::step].astype(np.float64)
    else:
        with np.errstate(divide="ignore"):
            values = 1.0 / cloud[::step, ::step, 2].astype(np.float64)
    here = np.isfinite(values)
    low, high = (float(values[here].min()), float(values[here].max())) if here.any() else (0.0, 1.0)
    high = max(high, low + 1e-9)
    cells = np.where(known, CUT, NONE).astype(np.uint16)
    cells[here] = np.rint(FIRST + (values[here] - low) / (high - low) * _STEPS).astype(np.uint16)
    return Grid(cells=cells, step_px=step, low=low, high=high, metric=cloud is not None)


def points(cloud: CloudImage, left: Image, limits: DepthLimits | None) -> Points | None:
    """Choose evenly spread points of a cloud.

    Args:
        cloud: (H, W, 3) float32, m, NaN = none.
        left: the left image, which colours them.
        limits: to which the cloud was cut; None: not at all.

    Returns:
        The points; None if there are none.
    """
    depth = cloud[..., 2]
    valid = np.isfinite(depth)
    total = int(valid.sum())
    if not total:
        return None
    if limits is None:
        valid &= np.where(valid, depth, np.inf) <= _FARTHEST_MEDIANS * float(np.median(depth[valid]))
    step = max(1.0, math.sqrt(int(valid.sum()) / MOST_POINTS))
    row, column = (np.arange(0.0, size, step).astype(np.int64) for size in depth.shape)
    first, second = np.nonzero(valid[np.ix_(row, column)])
    rows, columns = row[first], column[second]
    if rows.size == 0:  # only a few points, between the chosen rows
        rows, columns = np.nonzero(valid)
    keep = np.unique(np.linspace(0, rows.size - 1, min(rows.size, MOST_POINTS)).astype(np.int64))
    places = cloud[rows[keep], columns[keep]].astype(np.float64)
    low, high = places.min(axis=0), places.max(axis=0)
    span = np.maximum(high - low, 1e-9)
    shades = left[rows[keep], columns[keep]]
    colours = shades[:, ::-1] if left.ndim == 3 else np.repeat(shades[:, None], 3, axis=1)
    return Points(
        places=np.rint((places - low) / span * 65535).astype(np.uint16),
        colours=np.ascontiguousarray(colours),
        low_m=low,
        high_m=low + span,
        pivot_m=np.median(places, axis=0),
        step_px=step,
        total=total,
    )


def depth_picture(depth: NDArray[np.float32], near_m: float, far_m: float) -> Image:
    """Colour depth, even steps of its logarithm; near is bright, black is none.

    Args:
        depth: (H, W) float32, m, NaN = none.
        near_m: depth of the brightest colour.
        far_m: depth of the darkest colour, above `near_m`.
    """
    with np.errstate(invalid="ignore"):
        nearness = -np.log(reduced(depth))
    return colour_disparity(nearness.astype(np.float32), -math.log(far_m), -math.log(near_m))


def reduced(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Leave out rows and columns until a picture of the values is small enough.

    Args:
        values: (H, W) float32.
    """
    height, width = values.shape
    size = _small_size(width, height)
    if size == (width, height):
        return values
    return np.asarray(cv2.resize(values, size, interpolation=cv2.INTER_NEAREST), dtype=np.float32)


def photograph(image: Image, most_px: int = MOST_PICTURE_PX) -> bytes:
    """Make an image into a JPEG of at most `most_px` in width and height.

    Args:
        image: grey or BGR.
        most_px: its larger side, px.
    """
    height, width = image.shape[:2]
    size = _small_size(width, height, most_px)
    small = image if size == (width, height) else cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    done, data = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 85])
    assert done
    return data.tobytes()


def drawing(image: Image) -> bytes:
    """Make a coloured map into a PNG, whose edges against black stay sharp."""
    done, data = cv2.imencode(".png", image, [cv2.IMWRITE_PNG_COMPRESSION, 7])
    assert done
    return data.tobytes()


def text_of(values: NDArray[np.uint16] | NDArray[np.uint8]) -> str:
    """Write numbers as base64, little endian, row by row."""
    return base64.b64encode(values.astype(values.dtype.newbyteorder("<")).tobytes()).decode("ascii")


def density(processed: Processed) -> float:
    """Return the share of the left pixels that have a depth (a disparity, where there is no geometry); NaN without a core.

    Pixels outside a crop are not counted.
    """
    if processed.disparity is None:
        return float("nan")
    measured = processed.disparity if processed.cloud is None else processed.cloud[..., 2]
    inside = measured.size if processed.cut is None else processed.cut.inside
    return int(np.count_nonzero(np.isfinite(measured))) / max(1, inside)


def _small_size(width: int, height: int, most_px: int = MOST_PICTURE_PX) -> tuple[int, int]:
    scale = min(1.0, most_px / max(width, height))
    return max(1, round(width * scale)), max(1, round(height * scale))
