"""Finds where one point of the rectified left image lies in the right one, to a fraction of a pixel, and how surely. Pure.

Least-squares matching (Gruen, "Adaptive least squares correlation", 1985): a window around the point is compared with the
right image moved by a shift that may bend over the window like a curved surface (d, its slopes and its curvatures along
the epipolar line; one offset across it), and with another gain and offset of levels. Gauss-Newton finds the smallest
weighted sum of squared differences, beginning at the matcher's disparity.

The covariance does not take the differences for independent: rectification blurs neighbouring pixels together, JPEG
spoils blocks. With weights W, derivatives J and the differences' own autocovariance g, estimated in the window, it is

    N^-1 (sum over pixels p, q of w_p w_q g(p - q) J_p J_q^T) N^-1,  N = J^T W J

("sandwich", White 1980; Newey and West 1987). Pixels that the matcher puts on another surface, or that differ far more
than the rest, do not count.
"""

from dataclasses import dataclass
from enum import Enum
from typing import Final

import cv2
import numpy as np

from phone_host.model import Disparity, RectifiedPair
from phone_host.stereo.point_window import LEAST_PIXELS, STRAYED_PX, Floats, Mask, PointWindow

_SAME_SURFACE_PX: Final = 1.5
"""By how much the matcher's disparity may depart from the plane through the point's own surface."""

_SLOPE_PRIOR_PX: Final = 6.0
"""Keeps that plane level where little of it lies near the point: the standard deviation of the window's weights."""

_EDGE_PX: Final = 2
"""A matcher's edges are off by that much. Of 24 rendered rooms the stated 95 % hold 92 % of the points without such a
margin, 93 % with it, and no point is off by six times its uncertainty any more."""

_LARGEST_SIGMA_PX: Final = 0.5
"""From here on it is not known any more that the match is the right one of several."""

_LEAST_LIKENESS: Final = 0.6
"""Correlation of the two windows; windows of different things reach half of it by chance."""

_GRID_SIGMA_PX: Final = 0.013
"""Rectification reads images at steps of 1/32 px: each is off by up to 1/64 px, uniformly, which is 0.009 px; two images."""


_PLAIN_REACH_PX: Final = 6
"""Where the point's own pixel has no disparity, one so far from it may stand for it. Corners of plain squares lie nearer to what is matched."""

_PLAIN_FOUND: Final = 0.25
"""Share of the window that must lie on the point's surface before pixels without disparity may be plain parts of it."""


class Unmatched(Enum):
    """Why a point has no match; the value says it to the user."""

    OUTSIDE = "lies outside of what both cameras see"
    NO_DISPARITY = "has no disparity: it is hidden from the other camera, or too smooth"
    NO_SURFACE = "lies on too small a surface, or at an edge"
    UNLIKE = "looks different in the right image"
    UNSURE = "has too little texture around it"


@dataclass(frozen=True, slots=True, eq=False)
class PointMatch:
    """A point's place in the rectified right image.

    Attributes:
        right_px: (2,) float64 x, y, px.
        covariance_px2: (2, 2) float64 of it, px^2.
        disparity_px: the distance along the epipolar line, px.
        across_px: how far beside its epipolar line it lies, px.
        pixels: how many pixels were compared.
    """

    right_px: Floats
    covariance_px2: Floats
    disparity_px: float
    across_px: float
    pixels: int


def match_point(
    pair: RectifiedPair, disparity: Disparity, at_px: tuple[float, float], step_px: float = 1.0
) -> PointMatch | Unmatched:
    """Find one point of the rectified left image in the right one.

    Args:
        pair: the rectified images.
        disparity: (H, W) float32 of the left one, px, as a matcher found it.
        at_px: x and y of the point in the left image, px; any fraction.
        step_px: px of the rectified images that one px of those was that were matched (1 / scale).
    """
    height, width = disparity.shape
    x, y = at_px
    if not (0 <= x <= width - 1 and 0 <= y <= height - 1):
        return Unmatched.OUTSIDE
    start_px = _nearby(disparity, x, y, step_px)
    if not np.isfinite(start_px):
        return Unmatched.NO_DISPARITY
    window = PointWindow(pair, at_px, start_px, step_px)
    window.keep(_same_surface(disparity[window.rows, window.columns], window, start_px, step_px))
    if window.count < LEAST_PIXELS:
        return Unmatched.NO_SURFACE
    return _fitted(window, at_px, start_px, step_px)


