"""The quality of depth on a flat wall or board: the figures of Intel's rs-depth-quality, and more. Pure.

Definitions (librealsense, tools/depth-quality: readme.md and rs-depth-quality.cpp): fill rate, plane-fit RMS, sub-pixel RMS, Z accuracy. Differences:
the plane is fitted to disparities, not to points (`plane_fit` says why). Wrong matches are left out by their distance from the plane
and counted, where that tool drops the nearest and farthest 0.5 % of all points. The depth error of a pixel is measured along
its ray, as in that tool's help, at the pixel where it was found.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.model import Crop, Disparity, DisparityPlane, PlaneQuality, Seen, StereoGeometry, Tiles
from phone_host.stereo.plane_fit import (
    LEAST_VALUES,
    Floats,
    fit_plane,
    normal_over_distance,
    plane_at,
    plane_in_disparity,
    tilt_deg,
)

_MIDDLE: Final = 0.4
"""Share of width and height that counts, as rs-depth-quality's default region."""

_LEAST_FILL: Final = 0.1  # with fewer disparities it is not known whose they are
_MOST_OFF_PLANE: Final = 0.2  # a fifth of all values off the plane is a second surface, or no match at all
_MOST_BEND_PX: Final = 0.4
"""px of the matched images. Neighbours on a rendered wall deviate together by less than 0.04, on 15 real boards, whose plain
squares are hard to match, by 0.06 to 0.30."""

_MOST_SCATTER_PX: Final = (
    1.0  # px of the matched images; what is farther off counts as wrong everywhere (bad1 of Middlebury)
)
_CELLS: Final = (
    4  # across and down, for the bend: coarse enough that noise averages out, and more than one square of a board
)
_LEAST_CELL: Final = 50
_COLUMNS, _ROWS = 12, 9  # tiles of 4:3 images are squares
_LEAST_TILE: Final = 20
_TILE_FAR_PX: Final = 3.0
"""A tile whose median lies farther off the plane, px of the matched images, does not show the wall."""

_TILE_LEAST_ON: Final = 0.5


@dataclass(frozen=True, slots=True)
class NoTruth:
    """The true distance is not known; the distance is told at this pixel.

    Attributes:
        x_px: its column.
        y_px: its row.
    """

    x_px: float
    y_px: float


@dataclass(frozen=True, slots=True, kw_only=True)
class StatedDistance:
    """The distance along an optical axis is known; the tilt is not, and is taken from the fitted plane.

    Attributes:
        distance_m: from the left camera's centre, m.
        axis: direction of the axis in the rectified left camera's axes, unit length.
    """

    distance_m: float
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownPlane:
    """The plane is known.

    Attributes:
        plane: as disparities.
        x_px: where it is compared: the column of its middle.
        y_px: the row.
    """

    plane: DisparityPlane
    x_px: float
    y_px: float


Truth = NoTruth | StatedDistance | KnownPlane


