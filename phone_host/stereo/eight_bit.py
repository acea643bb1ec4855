"""Brings images of any depth to 8 bit. Both images of a pair get the same scale, or the matcher would see two brightnesses."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from phone_host.model import Image

AnyImage = NDArray[Any]
"""(H, W) or (H, W, 3) BGR, any depth."""

# 16-bit files hold sensor values of 10, 12 and 14 bit with the upper bits 0 about as often as shifted up.
_SENSOR_BITS = (8, 10, 12, 14, 16)
# Hot pixels must not set the scale: 1 per mille is left out at each end.
_LOW_PERCENT, _HIGH_PERCENT = 0.1, 99.9
# If an image uses less than this share of the range (about 5 of 8 bits), plain scaling leaves too few levels: stretch
# it instead (thermal cameras).
_NARROW_SHARE = 1 / 8


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
    values = np.concatenate([image.ravel() for image in deep], dtype=np.float32, casting="unsafe")
    if any(image.dtype.kind == "f" for image in deep):
        values = values[np.isfinite(values)]
    low, high = _ends(values) if values.size else (0.0, 1.0)
    if all(image.dtype == np.uint16 for image in deep):
        full = next(2**bits - 1 for bits in _SENSOR_BITS if high <= 2**bits - 1)
        if high - low >= full * _NARROW_SHARE or high <= 255:
            low, high = 0.0, float(full)
    scale = 255.0 / (high - low) if high > low else 0.0
    return tuple(image if image.dtype == np.uint8 else _scaled(image, low, scale) for image in images)


def _ends(values: NDArray[np.float32]) -> tuple[float, float]:
    """Return the values beyond which hot pixels lie, dark and bright; reorders `values`."""
    low, high = np.percentile(values, (_LOW_PERCENT, _HIGH_PERCENT), overwrite_input=True)
    return float(low), float(high)


def _scaled(image: AnyImage, low: float, scale: float) -> Image:
    # In place: a copy at each step would take five times the memory of the image.
    values = image.astype(np.float32)
    np.nan_to_num(values, copy=False, nan=low)
    values -= low
    values *= scale
    np.rint(values, out=values)
    levels: Image = np.clip(values, 0, 255, out=values).astype(np.uint8)
    return levels
