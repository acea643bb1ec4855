"""Calibrates one camera with a fisheye lens. Pure.

OpenCV's `fisheye.calibrate` starts from half the image's width as the focal length and gives up where a view is ill-conditioned. Here
several fields of view are tried: each gives the corners' rays, the rays give poses, and the one that fits best is
adjusted with all coefficients free.
"""

from typing import Final

import cv2
import numpy as np

from common.errors import DataError
from phone_host.calibration.solve.bend import Bend
from phone_host.calibration.solve.board_pose import rough_pose
from phone_host.calibration.solve.bundle import BundleState, Vector, adjust_alone, alone_state
from phone_host.calibration.target.corners import Corners
from phone_host.geometry.lens import project
from phone_host.geometry.se3 import SE3
from phone_host.model import CameraModel, Lens

_FIELDS_RAD: Final = (0.9, 1.2, 1.6, 2.1, 2.7, 3.3)
"""Fields of view across the image's width: 50 to 190 degrees, each a third wider than the one before."""


def fisheye_camera(views: list[Corners], points_m: Vector, size_px: tuple[int, int]) -> tuple[CameraModel, Vector]:
    """Calibrate one camera with a fisheye lens.

    Args:
        views: (N, 2) corners of each view.
        points_m: (N, 3) corners in the board's axes.
        size_px: width and height of the images.

    Returns:
        Its model, and the poses (V, 6).

    Raises:
        DataError: no field of view explains the views.
    """
    starts = [_start(views, points_m, size_px, size_px[0] / field) for field in _FIELDS_RAD]
    known = [start for start in starts if start is not None]
    if not known:
        raise DataError("the views fit no fisheye lens", "show the board nearer to the middle, too")
    _, start = min(known, key=lambda each: each[0])
    found = adjust_alone(views, points_m, start, Bend.FISHEYE.free())
    return found.left, found.poses


def _start(
    views: list[Corners], points_m: Vector, size_px: tuple[int, int], focal_px: float
) -> tuple[float, BundleState] | None:
    """Return the median error with an undistorted fisheye lens, px, and the state; None if the views have no poses in it."""
    matrix = np.array([[focal_px, 0, (size_px[0] - 1) / 2], [0, focal_px, (size_px[1] - 1) / 2], [0, 0, 1]])
    model = CameraModel(
        width_px=size_px[0], height_px=size_px[1], matrix=matrix, distortion=np.zeros(4), lens=Lens.FISHEYE
    )
    try:
        poses = np.array([rough_pose(points_m, corners, model) for corners in views])
    except cv2.error:
        return None
    errors = [
        np.linalg.norm(corners - project(SE3.of(pose).apply(points_m), model), axis=1)
        for corners, pose in zip(views, poses, strict=True)
    ]
    median = float(np.nanmedian(np.concatenate(errors)))
    return (median, alone_state(model, poses)) if np.isfinite(median) else None
