"""Converts disparity to metres and back, for a rectified pair.

z = f b / (d + doffs), x = (u - cx) z / f, y = (v - cy) z / f: Hartley and Zisserman, "Multiple View Geometry", chapter 11;
`doffs` as on https://vision.middlebury.edu/stereo/data/scenes2014/. OpenCV's `reprojectImageTo3D` does not mark missing values.
A pair's cut cloud is made in one pass of the native library, or with numpy where there is none. Both give the same bits.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from common.diagnostic import Diagnostic
from phone_host.model import CloudImage, CutCounts, DepthLimits, Disparity, StereoGeometry
from phone_host.native.library import Library, ReprojectJob, native
from phone_host.stereo.depth_limits import above_zero, cut_cloud, drop_zeros, float32_below, is_wide

_DISPARITY_STEP = 16  # StereoSGBM needs multiples of 16; vector registers of 8-bit costs do as well.

# Greater depths would overflow float32 in x and y; no such disparity is a measurement.
_FARTHEST_M = 1e30


@lru_cache(maxsize=8)
def rays(geometry: StereoGeometry, width: int, height: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the slopes (u - cx) / f of the columns, (W,) float32, and (v - cy) / f of the rows, (H, 1) float32; both packed."""
    columns = (np.arange(width) - geometry.cx_px) / geometry.focal_px
    rows = (np.arange(height) - geometry.cy_px) / geometry.focal_px
    return columns.astype(np.float32), rows.astype(np.float32)[:, np.newaxis]


def least_in_front_px(geometry: StereoGeometry) -> float:
    """Return the value that d + doffs exceeds for points in front of the cameras, px."""
    return geometry.focal_px * geometry.baseline_m / _FARTHEST_M


def reproject(disparity: Disparity, geometry: StereoGeometry) -> CloudImage:
    """Compute the point of every pixel in the left camera's axes.

    Args:
        disparity: (H, W) float32, px, NaN = none.
        geometry: of the rectified pair.

    Returns:
        (H, W, 3) float32, m; NaN in all three where there is no disparity, d + doffs <= 0 (behind infinity) or the depth is
        beyond 1e30 m.
    """
    height, width = disparity.shape
    columns, rows = rays(geometry, width, height)
    product = geometry.focal_px * geometry.baseline_m
    shifted = disparity + np.float32(geometry.doffs_px) if geometry.doffs_px else disparity
    in_front = shifted > least_in_front_px(geometry)
    depth = np.full(disparity.shape, np.nan, dtype=np.float32)
    np.divide(np.float32(product), shifted, out=depth, where=in_front)
    cloud = np.empty((height, width, 3), dtype=np.float32)
    np.multiply(depth, columns, out=cloud[..., 0])
    np.multiply(depth, rows, out=cloud[..., 1])
    cloud[..., 2] = depth
    return cloud


def project(points_m: NDArray[np.floating], geometry: StereoGeometry) -> NDArray[np.float64]:
    """The inverse of `reproject`: compute where points appear in the left image, and their disparity.

    Args:
        points_m: (..., 3), m, z > 0, in the left camera's axes.
        geometry: of the rectified pair.

    Returns:
        (..., 3) float64: u, v, d, px.
    """
    points = np.asarray(points_m, dtype=np.float64)
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    u = geometry.focal_px * x / z + geometry.cx_px
    v = geometry.focal_px * y / z + geometry.cy_px
    d = geometry.focal_px * geometry.baseline_m / z - geometry.doffs_px
    return np.stack((u, v, d), axis=-1)


