"""What an encoded image says of itself, read before anything is decoded: its kind, its size, whether it can be whole.

Rules:
- nothing is decompressed, nothing is allocated by what a header claims; every loop is bounded by the bytes that are there;
- where a decoder could read a header in two ways, the image is refused;
- kinds that are not known here are not decoded at all: a decoder that nobody has looked at is a door.
"""

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from typing import Final

from common.errors import DataError
from common.frame import FrameFault, ImageSizeError, SpoiledImageError

MEGAPIXEL: Final = 2**20
"""As a megabyte here is 2^20 bytes; so the phones' "64 MP" (9248x6936) lie within 64 of them."""

MOST_PIXELS: Final = 64 * MEGAPIXEL
"""The limit where nobody set another: the largest usual sensor. Decoded in colour it takes 192 MB."""

JPEG_FRAME_HEADERS: Final = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
"""SOF0 to SOF15: the codes between them that are DHT, JPG and DAC are left out (ITU-T T.81, table B.1)."""

PNM_HEADER: Final = re.compile(rb"P([1-6])(?:\s|#[^\n]*\n)+(\d{1,9})(?:\s|#[^\n]*\n)+(\d{1,9})")
"""Magic, width, height (netpbm's pbm(5), pgm(5), ppm(5)).

Each blank can match in one way only: a nested quantifier took seconds for 30 blanks without a number behind them."""