def middle_of(width_px: int, height_px: int) -> Crop:
    """Return the middle 40 % by 40 % of an image."""
    width, height = max(1, round(_MIDDLE * width_px)), max(1, round(_MIDDLE * height_px))
    return Crop(x_px=(width_px - width) // 2, y_px=(height_px - height) // 2, width_px=width, height_px=height)


def measure_plane(
    disparity: Disparity,
    geometry: StereoGeometry,
    counts: NDArray[np.bool_],
    *,
    area: Crop,
    truth: Truth,
    unit_px: float = 1.0,
) -> PlaneQuality:
    """Measure how well depth shows a plane.

    Args:
        disparity: (H, W) float32, px, NaN = none.
        geometry: of the rectified pair.
        counts: (H, W) bool, the pixels that count: the region of interest; at least one.
        area: what the grid of tiles covers.
        truth: what is known of the plane.
        unit_px: size of a pixel of the matched images, px: at half the size, 2.

    Returns:
        The figures; `seen` says whether they hold.
    """
    known = _known(disparity, geometry)
    rows, columns = np.nonzero(counts & known)
    pixels = int(np.count_nonzero(counts))
    y, x, d = rows.astype(np.float64), columns.astype(np.float64), disparity[rows, columns].astype(np.float64)
    fill = d.size / pixels
    if d.size < LEAST_VALUES or fill < _LEAST_FILL:
        return _nothing(counts, area, known, fill)
    fit = fit_plane(x, y, d, unit_px)
    endless = bool((plane_at(fit.plane, x, y)[fit.on_plane] + geometry.doffs_px <= 0).any())
    on = fit.on_plane
    residual = d - plane_at(fit.plane, x, y)
    off_plane = 1 - float(np.mean(on))
    subpixel_px = _rms(residual[on])
    bend_px = _bend_px(x[on], y[on], residual[on])
    errors_m = _depth_m(d[on], geometry) - _depth_m(plane_at(fit.plane, x[on], y[on]), geometry)
    distance_m, true_m, reference = _against(truth, fit.plane, geometry)
    everywhere = off_plane_px(disparity, geometry, fit.plane)
    return PlaneQuality(
        seen=_judged(endless=endless, off_plane=off_plane, bend=bend_px / unit_px, scatter=subpixel_px / unit_px),
        roi=_box(counts),
        pixels=pixels,
        fill=fill,
        off_plane=off_plane,
        plane=fit.plane,
        subpixel_rms_px=subpixel_px,
        rms_m=_rms(errors_m),
        bend_px=bend_px,
        distance_m=distance_m,
        perpendicular_m=1 / float(np.linalg.norm(normal_over_distance(fit.plane, geometry))),
        tilt_deg=tilt_deg(fit.plane, geometry),
        bias_m=distance_m - true_m,
        true_m=true_m,
        tiles=_tiles(everywhere, disparity, geometry, area=area, reference=reference, unit_px=unit_px),
    )


def off_plane_px(disparity: Disparity, geometry: StereoGeometry, plane: DisparityPlane) -> NDArray[np.float32]:
    """Return how far disparities lie off a plane.

    Args:
        disparity: (H, W) float32, px, NaN = none.
        geometry: of the rectified pair.
        plane: the plane.

    Returns:
        (H, W) float32, px, above 0 is nearer, NaN = no disparity.
    """
    height, width = disparity.shape
    columns, rows = np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64)
    at = plane_at(plane, columns[np.newaxis], rows[:, np.newaxis])
    return np.where(_known(disparity, geometry), disparity - at, np.nan).astype(np.float32)


def _known(disparity: Disparity, geometry: StereoGeometry) -> NDArray[np.bool_]:
    """Return which pixels have a disparity in front of the cameras."""
    found: NDArray[np.bool_] = np.isfinite(disparity) & (disparity + geometry.doffs_px > 0)
    return found


def _judged(*, endless: bool, off_plane: float, bend: float, scatter: float) -> Seen:
    """Say what was seen; bend and scatter in px of the matched images."""
    if off_plane > _MOST_OFF_PLANE:
        return Seen.OFF_PLANE
    if endless:
        return Seen.ENDLESS
    if bend > _MOST_BEND_PX:
        return Seen.BENT
    if scatter > _MOST_SCATTER_PX:
        return Seen.SCATTERED
    return Seen.PLANE


def _against(
    truth: Truth, plane: DisparityPlane, geometry: StereoGeometry
) -> tuple[float, float, DisparityPlane | None]:
    """Return the measured and the true distance, m, and the true plane; NaN and None without one."""
    if isinstance(truth, StatedDistance):
        over = normal_over_distance(plane, geometry)
        distance_m = 1 / float(over @ np.array(truth.axis))
        return distance_m, truth.distance_m, plane_in_disparity(over * (distance_m / truth.distance_m), geometry)
    at = np.array(truth.x_px), np.array(truth.y_px)
    distance_m = float(_depth_m(plane_at(plane, *at), geometry))
    if isinstance(truth, KnownPlane):
        return distance_m, float(_depth_m(plane_at(truth.plane, *at), geometry)), truth.plane
    return distance_m, math.nan, None


