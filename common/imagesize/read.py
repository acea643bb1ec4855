"""Reads the header of an image of any known kind, identified by its first bytes, and makes further checks of that kind."""

import struct
from typing import Final, assert_never

from common.frame import FrameFault, SpoiledImageError
from common.imagesize.head import COPY_AGAIN, ImageHead, ImageKind, size_text
from common.imagesize.jpeg import SOI, check_scans, jpeg_head
from common.imagesize.png import PNG_START, pixel_chunks, png_head
from common.imagesize.short_heads import PNM_HEADER, bmp_head, pnm_head, webp_head
from common.imagesize.tiff import TIFF_KINDS, as_stored, tiff_head
from common.orientation import UPRIGHT

_KNOWN: Final = "give a PNG, JPEG, TIFF, BMP, PGM, PPM or WebP image"

_PHONE_KINDS: Final = dict.fromkeys(
    (b"heic", b"heix", b"hevc", b"hevx", b"heim", b"heis", b"mif1", b"msf1"), "HEIC"
) | {
    b"avif": "AVIF",
    b"avis": "AVIF",
}
"""Brands of the image formats of phones (ISO/IEC 23008-12, annex B; AVIF 1.0, section 6), by name. They need decoders that OpenCV does not bring
everywhere."""


def read_head(data: bytes, name: str) -> ImageHead:
    """Read what an image says about itself.

    Args:
        data: the encoded image; it may come from anybody.
        name: the image's name in errors.

    Raises:
        SpoiledImageError: it is of no known kind, or its header cannot be believed.
    """
    if not data:
        raise SpoiledImageError(FrameFault.EMPTY, f"{name} is empty", COPY_AGAIN)
    try:
        head = _head(data, name)
    except struct.error:
        raise SpoiledImageError(FrameFault.NO_END, f"{name} is cut short: its header ends early", COPY_AGAIN) from None
    if not (head.width_px and head.height_px):
        raise SpoiledImageError(FrameFault.NO_START, f"{name} is {size_text(head.size_px)} px", COPY_AGAIN)
    return head


def whole_image(data: bytes, head: ImageHead, name: str) -> bytes:
    """Check that encoded bytes can be the whole image of their header, as far as this shows without decoding.

    Returns:
        What a decoder should get: the same bytes. Of a PNG only the chunks that carry pixels, because texts and colour profiles may be bombs. A TIFF
        says that it is upright, so that no decoder turns it; the caller does, by `head.orientation`.

    Raises:
        SpoiledImageError: they cannot be the whole image.
    """
    match head.kind:
        case ImageKind.JPEG:
            check_scans(data, head, name)
            return data
        case ImageKind.PNG:
            return pixel_chunks(data, head, name)
        case ImageKind.TIFF:
            return data if head.orientation == UPRIGHT else as_stored(data, name)
        case ImageKind.BMP | ImageKind.PNM | ImageKind.WEBP:
            return data
        case _:
            assert_never(head.kind)


def _head(data: bytes, name: str) -> ImageHead:
    if data.startswith(SOI):
        return jpeg_head(data, name)
    if data.startswith(PNG_START):
        return png_head(data, name)
    if data.startswith(b"BM"):
        return bmp_head(data)
    if data[:4] in TIFF_KINDS:
        return tiff_head(data, name)
    if data.startswith(b"RIFF") and data[8:12] == b"WEBP":
        return webp_head(data, name)
    if data[4:8] == b"ftyp" and (kind := _PHONE_KINDS.get(data[8:12])):
        raise SpoiledImageError(
            FrameFault.NO_START,
            f"{name} is a {kind} image, which is not read",
            f"convert it to JPEG, for example: magick {'IMG.AVIF' if kind == 'AVIF' else 'IMG.HEIC'} IMG.jpg (ImageMagick);"
            " or set the phone's camera to save JPEG",
        )
    if found := PNM_HEADER.match(data):
        return pnm_head(found)
    raise SpoiledImageError(FrameFault.NO_START, f"{name} is no image of a known kind", _KNOWN)
