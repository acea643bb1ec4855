"""A window around a point of the rectified left image, compared with the right image moved by some shift. Pure.

What is compared, how the unknowns are fitted and where the covariance comes from says `point_match`.
"""

import math
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Image, RectifiedPair

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


HALF_PX: Final = 12
_SPREAD_PX: Final = 6.0
"""Half width of the window, and the standard deviation of its weights. With 3 px the noise of a webcam alone leaves a
tenth of a pixel; with 10 px two surfaces meet in most windows."""

LEAST_PIXELS: Final = 60
"""Fewer on the same surface fit nine unknowns to almost any image."""

STRAYED_PX: Final = 1.5
"""A fit that moves farther from the matcher's disparity, or from the epipolar line, has found something else."""

_SMOOTH_PX: Final = 0.5
"""Levels are smoothed that little: interpolation alters waves of two pixels most, and noise has most of them."""

_STEPS: Final = 12
_CONVERGED_PX: Final = 1e-3
_LAGS: Final = 4
"""Differences of pixels farther from each other than this are taken for independent."""

_OUTLIER_SIGMAS: Final = 4.0
_SIGMA_OF_MEDIAN: Final = 1.4826
_LEAST_LEVELS: Final = 0.3
"""Rounding to whole levels leaves this standard deviation in any difference (1 / sqrt(12))."""

_LEAST_STRETCH: Final = 0.2
"""Where a surface is seen so much narrower by the other camera, its texture is not comparable."""

# Surfaces seen by two cameras bend no more than this; it keeps windows with little texture from bending at will.
_SLOPE: Final = 0.5
_CURVATURE_PER_PX: Final = 0.01
_ACROSS_PX: Final = 1.0

_UNKNOWNS: Final = 9  # d, across, its slopes x and y, its curvatures xx, xy, yy, gain, offset
_PRIOR: Final = np.diag([0, _ACROSS_PX**-2, *(_SLOPE**-2,) * 2, *(_CURVATURE_PER_PX**-2,) * 3, 0, 0])
"""The way from a left pixel to its partner for a growing disparity."""


@dataclass(frozen=True, slots=True, eq=False)
class _Compared:
    """Both windows, compared at some values of the unknowns.

    Attributes:
        difference: (h, w) left minus moved right image.
        by_left: (9, h, w) its negative derivatives by the unknowns, as the left image shows them.
        by_right: (9, h, w) the same as the right image shows them.
        inside: (h, w) which pixels count.
    """

    difference: Floats
    by_left: Floats
    by_right: Floats
    inside: Mask

    @property
    def derivatives(self) -> Floats:
        """Their mean."""
        return (self.by_left + self.by_right) / 2


