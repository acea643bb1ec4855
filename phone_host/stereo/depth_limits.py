"""How far a rig sees: which depths are measurements, and how certain each is. Pure.

With D = d + doffs, depth is z = f b / D. Let D be measured and D + e be true. Then the true depth is f b / (D + e), and

    (z - z_true) / z_true = (D + e) / D - 1 = e / D

exactly, whichever sign e has. An error of at most delta therefore makes a measured depth wrong by more than a share s
only where D < delta / s, that is beyond

    far = f b s / delta.

A disparity with D <= delta differs from 0 by no more than its error: it may as well be infinity or lie behind the
cameras. It is no measurement at all, with or without metres. To first order, the uncertainty of a depth is z^2 delta /
(f b).

A focal length, an offset or a principal point that cannot belong to images of a size is recognised here, too.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from common.errors import DataError, SettingsError
from phone_host.model import CloudImage, Crop, CutCounts, DepthLimits, Disparity, StereoGeometry

_LEAST_FOCAL: Final = 0.2
"""Focal length as a share of the width: a view of 136 degrees. Rectified images of a wider lens are mostly smeared corners."""

_MOST_FOCAL: Final = 50.0
"""The same for long lenses: a view of 1.1 degrees, a telescope's."""

_MOST_DOFFS: Final = 2.0
"""Greatest offset as a share of the width: two crops of one view can lie no farther apart and still share a part of it."""

_MIDDLE: Final = (0.2, 0.8)
"""Where principal points of rectified images lie, as shares of the width and the height. Those of given scenes of Middlebury, ETH3D
and KITTI lie at 0.42 to 0.58 of the width and the middle of the height."""


def require_plausible(geometry: StereoGeometry, size_px: tuple[int, int]) -> None:
    """Refuse geometry that was given by hand and cannot be right.

    Args:
        geometry: as given.
        size_px: width and height of the images, px.

    Raises:
        SettingsError: the view would be nearly half a turn or hardly a degree wide, the images' offset is wider than both, or the
            principal point lies outside the image.
    """
    width, height = size_px
    if not geometry.focal_px >= _LEAST_FOCAL * width:
        raise SettingsError(
            f"--focal {geometry.focal_px:g} is too short for images {width} px wide",
            "give it in px, not mm: focal length in mm / width of the sensor in mm * width of the image in px",
        )
    if not geometry.focal_px <= _MOST_FOCAL * width:
        raise SettingsError(
            f"--focal {geometry.focal_px:g} is too long for images {width} px wide",
            f"give it in px, at most {_MOST_FOCAL * width:g}: a longer lens would see less than a degree",
        )
    if not abs(geometry.doffs_px) <= _MOST_DOFFS * width:
        raise SettingsError(
            f"--doffs {geometry.doffs_px:g} is too much for images {width} px wide",
            "give the x of the right principal point minus that of the left one, in px",
        )
    if not (0 <= geometry.cx_px < width and 0 <= geometry.cy_px < height):
        raise SettingsError(
            f"--center {geometry.cx_px:g},{geometry.cy_px:g} lies outside the image of {width}x{height} px",
            "give the principal point of the rectified left image in px, or leave it out for the middle",
        )


def require_plausible_file(geometry: StereoGeometry, size_px: tuple[int, int], name: str) -> None:
    """Refuse geometry from a file that cannot be right for its images. Their crops may leave the principal point outside.

    Args:
        geometry: of the images.
        size_px: width and height of the images, px.
        name: of its file, for errors.

    Raises:
        DataError: its focal length or doffs cannot be that of images of this size.
    """
    width, _ = size_px
    if not _LEAST_FOCAL * width <= geometry.focal_px <= _MOST_FOCAL * width:
        raise DataError(
            f"{name}: the focal length is {geometry.focal_px:g} px for images {width} px wide",
            f"it must be from {_LEAST_FOCAL * width:g} to {_MOST_FOCAL * width:g} px; give the calibration of these images",
        )
    if not abs(geometry.doffs_px) <= _MOST_DOFFS * width:
        raise DataError(
            f"{name}: doffs is {geometry.doffs_px:g} px for images {width} px wide",
            f"it must be at most {_MOST_DOFFS * width:g} px; give the calibration of these images",
        )


def is_off_the_middle(geometry: StereoGeometry, size_px: tuple[int, int]) -> bool:
    """Tell whether a principal point lies so far aside that the geometry may belong to images of another size.

    Args:
        geometry: of rectified images.
        size_px: their width and height, px.
    """
    low, high = _MIDDLE
    return any(
        not low <= (at + 0.5) / edge <= high for at, edge in zip((geometry.cx_px, geometry.cy_px), size_px, strict=True)
    )


DISPARITY_ERROR_PX: Final = 0.25
"""Error of a disparity, px of the images that were matched. Tuned matchers leave a quarter of all values of a real scene
off by more than that (Motorcycle: 24 %, docs/decisions/0002-sgbm-tuning.md)."""

