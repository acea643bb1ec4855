"""From disparities to a cut point cloud image: in one pass of the native library, or with numpy where there is none. Both give the same bits."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from common.diagnostic import Diagnostic
from phone_host.model import CloudImage, CutCounts, DepthLimits, Disparity, StereoGeometry
from phone_host.native.library import Library, ReprojectJob, native
from phone_host.stereo.depth_limits import above_zero, cut_cloud, drop_zeros, float32_below, is_wide
from phone_host.stereo.reproject import least_in_front_px, rays, reproject


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
    library.reproject(job)
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
