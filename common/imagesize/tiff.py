"""Reads the headers of TIFF (6.0), BigTIFF and EXIF, whose metadata are a small TIFF (CIPA DC-008, 4.6.2 to 4.6.5). Pure."""

import struct
from collections.abc import Iterator
from typing import Final

from common.frame import FrameFault, SpoiledImageError
from common.imagesize.head import COPY_AGAIN, ImageHead, ImageKind
from common.orientation import UPRIGHT, Flip, Orientation

EXIF_START: Final = b"Exif\0\0"
"""What stands before the small TIFF in a JPEG's APP1 segment and in some WebP chunks (4.7.2)."""

ORIENTATION_TAG: Final = 274
"""Orientation, in EXIF's directory 0 as in TIFF (TIFF 6.0, section 8)."""

_ORIENTATIONS: Final = {
    1: UPRIGHT,
    2: Orientation(0, Flip.H),
    3: Orientation(180),
    4: Orientation(0, Flip.V),
    5: Orientation(90, Flip.H),
    6: Orientation(90),
    7: Orientation(90, Flip.V),
    8: Orientation(270),
}
"""By where the stored rows and columns begin in the upright image: 1 top left, 2 top right, 3 bottom right, 4 bottom left, 5 left top, 6 right
top, 7 right bottom, 8 left bottom."""

_ORDERS: Final = {b"II*\0": "<", b"MM\0*": ">"}
_SHORT, _LONG = 3, 4
_MOST_EXIF_ENTRIES: Final = 1024
"""Limit for a directory. Phones write about 20 entries into directory 0."""


def orientation_named(value: int, name: str) -> Orientation:
    """Return by which turn and mirroring an image with this orientation value becomes upright.

    Args:
        value: of the tag; 0 is what some phones write when they do not know, and viewers show such images as they are.
        name: the image's name in errors.

    Raises:
        SpoiledImageError: no orientation has this value.
    """
    if value == 0:
        return UPRIGHT
    if value not in _ORIENTATIONS:
        raise SpoiledImageError(
            FrameFault.CORRUPT,
            f"{name} says that it has EXIF orientation {value}, which does not exist (1 to 8 do)",
            "save it upright, without that tag",
        )
    return _ORIENTATIONS[value]


def exif_orientation(tiff: bytes, name: str) -> Orientation:
    """Read the orientation from EXIF metadata.

    Metadata that end early or hold no directory say nothing, as every viewer takes them.

    Args:
        tiff: the metadata, from their byte order on.
        name: the image's name in errors.

    Raises:
        SpoiledImageError: the orientation is a value that does not exist.
    """
    order = _ORDERS.get(tiff[:4])
    if order is None:
        return UPRIGHT
    try:
        (directory,) = struct.unpack_from(f"{order}I", tiff, 4)
        (count,) = struct.unpack_from(f"{order}H", tiff, directory)
        for index in range(min(count, _MOST_EXIF_ENTRIES)):
            at = directory + 2 + 12 * index
            tag, kind, values = struct.unpack_from(f"{order}HHI", tiff, at)
            if tag == ORIENTATION_TAG and values == 1 and kind in {_SHORT, _LONG}:
                (value,) = struct.unpack_from(f"{order}{'H' if kind == _SHORT else 'I'}", tiff, at + 8)
                return orientation_named(value, name)
    except struct.error:
        return UPRIGHT
    return UPRIGHT


TIFF_KINDS: Final = {b"II*\0": ("<", False), b"MM\0*": (">", False), b"II+\0": ("<", True), b"MM\0+": (">", True)}
"""First bytes, mapped to byte order and whether it is a BigTIFF."""

_WIDTH, _HEIGHT, _TILE_WIDTH, _TILE_HEIGHT = 256, 257, 322, 323
_DNG_VERSION: Final = 50706
"""DNGVersion (Adobe, Digital Negative specification): four bytes, the first of which is 1."""

