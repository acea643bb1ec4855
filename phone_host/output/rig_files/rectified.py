"""calib.txt as a rig: two ideal cameras side by side. Reading the file is `output.calib_txt`'s. Pure.

Rectified images of these formats share focal length and rows; the right camera stands at +x by the baseline.
"""

import numpy as np

from common.errors import DataError
from phone_host.model import Lens, Rectification, StereoGeometry
from phone_host.output.rig_files.stated import StatedCamera, StatedRig
from phone_host.output.rig_files.texts import RigText, number

_NAME = "calib.txt"


def stated_of_geometry(geometry: StereoGeometry, size_px: tuple[int, int] | None, file: str, cameras: str) -> StatedRig:
    """Return the rig of rectified images.

    Args:
        geometry: of them.
        size_px: their width and height, px; None: not stated.
        file: the file's name, for errors.
        cameras: which two of its cameras these are, in its own words.
    """
    width_px, height_px = size_px or (0, 0)
    left, right = (
        StatedCamera(
            name=file,
            width_px=width_px,
            height_px=height_px,
            focal_px=(geometry.focal_px, geometry.focal_px),
            centre_px=(geometry.cx_px + aside_px, geometry.cy_px),
            lens=Lens.PINHOLE,
            coefficients=(0.0,) * 4,
        )
        for aside_px in (0.0, geometry.doffs_px)
    )
    shift = np.array([-geometry.baseline_m, 0.0, 0.0])
    notes = (f"it is for rectified images of {cameras}",)
    return StatedRig(left, right, np.eye(3), shift, file, notes)


def middlebury_texts(rectification: Rectification, disparities: int) -> tuple[RigText, ...]:
    """Write the calib.txt of Middlebury and ETH3D for the images that `stereo` rectifies with a rig.

    Args:
        rectification: of the rig.
        disparities: N, the number of disparities to search, px.

    Raises:
        DataError: the cameras stand one above the other.
    """
    geometry = _side_by_side(rectification, "middlebury")
    f, cx, cy = (number(value) for value in (geometry.focal_px, geometry.cx_px, geometry.cy_px))
    right_cx = number(geometry.cx_px + geometry.doffs_px)
    text = (
        f"cam0=[{f} 0 {cx}; 0 {f} {cy}; 0 0 1]\ncam1=[{f} 0 {right_cx}; 0 {f} {cy}; 0 0 1]\n"
        f"doffs={number(geometry.doffs_px)}\nbaseline={number(geometry.baseline_m * 1e3)}\n"
        f"width={rectification.width_px}\nheight={rectification.height_px}\nndisp={disparities}\n"
    )
    return (RigText(_NAME, text),)


def kitti_texts(rectification: Rectification) -> tuple[RigText, ...]:
    """Write the calib.txt of KITTI's odometry for the images that `stereo` rectifies with a rig: P0 and P1.

    Raises:
        DataError: the cameras stand one above the other.
    """
    _side_by_side(rectification, "kitti")
    lines = [
        f"P{index}: {' '.join(number(value) for value in projection.ravel())}\n"
        for index, projection in enumerate((rectification.P_left, rectification.P_right))
    ]
    return (RigText(_NAME, "".join(lines)),)


def _side_by_side(rectification: Rectification, kind: str) -> StereoGeometry:
    if rectification.epipolar.is_vertical:
        raise DataError(f"{kind} has no cameras that stand one above the other", "export it as opencv or kalibr")
    return rectification.geometry
