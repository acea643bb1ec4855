"""Just enough of image files to replay them without an image library: size and encoding, and lossless PNG for simple raw formats."""

import re
import struct
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common.errors import DataError
from common.files import read_input
from common.frame import PixelFormat, SpoiledImageError
from common.imagesize.head import ImageHead, ImageKind
from common.imagesize.read import read_head
from common.orientation import UPRIGHT, Orientation
from common.protocol.wire import MAX_PAYLOAD_BYTES
from common.protocol.wire_fields import MAX_SIZE_PX


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageFile:
    """An image file's bytes as they are sent, and the content of its header.

    Attributes:
        pixel_format: encoding of `payload`.
        width_px: width, px.
        height_px: height, px.
        payload: JPEG and PNG files untouched, others as lossless PNG.
        orientation: how the file's own header says that it becomes upright.
    """

    pixel_format: PixelFormat
    width_px: int
    height_px: int
    payload: bytes
    orientation: Orientation = UPRIGHT


_REMEDY = "use JPEG, PNG or binary PGM/PPM files, or remove it from the folder"

SUFFIXES = frozenset({".jpg", ".jpeg", ".png", ".pgm", ".ppm", ".pnm"})
"""File suffixes that a replay folder is searched for."""

_MAXIMUM = re.compile(rb"(?:\s|#[^\n]*\n)+(\d{1,9})\s")
"""What follows a binary map's size: its maximum value and one white space (pgm(5), ppm(5))."""


_MOST_BYTES: Final = 4 * MAX_PAYLOAD_BYTES
"""Size limit of a file that is packed before it is sent. A link takes a quarter of that."""


def load(path: Path) -> ImageFile:
    """Load an image file in the form in which it is sent over a link.

    Args:
        path: a JPEG, PNG, binary PGM or PPM file.

    Returns:
        Its bytes and header.

    Raises:
        DataError: the file cannot be read, its header is of none of these kinds, or no link takes an image of that size.
    """
    return read_image(path, read_input(path, _MOST_BYTES, "check the file and its permissions"))


def read_image(path: Path, data: bytes) -> ImageFile:
    """Parse the content of an image file.

    Args:
        path: its name, for errors.
        data: its bytes; they may come from anybody.

    Returns:
        The bytes as they are sent, and the content of the header.

    Raises:
        DataError: the header is of none of these kinds, or no link takes an image of that size.
    """
    image = _parse(path, data)
    if not (1 <= image.width_px <= MAX_SIZE_PX and 1 <= image.height_px <= MAX_SIZE_PX):
        raise DataError(
            f"{path} is {image.width_px}x{image.height_px}", f"give images of 1 to {MAX_SIZE_PX} px in width and height"
        )
    if len(image.payload) > MAX_PAYLOAD_BYTES:
        raise DataError(
            f"{path} has {len(image.payload)} bytes when it is sent",
            f"give images of at most {MAX_PAYLOAD_BYTES // 2**20} MB",
        )
    return image


def _parse(path: Path, data: bytes) -> ImageFile:
    try:
        head = read_head(data, str(path))
    except SpoiledImageError as error:
        raise DataError(error.problem, _REMEDY) from None
    match head.kind:
        case ImageKind.JPEG | ImageKind.PNG:
            return ImageFile(
                pixel_format=PixelFormat.MJPEG if head.kind is ImageKind.JPEG else PixelFormat.PNG,
                width_px=head.width_px,
                height_px=head.height_px,
                payload=data,
                orientation=head.orientation,
            )
        case ImageKind.PNM if data[1:2] in b"56":
            return _from_pnm(path, head, data)
        case _:
            raise DataError(f"{path} is not an image that can be replayed", _REMEDY)


def _from_pnm(path: Path, head: ImageHead, data: bytes) -> ImageFile:
    found = _MAXIMUM.match(data, head.body_at)
    maximum, body_at = (int(found[1]), found.end()) if found else (0, len(data))
    width_px, height_px = head.size_px
    channels, depth = (1 if data[1:2] == b"5" else 3), (1 if maximum < 256 else 2)
    row = width_px * channels * depth
    body = data[body_at : body_at + row * height_px]
    if maximum not in {255, 65535} or len(body) < row * height_px:
        raise DataError(
            f"{path} is cut short or has maximum value {maximum}", "write it again with 8 or 16 bit, or remove it"
        )
    lines = b"".join(b"\0" + body[y * row : (y + 1) * row] for y in range(height_px))  # filter type 0, PNG 1.2, 6.2
    ihdr = struct.pack(">IIBBBBB", width_px, height_px, 8 * depth, 0 if channels == 1 else 2, 0, 0, 0)
    png = b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", ihdr) + _chunk(b"IDAT", zlib.compress(lines, 1)) + _chunk(b"IEND", b"")
    return ImageFile(pixel_format=PixelFormat.PNG, width_px=width_px, height_px=height_px, payload=png)


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
