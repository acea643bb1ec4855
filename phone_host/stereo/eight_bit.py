"""Brings images of any depth to 8 bit, and turns them upright: the board sends them as its camera gives them. Both images of a pair get the same scale, or the matcher would see two brightnesses."""

import math
from collections.abc import Iterator
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.orientation import UPRIGHT, Flip, Orientation
from phone_host.model import Image

_TURNS: Final = {90: cv2.ROTATE_90_CLOCKWISE, 180: cv2.ROTATE_180, 270: cv2.ROTATE_90_COUNTERCLOCKWISE}
_FLIPS: Final = {Flip.H: 1, Flip.V: 0}


def upright(image: Image, orientation: Orientation) -> Image:
    """Turn, then mirror, a decoded image.

    Args:
        image: (H, W) or (H, W, 3), uint8, as the camera gave it.
        orientation: how its camera is mounted.

    Returns:
        The upright image; the image itself if there is nothing to do.
    """
    if orientation == UPRIGHT:
        return image
    turned = cv2.rotate(image, _TURNS[orientation.rotate_deg]) if orientation.rotate_deg else image
    flipped = cv2.flip(turned, _FLIPS[orientation.flip]) if orientation.flip is not Flip.NONE else turned
    return np.asarray(flipped, np.uint8)


AnyImage = NDArray[Any]
"""(H, W) or (H, W, 3) BGR, any depth."""

# 16-bit files hold sensor values of 10, 12 and 14 bit with the upper bits 0 about as often as shifted up.
_SENSOR_BITS = (8, 10, 12, 14, 16)
# Hot pixels must not set the scale: 1 per mille is left out at each end.
_LOW_PERCENT, _HIGH_PERCENT = 0.1, 99.9
# If an image uses less than this share of the range (about 5 of 8 bits), plain scaling leaves too few levels: stretch
# it instead (thermal cameras).
_NARROW_SHARE = 1 / 8
_STRIP_VALUES = 1 << 22


def to_8_bit(images: tuple[AnyImage, ...]) -> tuple[Image, ...]:
    """Convert images of any depth to 8 bit with one common scale.

    8-bit images pass unchanged. For 16-bit images, take the smallest usual sensor depth (8, 10, 12, 14 or 16 bit) that
    holds 99.9 % of the values of all of them together; its range becomes 0..255. So an 8-bit picture stored as 16 bit
    (times 257) comes back exactly, and brightness does not jump between frames. Images that use less than an eighth of
    that range, and images of other types (float, signed), are stretched between their common 0.1 % and 99.9 % values
    instead.

    Args:
        images: each (H, W) or (H, W, 3), any depth.

    Returns:
        The same images as uint8, in the same order.
    """
    deep = [image for image in images if image.dtype != np.uint8]
    if not deep:
        return images
    are_counts = all(image.dtype == np.uint16 for image in deep)
    low, high = _ends_of_counts(deep) if are_counts else _ends(deep)
    if are_counts:
        full = next(2**bits - 1 for bits in _SENSOR_BITS if high <= 2**bits - 1)
        if high - low >= full * _NARROW_SHARE or high <= 255:
            low, high = 0.0, float(full)
    if not math.isfinite(high - low):
        low, high = 0.0, 1.0
    scale = 255.0 / (high - low) if high > low else 0.0
    return tuple(image if image.dtype == np.uint8 else _scaled(image, low, high, scale) for image in images)


def _ends(images: list[AnyImage]) -> tuple[float, float]:
    """Return the values beyond which hot pixels lie, dark and bright."""
    with np.errstate(over="ignore"):  # what float32 cannot hold becomes infinite and is left out
        values = np.concatenate([image.ravel() for image in images], dtype=np.float32, casting="unsafe")
    if any(image.dtype.kind == "f" for image in images):
        values = values[np.isfinite(values)]
    if not values.size:
        return 0.0, 1.0
    with np.errstate(over="ignore", invalid="ignore"):  # between two numbers at the end of float32's range
        low, high = np.percentile(values, (_LOW_PERCENT, _HIGH_PERCENT), overwrite_input=True)
    return float(low), float(high)


def _ends_of_counts(images: list[AnyImage]) -> tuple[float, float]:
    """Return the same for 16-bit images, by counting: a sorted copy of the largest images would take 1.6 GB."""
    counts = np.zeros(1 << 16, np.int64)
    for image in images:
        for rows in _strips(image):
            counts += np.bincount(image[rows].ravel(), minlength=counts.size)
    upto = np.cumsum(counts)
    ends = []
    for percent in (_LOW_PERCENT, _HIGH_PERCENT):
        at = (int(upto[-1]) - 1) * percent / 100
        below, above = np.searchsorted(upto, [math.floor(at), math.ceil(at)], side="right")
        ends.append(float(below + (above - below) * (at - math.floor(at))))
    return ends[0], ends[1]


def _scaled(image: AnyImage, low: float, high: float, scale: float) -> Image:
    levels = np.empty(image.shape, np.uint8)
    for rows in _strips(image):
        with np.errstate(over="ignore"):  # what becomes infinite is clipped
            values = image[rows].astype(np.float32)
            np.nan_to_num(values, copy=False, nan=low)
            np.clip(values, low, high, out=values)
            values -= low
            values *= scale
        np.rint(values, out=values)
        levels[rows] = np.clip(values, 0, 255, out=values)
    return levels


def _strips(image: AnyImage) -> Iterator[slice]:
    """Yield the rows of an image in parts, whose copies in other types take little memory."""
    rows = max(1, _STRIP_VALUES * len(image) // max(1, image.size))
    return (slice(top, top + rows) for top in range(0, len(image), rows))
