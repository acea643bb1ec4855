"""PFM files: Middlebury's disparities (one float32 per pixel, +inf = no value) and images of points (three, NaN = no value); bottom row first.

Source: https://vision.middlebury.edu/stereo/data/scenes2014/ ("disp*.pfm") and https://www.pauldebevec.com/Research/HDR/PFM/.
In memory the top row comes first and NaN means no value; only this module deals with the file's row order and its
infinity. The header has no place for comments that all readers would skip, so unit and axes of points stand in report.json.
"""

from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from phone_host.model import CloudImage, Disparity
from phone_host.output.atomic import write_parts
from phone_host.output.axes import Axes
from phone_host.output.strips import strips


def write_pfm(path: Path, disparity: Disparity) -> None:
    """Write a disparity map.

    Args:
        path: the file; it appears whole or not at all.
        disparity: (H, W) float32, px, NaN = none (any value that is not finite is written as +inf).

    Raises:
        OSError: the file cannot be written.
    """

    def row_strips() -> Iterator[memoryview]:
        for rows in _bottom_first(disparity):
            data = np.where(np.isfinite(rows), rows, np.float32(np.inf))
            yield np.ascontiguousarray(data, dtype="<f4").data.cast("B")

    height, width = disparity.shape
    write_parts(path, chain([f"Pf\n{width} {height}\n-1\n".encode()], row_strips()))


def write_xyz(path: Path, cloud: CloudImage, axes: Axes = Axes.CAMERA) -> None:
    """Write a cloud image: X, Y and Z of each pixel as the three channels.

    Args:
        path: the file; it appears whole or not at all.
        cloud: (H, W, 3) float32, m, in the left camera's axes, NaN = none.
        axes: axes of the file's points.

    Raises:
        OSError: the file cannot be written.
    """
    height, width, _ = cloud.shape
    # Whole rows: numpy multiplies a last axis of length 3 at a tenth of this speed.
    signs = np.tile(axes.signs, width)

    def row_strips() -> Iterator[memoryview]:
        for rows in _bottom_first(np.ascontiguousarray(cloud).reshape(height, 3 * width)):
            yield np.multiply(rows, signs, dtype="<f4").data.cast("B")

    write_parts(path, chain([f"PF\n{width} {height}\n-1\n".encode()], row_strips()))


def _bottom_first(values: NDArray[np.float32]) -> Iterator[NDArray[np.float32]]:
    """Yield the rows in the file's order, some at a time."""
    upside_down = values[::-1]
    for rows in strips(*values.shape):
        yield np.ascontiguousarray(upside_down[rows])
