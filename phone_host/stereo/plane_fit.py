"""Fits a plane to disparities, of which some may be wrong matches. Pure.

A plane in space is a plane in disparity. With the ray r = ((x - cx) / f, (y - cy) / f, 1) of a pixel, its point z r lies on
the plane n . P = h if 1 / z = n . r / h; with z = f b / (d + doffs) this is d = (f b / h) n . r - doffs, linear in x and y
(R. Labayrade, D. Aubert, J.-P. Tarel, "Real time obstacle detection in stereovision on non flat road geometry through v-disparity
representation", IV 2002, for roads; O. Faugeras, "Three-dimensional computer vision", 1993, for all planes: a plane relates
two rectified images by an affine map of the rows). The noise of matching is the same for all disparities, not for all
depths, so the fit belongs there.

The fit: least median of squares (P. Rousseeuw, "Least median of squares regression", JASA 79, 1984) finds where the plane
is; least squares over all values near it says exactly. Wrong matches are those farther from it than four standard
deviations and than one pixel of the matched images: what lies nearer may be noise, and is never left out.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.model import DisparityPlane, StereoGeometry

Floats = NDArray[np.float64]

_TRIALS: Final = 250
"""Planes through three values. With 40 % wrong matches a fifth of them is right."""

_SAMPLE: Final = 3000  # values on which a trial is judged: their median is known to 2 % of the noise
_NORMAL: Final = 1.4826  # standard deviation over median absolute deviation, of normal noise
_FAR_SIGMAS: Final = 4.0  # leaves out 0.006 % of normal noise, so that the RMS loses less than 0.1 %
_ROUNDS: Final = 20
LEAST_VALUES: Final = 50
"""Fewer values say nothing of a plane."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PlaneFit:
    """A plane, and which values lie on it.

    Attributes:
        plane: the plane.
        on_plane: (N,) bool, the others are wrong matches.
    """

    plane: DisparityPlane
    on_plane: NDArray[np.bool_]


def plane_at(plane: DisparityPlane, x_px: NDArray[np.floating], y_px: NDArray[np.floating]) -> Floats:
    """Return a plane's disparity at pixels, px; the arrays are broadcast.

    Args:
        plane: the plane.
        x_px: columns, px.
        y_px: rows, px.
    """
    found: Floats = plane.slope_x * np.asarray(x_px, np.float64) + plane.slope_y * np.asarray(y_px, np.float64)
    return found + plane.at_origin_px


def fit_plane(x_px: Floats, y_px: Floats, disparity_px: Floats, unit_px: float = 1.0) -> PlaneFit:
    """Fit a plane to disparities; the same values always give the same plane.

    Args:
        x_px: (N,) columns, px, N at least `LEAST_VALUES`.
        y_px: (N,) rows, px.
        disparity_px: (N,) finite, px.
        unit_px: size of a pixel of the matched images, px: at half the size, 2.
    """
    middle_x, middle_y = float(np.mean(x_px)), float(np.mean(y_px))
    size = max(float(np.ptp(x_px)), float(np.ptp(y_px)), 1.0)
    design = np.column_stack([(x_px - middle_x) / size, (y_px - middle_y) / size, np.ones(x_px.size)])
    found = _least_median(design, disparity_px)
    on_plane = np.zeros(x_px.size, np.bool_)
    for _ in range(_ROUNDS):
        away = np.abs(disparity_px - design @ found)
        limit_px = max(_FAR_SIGMAS * _NORMAL * float(np.median(away)), unit_px)
        nearer = away <= limit_px
        if np.array_equal(nearer, on_plane):
            break
        on_plane = nearer
        kept = design[on_plane]
        found = np.linalg.lstsq(kept.T @ kept, kept.T @ disparity_px[on_plane], rcond=None)[0]
    slope_x, slope_y = float(found[0]) / size, float(found[1]) / size
    at_origin = float(found[2]) - slope_x * middle_x - slope_y * middle_y
    plane = DisparityPlane(slope_x=slope_x, slope_y=slope_y, at_origin_px=at_origin)
    return PlaneFit(plane=plane, on_plane=on_plane)


def normal_over_distance(plane: DisparityPlane, geometry: StereoGeometry) -> Floats:
    """Return the plane in space, n / h: its unit normal over its distance from the left camera.

    Returns:
        (3,) 1/m, in the rectified left camera's axes. n / h . P = 1 on the plane; its length is 1 / h.
    """
    product = geometry.focal_px * geometry.baseline_m
    ahead = (
        plane.slope_x * geometry.cx_px + plane.slope_y * geometry.cy_px + plane.at_origin_px + geometry.doffs_px
    ) / product
    return np.array([plane.slope_x / geometry.baseline_m, plane.slope_y / geometry.baseline_m, ahead])


def plane_in_disparity(over: Floats, geometry: StereoGeometry) -> DisparityPlane:
    """Return a plane in disparity, the opposite of `normal_over_distance`.

    Args:
        over: (3,) n / h, 1/m.
        geometry: of the rectified pair.
    """
    slope_x, slope_y = float(over[0]) * geometry.baseline_m, float(over[1]) * geometry.baseline_m
    ahead_px = float(over[2]) * geometry.focal_px * geometry.baseline_m
    at_origin = ahead_px - slope_x * geometry.cx_px - slope_y * geometry.cy_px - geometry.doffs_px
    return DisparityPlane(slope_x=slope_x, slope_y=slope_y, at_origin_px=at_origin)


def tilt_deg(plane: DisparityPlane, geometry: StereoGeometry) -> float:
    """Return the angle between a plane's normal and the optical axis, degrees, 0 to 90."""
    over = normal_over_distance(plane, geometry)
    return math.degrees(math.acos(min(1.0, abs(float(over[2])) / float(np.linalg.norm(over)))))


def _least_median(design: Floats, disparity_px: Floats) -> Floats:
    """Return the plane through three values of which half of all values are nearest: (3,) in the design's columns."""
    rng = np.random.default_rng(0)
    shown = rng.permutation(disparity_px.size)[:_SAMPLE]
    few, values = design[shown], disparity_px[shown]
    best, least = np.array([0.0, 0.0, float(np.median(values))]), math.inf
    for _ in range(_TRIALS):
        three = rng.choice(values.size, 3, replace=False)
        try:
            tried = np.linalg.solve(few[three], values[three])
        except np.linalg.LinAlgError:  # on one line
            continue
        median = float(np.median(np.abs(values - few @ tried)))
        if median < least:
            best, least = tried, median
    return np.asarray(best, np.float64)
