"""Where two edges of a board cross, to a few hundredths of a pixel, and how well that is known. Pure.

Around a corner the image is modelled as

    (1 + g . d) (b + c tanh(k u) tanh(k v)),     d = pixel - corner,  u, v = distances of the pixel from the two edges,

with the corner, the two edges' directions, the edges' width, contrast, brightness and the fall of the light g fitted to the pixels
by least squares, weighted towards the corner. A corner between squares looks the same after half a turn about it, whatever the
blur, the tilt or the camera's tone curve; so does the model, and what the two do not share cannot shift the corner.

The image is smoothed first: an edge narrower than a pixel, as a sensor samples it or a driver sharpens it, comes out in steps that
no smooth model follows. Pixels far from both edges only say how bright the squares are, and are left out.

Source: model fitting of corners after R. Deriche and G. Giraudon, "A Computational Approach for Corner and Vertex Detection",
1993; saddle points after S. Duda and U. Frese, "Accurate Detection and Localization of Checkerboard Corners for
Calibration", BMVC 2018. What it reaches: docs/decisions/0053-corner-estimator.md.
"""

from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import Image

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

_SMOOTHED_PX: Final = 0.7
"""Deviation of the smoothing. Least for sharp images of 320 x 240 px: rows off by 0.26 px (95 %) without, 0.06 px with it."""

_NOISE_GAIN: Final = 4 * np.pi * _SMOOTHED_PX**2
"""Smoothing hides noise from the single pixel, not from a corner: the variance of white noise shrinks by this factor."""

_REACH_SHARE: Final = 0.5
"""How far the edges are followed, of the distance to the next corner: beyond, that one's edges begin."""

_SMALL_REACH_PX: Final = 8.0
"""Of small squares that is too little. A chessboard's next edges lie alike on all sides and shift nothing: squares of 10 px in images
scaled down scatter by 1.06 % with it, by 1.48 % without."""

_CHESSBOARD_SHARE: Final = 0.75
_LEAST_REACH_PX, _MOST_REACH_PX = 2.0, 20.0
_BESIDE_PX, _BESIDE_SHARE = 3.5, 0.35
"""How far from an edge a pixel may lie: px, and share of the reach, whichever is more."""

_STEEPNESS: Final = 0.8
"""k times the edge's deviation: tanh(0.8 x) is the error function's integral of a Gaussian, to 2 %."""

_LEAST_SINE: Final = 0.05
"""Of the angle between the edges: a board seen so flat shows no corners."""

_MOST_STEPS: Final = 12
_STILL_PX: Final = 0.01
"""A step so short ends the search: the next one is a tenth of it, or less."""
_DAMPING: Final = 1e-3
_MOST_STEP: Final = np.array([1.0, 1.0, 0.2, 0.2, 0.5])
"""Of the corner, px, the directions, rad, and the logarithm of the width: beyond, the derivatives say nothing."""

_UNSURE: Final = 5.0
"""Times the usual deviation. Corners half hidden by a hand have 11 and 34 times, one that a search put beside its place has 67
times; in sharp images of a real rig no other exceeds 2.2 times."""

_LEAST_SIGMA_PX: Final = 0.005
_LEAST_CONTRAST: Final = 2.0
"""Grey levels: what differs less from its surroundings is no square."""

_WIDTHS_PX: Final = (0.3, 12.0)
_PARAMETERS: Final = 9
_TINY: Final = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class FittedCorners:
    """Corners of one image.

    Attributes:
        px: (N, 2) where they are; NaN where the fit ran away or found no contrast: there is no such corner.
        sigma_px: (N,) standard deviation of one coordinate by the image's noise; NaN likewise.
        contrast: (N,) half of the difference of white and black, grey levels; its sign alternates between neighbours.
    """

    px: Floats
    sigma_px: Floats
    contrast: Floats

    def are_sure(self) -> NDArray[np.bool_]:
        """Return which corners are about as well known as most, (N,): the edge of a hand is no crossing of two edges."""
        if np.isnan(self.sigma_px).all():
            return np.zeros(len(self.px), np.bool_)
        return np.asarray(self.sigma_px < _UNSURE * max(float(np.nanmedian(self.sigma_px)), _LEAST_SIGMA_PX))


@dataclass(frozen=True, slots=True, eq=False)
class _Patches:
    """K pixels around each corner: where they are, px, their values and weights, (N, K) float32; weight 0: there is none."""

    x: Singles
    y: Singles
    values: Singles
    weights: Singles


@dataclass(frozen=True, slots=True, eq=False)
class _Equations:
    """The normal equations: what is left of the pixels (N, K), weighted derivatives (N, K, 9), matrix (N, 9, 9), right side (N, 9)."""

    errors: Singles
    weighted: Singles
    matrix: Singles
    right: Singles


