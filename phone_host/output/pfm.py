"""PFM files: Middlebury's disparities (one float32 per pixel, +inf = no value) and images of points (three, NaN = no value); bottom row first.

Source: https://vision.middlebury.edu/stereo/data/scenes2014/ ("disp*.pfm") and https://www.pauldebevec.com/Research/HDR/PFM/.
In memory the top row comes first and NaN means no value; only this module deals with the file's row order and its
infinity. The header has no place for comments that all readers would skip, so unit and axes of points stand in report.json.
"""

import re
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.model import CloudImage, Disparity
from phone_host.output.atomic import write_parts
from phone_host.output.axes import Axes
from phone_host.output.strips import strips

# Magic, width, height, scale; one white space character ends the header (the data may begin with any byte). A header of
# more than 256 bytes is not PFM: three numbers never need that much.
_HEADER = re.compile(rb"\A(Pf|PF)\s+(\d{1,6})\s+(\d{1,6})\s+([-+0-9.eE]{1,32})\s")
_HEADER_LIMIT_BYTES = 256


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


def read_pfm(path: Path) -> Disparity:
    """Read a one-channel PFM file of either byte order.

    Returns:
        (H, W) float32, top row first; NaN where the file holds no finite value.

    Raises:
        DataError: the file is missing, is not a one-channel PFM, or is cut short.
    """
    top_first = _read(path, b"Pf", "a disparity map has one channel ('Pf')")[..., 0]
    top_first[~np.isfinite(top_first)] = np.nan
    return top_first


def read_xyz(path: Path) -> CloudImage:
    """Read a three-channel PFM file of either byte order.

    Returns:
        (H, W, 3) float32, top row first, in the axes of the file.

    Raises:
        DataError: the file is missing, is not a three-channel PFM, or is cut short.
    """
    return _read(path, b"PF", "an image of points has three channels ('PF')")


def _read(path: Path, wanted: bytes, remedy: str) -> NDArray[np.float32]:
    """Read (H, W, channels), top row first."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise DataError(f"{path} cannot be read ({error.strerror})", "give a PFM file that exists") from error
    header = _HEADER.match(content[:_HEADER_LIMIT_BYTES])
    if header is None:
        raise DataError(f"{path} is not a PFM file", "its header must read 'Pf', width and height, and the scale")
    magic, width_text, height_text, scale_text = header.groups()
    channels = 3 if magic == b"PF" else 1
    if magic != wanted:
        raise DataError(f"{path} is a PFM of {'three channels' if channels == 3 else 'one channel'}", remedy)
    width, height = int(width_text), int(height_text)
    try:
        scale = float(scale_text)
    except ValueError:
        scale = 0.0
    if scale == 0.0 or width == 0 or height == 0:
        raise DataError(f"{path} has a bad PFM header", "width, height and scale must not be 0")
    expected_bytes = width * height * channels * 4
    if len(content) - header.end() < expected_bytes:
        raise DataError(f"{path} is cut short ({len(content)} bytes for {width}x{height})", "write the file again")
    # The sign of the scale is the byte order: negative = little endian. Its magnitude has no meaning for disparities and points.
    order = "<f4" if scale < 0 else ">f4"
    values = np.frombuffer(content, dtype=order, count=width * height * channels, offset=header.end())
    return values.reshape(height, width, channels)[::-1].astype(np.float32)
