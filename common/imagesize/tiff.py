"""TIFF (6.0) and BigTIFF: reads the header from the first directory."""

import struct
from typing import Final

from common.errors import DataError
from common.frame import FrameFault, SpoiledImageError
from common.imagesize.head import COPY_AGAIN, ImageHead, ImageKind

TIFF_KINDS: Final = {b"II*\0": ("<", False), b"MM\0*": (">", False), b"II+\0": ("<", True), b"MM\0+": (">", True)}
"""First bytes, mapped to byte order and whether it is a BigTIFF."""

_WIDTH, _HEIGHT, _TILE_WIDTH, _TILE_HEIGHT = 256, 257, 322, 323
_ORIENTATION: Final = 274
_TIFF_NUMBERS: Final = {1: "B", 3: "H", 4: "I", 16: "Q"}
"""BYTE, SHORT, LONG (TIFF 6.0, section 2) and LONG8."""

_MOST_ENTRIES: Final = 65_535
"""Limit for a directory: as many as a TIFF can have; a BigTIFF could claim more."""


def tiff_head(data: bytes, name: str) -> ImageHead:
    """Read ImageWidth, ImageLength, TileWidth and TileLength from the first directory (TIFF 6.0, sections 2, 8, 15); of duplicates, the largest.

    Args:
        data: the encoded image; begins with one of TIFF_KINDS.
        name: the image's name in errors.

    Raises:
        SpoiledImageError: its directory is missing, or its size is not a number.
        DataError: a decoder would turn or mirror it.
        struct.error: it ends within the directory.
    """
    order, is_big = TIFF_KINDS[data[:4]]
    (directory,) = struct.unpack_from(f"{order}{'Q' if is_big else 'I'}", data, 8 if is_big else 4)
    if directory > len(data):
        raise SpoiledImageError(FrameFault.NO_END, f"{name} is cut short: its directory is missing", COPY_AGAIN)
    entry, entry_bytes, count_code = ("HHQ", 20, "Q") if is_big else ("HHI", 12, "H")
    count = min(struct.unpack_from(f"{order}{count_code}", data, directory)[0], _MOST_ENTRIES)
    first = directory + struct.calcsize(f"={count_code}")
    values = dict.fromkeys((_WIDTH, _HEIGHT, _TILE_WIDTH, _TILE_HEIGHT, _ORIENTATION), 0)
    for at in range(first, min(first + count * entry_bytes, len(data)), entry_bytes):
        tag, kind, _ = struct.unpack_from(f"{order}{entry}", data, at)
        if tag not in values:
            continue
        if kind not in _TIFF_NUMBERS or (kind == 16 and not is_big):
            raise SpoiledImageError(FrameFault.NO_START, f"{name} is a TIFF whose size is no whole number", COPY_AGAIN)
        (value,) = struct.unpack_from(f"{order}{_TIFF_NUMBERS[kind]}", data, at + entry_bytes - (8 if is_big else 4))
        values[tag] = max(values[tag], value)
    if values[_ORIENTATION] not in {0, 1}:  # decoders rotate a TIFF by it, but no other format
        raise DataError(
            f"{name} must be turned or mirrored to stand upright (TIFF orientation {values[_ORIENTATION]})",
            "save it upright, without that tag",
        )
    block_pixels = values[_TILE_WIDTH] * values[_TILE_HEIGHT]
    return ImageHead(kind=ImageKind.TIFF, width_px=values[_WIDTH], height_px=values[_HEIGHT], block_pixels=block_pixels)
