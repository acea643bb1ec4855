"""Chessboards before two known cameras: exact corners, and images rendered ray by ray."""

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.pairs import BoardPair
from phone_host.geometry.lens import rays_through
from phone_host.model import CameraModel, Image, Rig
from tests.support.rigs import project_points

BOARD = Board(9, 6, 0.025)


def poses(
    count: int, seed: int, tilt_deg: float = 35.0, depth_m: tuple[float, float] = (0.45, 0.8)
) -> NDArray[np.float64]:
    """Poses of boards in the left camera's axes, (V, 6): tilted by up to `tilt_deg`, spread over the common view of both cameras."""
    random = np.random.default_rng(seed)
    result = []
    for _ in range(count):
        axis = random.uniform(-1, 1, 2)
        turn = np.radians(tilt_deg) * axis / max(1.0, float(np.linalg.norm(axis)))
        z = random.uniform(*depth_m)
        centre = np.array([random.uniform(-0.16, 0.2) * z, random.uniform(-0.08, 0.08) * z, z])
        rotation = cv2.Rodrigues(np.array([turn[0], turn[1], random.uniform(-0.2, 0.2)]))[0]
        middle = BOARD.points_m().mean(axis=0)
        result.append(np.concatenate([np.ravel(cv2.Rodrigues(rotation)[0]), centre - rotation @ middle]))
    return np.array(result)


def exact_pairs(
    rig: Rig, board_poses: NDArray[np.float64], noise_px: float = 0.0, seed: int = 0, board: Board = BOARD
) -> list[BoardPair]:
    """The corners that both cameras see, with Gaussian noise."""
    random = np.random.default_rng(seed)
    pairs = []
    for index, pose in enumerate(board_poses):
        points = board.points_m() @ np.asarray(cv2.Rodrigues(pose[:3])[0]).T + pose[3:]
        left, right = project_points(points, rig)
        left, right = (corners + random.normal(0, noise_px, corners.shape) for corners in (left, right))
        pairs.append(BoardPair(str(index), left, right))
    return pairs


def render_board(
    model: CameraModel, rotation: NDArray[np.float64], translation_m: NDArray[np.float64], board: Board = BOARD
) -> Image:
    """What a camera sees of a board at a pose in its own axes: white paper with a margin of one square, grey around it."""
    fine, coarse = (
        3,
        4,
    )  # rays per pixel and direction; pixels per solved ray: linear interpolation between them is off by 0.003 px
    steps_x = (np.arange(model.width_px // coarse) + 0.5) * coarse - 0.5
    steps_y = (np.arange(model.height_px // coarse) + 0.5) * coarse - 0.5
    columns, rows = np.meshgrid(steps_x, steps_y)
    pixels = np.column_stack([columns.ravel(), rows.ravel()])
    rays = rays_through(pixels, model)
    grid = [np.reshape(rays[:, i] / rays[:, 2], columns.shape) for i in range(2)]
    x, y = _squares(grid[0], grid[1], rotation, translation_m, board)
    # Something is visible only near the paper: two squares or two solved rays beyond it everything is grey.
    near = (x >= -3) & (x < board.columns + 4) & (y >= -3) & (y < board.rows + 4)
    part = tuple(
        slice(max(0, int(at.min()) - 2), int(at.max()) + 3) for at in (np.flatnonzero(near.any(axis=i)) for i in (1, 0))
    )
    image: Image = np.full((model.height_px, model.width_px), 120, dtype=np.uint8)
    seen = image[tuple(slice(at.start * coarse, at.stop * coarse) for at in part)]
    fine_size = (seen.shape[1] * fine, seen.shape[0] * fine)
    dense = [np.asarray(cv2.resize(axis[part], fine_size, interpolation=cv2.INTER_LINEAR), np.float64) for axis in grid]
    x, y = _squares(dense[0], dense[1], rotation, translation_m, board)
    black = (np.floor(x).astype(np.int32) + np.floor(y).astype(np.int32)) & 1 == 0
    inside = (x >= 0) & (x < board.columns + 1) & (y >= 0) & (y < board.rows + 1)
    paper = (x >= -1) & (x < board.columns + 2) & (y >= -1) & (y < board.rows + 2)
    value = np.full(x.shape, 120.0, np.float32)
    value[paper] = 230.0
    value[inside & black] = 20.0
    seen[:] = np.rint(cv2.resize(value, (seen.shape[1], seen.shape[0]), interpolation=cv2.INTER_AREA))
    return image


def _squares(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    rotation: NDArray[np.float64],
    translation_m: NDArray[np.float64],
    board: Board,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where rays (x, y, 1) meet the board's plane, in squares from its outer corner."""
    # Rotate the rays into the board's axes and intersect them with its plane z = 0; written out, this takes a third of
    # the time of a matrix product.
    along, down, away = (x * rotation[0, i] + y * rotation[1, i] + rotation[2, i] for i in range(3))
    origin = -rotation.T @ translation_m
    depth = origin[2] / away
    # The inner corners start one square inside.
    return (origin[0] - along * depth) / board.square_m + 1, (origin[1] - down * depth) / board.square_m + 1


def render_pair(rig: Rig, pose: NDArray[np.float64], board: Board = BOARD) -> tuple[Image, Image]:
    """Both cameras' images of a board at a pose in the left camera's axes."""
    rotation = np.asarray(cv2.Rodrigues(pose[:3])[0], dtype=np.float64)
    return (
        render_board(rig.left, rotation, pose[3:], board),
        render_board(rig.right, rig.R_right_left @ rotation, rig.R_right_left @ pose[3:] + rig.t_right_left_m, board),
    )
