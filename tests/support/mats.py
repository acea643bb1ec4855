"""A mat as a camera sees it, with a ball on it that hides its middle, and where it lies exactly.

Each pixel is the mean of 16 samples of a sheet that is drawn with the exact share of ink in each of its cells.
"""

import math
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.target.marked import Charuco
from phone_host.calibration.target.sheet import Ink
from phone_host.calibration.target.sheet_layout import Chessboard, MarkedBoard, marked_rectangles
from phone_host.geometry.lens import rays_through
from phone_host.geometry.se3 import SE3
from phone_host.model import CameraModel, Image, Rig
from phone_host.scan.mat import USUAL_MAT, Mat, parse_mat

Floats = NDArray[np.float64]
Rays = NDArray[np.float32]

MAT: Final = parse_mat(USUAL_MAT)
BALL_M: Final = 0.04
_CELL_MM: Final = 0.125
_FINE: Final = 4
_MARGIN_MM: Final = 10.0
_BLACK, _WHITE, _TABLE, _AROUND = 30.0, 215.0, 120.0, 60.0


def sheet_of(mat: Mat) -> NDArray[np.float32]:
    """Draw a sheet with a white margin of 10 mm, 0.125 mm a cell: grey levels."""
    marks, board = mat.board.marks, mat.board
    assert isinstance(marks, Charuco)
    side = board.square_m * 1e3
    printed = MarkedBoard(Chessboard(board.columns + 1, board.rows + 1, side), marks.mark_share * side, marks.family)
    width, height = (round((each * 1e3 + 2 * _MARGIN_MM) / _CELL_MM) for each in mat.size_m)
    sheet = np.full((height, width), _WHITE, np.float32)
    for each in marked_rectangles(printed):
        rows, down = _covered(each.y_mm + _MARGIN_MM, each.height_mm, height)
        columns, across = _covered(each.x_mm + _MARGIN_MM, each.width_mm, width)
        share = down[:, np.newaxis] * across
        ink = _BLACK if each.ink is Ink.BLACK else _WHITE
        sheet[rows, columns] += share * (ink - sheet[rows, columns])
    return sheet


def _covered(start_mm: float, length_mm: float, count: int) -> tuple[slice, NDArray[np.float32]]:
    """Return the cells that a stretch touches, and which share of each it covers."""
    low, high = start_mm / _CELL_MM, (start_mm + length_mm) / _CELL_MM
    cells = np.arange(max(math.floor(low), 0), min(math.ceil(high), count))
    share = np.minimum(cells + 1, high) - np.maximum(cells, low)
    return slice(int(cells[0]), int(cells[-1]) + 1), share.astype(np.float32)


class MatPainter:
    """Paints a mat on a table as one camera sees it. Its rays are found once.

    Args:
        model: the camera.
        mat: the sheet.
        ball_m: radius of the ball on its middle, m; 0: there is none.
        fine: samples per pixel and direction.
    """

    def __init__(self, model: CameraModel, mat: Mat = MAT, ball_m: float = BALL_M, fine: int = _FINE) -> None:
        self._fine = fine
        self._size, self._mat, self._ball_m = (model.width_px, model.height_px), mat, ball_m
        self._sheet = sheet_of(mat)
        columns, rows = ((np.arange(count * fine) + 0.5) / fine - 0.5 for count in self._size)
        x, y = np.meshgrid(columns, rows)
        # In float32 they are off by 1e-7, a thousandth of a sample.
        self._rays = rays_through(np.column_stack([x.ravel(), y.ravel()]), model).astype(np.float32)

    def image(self, camera_mat: SE3, seed: int = 0, stretch: float = 1.0) -> Image:
        """Paint it, with blur, noise and JPEG as a webcam has them.

        Args:
            camera_mat: takes the mat's axes to the camera's.
            seed: of the noise.
            stretch: by which the sheet was printed larger than it should.
        """
        rays = self._rays @ camera_mat.R.astype(np.float32)
        eye = camera_mat.inverse().t_m.astype(np.float32)
        with np.errstate(divide="ignore", invalid="ignore"):
            plane = eye + rays * (-eye[2] / rays[:, 2])[:, np.newaxis]
        width, height = self._mat.size_m
        shape = (self._size[1] * self._fine, self._size[0] * self._fine)
        column = ((plane[:, 0] / stretch + width / 2) * 1e3 + _MARGIN_MM) / _CELL_MM - 0.5
        row = ((height / 2 - plane[:, 1] / stretch) * 1e3 + _MARGIN_MM) / _CELL_MM - 0.5
        painted = cv2.remap(
            self._sheet,
            column.reshape(shape).astype(np.float32),
            row.reshape(shape).astype(np.float32),
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=_TABLE,
        )
        levels = np.asarray(painted, np.float32)
        levels[(rays[:, 2] >= 0).reshape(shape)] = _AROUND
        if self._ball_m:
            self._put_ball(levels, eye, rays)
        small = cv2.resize(levels, self._size, interpolation=cv2.INTER_AREA)
        return _as_camera(np.asarray(small, np.float32), seed)

    def _put_ball(self, levels: NDArray[np.float32], eye: Rays, rays: Rays) -> None:
        """Paint a ball with speckles that are fixed to it, lit from above."""
        unit = rays / np.linalg.norm(rays, axis=1, keepdims=True)
        to = np.array([0.0, 0.0, self._ball_m], np.float32) - eye
        along = unit @ to
        reach = self._ball_m**2 - (to @ to - along**2)
        hit = reach > 0
        points = unit[hit] * (along[hit] - np.sqrt(reach[hit]))[:, np.newaxis] - to
        light = 0.6 + 0.4 * points[:, 2] / self._ball_m
        levels.reshape(-1)[hit] = speckles(points.astype(np.float64)) * light


def speckles(points_m: Floats) -> Floats:
    """Return grey levels of a solid texture at points (N, 3), m: waves of 3 to 12 mm in many directions."""
    random = np.random.default_rng(5)
    value = np.zeros(len(points_m))
    for length_m in np.geomspace(0.003, 0.012, 24):
        direction = random.normal(size=3)
        direction *= 2 * np.pi / length_m / np.linalg.norm(direction)
        value += np.sin(points_m @ direction + random.uniform(0, 2 * np.pi))
    return np.asarray(np.clip(128 + 24 * value, 20, 235), np.float64)


def _as_camera(levels: NDArray[np.float32], seed: int) -> Image:
    noisy = cv2.GaussianBlur(levels, (0, 0), 0.6) + np.random.default_rng(seed).normal(0, 2.5, levels.shape)
    jpeg = cv2.imencode(".jpg", np.clip(noisy, 0, 255).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, 85])[1]
    return np.asarray(cv2.imdecode(jpeg, cv2.IMREAD_GRAYSCALE), np.uint8)


def looking_at(azimuth: float, elevation: float, distance_m: float, target_m: Floats) -> SE3:
    """Return camera_mat for a camera that looks at a point of the mat's axes, its x axis level; angles in rad."""
    away = np.array(
        [
            math.cos(elevation) * math.cos(azimuth),
            math.cos(elevation) * math.sin(azimuth),
            math.sin(elevation),
        ]
    )
    forward = -away
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return SE3(np.column_stack([right, np.cross(forward, right), forward]), target_m + distance_m * away).inverse()


def of_right(rig: Rig, left_mat: SE3) -> SE3:
    """Return camera_mat of a rig's right camera, from that of the left one."""
    return SE3(rig.R_right_left, rig.t_right_left_m) @ left_mat
