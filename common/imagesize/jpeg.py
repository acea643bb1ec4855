"""JPEG (ITU-T T.81, annex B): reads the header from its segments, and checks whether its scans can be whole."""

import re
import struct
from collections.abc import Iterator
from typing import Final

from common.frame import FrameFault, SpoiledImageError
from common.imagesize.head import COPY_AGAIN, ImageHead, ImageKind, check_length
from common.imagesize.tiff import EXIF_START, exif_orientation
from common.orientation import UPRIGHT, Orientation

SOI: Final = b"\xff\xd8"
"""The first bytes of every JPEG."""

FRAME_HEADERS: Final = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
"""SOF0 to SOF15, without the codes in between that are DHT, JPG and DAC (ITU-T T.81, table B.1)."""

_MARKER: Final = re.compile(rb"\xff[^\x00\xff]", re.DOTALL)
"""A marker, after fill bytes (B.1.1.2) and whatever a careless writer left before it. Decoders skip that too."""

_SCAN_END: Final = re.compile(rb"\xff[^\x00\xd0-\xd7\xff]", re.DOTALL)
"""A marker that ends compressed data: not a stuffed byte, a restart marker or a fill byte (B.1.1.5)."""

_BARE: Final = frozenset(range(0xD0, 0xD8)) | {0x01}
"""Markers without a length: RST0 to RST7, TEM."""

_EOI_CODE, _SOI_CODE, _SOS_CODE, _APP1_CODE = 0xD9, 0xD8, 0xDA, 0xE1
_BETWEEN_SCANS: Final = frozenset({0xC4, 0xCC, 0xDA, 0xDB, 0xDC, 0xDD, 0xFE, *range(0xE0, 0xF0)})
"""Segments that may stand between scans: DHT, DAC, SOS, DQT, DNL, DRI, COM, APPn (figure B.2)."""

_MOST_SCANS: Final = 64
"""Honest progressive photographs have about 10 (the usual script). Each further scan costs a pass over the whole image."""

_BLOCK_BITS: Final = {0xC0: 2, 0xC1: 2, 0xC2: 1}
"""The fewest bits per block of 8x8 px in Huffman coding. Sequential: one bit for the DC code and one for the end of block (F.1.2). Progressive: one
bit in the first DC scan (G.1.2.1; AC blocks are left out in runs). Arithmetic coding has no such bound."""


def jpeg_head(data: bytes, name: str) -> ImageHead:
    """Read the header of a JPEG.

    Args:
        data: the encoded image; begins with SOI.
        name: the image's name in errors.

    Raises:
        SpoiledImageError: it has no image, two frame headers, a segment of no length, or an orientation that does not exist.
        struct.error: it ends within a header.
    """
    size_px, process = (0, 0), 0
    orientation: Orientation | None = None
    for code, at in _segments(data, name):
        if code in FRAME_HEADERS:
            if process:
                raise SpoiledImageError(FrameFault.OTHER_SIZE, f"{name} is a JPEG with two frame headers", COPY_AGAIN)
            height_px, width_px = struct.unpack_from(">HH", data, at + 5)
            size_px, process = (width_px, height_px), code
        elif code == _APP1_CODE and orientation is None:  # the first one counts; films and maps have others
            orientation = _app1_orientation(data, at, name)
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
                orientation=orientation or UPRIGHT,
            )
    raise SpoiledImageError(FrameFault.NO_END, f"{name} is cut short: it is a JPEG without an image", COPY_AGAIN)


def _app1_orientation(data: bytes, at: int, name: str) -> Orientation | None:
    """Return the orientation that an APP1 segment states; None if it holds something else than EXIF, such as XMP."""
    (length,) = struct.unpack_from(">H", data, at + 2)
    content = data[at + 4 : at + 2 + length]
    return exif_orientation(content[len(EXIF_START) :], name) if content.startswith(EXIF_START) else None


def _segments(data: bytes, name: str) -> Iterator[tuple[int, int]]:
    """Code and offset of each marker before the compressed data, in order, including the start of scan."""
    at = len(SOI)
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
            raise SpoiledImageError(
                FrameFault.CORRUPT, f"{name} is a JPEG with a segment of {length} bytes", COPY_AGAIN
            )
        at += length


def check_scans(data: bytes, head: ImageHead, name: str) -> None:
    """Check that a JPEG has its end, not too many scans, and enough bytes.

    The end marker counts only after the start of the compressed data, because the thumbnail in an EXIF segment has one of its own. Bytes after the
    end are legal and common (webcams pad with zeros, phones append depth maps and films).

    Args:
        data: the encoded image.
        head: the result of `jpeg_head`.
        name: the image's name in errors.

    Raises:
        SpoiledImageError: its end is missing, it has too many scans, or too few bytes for its size.
    """
    at, scans = head.body_at, 1
    while True:
        found = _SCAN_END.search(data, at)
        if found is None:
            raise SpoiledImageError(FrameFault.NO_END, f"{name} is cut short: its end marker is missing", COPY_AGAIN)
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
    check_length(at - head.body_at, head, name)