def _depth_m(disparity_px: Floats, geometry: StereoGeometry) -> Floats:
    """Return depths, m; NaN behind the camera."""
    shifted = disparity_px + geometry.doffs_px
    with np.errstate(divide="ignore"):
        depth: Floats = np.where(shifted > 0, geometry.focal_px * geometry.baseline_m / shifted, np.nan)
    return depth


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _bend_px(x: Floats, y: Floats, residual: Floats) -> float:
    """Return the RMS of the mean residuals in a grid of cells, less what noise leaves of them; 0 if noise explains them."""
    cell = _cell_of(x) + _CELLS * _cell_of(y)
    count = np.bincount(cell, minlength=_CELLS**2)
    total = np.bincount(cell, residual, minlength=_CELLS**2)
    square = np.bincount(cell, np.square(residual), minlength=_CELLS**2)
    full = count >= _LEAST_CELL
    if not full.any():
        return 0.0
    mean = total[full] / count[full]
    noise = np.maximum(square[full] / count[full] - mean**2, 0) / count[full]
    return math.sqrt(max(0.0, float(np.average(mean**2 - noise, weights=count[full]))))


def _cell_of(along: Floats) -> NDArray[np.int64]:
    low, size = float(along.min()), max(float(np.ptp(along)), 1.0)
    return np.minimum(((along - low) / size * _CELLS).astype(np.int64), _CELLS - 1)


def _tiles(
    residual: NDArray[np.float32],
    disparity: Disparity,
    geometry: StereoGeometry,
    *,
    area: Crop,
    reference: DisparityPlane | None,
    unit_px: float,
) -> Tiles:
    """Measure every tile of a grid."""
    shape = min(_ROWS, area.height_px), min(_COLUMNS, area.width_px)
    fill, scatter, offset, depth, share = (np.full(shape, np.nan) for _ in range(5))
    tops = area.y_px + np.linspace(0, area.height_px, shape[0] + 1).round().astype(int)
    lefts = area.x_px + np.linspace(0, area.width_px, shape[1] + 1).round().astype(int)
    for row, column in np.ndindex(shape):
        inside = np.s_[tops[row] : tops[row + 1], lefts[column] : lefts[column + 1]]
        known = np.isfinite(residual[inside])
        fill[row, column] = float(np.mean(known))
        values = residual[inside][known].astype(np.float64)
        if values.size < _LEAST_TILE:
            continue
        middle = float(np.median(values))
        near = np.abs(values - middle) <= unit_px
        if abs(middle) > _TILE_FAR_PX * unit_px or np.mean(near) < _TILE_LEAST_ON:
            continue
        offset[row, column], scatter[row, column] = middle, _rms(values[near] - middle)
        y, x = np.nonzero(known)
        x, y = x[near] + lefts[column], y[near] + tops[row]
        d = disparity[y, x].astype(np.float64)
        true_px = (
            d - values[near] if reference is None else plane_at(reference, x.astype(np.float64), y.astype(np.float64))
        )
        true_m = _depth_m(true_px, geometry)
        errors_m = _depth_m(d, geometry) - true_m
        depth[row, column] = float(np.median(errors_m))
        share[row, column] = float(np.median(errors_m / true_m))
    return Tiles(area=area, fill=fill, scatter_px=scatter, offset_px=offset, offset_m=depth, offset_share=share)


def _box(counts: NDArray[np.bool_]) -> Crop:
    """Return the bounding box of the pixels that count."""
    rows, columns = np.flatnonzero(counts.any(axis=1)), np.flatnonzero(counts.any(axis=0))
    top, left = int(rows[0]), int(columns[0])
    return Crop(x_px=left, y_px=top, width_px=int(columns[-1]) - left + 1, height_px=int(rows[-1]) - top + 1)


def _nothing(counts: NDArray[np.bool_], area: Crop, known: NDArray[np.bool_], fill: float) -> PlaneQuality:
    """Return the result without a plane: only how much has a disparity."""
    nan = math.nan
    none = DisparityPlane(slope_x=nan, slope_y=nan, at_origin_px=nan)
    empty = np.full((1, 1), nan)
    shown = known[area.y_px : area.y_px + area.height_px, area.x_px : area.x_px + area.width_px]
    tiles = Tiles(
        area=area,
        fill=np.full((1, 1), float(np.mean(shown))),
        scatter_px=empty,
        offset_px=empty,
        offset_m=empty,
        offset_share=empty,
    )
    return PlaneQuality(
        seen=Seen.TOO_FEW, roi=_box(counts), pixels=int(np.count_nonzero(counts)), fill=fill, off_plane=nan, plane=none,
        subpixel_rms_px=nan, rms_m=nan, bend_px=nan, distance_m=nan, perpendicular_m=nan, tilt_deg=nan, bias_m=nan,
        true_m=nan, tiles=tiles,
    )  # fmt: skip
