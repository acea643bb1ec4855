"""Makes a pair's depth small enough to lie inside a page: reduced pictures, a grid of disparities. Pure.

Nothing here is for measuring. The exact values are in the files beside the page.
"""

import base64
import math
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import CloudImage, Disparity, Image, Processed
from phone_host.output.preview import colour_disparity

MOST_PICTURE_PX: Final = 1280
"""Width or height of an embedded picture. Larger ones only make the page heavy: no window shows half a page wider."""

MOST_CELLS: Final = 320_000
"""Cells of the grid, from which a pointer reads and the cloud is drawn: every pixel of 640 x 480, 0.8 MB in the page."""

NONE, CUT, FIRST = 0, 1, 2
"""Cells without disparity, cells whose point was cut, and the least value."""

_STEPS: Final = 65535 - FIRST


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Grid:
    """What a pointer reads, and what the cloud is drawn from: one disparity for each cell.

    Attributes:
        cells: (rows, columns) uint16: NONE, CUT, or FIRST and above, even steps from `low_px` to `high_px`.
        step_px: cell (row, column) holds the value of the left pixel (column * step_px, row * step_px).
        low_px: value of FIRST, px.
        high_px: value of 65535, px.
    """

    cells: NDArray[np.uint16]
    step_px: int
    low_px: float
    high_px: float

    @property
    def points(self) -> int:
        """Number of cells with a value."""
        return int(np.count_nonzero(self.cells >= FIRST))


def grid(disparity: Disparity, cloud: CloudImage | None) -> Grid:
    """Reduce disparities to a grid, by leaving out rows and columns: every value is a measured one.

    Args:
        disparity: (H, W) float32, px, NaN = none.
        cloud: (H, W, 3) float32, m, NaN = none: where it has no point, the disparity was cut; None if there is no geometry.
    """
    height, width = disparity.shape
    step = max(1, math.ceil(math.sqrt(width * height / MOST_CELLS)))
    values = disparity[::step, ::step].astype(np.float64)
    known = np.isfinite(values)
    here = known if cloud is None else known & np.isfinite(cloud[::step, ::step, 2])
    low, high = (float(values[here].min()), float(values[here].max())) if here.any() else (0.0, 1.0)
    high = max(high, low + 1e-6)
    cells = np.where(known, CUT, NONE).astype(np.uint16)
    cells[here] = np.rint(FIRST + (values[here] - low) / (high - low) * _STEPS).astype(np.uint16)
    return Grid(cells=cells, step_px=step, low_px=low, high_px=high)


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


def text_of(values: NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.uint32]) -> str:
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
