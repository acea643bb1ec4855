"""Recognises a focal length, an offset or a principal point that cannot belong to images of this size. Pure."""

from typing import Final

from common.errors import DataError, SettingsError
from phone_host.model import StereoGeometry

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