_BITS, _SAMPLES = 258, 277
_READ: Final = (_WIDTH, _HEIGHT, _TILE_WIDTH, _TILE_HEIGHT, _BITS, _SAMPLES, ORIENTATION_TAG, _DNG_VERSION)
_TIFF_NUMBERS: Final = {1: "B", 3: "H", 4: "I", 16: "Q"}
"""BYTE, SHORT, LONG (TIFF 6.0, section 2) and LONG8."""

_MOST_ENTRIES: Final = 65_535
"""Limit for a directory: as many as a TIFF can have; a BigTIFF could claim more."""


def tiff_head(data: bytes, name: str) -> ImageHead:
    """Read ImageWidth, ImageLength, BitsPerSample, SamplesPerPixel, TileWidth, TileLength and Orientation from the first directory (TIFF 6.0, sections 2, 8, 15); of duplicates, the largest.

    Args:
        data: the encoded image; begins with one of TIFF_KINDS.
        name: the image's name in errors.

    Raises:
        SpoiledImageError: its directory is missing, its size is not a number, its orientation does not exist, or it is
            a raw photograph, whose first directory is a thumbnail.
        struct.error: it ends within the directory.
    """
    values = dict.fromkeys(_READ, 0)
    for tag, value, _, _ in _numbers(data, name):
        values[tag] = max(values[tag], value)
    if values[_DNG_VERSION]:
        raise SpoiledImageError(FrameFault.NO_START, f"{name} is a raw photograph (DNG)", "save it as JPEG or PNG")
    return ImageHead(
        kind=ImageKind.TIFF,
        width_px=values[_WIDTH],
        height_px=values[_HEIGHT],
        pixel_bytes=max(3, max(1, values[_SAMPLES]) * ((values[_BITS] + 7) // 8)),  # OpenCV gives colours for a palette
        block_pixels=values[_TILE_WIDTH] * values[_TILE_HEIGHT],
        orientation=orientation_named(values[ORIENTATION_TAG], name),
    )


def as_stored(data: bytes, name: str) -> bytes:
    """Return a TIFF whose orientation tag says upright. Decoders turn a TIFF by that tag, some only in part; no other format."""
    changed = bytearray(data)
    order = TIFF_KINDS[data[:4]][0]
    for tag, _, at, code in _numbers(data, name):
        if tag == ORIENTATION_TAG:
            struct.pack_into(f"{order}{code}", changed, at, 1)
    return bytes(changed)


def _numbers(data: bytes, name: str) -> Iterator[tuple[int, int, int, str]]:
    """Yield the tag, the value, its offset and its struct code of each entry of the first directory that is read here."""
    order, is_big = TIFF_KINDS[data[:4]]
    (directory,) = struct.unpack_from(f"{order}{'Q' if is_big else 'I'}", data, 8 if is_big else 4)
    if directory > len(data):
        raise SpoiledImageError(FrameFault.NO_END, f"{name} is cut short: its directory is missing", COPY_AGAIN)
    entry, entry_bytes, count_code = ("HHQ", 20, "Q") if is_big else ("HHI", 12, "H")
    count = min(struct.unpack_from(f"{order}{count_code}", data, directory)[0], _MOST_ENTRIES)
    first = directory + struct.calcsize(f"={count_code}")
    for at in range(first, min(first + count * entry_bytes, len(data)), entry_bytes):
        tag, kind, values = struct.unpack_from(f"{order}{entry}", data, at)
        if tag not in _READ:
            continue
        if kind not in _TIFF_NUMBERS or (kind == 16 and not is_big):
            raise SpoiledImageError(FrameFault.NO_START, f"{name} is a TIFF whose size is no whole number", COPY_AGAIN)
        code, room = _TIFF_NUMBERS[kind], 8 if is_big else 4
        value_at = at + entry_bytes - room
        if tag == _BITS and values * struct.calcsize(f"={code}") > room:  # one number per channel: they lie elsewhere
            (value_at,) = struct.unpack_from(f"{order}{'Q' if is_big else 'I'}", data, value_at)
        yield tag, struct.unpack_from(f"{order}{code}", data, value_at)[0], value_at, code