class PointWindow:
    """The pixels around a point, and the right image that they are compared with.

    The nine unknowns are: the disparity at the point, the shift across the epipolar line, the disparity's slopes by x and
    y, its curvatures by xx, xy and yy, and the gain and offset of levels.

    Attributes:
        rows: of the window.
        columns: of the window.
        dx: (h, w) float64 x from the point, px.
        dy: (h, w) float64 y from the point, px.
        axes: (2, 2) float64, columns: the way along the epipolar line for a growing disparity, and the way across.

    Args:
        pair: the rectified images.
        at_px: x and y of the point, px.
        start_px: about its disparity, px.
        step_px: by how much that may be off for every pixel of the matcher's search.
    """

    def __init__(self, pair: RectifiedPair, at_px: tuple[float, float], start_px: float, step_px: float) -> None:
        height, width = pair.left.shape[:2]
        x, y = at_px
        column, row = round(x), round(y)
        self.rows = slice(max(row - HALF_PX, 0), min(row + HALF_PX + 1, height))
        self.columns = slice(max(column - HALF_PX, 0), min(column + HALF_PX + 1, width))
        grid_y, grid_x = np.mgrid[self.rows, self.columns]
        self._x, self._y = grid_x.astype(np.float64), grid_y.astype(np.float64)
        self.dx, self.dy = self._x - x, self._y - y
        along = np.array(pair.epipolar.way, np.float64)
        self.axes = np.column_stack([along, [-along[1], along[0]]])
        # The part of the right image that the window may meet.
        middle = np.array([column, row]) + along * start_px
        reach = HALF_PX * (1 + _SLOPE) + STRAYED_PX * step_px + _LAGS
        low = np.floor(np.clip(middle - reach, 0, [width - 1, height - 1])).astype(int).tolist()
        high = np.ceil(np.clip(middle + reach, 0, [width - 1, height - 1])).astype(int).tolist()
        self._origin = low
        self._right = smooth_part(pair.right, slice(low[1], high[1] + 1), slice(low[0], high[0] + 1), _SMOOTH_PX)
        self._left = smooth_part(pair.left, self.rows, self.columns, _SMOOTH_PX)
        self._left_y, self._left_x = (np.asarray(each, np.float64) for each in np.gradient(self._left))
        self._weights = np.exp(-(self.dx**2 + self.dy**2) / (2 * _SPREAD_PX**2))
        self._used = np.ones(self.dx.shape, np.bool_)

    def keep(self, mask: Mask) -> None:
        """Leave out all pixels but those of a mask (h, w)."""
        self._used &= mask

    @property
    def count(self) -> int:
        """Number of pixels that are compared."""
        return int(np.count_nonzero(self._used))

    def rough(self, start_px: float, step_px: float) -> Floats:
        """Return the unknowns to begin with: a disparity in whole px from the matcher's. A search of small images may be off by some."""
        most = math.ceil(STRAYED_PX * step_px) if step_px > 1 else 0
        best, found = -np.inf, np.zeros(_UNKNOWNS)
        steps = np.arange(-most, most + 1)
        for step in steps:
            theta = np.zeros(_UNKNOWNS)
            theta[0], theta[-2] = start_px + step, 1.0
            likeness = self.likeness(theta)
            if likeness > best:
                best, found = likeness, theta
        return found

    def fitted(self, theta: Floats) -> Floats:
        """Return the unknowns with the smallest sum of squared differences, from where they are."""
        for _ in range(_STEPS):
            now = self._compared(theta)
            if np.count_nonzero(now.inside) < LEAST_PIXELS:
                return np.full_like(theta, np.nan)
            derivatives = now.derivatives
            weighted = derivatives * np.where(now.inside, self._weights, 0.0)
            prior = _PRIOR * _noise2(now.difference, now.inside, self._weights)
            normal = np.einsum("iyx,jyx->ij", weighted, derivatives) + prior
            right = np.einsum("iyx,yx->i", weighted, now.difference) - prior @ theta
            try:
                step = np.linalg.solve(normal, right)
            except np.linalg.LinAlgError:
                return np.full_like(theta, np.nan)
            step[:2] = np.clip(step[:2], -1.0, 1.0)
            theta = theta + step
            if np.abs(step[:2]).max() < _CONVERGED_PX:
                break
        return theta

    def drop_outliers(self, theta: Floats) -> None:
        """Leave out pixels that differ far more than the rest: of another surface, a reflection, a spoiled block."""
        if not np.isfinite(theta).all():
            return
        now = self._compared(theta)
        size = np.abs(now.difference)
        sigma = max(_SIGMA_OF_MEDIAN * float(np.median(size[now.inside])), _LEAST_LEVELS)
        self._used &= size <= _OUTLIER_SIGMAS * sigma

    def likeness(self, theta: Floats) -> float:
        """Return the correlation of both windows, -1 to 1."""
        now = self._compared(theta)
        if np.count_nonzero(now.inside) < LEAST_PIXELS:
            return -1.0
        weights = self._weights[now.inside]
        both = np.stack([self._left[now.inside], now.by_right[-2][now.inside]])
        both -= (both @ weights / weights.sum())[:, None]
        product = (both * weights) @ both.T
        scale = np.sqrt(product[0, 0] * product[1, 1])
        return float(product[0, 1] / scale) if scale > 0 else -1.0

    def covariance(self, theta: Floats) -> Floats:
        """Return (2, 2) of the shift along and across the epipolar line, px^2; infinite where it is not determined."""
        now = self._compared(theta)
        weights = np.where(now.inside, self._weights, 0.0)
        weighted = now.derivatives * weights
        noise2 = _noise2(now.difference, now.inside, self._weights)
        prior = _PRIOR * noise2
        # Noise makes any image's derivatives larger, and so a match look surer. The noise of two images is not alike:
        # products of the one's derivatives and the other's hold only what both show.
        common = np.einsum("iyx,jyx->ij", now.by_left * weights, now.by_right)
        normal = (common + common.T) / 2 + prior
        middle = prior * noise2
        covariances = _autocovariance(np.where(now.inside, now.difference, 0.0), weights)
        covariances *= noise2 / max(covariances[0, _LAGS], np.finfo(np.float64).tiny)
        for lag_y in range(_LAGS + 1):
            for lag_x in range(-_LAGS, _LAGS + 1):
                if lag_y == 0 and lag_x < 0:
                    continue
                here, there = _shifted(weighted, lag_x, lag_y)
                product = np.einsum("iyx,jyx->ij", here, there) * covariances[lag_y, lag_x + _LAGS]
                middle += product if lag_x == lag_y == 0 else product + product.T
        try:
            inverse = np.linalg.inv(normal)
        except np.linalg.LinAlgError:
            return np.full((2, 2), np.inf)
        return np.asarray((inverse @ middle @ inverse)[:2, :2], np.float64)

    def _compared(self, theta: Floats) -> _Compared:
        d, across, slope_x, slope_y, xx, xy, yy, gain, offset = theta
        dx, dy = self.dx, self.dy
        shift = d + slope_x * dx + slope_y * dy + xx * dx * dx + xy * dx * dy + yy * dy * dy
        (ax, bx), (ay, by) = self.axes
        value, by_x, by_y, inside = cubic(
            self._right, self._x + ax * shift + bx * across - self._origin[0],
            self._y + ay * shift + by * across - self._origin[1],
        )  # fmt: skip
        # The left image's own derivatives, taken over to the right one's axes, have noise of their own: beside it that of
        # the right image's stands out, and their mean has less of both.
        bend_x, bend_y = slope_x + 2 * xx * dx + xy * dy, slope_y + xy * dx + 2 * yy * dy
        stretch = 1 + ax * bend_x + ay * bend_y
        lefts = (ax * self._left_x + ay * self._left_y) / stretch
        left_along = lefts
        left_beside = bx * self._left_x + by * self._left_y - (bx * bend_x + by * bend_y) * lefts
        right_along, right_beside = gain * (ax * by_x + ay * by_y), gain * (bx * by_x + by * by_y)
        return _Compared(
            self._left - gain * value - offset,
            _derivatives(left_along, left_beside, dx, dy, value),
            _derivatives(right_along, right_beside, dx, dy, value),
            inside & self._used & (stretch > _LEAST_STRETCH),
        )