DEPTH_ERROR_SHARE: Final = 0.2
"""A depth that may be wrong by more than a fifth is not shown."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthWanted:
    """What part of a scene is wanted, and how finely.

    Attributes:
        search_from_m: disparities are searched from infinity to this depth, m; NaN: as the matcher is set.
        near_m: nearer points are cut, m; 0: none.
        far_m: points with a coordinate beyond it are cut, m; NaN: as follows from the rig.
        crop: only its pixels get a disparity and a depth; None: all.
        scale: size of the images to match, as a share of the rectified ones', in (0, 1]; NaN: chosen by their size.
    """

    search_from_m: float = math.nan
    near_m: float = 0.0
    far_m: float = math.nan
    crop: Crop | None = None
    scale: float = math.nan


def disparity_error_px(scale: float, zero_sigma_px: float) -> float:
    """Return delta: the larger of the matcher's error and the rig's.

    Args:
        scale: size of the matched images as a share of the rectified ones'.
        zero_sigma_px: the rig's standard uncertainty of the disparity of infinitely far points, px of the rectified
            images; NaN = not measured.

    Returns:
        px of the rectified images.
    """
    return max(DISPARITY_ERROR_PX / scale, zero_sigma_px)  # in this order: NaN is never the larger one


def depth_limits(
    geometry: StereoGeometry, error_px: float, wanted: DepthWanted, share: float = DEPTH_ERROR_SHARE
) -> DepthLimits:
    """Find the limits between which points are kept.

    Args:
        geometry: of the rectified pair.
        error_px: delta, px.
        wanted: limits that the user gave.
        share: s, the greatest relative error of a depth.

    Returns:
        The limits; `far_m` follows from the rig unless it is wanted otherwise.
    """
    given = not math.isnan(wanted.far_m)
    far_m = wanted.far_m if given else geometry.focal_px * geometry.baseline_m * share / error_px
    return DepthLimits(near_m=wanted.near_m, far_m=far_m, disparity_error_px=error_px, from_rig=not given)


def above_zero(disparity: Disparity, doffs_px: float, error_px: float) -> tuple[Disparity, int]:
    """Drop the disparities that cannot be told from infinity: D = d + doffs <= delta.

    Args:
        disparity: (H, W) float32, px, NaN = none.
        doffs_px: of the geometry; 0 without one.
        error_px: delta, px.

    Returns:
        The remaining disparities (the same array if none was dropped), and how many were dropped.
    """
    limit = np.float32(error_px - doffs_px)
    count = int(np.count_nonzero(disparity <= limit))
    return (drop_zeros(disparity, limit) if count else disparity), count


def drop_zeros(disparity: Disparity, at_zero_px: np.float32) -> Disparity:
    """Return a copy without the disparities up to a limit.

    Args:
        disparity: (H, W) float32, px, NaN = none.
        at_zero_px: the limit, px.
    """
    return np.where(disparity <= at_zero_px, np.float32(np.nan), disparity)


def cut_cloud(cloud: CloudImage, geometry: StereoGeometry, limits: DepthLimits) -> CutCounts:
    """Cut a cloud to its limits, in place: every coordinate of what remains lies below the far one.

    Args:
        cloud: (H, W, 3) float32, m, NaN = none; changed.
        geometry: of the rectified pair.
        limits: its limits.

    Returns:
        How many points are kept, too far and too near; the other counts are 0.
    """
    depth = cloud[..., 2]
    before = int(np.count_nonzero(np.isfinite(depth)))
    far_m = float32_below(limits.far_m)
    too_far = depth >= far_m
    if is_wide(geometry, cloud.shape[1], cloud.shape[0]):
        for axis in (0, 1):
            too_far |= np.abs(cloud[..., axis]) >= far_m
    too_near = (depth < limits.near_m) & ~too_far if limits.near_m > 0 else np.zeros(0, np.bool_)
    counts = CutCounts(too_far=int(np.count_nonzero(too_far)), too_near=int(np.count_nonzero(too_near)))
    if counts.too_far:
        cloud[too_far] = np.nan
    if counts.too_near:
        cloud[too_near] = np.nan
    return replace(counts, kept=before - counts.too_far - counts.too_near)


def is_wide(geometry: StereoGeometry, width_px: int, height_px: int) -> bool:
    """Return whether an image reaches more than 45 degrees to a side; else no |x| or |y| is larger than z."""
    sides = (geometry.cx_px, width_px - 1 - geometry.cx_px, geometry.cy_px, height_px - 1 - geometry.cy_px)
    return bool(max(sides) > geometry.focal_px)  # also for numbers of numpy, as a program may give them


def float32_below(value: float) -> np.float32:
    """Return the largest float32 that is not above a value; plain rounding might be, and pass a point beyond the limit."""
    rounded = np.float32(value)
    return rounded if float(rounded) <= value else np.nextafter(rounded, np.float32(-np.inf))


def crop_inside(crop: Crop, width_px: int, height_px: int, option: str = "--crop") -> Crop:
    """Return the part of a crop that lies in the image.

    Args:
        crop: what the user wants.
        width_px: of the rectified left image, px.
        height_px: the same.
        option: with which it was given, for the error.

    Raises:
        SettingsError: nothing of it lies in the image.
    """
    left, top = max(crop.x_px, 0), max(crop.y_px, 0)
    right, bottom = min(crop.x_px + crop.width_px, width_px), min(crop.y_px + crop.height_px, height_px)
    if right <= left or bottom <= top:
        raise SettingsError(
            f"{option} {crop.x_px},{crop.y_px},{crop.width_px},{crop.height_px} lies outside the rectified left image of"
            f" {width_px}x{height_px} px",
            "give X,Y,W,H inside it",
        )
    return Crop(x_px=left, y_px=top, width_px=right - left, height_px=bottom - top)