def disparities_for_near(geometry: StereoGeometry, near_m: float, width_px: int) -> int:
    """Return the number N of disparities 0 <= d < N that covers infinity down to `near_m`.

    Args:
        geometry: of the rectified pair.
        near_m: nearest depth wanted, m, > 0.
        width_px: width of the rectified images. N does not exceed half of it: nearer than that, the right camera sees
            less than half of the left image.

    Returns:
        N, a multiple of 16, at least 16.
    """
    nearest_px = geometry.focal_px * geometry.baseline_m / near_m - geometry.doffs_px
    wanted = math.ceil(max(nearest_px, 1.0) / _DISPARITY_STEP) * _DISPARITY_STEP
    most = max(width_px // 2 // _DISPARITY_STEP, 1) * _DISPARITY_STEP
    return min(wanted, most)


def nearest_depth_m(geometry: StereoGeometry, disparities: int) -> float:
    """Return the nearest depth that N = `disparities` can give, m; NaN when d + doffs cannot be positive."""
    largest_px = disparities + geometry.doffs_px
    return geometry.focal_px * geometry.baseline_m / largest_px if largest_px > 0 else math.nan


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Points:
    """What the disparities of an image give.

    Attributes:
        disparity: (H, W) float32, px: without those that cannot be told from infinity; the same array if there are none.
        cloud: (H, W, 3) float32, m, NaN = none: what lies within the limits.
        counts: points kept, too far and too near, and disparities at zero; the others are 0.
        found: disparities that came in.
    """

    disparity: Disparity
    cloud: CloudImage
    counts: CutCounts
    found: int


def points_of(
    matched: Disparity,
    geometry: StereoGeometry,
    limits: DepthLimits,
    library: Library | Diagnostic | None = None,
) -> Points:
    """Drop the disparities that are no measurement, compute the points of the others, cut and count them.

    Args:
        matched: (H, W) float32, px, NaN = none.
        geometry: of the rectified pair.
        limits: of its depths; `disparity_error_px` tells a disparity from that of infinity.
        library: computes; None: that of this installation.
    """
    library = native() if library is None else library
    if isinstance(library, Library) and matched.dtype == np.float32 and matched.ndim == 2:
        return _by_library(matched, geometry, limits, library)
    return _by_numpy(matched, geometry, limits)


def _by_numpy(matched: Disparity, geometry: StereoGeometry, limits: DepthLimits) -> Points:
    found = int(np.count_nonzero(np.isfinite(matched)))
    disparity, at_zero = above_zero(matched, geometry.doffs_px, limits.disparity_error_px)
    cloud = reproject(disparity, geometry)
    counts = replace(cut_cloud(cloud, geometry, limits), at_zero=at_zero)
    return Points(disparity=disparity, cloud=cloud, counts=counts, found=found)


def _by_library(matched: Disparity, geometry: StereoGeometry, limits: DepthLimits, library: Library) -> Points:
    matched = _with_packed_rows(matched)
    cloud = np.empty((*matched.shape, 3), np.float32)
    slopes = rays(geometry, matched.shape[1], matched.shape[0])
    job = reproject_job(matched, slopes, geometry, limits, cloud)
    library.run(job)
    counts = CutCounts(
        kept=job.in_front - job.too_far - job.too_near,
        at_zero=job.at_zero,
        too_far=job.too_far,
        too_near=job.too_near,
    )
    disparity = drop_zeros(matched, np.float32(job.at_zero_px)) if job.at_zero else matched
    return Points(disparity=disparity, cloud=cloud, counts=counts, found=job.found)


def reproject_job(
    disparity: Disparity,
    slopes: tuple[NDArray[np.float32], NDArray[np.float32]],
    geometry: StereoGeometry,
    limits: DepthLimits,
    cloud: CloudImage,
) -> ReprojectJob:
    """Describe the computation of a cloud for the native library; the arrays must outlive the job.

    Args:
        disparity: (H, W) float32, px, neighbours in a row beside each other in memory.
        slopes: of columns and rows, as `rays` gives them.
        geometry: of the rectified pair.
        limits: of its depths.
        cloud: (H, W, 3) float32, packed; will be written.
    """
    height, width = disparity.shape
    columns, rows = slopes
    return ReprojectJob(
        disparity_px=disparity.ctypes.data,
        column_slopes=columns.ctypes.data,
        row_slopes=rows.ctypes.data,
        cloud_m=cloud.ctypes.data,
        disparity_stride=disparity.strides[0] // disparity.itemsize,
        width=width,
        height=height,
        doffs_px=np.float32(geometry.doffs_px),
        product=np.float32(geometry.focal_px * geometry.baseline_m),
        least_px=np.float32(least_in_front_px(geometry)),
        at_zero_px=np.float32(limits.disparity_error_px - geometry.doffs_px),
        far_m=float32_below(limits.far_m),
        near_m=np.float32(max(limits.near_m, 0.0)),
        wide=is_wide(geometry, width, height),
    )


def _with_packed_rows(array: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the array with neighbours in a row beside each other in memory and aligned, as it is if possible."""
    packed = array.strides[1] == array.itemsize and array.strides[0] % array.itemsize == 0
    return array if packed and array.flags.aligned else np.ascontiguousarray(array)
