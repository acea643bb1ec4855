"""Recognises a focal length or a principal point that cannot belong to images of this size. Pure."""

from typing import Final

from common.errors import SettingsError
from phone_host.model import StereoGeometry

_LEAST_FOCAL: Final = 0.2
"""Focal length as a share of the width: a view of 136 degrees. Rectified images of a wider lens are mostly smeared corners."""

_MIDDLE: Final = (0.2, 0.8)
"""Where principal points of rectified images lie, as shares of the width and the height. Those of given scenes of Middlebury, ETH3D
and KITTI lie at 0.42 to 0.58 of the width and the middle of the height."""


def require_plausible(geometry: StereoGeometry, size_px: tuple[int, int]) -> None:
    """Refuse geometry that was given by hand and cannot be right.

    Args:
        geometry: as given.
        size_px: width and height of the images, px.

    Raises:
        SettingsError: the view would be nearly half a turn wide, or the principal point lies outside the image.
    """
    width, height = size_px
    if geometry.focal_px < _LEAST_FOCAL * width:
        raise SettingsError(
            f"--focal {geometry.focal_px:g} is too short for images {width} px wide",
            "give it in px, not mm: focal length in mm / width of the sensor in mm * width of the image in px",
        )
    if not (0 <= geometry.cx_px < width and 0 <= geometry.cy_px < height):
        raise SettingsError(
            f"--center {geometry.cx_px:g},{geometry.cy_px:g} lies outside the image of {width}x{height} px",
            "give the principal point of the rectified left image in px, or leave it out for the middle",
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
