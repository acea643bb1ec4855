"""Images from files and from encoded bytes: anything OpenCV reads, brought to 8-bit grey or BGR.

Rules:
- one path for files and for streamed frames, so that both give the same bits;
- EXIF rotation is ignored: a calibration belongs to the sensor's own rows and columns;
- deeper than 8 bit: both images of a pair get the same scale, or the matcher would see two brightnesses (see `to_8_bit`).
"""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from phone_host.model import Image

AnyImage = NDArray[Any]
"""(H, W) or (H, W, 3) BGR, any depth."""

_JPEG_START, _JPEG_END = b"\xff\xd8", b"\xff\xd9"
_PNG_START, _PNG_END = b"\x89PNG\r\n\x1a\n", b"IEND\xaeB`\x82"
_START_OF_SCAN = 0xDA
# Sensors of 10, 12 and 14 bit are stored in 16-bit files with the upper bits 0 as often as shifted up.
_SENSOR_BITS = (8, 10, 12, 14, 16)
# Hot pixels must not set the scale: 1 per mille at each end is left out.
_LOW_PERCENT, _HIGH_PERCENT = 0.1, 99.9
# Below this share of the range (about 5 of 8 bits) plain scaling leaves too few levels: stretch instead (thermal cameras).
_NARROW_SHARE = 1 / 8


def decode(payload: bytes | memoryview, name: str = "the image") -> Image:
    """Decode one encoded image (JPEG, PNG, ...) to 8 bit.

    Args:
        payload: the encoded bytes.
        name: how errors call it.

    Returns:
        (H, W) grey or (H, W, 3) BGR, uint8.

    Raises:
        DataError: the bytes are spoiled or of no known format.
    """
    return to_8_bit((_decode_any(payload, name),))[0]


def decode_pair(
    left: bytes | memoryview,
    right: bytes | memoryview,
    left_name: str = "the left image",
    right_name: str = "the right image",
) -> tuple[Image, Image]:
    """Decode the two images of a pair, with one common scale where they are deeper than 8 bit.

    Args:
        left: encoded bytes of the left image.
        right: encoded bytes of the right image.
        left_name: how errors call the left image.
        right_name: how errors call the right image.

    Returns:
        Left and right, each (H, W) grey or (H, W, 3) BGR, uint8.

    Raises:
        DataError: one of the two is spoiled or of no known format.
    """
    first, second = to_8_bit((_decode_any(left, left_name), _decode_any(right, right_name)))
    return first, second


def read_image(path: Path) -> Image:
    """Read an image file as 8-bit grey or BGR.

    Args:
        path: the file.

    Returns:
        (H, W) grey or (H, W, 3) BGR, uint8; alpha is dropped.

    Raises:
        DataError: the file is missing, empty, spoiled or of no known format.
    """
    return decode(_read_bytes(path), str(path))


def read_pair(left: Path, right: Path) -> tuple[Image, Image]:
    """Read the two image files of a pair, with one common scale where they are deeper than 8 bit.

    Args:
        left: the left image's file.
        right: the right image's file.

    Returns:
        Left and right, each (H, W) grey or (H, W, 3) BGR, uint8.

    Raises:
        DataError: a file is missing, empty, spoiled or of no known format.
    """
    return decode_pair(_read_bytes(left), _read_bytes(right), str(left), str(right))


def require_same_size(left: Image, right: Image, left_name: str, right_name: str) -> None:
    """Check that two images can be a rectified pair.

    Args:
        left: (H, W[, 3]) image.
        right: (H, W[, 3]) image.
        left_name: how errors call the left image.
        right_name: how errors call the right image.

    Raises:
        DataError: their sizes differ.
    """
    if left.shape[:2] != right.shape[:2]:
        raise DataError(
            f"{left_name} is {size_text(left)} px, {right_name} is {size_text(right)} px",
            "a rectified pair has one size; for two unlike cameras give --calibration rig.yaml",
        )


def size_text(image: AnyImage) -> str:
    """Width and height of an image as people write it, such as 640x480."""
    return f"{image.shape[1]}x{image.shape[0]}"


