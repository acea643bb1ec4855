"""Where a board is in an image, and what the views that were taken cover: places, distances, tilts. Pure."""

import math
from dataclasses import dataclass
from enum import Enum
from typing import Final

import cv2
import numpy as np

from phone_host.calibration.guide.gates import Size
from phone_host.calibration.solve.board_pose import fit_pose
from phone_host.calibration.target.corners import Board, Corners
from phone_host.geometry.se3 import rotations_of
from phone_host.model import CameraModel

_FOCAL_WIDTHS: Final = 0.9
"""Focal length of a usual webcam, in image widths; only until the first calibration is there."""

CORNERS: Final = ((-1, -1), (1, -1), (-1, 1), (1, 1))
"""The corners of an image: left or right, top or bottom."""

COLUMNS, ROWS = 8, 6
"""Cells of an image: as fine as lenses bend."""

_FLAT_DEG: Final = 12.0


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
    """Return where a board stands."""
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


class Depth(Enum):
    """How far the board is, by the share of the width that it fills, up to which."""

    FAR = 0.25
    MIDDLE = 0.42
    NEAR = float("inf")


class Tilt(Enum):
    """Which edge of the board is away."""

    FLAT = "flat"
    LEFT_AWAY = "left away"
    RIGHT_AWAY = "right away"
    TOP_AWAY = "top away"
    BOTTOM_AWAY = "bottom away"


@dataclass(frozen=True, slots=True)
class Coverage:
    """What the views taken so far cover of one camera.

    Attributes:
        size_px: of its images.
        cells: corners seen in each cell, row by row.
        depths: views at each depth, in the order of `Depth`.
        tilts: views at each tilt, in the order of `Tilt`.
    """

    size_px: Size
    cells: tuple[tuple[int, ...], ...] = ((0,) * COLUMNS,) * ROWS
    depths: tuple[int, ...] = (0,) * len(Depth)
    tilts: tuple[int, ...] = (0,) * len(Tilt)

    @property
    def share(self) -> float:
        """Share of the cells in which corners were seen."""
        return sum(count > 0 for row in self.cells for count in row) / (COLUMNS * ROWS)

    def with_view(self, corners: Corners, placement: Placement) -> "Coverage":
        """Return what is covered with one view more."""
        seen = corners[np.isfinite(corners).all(axis=1)]
        counts, _, _ = np.histogram2d(
            seen[:, 1], seen[:, 0], bins=(ROWS, COLUMNS), range=((0, self.size_px[1]), (0, self.size_px[0]))
        )
        cells = np.array(self.cells) + counts.astype(int)
        return Coverage(
            size_px=self.size_px,
            cells=tuple(tuple(int(count) for count in row) for row in cells),
            depths=_counted(self.depths, list(Depth).index(depth_of(placement))),
            tilts=_counted(self.tilts, list(Tilt).index(tilt_of(placement))),
        )


def depth_of(placement: Placement) -> Depth:
    """Return how far a board is."""
    return next(depth for depth in Depth if placement.fills <= depth.value)


def tilt_of(placement: Placement) -> Tilt:
    """Return how a board is tilted: the way in which it is tilted most."""
    across, down = placement.tilt_deg
    if max(abs(across), abs(down)) < _FLAT_DEG:
        return Tilt.FLAT
    if abs(across) >= abs(down):
        return Tilt.LEFT_AWAY if across > 0 else Tilt.RIGHT_AWAY
    return Tilt.TOP_AWAY if down > 0 else Tilt.BOTTOM_AWAY


def _counted(counts: tuple[int, ...], at: int) -> tuple[int, ...]:
    return tuple(count + (index == at) for index, count in enumerate(counts))