def _derivatives(along: Floats, beside: Floats, dx: Floats, dy: Floats, value: Floats) -> Floats:
    """Return (9, h, w): how the moved right image changes with each unknown."""
    terms = (along, beside, along * dx, along * dy, along * dx * dx, along * dx * dy, along * dy * dy, value)
    return np.stack([*terms, np.ones_like(value)])


def _noise2(difference: Floats, inside: Mask, weights: Floats) -> float:
    """Return the weighted variance of the differences, for the unknowns that were fitted to them."""
    kept = weights[inside]
    effective = float(kept.sum() ** 2 / (kept**2).sum())
    variance = float((kept * difference[inside] ** 2).sum() / kept.sum())
    return max(variance * effective / max(effective - _UNKNOWNS, 1.0), _LEAST_LEVELS**2)


def _autocovariance(difference: Floats, weights: Floats) -> Floats:
    """Return (lags + 1, 2 lags + 1) mean products of differences at pixels that lie so far from each other (y, x).

    The fitted offset has taken the mean out of the differences, and with it the same from each product: the noise's
    variance summed over all lags, divided by the number of pixels. It is put back.
    """
    made = np.zeros((_LAGS + 1, 2 * _LAGS + 1))
    for lag_y in range(_LAGS + 1):
        for lag_x in range(-_LAGS, _LAGS + 1):
            a, b = _shifted(difference[None], lag_x, lag_y)
            u, v = _shifted(weights[None], lag_x, lag_y)
            total = float((u * v).sum())
            made[lag_y, lag_x + _LAGS] = float((a * b * u * v).sum()) / total if total > 0 else 0.0
    summed = max(float(made[0].sum() + 2 * made[1:].sum()), float(made[0, _LAGS]))
    pixels = float(weights.sum() ** 2 / (weights**2).sum())
    return made + summed / max(pixels - (2 * _LAGS + 1) ** 2, pixels / 4)


def _shifted(images: Floats, lag_x: int, lag_y: int) -> tuple[Floats, Floats]:
    """Return views of images (N, h, w) without their last and first rows and columns: pixels that lie a lag apart."""
    height, width = images.shape[1:]
    here_x = slice(max(-lag_x, 0), width - max(lag_x, 0))
    there_x = slice(max(lag_x, 0), width - max(-lag_x, 0))
    return images[:, : height - lag_y, here_x], images[:, lag_y:, there_x]
