"""Raw camera images (YUYV, grey, NV12) to grey or BGR, and frames of any encoding to images."""

from dataclasses import dataclass

import cv2
import numpy as np

from common.errors import DataError
from common.frame import PixelFormat, raw_bytes
from phone_host.model import Image
from phone_host.stereo.images import decode, decode_pair


@dataclass(frozen=True, slots=True)
class EncodedImage:
    """A frame's bytes and what its header says of them.

    Attributes:
        payload: the bytes as they came.
        pixel_format: their encoding.
        width_px: image width, px.
        height_px: image height, px.
        name: how errors call it.
    """

    payload: bytes | memoryview
    pixel_format: PixelFormat
    width_px: int
    height_px: int
    name: str


def decode_frames(left: EncodedImage, right: EncodedImage) -> tuple[Image, Image]:
    """Decode the two frames of a pair.

    Args:
        left: the left frame.
        right: the right frame, of the same encoding or another one.

    Returns:
        Left and right, each (H, W) grey or (H, W, 3) BGR, uint8.

    Raises:
        DataError: one of the two is spoiled.
    """
    if _is_raw(left) or _is_raw(right):
        return decode_frame(left), decode_frame(right)
    return decode_pair(left.payload, right.payload, left.name, right.name)


def decode_frame(image: EncodedImage) -> Image:
    """Decode one frame.

    Args:
        image: of any encoding.

    Returns:
        (H, W) grey or (H, W, 3) BGR, uint8.

    Raises:
        DataError: it is spoiled.
    """
    return decode_raw(image) if _is_raw(image) else decode(image.payload, image.name)


def decode_raw(image: EncodedImage) -> Image:
    """Turn a raw image into one that the stereo core takes.

    Args:
        image: a YUYV, grey or NV12 image without row padding.

    Returns:
        (H, W) uint8 for grey; (H, W, 3) BGR, uint8, else (ITU-R BT.601, limited range, as OpenCV converts).

    Raises:
        DataError: its length is not that of its size.
    """
    width, height = image.width_px, image.height_px
    expected = raw_bytes(image.pixel_format, width, height)
    if len(image.payload) != expected:
        raise DataError(
            f"{image.name} has {len(image.payload)} bytes, a {width}x{height} {image.pixel_format.value} image has {expected}",
            "check the camera's format and size",
        )
    content = np.frombuffer(image.payload, dtype=np.uint8)
    if image.pixel_format is PixelFormat.GREY:
        return content.reshape(height, width).copy()  # a view of the message could not be written to
    if width % 2 or (image.pixel_format is PixelFormat.NV12 and height % 2):
        raise DataError(
            f"{image.name} is {width}x{height}, which {image.pixel_format.value} cannot be", "use an even size"
        )
    if image.pixel_format is PixelFormat.YUYV:
        converted = cv2.cvtColor(content.reshape(height, width, 2), cv2.COLOR_YUV2BGR_YUYV)
    else:
        converted = cv2.cvtColor(content.reshape(height * 3 // 2, width), cv2.COLOR_YUV2BGR_NV12)
    return np.asarray(converted, dtype=np.uint8)


def _is_raw(image: EncodedImage) -> bool:
    return raw_bytes(image.pixel_format, image.width_px, image.height_px) is not None
