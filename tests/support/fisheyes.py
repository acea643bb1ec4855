"""Series of board views before wide fisheyes, from exact geometry with noise: boards up to the edge of the field of view."""

import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.pairs import BoardPair
from phone_host.geometry.lens import project
from phone_host.geometry.se3 import rotations_of
from phone_host.model import CameraModel, Lens

BOARD = Board(9, 6, 0.03)
RIGHT_M = np.array([-0.1, 0.0, 0.0])
"""The left camera's centre in the right one's axes, m: they look the same way."""

_NOISE_PX = 0.1
_MARGIN_PX = 5


def fisheye(across_deg: float) -> CameraModel:
    """A camera of 1000x750 whose width covers an angle."""
    focal = 1000 / np.radians(across_deg)
    return CameraModel(
        width_px=1000,
        height_px=750,
        matrix=np.array([[focal, 0, 499.5], [0, focal, 374.5], [0, 0, 1]]),
        distortion=np.array([-0.01, 0.002, 0.0, 0.0]),
        lens=Lens.FISHEYE,
    )


def webcam() -> CameraModel:
    """A wide webcam of 78 degrees, 1280x720."""
    return CameraModel(
        width_px=1280,
        height_px=720,
        matrix=np.array([[793.6, 0, 639.5], [0, 793.6, 359.5], [0, 0, 1]]),
        distortion=np.array([-0.1, 0.03, 0.0, 0.0, 0.0]),
    )


def fisheye_pairs(left: CameraModel, right: CameraModel, seed: int, count: int = 20) -> list[BoardPair]:
    """Boards 0.4 to 0.8 m away that both cameras see whole, as far off the axis as the narrower one sees."""
    random, pairs = np.random.default_rng(seed), list[BoardPair]()
    points = BOARD.points_m() - BOARD.points_m().mean(axis=0)
    reach = min(model.width_px / float(model.matrix[0, 0]) for model in (left, right)) / 2
    while len(pairs) < count:
        way, angle = random.uniform(0, 2 * np.pi), random.uniform(0, reach)
        aside = rotations_of(np.array([-np.sin(way), np.cos(way), 0.0]) * angle)
        stands = points @ rotations_of(random.normal(0, 0.35, 3)).T + [0, 0, random.uniform(0.4, 0.8)]
        there = stands @ aside.T
        if there[:, 2].min() <= 0:
            continue
        seen = project(there, left), project(there + RIGHT_M, right)
        if _whole(seen[0], left) and _whole(seen[1], right):
            noisy = [each + random.normal(0, _NOISE_PX, each.shape) for each in seen]
            pairs.append(BoardPair(str(len(pairs)), noisy[0], noisy[1]))
    return pairs


def _whole(pixels: NDArray[np.float64], model: CameraModel) -> bool:
    limit = np.array([model.width_px, model.height_px]) - _MARGIN_PX
    return bool(((pixels > _MARGIN_PX) & (pixels < limit)).all())
