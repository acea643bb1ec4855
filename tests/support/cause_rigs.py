"""Random pairs of cameras, and boards before them that both see whole: what series with a mistake are made of."""

import math
from dataclasses import replace
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.target.corners import Board
from phone_host.model import CameraModel, Rig
from tests.support.rigs import project_points

Vector = NDArray[np.float64]

_MARGIN_PX: Final = 12.0


def random_rig(random: np.random.Generator) -> Rig:
    """Two cameras as people have them: alike or unlike, 60 to 150 mm apart, turned by up to 3 degrees."""
    left = _camera(random)
    right = _camera(random) if random.random() < 0.5 else _sibling(left, random)
    rotation = np.asarray(cv2.Rodrigues(np.radians(random.uniform(-3, 3, 3)))[0], np.float64)
    centre = np.array([random.uniform(0.06, 0.15), *random.uniform(-0.005, 0.005, 2)])
    return Rig(left=left, right=right, R_right_left=rotation, t_right_left_m=-rotation @ centre)


def _camera(random: np.random.Generator) -> CameraModel:
    width, height = ((640, 480), (1280, 720), (1280, 960))[random.integers(3)]
    focal = width * random.uniform(0.75, 1.1)
    middle = np.array([width / 2, height / 2]) + random.uniform(-0.02, 0.02, 2) * width
    matrix = np.array([[focal, 0, middle[0]], [0, focal * random.uniform(0.999, 1.001), middle[1]], [0, 0, 1]])
    k1 = random.uniform(-0.25, 0.15)
    distortion = np.array([k1, -0.3 * k1, random.normal(0, 5e-4), random.normal(0, 5e-4), 0.0])
    return CameraModel(width_px=width, height_px=height, matrix=matrix, distortion=distortion)


def _sibling(camera: CameraModel, random: np.random.Generator) -> CameraModel:
    matrix = camera.matrix.copy()
    matrix[:2, :2] *= random.uniform(0.99, 1.01)
    matrix[:2, 2] += random.normal(0, 5, 2)
    return replace(camera, matrix=matrix)


def random_poses(rig: Rig, board: Board, count: int, random: np.random.Generator) -> Vector:
    """Poses (V, 6) of a board that both cameras see whole, tilted by up to 40 degrees, near and far."""
    found = list[Vector]()
    points = board.points_m()
    middle, longest = points.mean(axis=0), float(np.ptp(points, axis=0).max())
    left = rig.left
    while len(found) < count:
        z = longest * left.matrix[0, 0] / left.width_px / random.uniform(0.22, 0.6)
        at = random.uniform(-0.45, 0.45, 2) * [left.width_px, left.height_px] * z / left.matrix[0, 0]
        turn = np.radians(random.uniform(5, 40)) * _direction(random)
        rotation = np.asarray(cv2.Rodrigues(np.array([*turn, random.uniform(-0.3, 0.3)]))[0])
        pose = np.concatenate([np.ravel(cv2.Rodrigues(rotation)[0]), np.array([*at, z]) - rotation @ middle])
        if _is_inside(rig, points @ rotation.T + pose[3:]):
            found.append(pose)
    return np.array(found)


def _direction(random: np.random.Generator) -> Vector:
    angle = random.uniform(0, 2 * math.pi)
    return np.array([math.cos(angle), math.sin(angle)])


def _is_inside(rig: Rig, points: Vector) -> bool:
    return all(
        bool(((seen > _MARGIN_PX) & (seen < np.array([lens.width_px, lens.height_px]) - _MARGIN_PX)).all())
        for seen, lens in zip(project_points(points, rig), (rig.left, rig.right), strict=True)
    )