_COPY: Final = "copy or record the image again"
_KNOWN: Final = "give a PNG, JPEG, TIFF, BMP, PGM, PPM or WebP image"


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
    """What an image's header says.

    Attributes:
        kind: what it is.
        width_px: width, px, at least 1.
        height_px: height, px, at least 1.
        body_at: where in the bytes the compressed image begins; 0 where that is not looked for.
        least_bytes: with fewer bytes than these the compressed image cannot be whole; 0: not known.
        block_pixels: pixels of the largest piece that is decoded at once; 0: no more than the image has.
    """

    kind: ImageKind
    width_px: int
    height_px: int
    body_at: int = 0
    least_bytes: int = 0
    block_pixels: int = 0

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height, px."""
        return self.width_px, self.height_px


def read_head(data: bytes, name: str) -> ImageHead:
    """Read what an image says of itself.

    Args:
        data: the encoded image, from anybody.
        name: how errors call it.

    Raises:
        SpoiledImageError: it is of no known kind, or its header cannot be believed.
    """
    if not data:
        raise SpoiledImageError(FrameFault.EMPTY, f"{name} is empty", _COPY)
    try:
        head = _head(data, name)
    except struct.error:
        raise SpoiledImageError(FrameFault.NO_END, f"{name} is cut short: its header ends early", _COPY) from None
    if not (head.width_px and head.height_px):
        raise SpoiledImageError(FrameFault.NO_START, f"{name} is {size_text(head.size_px)} px", _COPY)
    return head


def require_pixels(size_px: tuple[int, int], most_pixels: int, name: str) -> None:
    """Check a size against the limit.

    Args:
        size_px: width and height, px.
        most_pixels: the limit.
        name: how errors call what has this size.

    Raises:
        ImageSizeError: it has more pixels.
    """
    pixels = size_px[0] * size_px[1]
    if pixels > most_pixels:
        raise ImageSizeError(
            FrameFault.TOO_LARGE,
            f"{name} is {size_text(size_px)} px ({pixels / MEGAPIXEL:.3g} MPx), the limit is {most_pixels / MEGAPIXEL:.3g} MPx",
            "scale it down, or raise --max-megapixels if its size is right",
        )


def require_believable(head: ImageHead, most_pixels: int, name: str) -> None:
    """Check an image's size against the limit, and that of the pieces in which it is decoded.

    Args:
        head: what it says of itself.
        most_pixels: the limit.
        name: how errors call it.

    Raises:
        ImageSizeError: it has more pixels.
    """
    require_pixels(head.size_px, most_pixels, name)
    if head.block_pixels:
        require_pixels((head.block_pixels, 1), most_pixels, f"one piece of {name}")


def whole_image(data: bytes, head: ImageHead, name: str) -> bytes:
    """Check that encoded bytes can be the whole image of their header, as far as that is seen without decoding.

    Args:
        data: the encoded image.
        head: of `read_head`.
        name: how errors call it.

    Returns:
        What a decoder should get: the same bytes; of a PNG only the chunks that carry pixels, since texts and colour profiles may be bombs.

    Raises:
        SpoiledImageError: they cannot be.
    """
    match head.kind:
        case ImageKind.JPEG:
            _check_scans(data, head, name)
            return data
        case ImageKind.PNG:
            return _pixel_chunks(data, head, name)
        case ImageKind.BMP | ImageKind.PNM | ImageKind.TIFF | ImageKind.WEBP:
            return data


def size_text(size_px: tuple[int, int]) -> str:
    """Width and height as people write them, such as 640x480."""
    return f"{size_px[0]}x{size_px[1]}"


def _head(data: bytes, name: str) -> ImageHead:
    if data.startswith(_SOI):
        return _jpeg_head(data, name)
    if data.startswith(_PNG_START):
        return _png_head(data, name)
    if data.startswith(b"BM"):
        return _bmp_head(data)
    if data[:4] in _TIFF_KINDS:
        return _tiff_head(data, name)
    if data.startswith(b"RIFF") and data[8:12] == b"WEBP":
        return _webp_head(data, name)
    if found := PNM_HEADER.match(data):
        return ImageHead(kind=ImageKind.PNM, width_px=int(found[2]), height_px=int(found[3]), body_at=found.end())
    raise SpoiledImageError(FrameFault.NO_START, f"{name} is no image of a known kind", _KNOWN)


# JPEG: ITU-T T.81, annex B.

_SOI: Final = b"\xff\xd8"
_MARKER: Final = re.compile(rb"\xff[^\x00\xff]", re.DOTALL)
"""A marker, after fill bytes (B.1.1.2) and whatever a sloppy writer left before it: decoders pass over that, too."""

_SCAN_END: Final = re.compile(rb"\xff[^\x00\xd0-\xd7\xff]", re.DOTALL)
"""What ends compressed data: neither a stuffed byte nor a restart marker nor a fill byte (B.1.1.5)."""

_BARE: Final = frozenset(range(0xD0, 0xD8)) | {0x01}
"""Markers without a length: RST0 to RST7, TEM."""

_EOI_CODE, _SOI_CODE, _SOS_CODE = 0xD9, 0xD8, 0xDA
_BETWEEN_SCANS: Final = frozenset({0xC4, 0xCC, 0xDA, 0xDB, 0xDC, 0xDD, 0xFE, *range(0xE0, 0xF0)})
"""Segments that may stand between scans: DHT, DAC, SOS, DQT, DNL, DRI, COM, APPn (figure B.2)."""

_MOST_SCANS: Final = 64
"""Honest progressive photographs have about 10 (the usual script); each scan more costs a pass over the whole image."""

_BLOCK_BITS: Final = {0xC0: 2, 0xC1: 2, 0xC2: 1}
"""The fewest bits of a block of 8x8 px in Huffman coding: sequential one bit for the DC code and one for the end of block (F.1.2), progressive one bit
in the first DC scan (G.1.2.1; AC blocks are left out in runs). Arithmetic coding has no such bound."""


def _jpeg_head(data: bytes, name: str) -> ImageHead:
    size_px, process = (0, 0), 0
    for code, at in _segments(data, name):
        if code in JPEG_FRAME_HEADERS:
            if process:
                raise SpoiledImageError(FrameFault.OTHER_SIZE, f"{name} is a JPEG with two frame headers", _COPY)
            height_px, width_px = struct.unpack_from(">HH", data, at + 5)
            size_px, process = (width_px, height_px), code
        elif code == _SOS_CODE:
            if not process:
                break
            body_at = at + 2 + int.from_bytes(data[at + 2 : at + 4], "big")
            # Only the largest component must have a block for each 8x8 px; the others may be coarser.
            blocks = (-(-size_px[0] // 8)) * (-(-size_px[1] // 8))
            return ImageHead(
                kind=ImageKind.JPEG,
                width_px=size_px[0],
                height_px=size_px[1],
                body_at=body_at,
                least_bytes=blocks * _BLOCK_BITS.get(process, 0) // 8,
            )
    raise SpoiledImageError(FrameFault.NO_END, f"{name} is cut short: it is a JPEG without an image", _COPY)


def _segments(data: bytes, name: str) -> Iterator[tuple[int, int]]:
    """Code and offset of each marker before the compressed data, in order, the start of scan included."""
    at = len(_SOI)
    while found := _MARKER.search(data, at):
        at, code = found.start(), data[found.start() + 1]
        if code in {_SOI_CODE, _EOI_CODE}:
            return
        yield code, at
        at += 2
        if code in _BARE:
            continue
        (length,) = struct.unpack_from(">H", data, at)
        if length < 2:
            raise SpoiledImageError(FrameFault.CORRUPT, f"{name} is a JPEG with a segment of {length} bytes", _COPY)
        at += length


def _check_scans(data: bytes, head: ImageHead, name: str) -> None:
    """Check that a JPEG has its end, not too many scans, and bytes enough.

    The end marker counts only behind the start of the compressed data: the thumbnail in an EXIF segment has one of its own. Bytes behind the end
    are legal and common (webcams pad with zeros, phones append depth maps and films).
    """
    at, scans = head.body_at, 1
    while True:
        found = _SCAN_END.search(data, at)
        if found is None:
            raise SpoiledImageError(FrameFault.NO_END, f"{name} is cut short: its end marker is missing", _COPY)
        at, code = found.end(), data[found.start() + 1]
        if code == _EOI_CODE:
            break
        scans += code == _SOS_CODE
        if scans > _MOST_SCANS:
            raise SpoiledImageError(
                FrameFault.TOO_MANY_SCANS,
                f"{name} is a JPEG of more than {_MOST_SCANS} scans",
                "save it again, not progressive",
            )
        if code in _BETWEEN_SCANS:
            at += int.from_bytes(data[at : at + 2], "big")
    _check_length(at - head.body_at, head, name)


def _check_length(count: int, head: ImageHead, name: str) -> None:
    if count < head.least_bytes:
        raise SpoiledImageError(
            FrameFault.TOO_SHORT,
            f"{name} has {count} bytes of image data, {size_text(head.size_px)} px take at least {head.least_bytes}",
            _COPY,
        )


# PNG: PNG specification, third edition, 5 (chunks) and 11.2 (critical chunks).

_PNG_START: Final = b"\x89PNG\r\n\x1a\n"
_PIXEL_CHUNKS: Final = frozenset({b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND"})
_CHANNELS: Final = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
_DEFLATE_RATIO: Final = 1032
"""No deflate stream holds more: 258 bytes in two bits (zlib, "Maximum compression factor")."""

_MOST_CHUNKS: Final = 2**17
"""Writers put 8 KB and more into a chunk of pixels: the largest image that is let through by default has 2^15 of them."""

_SLACK_BYTES: Final = 65_536


def _png_head(data: bytes, name: str) -> ImageHead:
    length, kind, width_px, height_px, bits, colour = struct.unpack_from(">I4sIIBB", data, len(_PNG_START))
    if kind != b"IHDR" or length != 13 or colour not in _CHANNELS or bits not in {1, 2, 4, 8, 16}:
        raise SpoiledImageError(FrameFault.NO_START, f"{name} is a PNG without a sound header", _COPY)
    row_bytes = (width_px * bits * _CHANNELS[colour] + 7) // 8
    return ImageHead(
        kind=ImageKind.PNG,
        width_px=width_px,
        height_px=height_px,
        body_at=33,
        least_bytes=height_px * row_bytes // _DEFLATE_RATIO,
    )


def _pixel_chunks(data: bytes, head: ImageHead, name: str) -> bytes:
    at, has_others, pixel_bytes = len(_PNG_START), False, 0
    kept: list[bytes | memoryview] = [_PNG_START]
    for _ in range(_MOST_CHUNKS):
        if at + 12 > len(data):
            break
        length, kind = struct.unpack_from(">I4s", data, at)
        if kind == b"IHDR" and at > len(_PNG_START):
            raise SpoiledImageError(FrameFault.OTHER_SIZE, f"{name} is a PNG with two headers", _COPY)
        if kind in _PIXEL_CHUNKS:
            kept.append(memoryview(data)[at : at + 12 + length])
        else:
            has_others = True
        if kind == b"IDAT":
            pixel_bytes += length
        at += 12 + length
        if kind == b"IEND" and at <= len(data):
            _check_length(pixel_bytes, head, name)
            _check_excess(pixel_bytes, data, head, name)
            return b"".join(kept) if has_others else data
    raise SpoiledImageError(FrameFault.NO_END, f"{name} is cut short: its end marker is missing", _COPY)


def _check_excess(pixel_bytes: int, data: bytes, head: ImageHead, name: str) -> None:
    """Check that a PNG has not far more data than its pixels take when nothing can be compressed: a decoder unpacks them all."""
    bits, colour = data[24], data[25]
    most = head.height_px * (head.width_px * bits * _CHANNELS[colour] // 8 + 2)
    if pixel_bytes > most + most // 64 + _SLACK_BYTES:
        raise SpoiledImageError(
            FrameFault.WRONG_LENGTH,
            f"{name} has {pixel_bytes} bytes of image data, {size_text(head.size_px)} px take at most {most}",
            _COPY,
        )


# Other kinds, for files only.


def _bmp_head(data: bytes) -> ImageHead:
    """BITMAPCOREHEADER or BITMAPINFOHEADER behind a BITMAPFILEHEADER (wingdi.h); a negative height means rows from the top down."""
    (header_bytes,) = struct.unpack_from("<I", data, 14)
    width_px, height_px = struct.unpack_from("<HH" if header_bytes == 12 else "<ii", data, 18)
    return ImageHead(kind=ImageKind.BMP, width_px=abs(width_px), height_px=abs(height_px))


_TIFF_KINDS: Final = {b"II*\0": ("<", False), b"MM\0*": (">", False), b"II+\0": ("<", True), b"MM\0+": (">", True)}
"""First bytes to byte order and whether it is a BigTIFF."""

_WIDTH, _HEIGHT, _TILE_WIDTH, _TILE_HEIGHT = 256, 257, 322, 323
_ORIENTATION: Final = 274
_TIFF_NUMBERS: Final = {1: "B", 3: "H", 4: "I", 16: "Q"}
"""BYTE, SHORT, LONG (TIFF 6.0, section 2) and LONG8."""

_MOST_ENTRIES: Final = 65_535
"""Of a directory: all that a TIFF can have; a BigTIFF could claim more."""


def _tiff_head(data: bytes, name: str) -> ImageHead:
    """ImageWidth, ImageLength, TileWidth and TileLength of the first directory (TIFF 6.0, sections 2, 8 and 15); of doubled ones the largest."""
    order, is_big = _TIFF_KINDS[data[:4]]
    (directory,) = struct.unpack_from(f"{order}{'Q' if is_big else 'I'}", data, 8 if is_big else 4)
    if directory > len(data):
        raise SpoiledImageError(FrameFault.NO_END, f"{name} is cut short: its directory is missing", _COPY)
    entry, entry_bytes, count_code = ("HHQ", 20, "Q") if is_big else ("HHI", 12, "H")
    count = min(struct.unpack_from(f"{order}{count_code}", data, directory)[0], _MOST_ENTRIES)
    first = directory + struct.calcsize(f"={count_code}")
    values = dict.fromkeys((_WIDTH, _HEIGHT, _TILE_WIDTH, _TILE_HEIGHT, _ORIENTATION), 0)
    for at in range(first, min(first + count * entry_bytes, len(data)), entry_bytes):
        tag, kind, _ = struct.unpack_from(f"{order}{entry}", data, at)
        if tag not in values:
            continue
        if kind not in _TIFF_NUMBERS or (kind == 16 and not is_big):
            raise SpoiledImageError(FrameFault.NO_START, f"{name} is a TIFF whose size is no whole number", _COPY)
        (value,) = struct.unpack_from(f"{order}{_TIFF_NUMBERS[kind]}", data, at + entry_bytes - (8 if is_big else 4))
        values[tag] = max(values[tag], value)
    if values[_ORIENTATION] not in {0, 1}:  # decoders turn a TIFF by it, and by no other format's
        raise DataError(
            f"{name} is to be turned or mirrored (TIFF orientation {values[_ORIENTATION]})",
            "save it upright, without that tag",
        )
    block_pixels = values[_TILE_WIDTH] * values[_TILE_HEIGHT]
    return ImageHead(kind=ImageKind.TIFF, width_px=values[_WIDTH], height_px=values[_HEIGHT], block_pixels=block_pixels)


def _webp_head(data: bytes, name: str) -> ImageHead:
    """RFC 9649, 2.5 to 2.7 and 3.4; RFC 6386, 9.1."""
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
        return ImageHead(kind=ImageKind.WEBP, width_px=width_px, height_px=height_px)
    raise SpoiledImageError(FrameFault.NO_START, f"{name} is a WebP without a sound header", _COPY)
