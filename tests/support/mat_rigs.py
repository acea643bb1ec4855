"""Rigs of two unlike cameras for an object half a metre away: small for tests, at VGA and at 720p."""

import math
from typing import Final

import numpy as np

from phone_host.model import CameraModel, Rig
from phone_host.scene.scene_model import rotation

_BASELINE_M: Final = 0.06


def rig_of(size: str) -> Rig:
    """Return the rig whose left camera has a size: "small", "vga" or "720p"."""
    left, right = {
        "small": (
            _camera((480, 360), 450.0, (-0.12, 0.05, 0.0005, -0.0004, 0.0)),
            _camera((560, 420), 540.0, (0.05, -0.1, -0.0004, 0.0006, 0.0)),
        ),
        "vga": (
            _camera((640, 480), 600.0, (-0.12, 0.05, 0.0005, -0.0004, 0.0)),
            _camera((800, 600), 742.0, (0.05, -0.1, -0.0004, 0.0006, 0.0)),
        ),
        "720p": (
            _camera((1280, 720), 1100.0, (-0.08, 0.03, 0.0004, -0.0003, 0.0)),
            _camera((1600, 1200), 1420.0, (0.05, -0.08, -0.0003, 0.0004, 0.0)),
        ),
    }[size]
    turn = rotation((0.3, 1.0, 0.4), math.radians(-1.5))
    centre = np.array([0.0598, -0.0024, -0.003])
    centre *= _BASELINE_M / np.linalg.norm(centre)
    return Rig(left=left, right=right, R_right_left=turn, t_right_left_m=-turn @ centre)


def _camera(size_px: tuple[int, int], focal_px: float, bend: tuple[float, ...]) -> CameraModel:
    width, height = size_px
    matrix = np.array([[focal_px, 0.0, 0.496 * width], [0.0, 1.001 * focal_px, 0.507 * height], [0.0, 0.0, 1.0]])
    return CameraModel(width_px=width, height_px=height, matrix=matrix, distortion=np.array(bend))
