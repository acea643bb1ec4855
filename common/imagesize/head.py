"""What an image's header tells about it, and the limits that its size must respect."""

from dataclasses import dataclass
from enum import Enum
from typing import Final

from common.frame import FrameFault, ImageSizeError, SpoiledImageError
from common.orientation import UPRIGHT, Orientation

MEGAPIXEL: Final = 2**20
"""A megabyte here is 2^20 bytes as well. So the phones' "64 MP" (9248x6936) lie within 64 of these."""

MOST_PIXELS: Final = 64 * MEGAPIXEL
"""The default limit: the largest usual sensor. Decoded in colour it takes 192 MB."""

_BYTES_A_PIXEL: Final = 6
"""Three colours of 16 bit: what an image of the largest size may take once it is decoded. With an alpha channel or floating point it takes more."""

MOST_SIDE_PX: Final = 32_766
"""OpenCV's `remap` has coordinates of 16 bit with a sign."""

COPY_AGAIN: Final = "copy or record the image again"
"""The remedy for an image that is incomplete or damaged."""


class ImageKind(Enum):
    """Kinds of image files that are decoded."""

    JPEG = "JPEG"
    PNG = "PNG"
    BMP = "BMP"
    PNM = "PNM"
    TIFF = "TIFF"
    WEBP = "WebP"


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageHead:
    """The content of an image's header.

    Attributes:
        kind: the kind of image.
        width_px: width as it is stored, px, at least 1.
        height_px: height as it is stored, px, at least 1.
        body_at: offset of the compressed image in the bytes; 0 if it is not looked for.
        least_bytes: with fewer bytes the compressed image cannot be whole; 0 if not known.
        block_pixels: pixels of the largest piece decoded at once; 0: no more than the image has.
        pixel_bytes: bytes of one decoded pixel, at most.
        orientation: by which turn and mirroring the stored image becomes upright, as its metadata say.
    """

    kind: ImageKind
    width_px: int
    height_px: int
    body_at: int = 0
    least_bytes: int = 0
    block_pixels: int = 0
    pixel_bytes: int = 4
    orientation: Orientation = UPRIGHT

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height as it is stored, px."""
        return self.width_px, self.height_px

    @property
    def upright_px(self) -> tuple[int, int]:
        """Width and height once it is upright, px."""
        return self.orientation.turned_size(self.size_px)


def require_pixels(size_px: tuple[int, int], most_pixels: int, name: str) -> None:
    """Check a size against the limit.

    Args:
        size_px: width and height, px.
        most_pixels: the limit.
        name: what errors call the thing of this size.

    Raises:
        ImageSizeError: it has more pixels.
    """
    pixels = size_px[0] * size_px[1]
    if pixels > most_pixels:
        raise ImageSizeError(
            FrameFault.TOO_LARGE,
            f"{name} is {size_text(size_px)} px ({_megapixels(pixels)}), the limit is {_megapixels(most_pixels)}",
            "scale it down, or raise --max-megapixels if its size is right",
        )


def require_believable(head: ImageHead, most_pixels: int, name: str) -> None:
    """Check an image's size, the memory it takes decoded, and the pieces in which it is decoded, against the limit.

    Raises:
        ImageSizeError: it has more pixels, takes more memory, or has a side that is too long.
    """
    require_pixels(head.size_px, most_pixels, name)
    if max(head.size_px) > MOST_SIDE_PX:
        raise ImageSizeError(
            FrameFault.TOO_LARGE,
            f"{name} is {size_text(head.size_px)} px, the longest side may have {MOST_SIDE_PX} px",
            "scale it down, or cut it",
        )
    taken, most = head.width_px * head.height_px * head.pixel_bytes, most_pixels * _BYTES_A_PIXEL
    if taken > most:
        raise ImageSizeError(
            FrameFault.TOO_LARGE,
            f"{name} takes {taken / MEGAPIXEL:.3g} MB decoded ({head.pixel_bytes} bytes a pixel), the limit is {most / MEGAPIXEL:.3g} MB",
            "save it without alpha, in 8 or 16 bit, or raise --max-megapixels",
        )
    if head.block_pixels:
        require_pixels((head.block_pixels, 1), most_pixels, f"one piece of {name}")


def check_length(count: int, head: ImageHead, name: str) -> None:
    """Check that there is at least as much compressed data as the size in the header requires.

    Args:
        count: number of bytes of compressed data.
        head: the image's header.
        name: the image's name in errors.

    Raises:
        SpoiledImageError: there is less.
    """
    if count < head.least_bytes:
        raise SpoiledImageError(
            FrameFault.TOO_SHORT,
            f"{name} has {count} bytes of image data, {size_text(head.size_px)} px take at least {head.least_bytes}",
            COPY_AGAIN,
        )


def size_text(size_px: tuple[int, int]) -> str:
    """Width and height as people write them, such as 640x480."""
    return f"{size_px[0]}x{size_px[1]}"


def _megapixels(pixels: int) -> str:
    size = pixels / MEGAPIXEL
    return f"{size:.0f} MPx" if size >= 100 else f"{size:.3g} MPx"