def _fitted(window: PointWindow, at_px: tuple[float, float], start_px: float, step_px: float) -> PointMatch | Unmatched:
    """Fit the window, without what differs far more than the rest, and judge what came of it."""
    theta = window.fitted(window.rough(start_px, step_px))
    window.drop_outliers(theta)
    if window.count < LEAST_PIXELS:
        return Unmatched.UNLIKE
    theta = window.fitted(theta)
    strayed = abs(theta[0] - start_px) > STRAYED_PX * step_px or abs(theta[1]) > STRAYED_PX
    if strayed or not np.isfinite(theta).all():
        return Unmatched.UNSURE
    if window.likeness(theta) < _LEAST_LIKENESS:
        return Unmatched.UNLIKE
    covariance = window.covariance(theta)
    is_known = 0 < covariance[0, 0] <= _LARGEST_SIGMA_PX**2 and 0 < covariance[1, 1] < np.inf
    if not (is_known and np.linalg.det(covariance) > 0):
        return Unmatched.UNSURE
    return PointMatch(
        right_px=np.array(at_px) + window.axes @ theta[:2],
        covariance_px2=window.axes @ covariance @ window.axes.T + np.eye(2) * _GRID_SIGMA_PX**2,
        disparity_px=float(theta[0]),
        across_px=float(theta[1]),
        pixels=window.count,
    )


def _nearby(disparity: Disparity, x: float, y: float, step_px: float) -> float:
    """Return the median disparity around the pixel that is nearest of those that have one; NaN if none is near."""
    column, row = round(x), round(y)
    reach = 0 if np.isfinite(disparity[row, column]) else round(_PLAIN_REACH_PX * step_px)
    top, left = max(row - reach, 0), max(column - reach, 0)
    rows, columns = np.nonzero(np.isfinite(disparity[top : row + reach + 1, left : column + reach + 1]))
    if not rows.size:
        return float("nan")
    nearest = int(np.argmin((rows + top - y) ** 2 + (columns + left - x) ** 2))
    row, column = int(rows[nearest]) + top, int(columns[nearest]) + left
    around = disparity[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
    return float(np.nanmedian(around))


def _same_surface(disparity: Disparity, window: PointWindow, start_px: float, step_px: float) -> Mask:
    """Return which pixels the matcher puts on the point's own surface, and not at its edge: near a plane fitted to it, connected."""
    found = np.isfinite(disparity)
    beside = np.where(found, disparity, start_px) - start_px
    near = found & (np.abs(beside) <= _SAME_SURFACE_PX * step_px)
    design = np.stack([window.dx, window.dy])
    normal = np.einsum("iyx,jyx->ij", design * near, design) + np.eye(2) * _SLOPE_PRIOR_PX**2
    slopes = np.linalg.solve(normal, np.einsum("iyx,yx->i", design, np.where(near, beside, 0.0)))
    plane = np.einsum("i,iyx->yx", slopes, design)
    same = found & (np.abs(beside - plane) <= _SAME_SURFACE_PX * step_px)
    same |= _plain(found, same)
    inner = cv2.erode(same.astype(np.uint8), np.ones((2 * _EDGE_PX + 1,) * 2, np.uint8), borderValue=1)
    middle = np.unravel_index(int(np.argmin(window.dx**2 + window.dy**2)), inner.shape)
    _, parts = cv2.connectedComponents(inner, connectivity=4)
    return np.asarray((parts == parts[middle]) & (inner[middle] > 0), np.bool_)


def _plain(found: Mask, same: Mask) -> Mask:
    """Return the pixels without disparity that meet no other surface: plain parts of this one. Where two surfaces meet, one hides the other."""
    if np.count_nonzero(same) < _PLAIN_FOUND * same.size:
        return np.zeros_like(same)
    _, parts = cv2.connectedComponents((~found).astype(np.uint8), connectivity=8)
    beside = cv2.dilate((found & ~same).astype(np.uint8), np.ones((3, 3), np.uint8))
    return np.asarray(~found & ~np.isin(parts, np.unique(parts[beside > 0])), np.bool_)
