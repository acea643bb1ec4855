"""Where a board stands in a camera's image: its place, how much of the image it fills, how it is tilted. Pure."""

import math
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np

from phone_host.calibration.solve.board_pose import fit_pose
from phone_host.calibration.target.corners import Board, Corners
from phone_host.geometry.se3 import rotations_of
from phone_host.model import CameraModel

_FOCAL_WIDTHS: Final = 0.9
"""Focal length of a usual webcam, in image widths; only until the first calibration is there."""

CORNERS: Final = ((-1, -1), (1, -1), (-1, 1), (1, 1))
"""The corners of an image: left or right, top or bottom."""


@dataclass(frozen=True, slots=True)
class Placement:
    """A board in one image. Shares are of the image's width and height.

    Attributes:
        low: leftmost and topmost corner, shares.
        high: rightmost and lowest corner, shares.
        square: side of a square, shares of width and height.
        fills: share of the width that the board would fill frontally.
        tilt_deg: across: positive if the board's left edge is away; down: positive if its top edge is.
        outline: the board's four outermost corners, shares; fewer where a part is seen.
        nearest: the corner of the board that lies deepest in the image's top left, top right, bottom left, bottom right
            quarter, shares.
    """

    low: tuple[float, float]
    high: tuple[float, float]
    square: tuple[float, float]
    fills: float
    tilt_deg: tuple[float, float]
    outline: tuple[tuple[float, float], ...]
    nearest: tuple[tuple[float, float], ...]

    def reach(self, x: int, y: int) -> float:
        """Return how far the board reaches into a corner of the image: 0 the middle, 1 the corner.

        Args:
            x: -1 left, 1 right.
            y: -1 top, 1 bottom.
        """
        across, down = self.nearest[CORNERS.index((x, y))]
        return min(x * (2 * across - 1), y * (2 * down - 1))


def usual_camera(size_px: tuple[int, int]) -> CameraModel:
    """Return what a camera is taken for before it is known."""
    width_px, height_px = size_px
    focal = _FOCAL_WIDTHS * max(size_px)
    matrix = np.array([[focal, 0, (width_px - 1) / 2], [0, focal, (height_px - 1) / 2], [0, 0, 1.0]])
    return CameraModel(width_px=width_px, height_px=height_px, matrix=matrix, distortion=np.zeros(5))


def placement(corners: Corners, board: Board, model: CameraModel) -> Placement:
    """Return where a board stands.

    Args:
        corners: (N, 2) px; NaN: not seen.
        board: the board.
        model: the camera, as far as it is known.
    """
    size = np.array([model.width_px, model.height_px], float)
    low, high = np.nanmin(corners, axis=0) / size, np.nanmax(corners, axis=0) / size
    grid = corners.reshape(board.rows, board.columns, 2)
    steps = [np.linalg.norm(np.diff(grid, axis=axis), axis=2) for axis in (0, 1)]
    square_px = max(float(np.nanmedian(step)) for step in steps if np.isfinite(step).any())
    ends = np.array([grid[0, 0], grid[0, -1], grid[-1, -1], grid[-1, 0]]) / size
    return Placement(
        low=(float(low[0]), float(low[1])),
        high=(float(high[0]), float(high[1])),
        square=(square_px / model.width_px, square_px / model.height_px),
        fills=square_px * (board.columns - 1) / model.width_px,
        tilt_deg=_tilt_deg(corners, board, model),
        outline=tuple((float(x), float(y)) for x, y in ends if math.isfinite(x)),
        nearest=tuple(_nearest(corners / size, x, y) for x, y in CORNERS),
    )


def _nearest(shares: Corners, x: int, y: int) -> tuple[float, float]:
    depths = np.minimum(x * (shares[:, 0] - 0.5), y * (shares[:, 1] - 0.5))
    deepest = shares[int(np.nanargmax(depths))]
    return float(deepest[0]), float(deepest[1])


def _tilt_deg(corners: Corners, board: Board, model: CameraModel) -> tuple[float, float]:
    try:
        pose = fit_pose(board.points_m(), corners, model)
    except cv2.error:  # too few corners for a pose
        return 0.0, 0.0
    x, y, z = rotations_of(pose[:3])[:, 2]
    forward = max(abs(float(z)), 1e-9)
    sign = 1.0 if z >= 0 else -1.0
    return math.degrees(math.atan2(sign * x, forward)), math.degrees(math.atan2(sign * y, forward))
