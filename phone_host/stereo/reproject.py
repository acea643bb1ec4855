"""Converts disparity to metres and back, for a rectified pair.

z = f b / (d + doffs), x = (u - cx) z / f, y = (v - cy) z / f: Hartley and Zisserman, "Multiple View Geometry", chapter 11;
`doffs` as on https://vision.middlebury.edu/stereo/data/scenes2014/. OpenCV's `reprojectImageTo3D` does not mark missing values.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from phone_host.model import CloudImage, Disparity, StereoGeometry

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