def to_grey(image: Image) -> Image:
    """The grey version of an image.

    Args:
        image: (H, W) grey or (H, W, 3) BGR, uint8.

    Returns:
        (H, W) uint8.
    """
    if image.ndim == 2:
        return image
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def to_8_bit(images: tuple[AnyImage, ...]) -> tuple[Image, ...]:
    """Bring images of any depth to 8 bit with one common scale.

    8-bit images pass untouched. 16-bit images are divided so that the smallest usual sensor depth (8, 10, 12, 14 or 16 bit)
    that holds 99.9 % of the values of all of them together becomes 0..255: an 8-bit picture stored as 16 bit (times 257)
    comes back exactly, and brightness does not jump between frames. Images that use less than an eighth of that range, and
    images of other types (float, signed), are stretched between their common 0.1 % and 99.9 % values instead.

    Args:
        images: each (H, W) or (H, W, 3), any depth.

    Returns:
        The same images as uint8, in the same order.
    """
    deep = [image for image in images if image.dtype != np.uint8]
    if not deep:
        return images
    values = np.concatenate([image.ravel() for image in deep]).astype(np.float32)
    values = values[np.isfinite(values)]
    low, high = (float(v) for v in np.percentile(values, (_LOW_PERCENT, _HIGH_PERCENT))) if values.size else (0.0, 1.0)
    if all(image.dtype == np.uint16 for image in deep):
        full = next(2**bits - 1 for bits in _SENSOR_BITS if high <= 2**bits - 1)
        if high - low >= full * _NARROW_SHARE or high <= 255:
            low, high = 0.0, float(full)
    scale = 255.0 / (high - low) if high > low else 0.0
    return tuple(image if image.dtype == np.uint8 else _scaled(image, low, scale) for image in images)


def _scaled(image: AnyImage, low: float, scale: float) -> Image:
    values = (np.nan_to_num(image.astype(np.float32), nan=low) - low) * scale
    levels: Image = np.clip(np.rint(values), 0, 255).astype(np.uint8)
    return levels


def _read_bytes(path: Path) -> bytes:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise DataError(f"{path} cannot be read ({error.strerror})", "give an image file that exists") from error
    if not content:
        raise DataError(f"{path} is empty", "copy or record the image again")
    return content


def _decode_any(payload: bytes | memoryview, name: str) -> AnyImage:
    if _cut_short(payload):
        raise DataError(f"{name} is cut short: its end marker is missing", "copy or record the image again")
    remedy = "give an image that OpenCV reads (PNG, JPEG, TIFF, BMP, PGM, ...)"
    if len(payload) == 0:
        raise DataError(f"{name} is empty", remedy)
    try:
        decoded = cv2.imdecode(np.frombuffer(payload, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error as error:
        raise DataError(f"{name} cannot be decoded ({error.err})", remedy) from error
    if decoded is None:
        raise DataError(f"{name} is no image or spoiled", remedy)
    image: AnyImage = decoded
    if image.ndim == 3:
        # One or two channels in three dimensions: grey (and alpha); four: BGR and alpha.
        return image[..., 0] if image.shape[2] < 3 else np.ascontiguousarray(image[..., :3])
    return image


def _cut_short(payload: bytes | memoryview) -> bool:
    """Whether a JPEG or PNG lacks its end: OpenCV would give half an image with grey below."""
    content = bytes(payload)
    if content.startswith(_JPEG_START):
        return content.find(_JPEG_END, _scan_start(content)) < 0
    if content.startswith(_PNG_START):
        return content.rfind(_PNG_END) < 0
    return False


def _scan_start(jpeg: bytes) -> int:
    """Offset of the compressed data of a JPEG (its length when there are none): ITU T.81, annex B.

    The end marker counts only behind this: the thumbnail in an EXIF segment has one of its own. Bytes after the end marker
    are legal and common (webcams pad with zeros, phones append depth maps and films).
    """
    offset = len(_JPEG_START)
    while offset + 4 <= len(jpeg) and jpeg[offset] == 0xFF:
        marker, length = jpeg[offset + 1], int.from_bytes(jpeg[offset + 2 : offset + 4], "big")
        if marker == 0xFF:  # fill byte
            offset += 1
        elif marker == _START_OF_SCAN:
            return offset + 2 + length
        else:
            offset += 2 + length
    return len(jpeg)


def enlarged(image: Image, size_px: tuple[int, int], name: str) -> Image:
    """Enlarge an image that a camera made smaller: it shows the same view, each of its pixels the mean of some of the larger one.

    Args:
        image: (H, W) or (H, W, 3), uint8.
        size_px: (width, height) that it shall have, px; edges of pixels coincide, not centres, as with `cv2.resize`.
        name: how errors call it.

    Returns:
        The image itself if it has that size.

    Raises:
        DataError: its shape is another one, so that it can only show a part of the view.
    """
    height, width = image.shape[:2]
    if (width, height) == size_px:
        return image
    if width * size_px[1] != height * size_px[0]:
        raise DataError(
            f"{name} is {width}x{height} px, its camera was asked for {size_px[0]}x{size_px[1]}, another shape",
            "leave size out of the board's setting adapt",
        )
    return np.asarray(cv2.resize(image, size_px, interpolation=cv2.INTER_LINEAR), dtype=np.uint8)