def fit_corners(
    grey: Image, start: Floats, along: Floats, down: Floats, most_share: float = _CHESSBOARD_SHARE
) -> FittedCorners:
    """Fit corners of a board to an image; returns them in the same order.

    Args:
        grey: (H, W) uint8.
        start: (N, 2) px, each off by less than a third of the reach.
        along: (N, 2) px from each corner to the next along one edge.
        down: (N, 2) px likewise along the other edge.
        most_share: of these steps, up to which small squares are looked at.
    """
    lengths = np.stack([np.linalg.norm(along, axis=1), np.linalg.norm(down, axis=1)], axis=1)
    reach = np.maximum(_REACH_SHARE * lengths, np.minimum(most_share * lengths, _SMALL_REACH_PX))
    reach = np.clip(reach, _LEAST_REACH_PX, _MOST_REACH_PX)
    edges = np.stack([along, down], axis=1) / np.maximum(lengths, _TINY)[..., np.newaxis]
    patches = _cut(grey, start, edges, reach)
    values = np.zeros((len(start), _PARAMETERS))
    values[:, :2] = start
    values[:, 2] = np.arctan2(along[:, 1], along[:, 0])
    values[:, 3] = np.arctan2(down[:, 1], down[:, 0])
    values[:, 5:7] = _levels(values, patches)
    equations = _equations(values, patches)
    for _ in range(_MOST_STEPS):
        step = _step(equations)
        values += step
        values[:, 4] = np.clip(values[:, 4], *np.log(_WIDTHS_PX))
        if np.abs(step[:, :2]).max() < _STILL_PX:
            break
        equations = _equations(values, patches)
    astray = (np.linalg.norm(values[:, :2] - start, axis=1) > reach.min(axis=1)) | (
        np.abs(values[:, 5]) < _LEAST_CONTRAST
    )
    fitted = FittedCorners(values[:, :2], _sigma_px(patches, equations), values[:, 5])
    fitted.px[astray], fitted.sigma_px[astray] = np.nan, np.nan
    return fitted


def steps_between(grid: Floats) -> tuple[Floats, Floats]:
    """Return the steps from each corner of a grid (rows, columns, 2) to the next along its row and along its column: means of both sides.

    Returns:
        (N, 2) px each.
    """
    along, down = (np.gradient(grid, axis=axis).reshape(-1, 2) for axis in (1, 0))
    return along, down


def _cut(grey: Image, start: Floats, edges: Floats, reach: Floats) -> _Patches:
    """Return the pixels near the edges of each corner.

    Args:
        grey: (H, W) uint8.
        start: (N, 2) px.
        edges: (N, 2, 2) unit vectors along both edges.
        reach: (N, 2) px, how far each is followed.
    """
    window = int(np.ceil((np.abs(edges) * reach[..., np.newaxis]).sum(axis=1).max()))
    steps = np.arange(-window, window + 1)
    offset_x, offset_y = (each.ravel() for each in np.meshgrid(steps, steps))
    middle = np.rint(start).astype(int)
    column, row = middle[:, :1] + offset_x, middle[:, 1:] + offset_y
    x, y = (column - start[:, :1]).astype(np.float32), (row - start[:, 1:]).astype(np.float32)
    # Distances from the two edges; divided by the sine of the angle between them they run along the other edge.
    first, second = (edges[:, i, :1].astype(np.float32) * y - edges[:, i, 1:].astype(np.float32) * x for i in (0, 1))
    sine = np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0])
    far = (np.maximum(sine, _LEAST_SINE)[:, np.newaxis] * reach).astype(np.float32)
    skewed = (second / far[:, :1]) ** 2, (first / far[:, 1:]) ** 2
    beside = np.maximum(_BESIDE_PX, _BESIDE_SHARE * reach.min(axis=1))[:, np.newaxis]
    used = (np.minimum(np.abs(first), np.abs(second)) < beside) & (np.maximum(*skewed) <= 1)
    used &= (column >= 0) & (row >= 0) & (column < grey.shape[1]) & (row < grey.shape[0])
    corner, pixel = np.nonzero(used)
    counts = used.sum(axis=1)
    slot = np.arange(len(corner)) - np.repeat(np.cumsum(counts) - counts, counts)
    columns, rows = column[corner, pixel], row[corner, pixel]
    patches = _Patches(*(np.zeros((len(start), max(int(counts.max()), 1)), np.float32) for _ in range(4)))
    patches.x[corner, slot], patches.y[corner, slot] = columns, rows
    patches.values[corner, slot] = _smoothed(grey, columns, rows)
    patches.weights[corner, slot] = np.exp(-(skewed[0] + skewed[1])[corner, pixel])
    return patches


def _smoothed(grey: Image, columns: NDArray[np.intp], rows: NDArray[np.intp]) -> NDArray[np.float32]:
    """Return the smoothed image at some pixels, (M,): only the piece around them is smoothed."""
    if not len(columns):
        return np.empty(0, np.float32)
    margin = round(4 * _SMOOTHED_PX)
    left, top = max(int(columns.min()) - margin, 0), max(int(rows.min()) - margin, 0)
    piece = grey[top : rows.max() + margin + 1, left : columns.max() + margin + 1].astype(np.float32)
    smooth = np.asarray(cv2.GaussianBlur(piece, (0, 0), _SMOOTHED_PX), np.float32)
    return smooth[rows - top, columns - left]


