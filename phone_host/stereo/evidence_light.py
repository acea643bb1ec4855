"""Measures whether an image shows anything: brightness, structure, sharpness. Pure."""

from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Exposure, Image

_TINY_PX: Final = 80
"""Width at which structure is measured: each pixel is then the mean of many, and noise is gone."""

_SMOOTH_PX: Final = 4.0
"""Vignetting and glow through a finger are wider than this at that width, and no structure."""

_SHARP_WIDTH_PX: Final = 640
_REACH_PX: Final = 5
_EDGES: Final = 20
"""Fewer edges than this say nothing about focus."""

_LEAST_RISE: Final = 12.0
_SURE_RISE: Final = 24.0
_RISE_SHARE: Final = 0.3
"""Grey levels over which an edge must rise: far above a webcam's noise, which is 3 levels after averaging along the edge.
In images of little contrast a share of their range is enough."""

_SHARPEST: Final = 20
"""Percentile of the edges' widths. Edges of shadows and round bodies are wide in the sharpest image."""


def measure_exposure(image: Image, features: int) -> Exposure:
    """Measure what an image holds.

    Args:
        image: (H, W) uint8 grey, whole.
        features: number of features found in it.
    """
    height, width = image.shape
    tiny_px = (_TINY_PX, max(8, round(_TINY_PX * height / width)))
    tiny = np.asarray(cv2.resize(image, tiny_px, interpolation=cv2.INTER_AREA), np.float32)
    detail = np.abs(tiny - cv2.GaussianBlur(tiny, (0, 0), _SMOOTH_PX))
    return Exposure(
        mean_level=float(tiny.mean()),
        bright_level=float(np.percentile(tiny, 98)),
        structure=float(np.percentile(detail, 90)),
        blur_px=_edge_width_px(image),
        features=features,
    )


def _edge_width_px(image: Image) -> float:
    """Measure the width of the sharpest edges: how far brightness would need to rise to its full height at its steepest slope.

    Returns:
        Standard deviation of the blur that makes such an edge, px of an image at most 640 px wide; NaN with too few edges.
    """
    width = image.shape[1]
    scale = _SHARP_WIDTH_PX / width
    if scale < 1:
        image = np.asarray(cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), np.uint8)
    widths = np.concatenate([_widths(image), _widths(np.ascontiguousarray(image.T))])
    if len(widths) < _EDGES:
        return float("nan")
    return float(np.percentile(widths, _SHARPEST))


def _widths(image: Image) -> NDArray[np.float32]:
    """Return the widths of the edges that cross the rows, px."""
    if min(image.shape) < 2 * _REACH_PX + 1:
        return np.zeros(0, np.float32)
    # Along the edge only. Neighbouring rows hold the same edges: every second one is enough.
    smooth = cv2.blur(image, (1, 3))[::2].astype(np.int16)
    slope = np.abs(smooth[:, 2:] - smooth[:, :-2]).astype(np.float32) / 2
    window = np.ones((1, 2 * _REACH_PX + 1), np.uint8)
    inner = smooth[:, 1:-1]
    rise = (cv2.dilate(inner, window) - cv2.erode(inner, window)).astype(np.float32)
    steepest = cv2.dilate(slope, window)
    low, high = (float(level) for level in np.percentile(smooth[::2, ::4], (2, 98)))
    least = max(_LEAST_RISE, min(_SURE_RISE, _RISE_SHARE * (high - low)))
    edges = (slope >= steepest) & (rise >= least) & (slope > 0)
    # A step blurred by sigma rises by height / (sigma * sqrt(2 pi)) a pixel at its steepest.
    return np.asarray(rise[edges] / slope[edges] / np.float32(np.sqrt(2 * np.pi)), np.float32)
