"""Two unlike cameras with known geometry, and points that both see through their full models."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.model import CameraModel, Epipolar, Lens, Rig
from phone_host.scene.scene import unlike_rig as scene_rig


def unlike_rig(right_centre_m: tuple[float, float, float] = (0.1, 0.004, -0.006), turn: float = 1.0) -> Rig:
    """A 640x480 camera on the left and, on the right, a 1280x720 one with a longer focal length, turned by some degrees.

    Args:
        right_centre_m: the right camera's centre in the left one's axes, m.
        turn: factor on the rotation between the two.
    """
    left = CameraModel(
        width_px=640,
        height_px=480,
        matrix=np.array([[525.0, 0, 315], [0, 527, 243], [0, 0, 1]]),
        distortion=np.array([-0.25, 0.08, 0.001, -0.0005, 0.01]),
    )
    right = CameraModel(
        width_px=1280,
        height_px=720,
        matrix=np.array([[1130.0, 0, 652], [0, 1128, 351], [0, 0, 1]]),
        distortion=np.array([0.12, -0.3, -0.001, 0.0008, 0.1]),
    )
    rotation = np.asarray(cv2.Rodrigues(np.array([0.02, -0.05, 0.03]) * turn)[0], dtype=np.float64)
    return Rig(left=left, right=right, R_right_left=rotation, t_right_left_m=-rotation @ np.array(right_centre_m))


@dataclass(frozen=True, slots=True, eq=False)
class SeenPoints:
    """Points inside both images: (N, 3) m in the left camera's axes, (N, 2) px left and right."""

    points_m: NDArray[np.float64]
    left_px: NDArray[np.float64]
    right_px: NDArray[np.float64]


def project_points(points_m: NDArray[np.float64], rig: Rig) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where both cameras see points given in the left camera's axes, (N, 2) px each, through the full distortion."""
    beside = points_m @ rig.R_right_left.T + rig.t_right_left_m
    return _project(points_m, rig.left), _project(beside, rig.right)


def _project(points_m: NDArray[np.float64], model: CameraModel) -> NDArray[np.float64]:
    """By OpenCV, which is no part of what is tested."""
    nowhere = np.zeros((3, 1))
    if model.lens is Lens.FISHEYE:
        seen = cv2.fisheye.projectPoints(points_m[:, np.newaxis], nowhere, nowhere, model.matrix, model.distortion)[0]
    else:
        seen = cv2.projectPoints(points_m, nowhere, nowhere, model.matrix, model.distortion)[0]
    return np.asarray(seen, np.float64).reshape(-1, 2)


def fisheye_rig() -> Rig:
    """A 640x480 camera with a fisheye lens of 126 degrees on the left; on the right a 1280x720 one with a rational lens, 80 mm away."""
    left = CameraModel(
        width_px=640,
        height_px=480,
        matrix=np.array([[290.0, 0, 325], [0, 291, 236], [0, 0, 1]]),
        distortion=np.array([-0.02, 0.004, -0.003, 0.0006]),
        lens=Lens.FISHEYE,
    )
    right = CameraModel(
        width_px=1280,
        height_px=720,
        matrix=np.array([[900.0, 0, 652], [0, 901, 351], [0, 0, 1]]),
        distortion=np.array([0.9, 0.4, 0.001, -0.0005, 0.02, 1.1, 0.5, 0.06]),
        lens=Lens.RATIONAL,
    )
    rotation = np.asarray(cv2.Rodrigues(np.array([0.02, -0.04, 0.03]))[0], dtype=np.float64)
    return Rig(
        left=left, right=right, R_right_left=rotation, t_right_left_m=-rotation @ np.array([0.08, 0.003, -0.004])
    )


def points_seen_by_both(rig: Rig, count: int, seed: int) -> SeenPoints:
    """Random points 0.4 m to 3 m away that lie inside both images."""
    random = np.random.default_rng(seed)
    depth = random.uniform(0.4, 3.0, count)
    # Slopes up to 0.45: both models are invertible there, and none of their pixels lies farther out.
    points = np.column_stack([random.uniform(-0.45, 0.45, (count, 2)) * depth[:, np.newaxis], depth])
    left, right = project_points(points, rig)
    seen = _inside(left, rig.left) & _inside(right, rig.right)
    return SeenPoints(points[seen], left[seen], right[seen])


def _inside(points_px: NDArray[np.float64], model: CameraModel) -> NDArray[np.bool_]:
    limit = np.array([model.width_px - 1, model.height_px - 1])
    return np.asarray(((points_px >= 0) & (points_px <= limit)).all(axis=1))


def small_rig() -> Rig:
    """The demo's rig with pixels twice as wide and high, so a quarter as many."""

    def small(model: CameraModel) -> CameraModel:
        # The centre of the first pixel is 0, so the centre of the first two is 0.5.
        half = np.array([[0.5, 0.0, -0.25], [0.0, 0.5, -0.25], [0.0, 0.0, 1.0]])
        return replace(model, matrix=half @ model.matrix, width_px=model.width_px // 2, height_px=model.height_px // 2)

    whole = scene_rig()
    return replace(whole, left=small(whole.left), right=small(whole.right))


def narrow_rig() -> Rig:
    """The demo's rig with smaller sensors behind the same lenses: the middle of the images, a quarter of the pixels, each as fine as before."""

    def middle(model: CameraModel) -> CameraModel:
        width, height = model.width_px // 2, model.height_px // 2
        shift = np.zeros((3, 3))
        shift[:2, 2] = (width - model.width_px) / 2, (height - model.height_px) / 2
        return replace(model, matrix=model.matrix + shift, width_px=width, height_px=height)

    whole = scene_rig()
    return replace(whole, left=middle(whole.left), right=middle(whole.right))


def stacked_rig(epipolar: Epipolar) -> Rig:
    """Two equal cameras of 320x240, f = 260 px, the right one 100 mm below (UP) or above (DOWN) the left one."""
    model = CameraModel(
        width_px=320,
        height_px=240,
        matrix=np.array([[260.0, 0, 159.5], [0, 260.0, 119.5], [0, 0, 1]]),
        distortion=np.zeros(5),
    )
    down_m = 0.1 if epipolar is Epipolar.UP else -0.1
    return Rig(left=model, right=model, R_right_left=np.eye(3), t_right_left_m=np.array([0.0, -down_m, 0.0]))