def _levels(values: Floats, patches: _Patches) -> Floats:
    """Return contrast and brightness that fit best, (N, 2)."""
    plain = values.copy()
    plain[:, 5:] = [1, 0, 0, 0]
    weights, pattern = patches.weights, patches.values - _linearised(plain, patches)[0]
    whole = np.maximum(weights.sum(axis=1), _TINY)
    means = [(weights * each).sum(axis=1) / whole for each in (pattern, patches.values)]
    spread = (weights * pattern**2).sum(axis=1) / whole - means[0] ** 2
    contrast = ((weights * pattern * patches.values).sum(axis=1) / whole - means[0] * means[1]) / np.maximum(
        spread, _TINY
    )
    return np.stack([contrast, means[1] - contrast * means[0]], axis=1)


def _linearised(values: Floats, patches: _Patches) -> tuple[Singles, Singles]:
    """Return what the model leaves of the pixels, (N, K), and its derivatives by the parameters, (N, K, 9).

    Parameters: the corner x, y; the edges' directions, rad; the logarithm of their width; contrast, brightness, and the fall of
    the light by x and y, 1 / px.
    """
    x, y = (patches.x - values[:, :1]).astype(np.float32), (patches.y - values[:, 1:2]).astype(np.float32)
    values = values.astype(np.float32)
    sine, cosine = np.sin(values[:, 2:4]), np.cos(values[:, 2:4])
    steepness = _STEEPNESS * np.exp(-values[:, 4, np.newaxis])
    contrast, brightness = values[:, 5, np.newaxis], values[:, 6, np.newaxis]
    fall_x, fall_y = values[:, 7, np.newaxis], values[:, 8, np.newaxis]
    first, second = (cosine[:, i, np.newaxis] * y - sine[:, i, np.newaxis] * x for i in (0, 1))
    bent_1, bent_2 = np.tanh(steepness * first), np.tanh(steepness * second)
    pattern = bent_1 * bent_2
    squares = brightness + contrast * pattern
    light = 1 + fall_x * x + fall_y * y
    scale = contrast * light * steepness
    by_first, by_second = scale * (1 - bent_1**2) * bent_2, scale * (1 - bent_2**2) * bent_1
    jacobian = np.empty((*x.shape, _PARAMETERS), np.float32)
    jacobian[..., 0] = by_first * sine[:, :1] + by_second * sine[:, 1:] - squares * fall_x
    jacobian[..., 1] = -by_first * cosine[:, :1] - by_second * cosine[:, 1:] - squares * fall_y
    jacobian[..., 2] = -by_first * (cosine[:, :1] * x + sine[:, :1] * y)
    jacobian[..., 3] = -by_second * (cosine[:, 1:] * x + sine[:, 1:] * y)
    jacobian[..., 4] = -by_first * first - by_second * second
    jacobian[..., 5] = light * pattern
    jacobian[..., 6] = light
    jacobian[..., 7] = squares * x
    jacobian[..., 8] = squares * y
    return patches.values - light * squares, jacobian


def _equations(values: Floats, patches: _Patches) -> _Equations:
    errors, jacobian = _linearised(values, patches)
    weighted = jacobian * patches.weights[..., np.newaxis]
    turned = np.swapaxes(weighted, 1, 2)
    return _Equations(errors, weighted, turned @ jacobian, (turned @ errors[..., np.newaxis])[..., 0])


def _step(equations: _Equations) -> Floats:
    """Return a damped step of all parameters, (N, 9), no longer than the derivatives hold."""
    diagonal = np.einsum("nii->ni", equations.matrix)
    damped = equations.matrix + (_DAMPING * diagonal + _TINY)[..., np.newaxis] * np.eye(_PARAMETERS)
    step = np.linalg.solve(damped, equations.right[..., np.newaxis])[..., 0]
    step[:, :5] = np.clip(step[:, :5], -_MOST_STEP, _MOST_STEP)
    return np.asarray(step, np.float64)


def _sigma_px(patches: _Patches, equations: _Equations) -> Floats:
    """Return the standard deviation of one coordinate, (N,) px: that of weighted least squares, noise as it remains."""
    weights, weighted = patches.weights, equations.weighted
    used = (weights > 0).sum(axis=1)
    variance = (weights * equations.errors**2).sum(axis=1) / np.maximum(weights.sum(axis=1), _TINY)
    variance = variance * used / np.maximum(used - _PARAMETERS, 1) * _NOISE_GAIN
    inverse = np.linalg.inv(equations.matrix + _TINY * np.eye(_PARAMETERS))
    spread = (inverse @ (np.swapaxes(weighted, 1, 2) @ weighted) @ inverse)[:, :2, :2]
    found = variance * np.einsum("nii->n", spread) / 2
    return np.asarray(np.sqrt(np.where(found >= 0, found, np.inf)), np.float64)  # below: equations without a solution
