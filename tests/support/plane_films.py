"""Views of a textured plane by a camera that moves: exact depth and poses, drawn by one homography each."""

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.geometry.se3 import SE3
from phone_host.model import StereoGeometry
from phone_host.scan.view import View

Floats = NDArray[np.float64]

GEOMETRY = StereoGeometry(focal_px=200.0, baseline_m=0.1, cx_px=119.5, cy_px=89.5)
SIZE = (240, 180)
NORMAL, DISTANCE_M = np.array([0.2, -0.1, -1.0]) / np.linalg.norm([0.2, -0.1, -1.0]), 1.0
"""The plane n p = -DISTANCE in the world's axes."""

_TEXEL_M = 0.004
_TEXTURE_PX = 800


def texture(seed: int = 1) -> NDArray[np.uint8]:
    """Blotches of several sizes, (800, 800) uint8."""
    random, whole = np.random.default_rng(seed), np.zeros((_TEXTURE_PX, _TEXTURE_PX))
    for size in (2.0, 4.0, 8.0):
        noise = cv2.GaussianBlur(random.normal(size=whole.shape), (0, 0), size)
        whole += noise / noise.std()
    return np.clip(128 + 35 * whole, 0, 255).astype(np.uint8)


def plane_view(world_camera: SE3, picture: NDArray[np.uint8], noise_px: float = 0.1) -> View:
    """The plane as a camera sees it."""
    width, height = SIZE
    columns, rows = np.meshgrid(np.arange(width), np.arange(height))
    rays = np.stack(
        [
            (columns - GEOMETRY.cx_px) / GEOMETRY.focal_px,
            (rows - GEOMETRY.cy_px) / GEOMETRY.focal_px,
            np.ones(columns.shape),
        ],
        axis=-1,
    )
    depth = -(DISTANCE_M + NORMAL @ world_camera.t_m) / ((rays @ world_camera.R.T) @ NORMAL)
    points = world_camera.apply(rays * depth[..., np.newaxis])
    texels = (points[..., :2] / _TEXEL_M + _TEXTURE_PX / 2).astype(np.float32)
    grey = cv2.remap(picture, texels[..., 0], texels[..., 1], cv2.INTER_LINEAR)
    return View(
        grey=np.asarray(grey, np.uint8),
        colours=np.repeat(np.asarray(grey, np.uint8)[..., np.newaxis], 3, axis=2),
        depth_m=depth.astype(np.float32),
        geometry=GEOMETRY,
        noise_px=noise_px,
    )


def path(count: int, step: Floats) -> list[SE3]:
    """Poses that go on by the same motion, (6,) turn, rad, and shift, m."""
    poses = [SE3.identity()]
    for _ in range(count - 1):
        poses.append(poses[-1] @ SE3.of(step))
    return poses
