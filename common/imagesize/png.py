"""PNG (specification, third edition, 5 and 11.2): reads the header from its first chunk and the orientation, and extracts the chunks that carry pixels."""

import struct
from typing import Final

from common.frame import FrameFault, SpoiledImageError
from common.imagesize.head import COPY_AGAIN, ImageHead, ImageKind, check_length, size_text
from common.imagesize.tiff import exif_orientation
from common.orientation import UPRIGHT, Orientation

PNG_START: Final = b"\x89PNG\r\n\x1a\n"
"""The first bytes of every PNG."""

_PIXEL_CHUNKS: Final = frozenset({b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND"})
_CHANNELS: Final = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
_DECODED_CHANNELS: Final = {**_CHANNELS, 3: 4, 4: 4}
"""OpenCV gives colours and alpha for a palette, and four channels for grey with alpha."""

_DEFLATE_RATIO: Final = 1032
"""No deflate stream expands further: 258 bytes from two bits (zlib, "Maximum compression factor")."""

_MOST_CHUNKS: Final = 2**17
"""Writers put at least 8 KB into a chunk of pixels. The largest image allowed by default then has 2^15 of them."""

_SLACK_BYTES: Final = 65_536


def png_head(data: bytes, name: str) -> ImageHead:
    """Read the header of a PNG.

    Args:
        data: the encoded image; begins with PNG_START.
        name: the image's name in errors.

    Raises:
        SpoiledImageError: its first chunk is not a sound header, or its orientation does not exist.
        struct.error: it ends within that chunk.
    """
    length, kind, width_px, height_px, bits, colour = struct.unpack_from(">I4sIIBB", data, len(PNG_START))
    if kind != b"IHDR" or length != 13 or colour not in _CHANNELS or bits not in {1, 2, 4, 8, 16}:
        raise SpoiledImageError(FrameFault.NO_START, f"{name} is a PNG without a sound header", COPY_AGAIN)
    row_bytes = (width_px * bits * _CHANNELS[colour] + 7) // 8
    return ImageHead(
        kind=ImageKind.PNG,
        width_px=width_px,
        height_px=height_px,
        body_at=33,
        least_bytes=height_px * row_bytes // _DEFLATE_RATIO,
        pixel_bytes=_DECODED_CHANNELS[colour] * (2 if bits == 16 else 1),
        orientation=_orientation(data, name),
    )


def _orientation(data: bytes, name: str) -> Orientation:
    """Return what the eXIf chunk says (specification 11.3.3.4); it may stand before or behind the pixels."""
    at = len(PNG_START)
    for _ in range(_MOST_CHUNKS):
        if at + 8 > len(data):
            break
        length, kind = struct.unpack_from(">I4s", data, at)
        if kind == b"eXIf":
            return exif_orientation(data[at + 8 : at + 8 + length], name)
        if kind == b"IEND":
            break
        at += 12 + length
    return UPRIGHT


def pixel_chunks(data: bytes, head: ImageHead, name: str) -> bytes:
    """Return the chunks of a PNG that carry pixels, preceded by its start, if the image can be whole.

    Returns:
        A PNG; the same bytes if it has no other chunks.

    Raises:
        SpoiledImageError: its end is missing, it has two headers, or too few or far too many bytes for its size.
    """
    at, has_others, pixel_bytes = len(PNG_START), False, 0
    kept: list[bytes | memoryview] = [PNG_START]
    for _ in range(_MOST_CHUNKS):
        if at + 12 > len(data):
            break
        length, kind = struct.unpack_from(">I4s", data, at)
        if kind == b"IHDR" and at > len(PNG_START):
            raise SpoiledImageError(FrameFault.OTHER_SIZE, f"{name} is a PNG with two headers", COPY_AGAIN)
        if kind in _PIXEL_CHUNKS:
            kept.append(memoryview(data)[at : at + 12 + length])
        else:
            has_others = True
        if kind == b"IDAT":
            pixel_bytes += length
        at += 12 + length
        if kind == b"IEND" and at <= len(data):
            check_length(pixel_bytes, head, name)
            _check_excess(pixel_bytes, data, head, name)
            return b"".join(kept) if has_others else data
    raise SpoiledImageError(FrameFault.NO_END, f"{name} is cut short: its end marker is missing", COPY_AGAIN)


def _check_excess(pixel_bytes: int, data: bytes, head: ImageHead, name: str) -> None:
    """Check that a PNG has not far more data than its pixels take when nothing can be compressed: a decoder unpacks all of it."""
    bits, colour = data[24], data[25]
    most = head.height_px * (head.width_px * bits * _CHANNELS[colour] // 8 + 2)
    if pixel_bytes > most + most // 64 + _SLACK_BYTES:
        raise SpoiledImageError(
            FrameFault.WRONG_LENGTH,
            f"{name} has {pixel_bytes} bytes of image data, {size_text(head.size_px)} px take at most {most}",
            COPY_AGAIN,
        )
