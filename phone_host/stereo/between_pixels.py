"""Levels between pixels, with all their fractions: parts of an image as smooth functions. Pure."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Image

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


def grey(image: Image) -> Floats:
    """Return levels with all their fractions: rounding a mean of three colours would be noise of its own."""
    return np.asarray(image, np.float64) if image.ndim == 2 else np.asarray(image, np.float64) @ [0.114, 0.587, 0.299]


def smooth_part(image: Image, rows: slice, columns: slice, sigma_px: float) -> Floats:
    """Return the levels of a part of an image, smoothed with its surroundings.

    Args:
        image: grey or colour.
        rows: of the part, inside the image.
        columns: of the part, inside the image.
        sigma_px: standard deviation of the Gaussian, px.

    Returns:
        (h, w) float64.
    """
    top, bottom, left, right = rows.start, rows.stop, columns.start, columns.stop
    margin = math.ceil(3 * sigma_px)
    above, before = max(top - margin, 0), max(left - margin, 0)
    part = grey(image[above : bottom + margin, before : right + margin])
    whole = np.asarray(cv2.GaussianBlur(part, (0, 0), sigma_px, borderType=cv2.BORDER_REPLICATE), np.float64)
    return whole[top - above : bottom - above, left - before : right - before]


def cubic(image: Floats, x: Floats, y: Floats) -> tuple[Floats, Floats, Floats, Mask]:
    """Return values and derivatives by x and y between pixels by cubic convolution (Keys, 1981), and which lie inside."""
    height, width = image.shape
    with np.errstate(invalid="ignore"):
        inside: Mask = (x >= 1) & (y >= 1) & (x < width - 2) & (y < height - 2)
    x, y = np.where(inside, x, 1.0), np.where(inside, y, 1.0)
    column, row = np.floor(x).astype(np.intp), np.floor(y).astype(np.intp)
    wx, sx = _keys(x - column)
    wy, sy = _keys(y - row)
    if height < 4 or width < 4:
        nothing = np.zeros_like(x)
        return nothing, nothing, nothing, np.zeros_like(inside)
    offsets = np.arange(-1, 3)
    around = image[(row[None] + offsets[:, None, None])[:, None], (column[None] + offsets[:, None, None])[None]]
    along_x = np.einsum("jiyx,iyx->jyx", around, wx)
    value = np.einsum("jyx,jyx->yx", along_x, wy)
    by_y = np.einsum("jyx,jyx->yx", along_x, sy)
    by_x = np.einsum("jiyx,iyx,jyx->yx", around, sx, wy)
    return value, by_x, by_y, inside


def _keys(t: Floats) -> tuple[Floats, Floats]:
    """Return the weights of the four pixels around a place 0 <= t < 1 behind the second, and their derivatives by t."""
    t2, t3 = t * t, t * t * t
    weights = np.stack([-t + 2 * t2 - t3, 2 - 5 * t2 + 3 * t3, t + 4 * t2 - 3 * t3, -t2 + t3]) / 2
    steps = np.stack([-1 + 4 * t - 3 * t2, -10 * t + 9 * t2, 1 + 8 * t - 9 * t2, -2 * t + 3 * t2]) / 2
    return weights, steps
