"""Reads the header of an image of any known kind, identified by its first bytes, and makes further checks of that kind.

The headers of BMP, PNM and WebP, whose first bytes contain the size, are read here.
"""

import re
import struct
from typing import Final, assert_never

from common.frame import FrameFault, SpoiledImageError
from common.imagesize.head import COPY_AGAIN, ImageHead, ImageKind, size_text
from common.imagesize.jpeg import SOI, check_scans, jpeg_head
from common.imagesize.png import PNG_START, pixel_chunks, png_head
from common.imagesize.tiff import EXIF_START, TIFF_KINDS, as_stored, exif_orientation, tiff_head
from common.orientation import UPRIGHT, Orientation

PNM_HEADER: Final = re.compile(rb"P([1-6])(?:\s|#[^\n]*\n)+(\d{1,9})(?:\s|#[^\n]*\n)+(\d{1,9})")
"""Magic, width, height (netpbm's pbm(5), pgm(5), ppm(5)).

Each blank can match in only one way. A nested quantifier took seconds for 30 blanks without a number after them."""


_MOST_CHUNKS: Final = 1024
"""Limit for a walk through a WebP: a still image has about six chunks."""


def bmp_head(data: bytes) -> ImageHead:
    """Read a BITMAPCOREHEADER or BITMAPINFOHEADER after a BITMAPFILEHEADER (wingdi.h). A negative height means rows from the top down.

    Args:
        data: the encoded image; begins with BM.

    Raises:
        struct.error: it ends within the header.
    """
    (header_bytes,) = struct.unpack_from("<I", data, 14)
    width_px, height_px = struct.unpack_from("<HH" if header_bytes == 12 else "<ii", data, 18)
    return ImageHead(kind=ImageKind.BMP, width_px=abs(width_px), height_px=abs(height_px))


def pnm_head(found: re.Match[bytes]) -> ImageHead:
    """Read the header of a portable bitmap, graymap or pixmap.

    Args:
        found: match of PNM_HEADER at the start of the encoded image.
    """
    return ImageHead(
        kind=ImageKind.PNM,
        width_px=int(found[2]),
        height_px=int(found[3]),
        body_at=found.end(),
        pixel_bytes=6 if found[1] in b"36" else 2,  # the depth is stated behind the size
    )


def webp_head(data: bytes, name: str) -> ImageHead:
    """Read the header of a WebP (RFC 9649, 2.5 to 2.7 and 3.4; RFC 6386, 9.1).

    Args:
        data: the encoded image; begins with RIFF, a length and WEBP.
        name: the image's name in errors.

    Raises:
        SpoiledImageError: its first chunk is not a sound header.
        struct.error: it ends within that chunk.
    """
    kind = data[12:16]
    if kind == b"VP8 ":
        start, width, height = struct.unpack_from("<3sHH", data, 23)
        if start == b"\x9d\x01\x2a":
            return ImageHead(kind=ImageKind.WEBP, width_px=width & 0x3FFF, height_px=height & 0x3FFF)
    elif kind == b"VP8L":
        signature, bits = struct.unpack_from("<BI", data, 20)
        if signature == 0x2F:
            return ImageHead(kind=ImageKind.WEBP, width_px=(bits & 0x3FFF) + 1, height_px=(bits >> 14 & 0x3FFF) + 1)
    elif kind == b"VP8X":
        packed = struct.unpack_from("<6s", data, 24)[0]
        width_px, height_px = (int.from_bytes(packed[at : at + 3], "little") + 1 for at in (0, 3))
        orientation = _webp_orientation(data, name)
        return ImageHead(kind=ImageKind.WEBP, width_px=width_px, height_px=height_px, orientation=orientation)
    raise SpoiledImageError(FrameFault.NO_START, f"{name} is a WebP without a sound header", COPY_AGAIN)


def _webp_orientation(data: bytes, name: str) -> Orientation:
    """Return what the chunk EXIF says (RFC 9649, 2.7.1.5); only files with an extended header may have one."""
    at = 12
    for _ in range(_MOST_CHUNKS):
        if at + 8 > len(data):
            break
        kind, length = struct.unpack_from("<4sI", data, at)
        if kind == b"EXIF":
            return exif_orientation(data[at + 8 : at + 8 + length].removeprefix(EXIF_START), name)
        at += 8 + length + length % 2
    return UPRIGHT


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
