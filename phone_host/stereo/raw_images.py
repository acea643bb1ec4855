"""Converts raw camera images (YUYV, grey, NV12) to grey or BGR, and frames of any encoding to upright images."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np

from common.frame import FrameFault, ImageSizeError, PixelFormat, SpoiledImageError, raw_bytes
from common.imagesize.head import MOST_PIXELS, ImageKind, require_pixels, size_text
from common.orientation import UPRIGHT, Orientation
from phone_host.model import Image
from phone_host.stereo.eight_bit import upright
from phone_host.stereo.images import (
    WHOLE,
    EncodedFile,
    decode_file,
    decode_files,
    enlarged,
    examine,
    require_same_shape,
)

_KINDS: Final = {PixelFormat.MJPEG: ImageKind.JPEG, PixelFormat.PNG: ImageKind.PNG}
_LOOK: Final = "check the camera that sends it"


@dataclass(frozen=True, slots=True, kw_only=True)
class EncodedImage:
    """A frame's bytes and what its header says about them.

    Attributes:
        payload: the bytes as they arrived.
        pixel_format: their encoding.
        width_px: image width, px.
        height_px: image height, px.
        name: how error messages call it.
        asked_px: (width, height) that its camera was asked for, px; the image may be smaller. Zeros mean the size in
            the header.
        orientation: how the image becomes upright; all sizes above are those before that.
    """

    payload: bytes | memoryview
    pixel_format: PixelFormat
    width_px: int
    height_px: int
    name: str
    asked_px: tuple[int, int] = (0, 0)
    orientation: Orientation = UPRIGHT

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height from the header, px."""
        return self.width_px, self.height_px

    @property
    def whole_px(self) -> tuple[int, int]:
        """Width and height after enlarging to the size that the camera was asked for, before it is turned, px."""
        return self.asked_px if any(self.asked_px) else self.size_px


def decode_frames(
    first: EncodedImage,
    second: EncodedImage,
    most_pixels: int = MOST_PIXELS,
    plan: Callable[[tuple[int, int], tuple[int, int]], tuple[int, int]] | None = None,
) -> tuple[Image, Image]:
    """Decode the two frames of a pair.

    Args:
        first: the frame of one camera.
        second: the frame of the other, in the same encoding or another one.
        most_pixels: the limit for both camera and frame.
        plan: called with the whole sizes of both upright images, px, before either is decoded: returns by how much each
            may be decoded smaller, or raises if they are of no use.

    Returns:
        Both in that order, each (H, W) grey or (H, W, 3) BGR, uint8, upright as its EXIF header and then its camera's
            orientation say, and as large as its camera was asked for.

    Raises:
        SpoiledImageError: one of the two is spoiled, or its size cannot be believed.
    """
    one, other = _examined(first, most_pixels), _examined(second, most_pixels)
    asked = WHOLE if plan is None else plan(_turned(one, first.whole_px), _turned(other, second.whole_px))
    by = _reduction(first, asked[0]), _reduction(second, asked[1])
    if isinstance(one, EncodedFile) and isinstance(other, EncodedFile):
        images = decode_files(one, other, by)
    else:
        images = _decoded(one, by[0]), _decoded(other, by[1])
    return _whole(images[0], first, one, by[0]), _whole(images[1], second, other, by[1])


def decode_frame(image: EncodedImage, most_pixels: int = MOST_PIXELS, reduction: int = 1) -> Image:
    """Decode one frame.

    Args:
        image: of any encoding.
        most_pixels: the limit for both its camera and the frame.
        reduction: by how much it may be decoded smaller.

    Returns:
        (H, W) grey or (H, W, 3) BGR, uint8, upright and as large as `decode_frames` gives it.

    Raises:
        SpoiledImageError: it is spoiled, or its size cannot be believed.
    """
    examined = _examined(image, most_pixels)
    by = _reduction(image, reduction)
    return _whole(_decoded(examined, by), image, examined, by)


def _reduction(image: EncodedImage, asked: int) -> int:
    """Return by how much a frame may be decoded smaller: one that is to be enlarged, not at all."""
    return asked if image.whole_px == image.size_px else 1


