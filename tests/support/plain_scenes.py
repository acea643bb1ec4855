"""What tests alone need of rendered scenes: a plane, the rectified view of two ideal cameras, and where a mat's corners are."""

import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.target.sheet_layout import MarkedBoard
from phone_host.model import StereoGeometry
from phone_host.scene.object_scene import MAT
from phone_host.scene.scene import BASELINE_M, FOCAL_PX
from phone_host.scene.scene_model import Body, Plane, RectifiedView, Scene, Texture, rotation


def matched_view() -> RectifiedView:
    """Return the rectified view of `matched_rig`: its own left camera."""
    return RectifiedView(StereoGeometry(focal_px=FOCAL_PX, baseline_m=BASELINE_M, cx_px=319.5, cy_px=239.5), 640, 480)


def plane_scene(depth_m: float, tilt_rad: float = 0.0, seed: int = 0) -> Scene:
    """Return a scene of one infinite textured plane through (0, 0, depth), turned about the vertical axis by `tilt_rad`: a still scene.

    Args:
        depth_m: its distance along the left camera's axis.
        tilt_rad: 0 faces the camera.
        seed: selects the texture.
    """
    turn = rotation((0.0, 1.0, 0.0), tilt_rad)
    return Scene((Body("plane", Plane(), (0.0, 0.0, depth_m), Texture(seed=seed), turn),))


def mat_corners_m(board: MarkedBoard = MAT) -> NDArray[np.float64]:
    """Return the chessboard corners, row by row as they are numbered, (N, 3) float64 in the mat's axes."""
    squares = board.squares
    side = squares.square_mm / 1000.0
    x = (np.arange(1, squares.columns) - squares.columns / 2.0) * side
    y = (squares.rows / 2.0 - np.arange(1, squares.rows)) * side
    across, down = np.meshgrid(x, y)
    return np.stack([across.ravel(), down.ravel(), np.zeros(across.size)], axis=1)
