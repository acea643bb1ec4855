"""EXIF (CIPA DC-008, 4.6.2 to 4.6.5): reads the orientation of an image from its metadata, which is a small TIFF. Pure."""

import struct
from typing import Final

from common.frame import FrameFault, SpoiledImageError
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
_MOST_ENTRIES: Final = 1024
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
        for index in range(min(count, _MOST_ENTRIES)):
            at = directory + 2 + 12 * index
            tag, kind, values = struct.unpack_from(f"{order}HHI", tiff, at)
            if tag == ORIENTATION_TAG and values == 1 and kind in {_SHORT, _LONG}:
                (value,) = struct.unpack_from(f"{order}{'H' if kind == _SHORT else 'I'}", tiff, at + 8)
                return orientation_named(value, name)
    except struct.error:
        return UPRIGHT
    return UPRIGHT
