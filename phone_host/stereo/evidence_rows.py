"""Measures how unevenly the rows of a rectified pair are off. Pure.

A matcher corrects a common offset of the rows. A turned camera, another zoom or a wrong calibration moves rows more at
one edge of the image than at the other; that no offset mends. To first order it is a plane over the image; a camera that
was turned aside twists the rows, which is a product of x and y.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.stereo.evidence_points import Points

_FEWEST: Final = 20
"""A plane through fewer features, each off by some tenths of a pixel, may be steep by chance."""

_ROUNDS: Final = 4
_OUTLIER_SIGMAS: Final = 2.5
_LEAST_PX: Final = 0.15
"""Features farther from the plane than 2.5 robust standard deviations, and than tracking's own error, are left out."""

_EXPLAINED: Final = 0.7
"""The plane must leave less than this share of the median departure: half a degree of roll leaves 0.1 to 0.4 of it. False
matches of a chessboard tilt a plane that explains nothing: four times as much is left."""

_SIGMA_OF_MEDIAN: Final = 1.48
"""Standard deviation of normal errors relative to their median absolute value."""


def row_skew_px(left_px: Points, down_px: NDArray[np.float64], size_px: tuple[int, int]) -> float:
    """Fit a twisted plane to the features' offsets from their rows, and return how far it departs from its mean.

    Args:
        left_px: (N, 2) features on common rows, px of the left image.
        down_px: (N,) how far too low each lies in the right image, px.
        size_px: width and height of the image.

    Returns:
        Root mean square over the image, px; at the edge it is some 1.7 times as much. 0 if it does not explain the
        offsets. NaN with too few features.
    """
    if len(left_px) < _FEWEST:
        return math.nan
    design = _terms((left_px + 0.5) / np.array(size_px) - 0.5)
    plane, kept = np.zeros(design.shape[1], np.float64), np.ones(len(design), np.bool_)
    for _ in range(_ROUNDS):
        plane[:] = np.linalg.lstsq(design[kept], down_px[kept], rcond=None)[0]
        rest = np.abs(down_px - design @ plane)
        kept = rest <= max(_OUTLIER_SIGMAS * _SIGMA_OF_MEDIAN * float(np.median(rest)), _LEAST_PX)
        if kept.sum() < _FEWEST // 2:
            return math.nan
    departure = np.abs(down_px - np.median(down_px))
    if np.median(np.abs(down_px - design @ plane)) > _EXPLAINED * np.median(departure) and np.median(departure) > 0:
        return 0.0
    return float((_terms(_EVENLY) @ plane).std())


def _terms(places: Points) -> NDArray[np.float64]:
    """Return the surface's terms at places of the image, -1/2 to 1/2 in both directions."""
    x, y = places.T
    return np.column_stack([np.ones(len(places)), x, y, x * y])


_EVENLY: Final = np.stack(np.meshgrid(np.linspace(-0.5, 0.5, 9), np.linspace(-0.5, 0.5, 9)), axis=-1).reshape(-1, 2)
"""Places all over the image."""
