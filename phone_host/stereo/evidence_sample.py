"""Chooses the pixels at which a pair is checked. Pure."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.model import Disparity

_LOOKED_AT: Final = 50_000
"""Not all pixels are looked at: the places of all in a photograph of 50 megapixels take a gigabyte."""


def sampled_places(disparity: Disparity, count: int) -> NDArray[np.intp]:
    """Choose evenly spread pixels that have a disparity.

    Args:
        disparity: (H, W), px, NaN = none.
        count: how many.

    Returns:
        (count, 2): row, column; (0, 2) if fewer have one.
    """
    step = max(1, round(math.sqrt(disparity.size / _LOOKED_AT)))
    known = np.argwhere(np.isfinite(disparity[::step, ::step])) * step
    if len(known) < count:  # a small crop, or few disparities: then all are few
        known = np.argwhere(np.isfinite(disparity))
    if len(known) < count:
        return np.empty((0, 2), np.intp)
    return known[np.linspace(0, len(known) - 1, count).astype(np.intp)]
