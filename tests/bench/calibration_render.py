"""Renders a chessboard as a camera sees it, with edges that are exact to a thousandth of a pixel.

Hard edges sampled a few times per pixel come out in steps, which shift a corner by hundredths of a pixel in the same way in
many views: more than a calibration from thousands of corners may be off. Here each sample is the mean of the pattern over its own
footprint.
"""

from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from phone_host.calibration.target.corners import Board
from phone_host.geometry.lens import project, rays_through
from phone_host.geometry.se3 import SE3
from phone_host.model import CameraModel, Image

Floats = NDArray[np.float64]

_FINE: Final = 2
"""Samples per pixel and direction."""

_COARSE: Final = 4
"""Pixels per ray that is solved; cubic interpolation between them is off by 1e-5 px."""

_BLACK, _WHITE, _AROUND = 25.0, 220.0, 120.0
_PAPER: Final = 1.0
"""White margin, squares."""


def render(model: CameraModel, pose: SE3, board: Board) -> Image:
    """Render a board.

    Args:
        model: the camera.
        pose: of the board in the camera's axes.
        board: the board.

    Returns:
        (H, W) uint8 grey.
    """
    image = np.full((model.height_px, model.width_px), _AROUND, np.float32)
    x0, y0, x1, y1 = _box(model, pose, board)
    columns = np.arange(x0 - 2 * _COARSE, x1 + 2 * _COARSE, _COARSE).astype(np.float64)
    rows = np.arange(y0 - 2 * _COARSE, y1 + 2 * _COARSE, _COARSE).astype(np.float64)
    grid = np.stack(np.meshgrid(columns, rows), axis=2)
    rays = rays_through(grid.reshape(-1, 2), model)
    slopes = (rays[:, :2] / rays[:, 2:]).reshape(grid.shape).astype(np.float64)
    at_x = (np.arange((x1 - x0) * _FINE) + 0.5) / _FINE - 0.5 + 2 * _COARSE
    at_y = (np.arange((y1 - y0) * _FINE) + 0.5) / _FINE - 0.5 + 2 * _COARSE
    map_x, map_y = (axis / _COARSE for axis in np.meshgrid(at_x, at_y))
    dense = np.stack([_cubic(slopes[..., i], map_x, map_y) for i in range(2)], axis=2)
    x, y = _squares(dense, pose, board)
    value = _pattern(x, y, board)
    image[y0:y1, x0:x1] = cv2.resize(value.astype(np.float32), (x1 - x0, y1 - y0), interpolation=cv2.INTER_AREA)
    return np.rint(image).astype(np.uint8)


def _cubic(values: Floats, map_x: Floats, map_y: Floats) -> Floats:
    """Interpolate by Catmull-Rom, exactly: OpenCV's remap rounds positions to 1/32 px."""
    result = np.zeros(map_x.shape)
    x, y = map_x[0], map_y[:, 0]
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    across, down = _weights(x - left), _weights(y - top)
    rows = np.zeros((values.shape[0], len(x)))
    for step in range(4):
        rows += values[:, np.clip(left - 1 + step, 0, values.shape[1] - 1)] * across[step]
    for step in range(4):
        result += rows[np.clip(top - 1 + step, 0, values.shape[0] - 1)] * down[step][:, np.newaxis]
    return result


def _weights(t: Floats) -> list[Floats]:
    return [
        -0.5 * t + t**2 - 0.5 * t**3,
        1 - 2.5 * t**2 + 1.5 * t**3,
        0.5 * t + 2 * t**2 - 1.5 * t**3,
        -0.5 * t**2 + 0.5 * t**3,
    ]


def _box(model: CameraModel, pose: SE3, board: Board) -> tuple[int, int, int, int]:
    """Return the pixels around the paper: left, top, right, bottom."""
    first, last = -1 - _PAPER, np.array([board.columns, board.rows]) + _PAPER
    along = np.linspace(0, 1, 30)[:, np.newaxis]
    ends = np.array([[first, first], [last[0], first], last, [first, last[1]]])
    outline = np.concatenate([a + (b - a) * along for a, b in zip(ends, np.roll(ends, -1, axis=0), strict=True)])
    pixels = project(pose.apply(np.column_stack([outline, np.zeros(len(outline))]) * board.square_m), model)
    low, high = np.floor(pixels.min(axis=0)).astype(int) - 3, np.ceil(pixels.max(axis=0)).astype(int) + 3
    x0, y0 = np.maximum(low, 0)
    x1, y1 = np.minimum(high, [model.width_px, model.height_px])
    return int(x0), int(y0), int(x1), int(y1)


def _squares(slopes: Floats, pose: SE3, board: Board) -> tuple[Floats, Floats]:
    """Return where rays (x, y, 1) meet the board's plane, in squares from the first inner corner."""
    turn = pose.R.T
    x, y = slopes[..., 0], slopes[..., 1]
    along, down, away = (turn[i, 0] * x + turn[i, 1] * y + turn[i, 2] for i in range(3))
    origin = -turn @ pose.t_m
    depth = -origin[2] / away
    return (origin[0] + along * depth) / board.square_m, (origin[1] + down * depth) / board.square_m


def _pattern(x: Floats, y: Floats, board: Board) -> Floats:
    """Return the brightness of board coordinates, each averaged over the footprint of its sample."""
    wide_x, wide_y = _footprint(x), _footprint(y)
    inside = _within(x, -1.0, board.columns, wide_x) * _within(y, -1.0, board.rows, wide_y)
    paper = _within(x, -1 - _PAPER, board.columns + _PAPER, wide_x) * _within(
        y, -1 - _PAPER, board.rows + _PAPER, wide_y
    )
    checks = _wave(x, wide_x) * _wave(y, wide_y)  # 1 in white squares, -1 in black ones
    board_value = (_WHITE + _BLACK) / 2 + (_WHITE - _BLACK) / 2 * checks
    return _AROUND + (_WHITE - _AROUND) * (paper - inside) + (board_value - _AROUND) * inside


def _footprint(t: Floats) -> Floats:
    return np.asarray(np.hypot(np.gradient(t, axis=0), np.gradient(t, axis=1)), np.float64)


def _within(t: Floats, low: float, high: float, width: Floats) -> Floats:
    ramps = [np.clip((t - low) / width + 0.5, 0, 1), np.clip((high - t) / width + 0.5, 0, 1)]
    return np.asarray(ramps[0] * ramps[1], np.float64)


def _wave(t: Floats, width: Floats) -> Floats:
    """Return the mean over `width` of the wave that is 1 where floor(t) is even and -1 where it is odd."""
    return np.asarray((_integral(t + width / 2) - _integral(t - width / 2)) / width, np.float64)


def _integral(t: Floats) -> Floats:
    return np.asarray(1 - np.abs(np.mod(t, 2.0) - 1), np.float64)
