"""Depth as a 16-bit PNG in mm, the form in which depth cameras' pictures are passed on. 0 means none.

The text that says what the pixels mean is a tEXt chunk: PNG specification (third edition), sections 5.3 and 11.3.3.2.
"""

import struct
import zlib
from pathlib import Path
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import CloudImage
from phone_host.output.atomic import write_bytes
from phone_host.output.strips import strips

MOST_MM: Final = 65535
"""The greatest depth of a 16-bit picture in mm."""

_TEXT: Final = (
    "16 bit, unit millimetre, 0 = none: distance from the left camera along its optical axis (z forward), for each pixel of the"
    " rectified left image"
)
_BEFORE_CHUNKS: Final = 8  # the signature
_HEADER_END: Final = _BEFORE_CHUNKS + 12 + 13
"""IHDR, always the first chunk: 13 bytes of data; length, kind and CRC take 12."""


def depth_mm(cloud: CloudImage) -> tuple[NDArray[np.uint16], int]:
    """Round depths to mm.

    Args:
        cloud: (H, W, 3) float32, m, in the left camera's axes, NaN = none.

    Returns:
        (H, W) uint16, mm, 0 = none; and how many depths became 0 because they do not round to 1 to 65535 mm.
    """
    depth = np.empty(cloud.shape[:2], dtype=np.uint16)
    known = kept = 0
    for rows in strips(cloud.shape[0], cloud.shape[1]):
        millimetres = np.rint(cloud[rows, :, 2] * np.float32(1000))
        fits = (millimetres >= 1) & (millimetres <= MOST_MM)
        known += int(np.count_nonzero(~np.isnan(millimetres)))
        kept += int(np.count_nonzero(fits))
        millimetres[~fits] = 0
        depth[rows] = millimetres
    return depth, known - kept


def write_depth(path: Path, cloud: CloudImage) -> int:
    """Write the depth of each pixel.

    Args:
        path: the file; it appears whole or not at all.
        cloud: (H, W, 3) float32, m, in the left camera's axes, NaN = none.

    Returns:
        How many depths are missing because they do not round to 1 to 65535 mm.

    Raises:
        OSError: the file cannot be written.
    """
    depth, unfit = depth_mm(cloud)
    encoded = cv2.imencode(".png", depth, [cv2.IMWRITE_PNG_COMPRESSION, 1])[1]
    write_bytes(path, _with_text(encoded.tobytes(), "Description", _TEXT))
    return unfit


def _with_text(png: bytes, keyword: str, text: str) -> bytes:
    """Add a tEXt chunk behind the header.

    Args:
        png: a whole PNG file.
        keyword: 1 to 79 letters of Latin-1.
        text: Latin-1, without the character 0.
    """
    body = b"tEXt" + keyword.encode("latin-1") + b"\0" + text.encode("latin-1")
    chunk = struct.pack(">I", len(body) - 4) + body + struct.pack(">I", zlib.crc32(body))
    return png[:_HEADER_END] + chunk + png[_HEADER_END:]