def _whole(decoded: Image, image: EncodedImage, examined: EncodedImage | EncodedFile, reduction: int) -> Image:
    """Enlarge an image to the size that its camera was asked for, because rig, matcher and geometry need that size."""
    if not any(image.asked_px) or (reduction > 1 and image.whole_px == image.size_px):
        return decoded
    return enlarged(decoded, _turned(examined, image.asked_px), image.name)


def _turned(image: EncodedImage | EncodedFile, size_px: tuple[int, int]) -> tuple[int, int]:
    """Return the upright width and height of what is stored with this width and height. Raw frames have no EXIF header."""
    if isinstance(image, EncodedFile):
        return image.mounted.turned_size(image.head.orientation.turned_size(size_px))
    return image.orientation.turned_size(size_px)


def _decoded(image: EncodedImage | EncodedFile, reduction: int) -> Image:
    if isinstance(image, EncodedImage):
        return upright(decode_raw(image), image.orientation)
    return decode_file(image, reduction)


def _examined(image: EncodedImage, most_pixels: int) -> EncodedImage | EncodedFile:
    """Check a frame's size before its bytes are used; return a raw frame as it is, any other with its header read.

    Raises:
        ImageSizeError: the camera's or the frame's size is beyond the limit, the frame is larger than its camera or has
            another shape, or its bytes hold another size than its header says.
        SpoiledImageError: its bytes have another encoding, or no valid header.
    """
    if any(image.asked_px):
        require_pixels(image.asked_px, most_pixels, f"the camera of {image.name}")
        require_same_shape(image.size_px, image.asked_px, image.name)
    require_pixels(image.size_px, most_pixels, image.name)
    kind = _KINDS.get(image.pixel_format)
    if kind is None:
        return image  # the number of raw bytes is checked against the size when they are used
    file = examine(image.payload, image.name, most_pixels)
    if file.head.kind is not kind:
        raise SpoiledImageError(
            FrameFault.NO_START, f"{image.name} is {file.head.kind.value}, its header says {kind.value}", _LOOK
        )
    if file.head.size_px != image.size_px:
        raise ImageSizeError(
            FrameFault.OTHER_SIZE,
            f"{image.name} is {size_text(file.head.size_px)} px, its header says {size_text(image.size_px)}",
            _LOOK,
        )
    return replace(file, mounted=image.orientation)


def decode_raw(image: EncodedImage) -> Image:
    """Convert a raw image to one that the stereo core takes.

    Args:
        image: a YUYV, grey or NV12 image without row padding.

    Returns:
        (H, W) uint8 for grey; otherwise (H, W, 3) BGR, uint8 (ITU-R BT.601, limited range, as OpenCV converts).

    Raises:
        SpoiledImageError: its length does not match its size.
    """
    width, height = image.width_px, image.height_px
    expected = raw_bytes(image.pixel_format, width, height)
    if len(image.payload) != expected:
        raise SpoiledImageError(
            FrameFault.WRONG_LENGTH,
            f"{image.name} has {len(image.payload)} bytes, a {width}x{height} {image.pixel_format.value} image has {expected}",
            "check the camera's format and size",
        )
    content = np.frombuffer(image.payload, dtype=np.uint8)
    if image.pixel_format is PixelFormat.GREY:
        return content.reshape(height, width).copy()  # a view of the message would not be writable
    if width % 2 or (image.pixel_format is PixelFormat.NV12 and height % 2):
        raise SpoiledImageError(
            FrameFault.OTHER_SIZE,
            f"{image.name} is {width}x{height}, which {image.pixel_format.value} cannot be",
            "use an even size",
        )
    if image.pixel_format is PixelFormat.YUYV:
        converted = cv2.cvtColor(content.reshape(height, width, 2), cv2.COLOR_YUV2BGR_YUYV)
    else:
        converted = cv2.cvtColor(content.reshape(height * 3 // 2, width), cv2.COLOR_YUV2BGR_NV12)
    return np.asarray(converted, dtype=np.uint8)
