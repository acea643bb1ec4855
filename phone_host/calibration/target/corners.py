"""The calibration target: a chessboard, its corners in an image, and their order.

Corners come as (N, 2), row by row, in the order of `Board.points_m`. Two views of one board must agree on which corner
comes first; `order_by_colour` and `agree` ensure that.
"""

import re
from dataclasses import dataclass
from typing import Final

import cv2
import numpy as np
from numpy.typing import NDArray

from common.errors import SettingsError
from phone_host.calibration.target.corner_fit import FittedCorners, fit_corners, steps_between
from phone_host.calibration.target.marked import AprilGrid, Marks, find_marked, plan_of
from phone_host.calibration.target.small_picture import shrunk
from phone_host.model import Image
from phone_host.stereo.images import to_grey

Corners = NDArray[np.float64]
"""(N, 2) float64, px; N = 0: the board was not found."""

_LEAST_CORNERS, _MOST_CORNERS = 3, 100
_SMALLEST_SQUARE_M = 0.0005
"""A smaller one is a length in another unit."""

_LARGEST_SQUARE_M = 2.0

# OpenCV's two searches. The first follows the outlines of black squares: a few ms, and on 174 images of four real rigs it
# finds all boards. The second (sectors; Duda and Frese, BMVC 2018), ten times slower, finds blurred, distorted and glaring
# ones: with and without contrast normalisation, because glare defeats one and weak contrast the other; EXHAUSTIVE finds a few
# more and misses a few others. Both only say where to look: corners are fitted (`corner_fit`).
_OUTLINES: Final = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK
_SECTORS: Final = (
    cv2.CALIB_CB_NORMALIZE_IMAGE,
    0,
    cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE,
)
# Noise and moire can hide squares at full size that are visible at half size.
_SMALLER = 0.5
_LARGEST_SEARCHED_PX = 1600
# Photographs (12 MPx) are searched in a pyramid. Of 180 boards in a room, near and far, tilted, pale and blurred, these three found
# the same 133 as five did, with 800 px normalised and exhaustive; without the outlines 115, without 1600 px 122. The outlines of a whole room
# at 1600 px take half a second, and 74 small boards in it showed none that the sectors miss.
_PHOTO_OUTLINES_PX = 800
_PHOTO_SECTORS = ((800, 0), (1600, cv2.CALIB_CB_NORMALIZE_IMAGE))
"""The longer side of the searched image, px, and the way."""


@dataclass(frozen=True, slots=True)
class Board:
    """A chessboard, with or without coded marks, or an AprilGrid.

    Attributes:
        columns: inner corners in a row; of an AprilGrid two for each tag.
        rows: inner corners in a column; likewise.
        square_m: side of a square, m; of an AprilGrid the side of a tag.
        marks: the coded marks that tell its corners apart; None: it has none.

    Raises:
        SettingsError: no board has such a size.
    """

    columns: int
    rows: int
    square_m: float
    marks: Marks | None = None

    def __post_init__(self) -> None:
        if not all(_LEAST_CORNERS <= count <= _MOST_CORNERS for count in (self.columns, self.rows)):
            raise SettingsError(
                f"--board {self.columns}x{self.rows} is not a chessboard",
                "give its inner corners, such as 9x6 (3 to 100 each)",
            )
        if not _SMALLEST_SQUARE_M <= self.square_m <= _LARGEST_SQUARE_M:
            raise SettingsError(
                f"--square is {self.square_m * 1e3:g} mm, which no chessboard has",
                "give the side of one square with its unit, such as 25mm, 2.5cm or 0.025m",
            )

    def points_m(self) -> NDArray[np.float64]:
        """Return the inner corners, row by row, in the board's own plane z = 0: (N, 3) float64, m."""
        if isinstance(self.marks, AprilGrid):
            plan = plan_of(self.columns, self.rows, self.marks)
            return np.column_stack([plan, np.zeros(len(plan))]) * self.square_m
        rows, columns = np.mgrid[0 : self.rows, 0 : self.columns]
        return np.column_stack([columns.ravel(), rows.ravel(), np.zeros(rows.size)]) * self.square_m

    @property
    def quarter_turns(self) -> tuple[int, ...]:
        """By how many quarters a chessboard without marks can be turned and looks the same, colours included."""
        return (0,) if (self.columns + self.rows) % 2 else (0, 1, 2, 3) if self.rows == self.columns else (0, 2)


def parse_board(corners: str, square_mm: float) -> Board:
    """Read a board's size as people write it.

    Raises:
        SettingsError: one of the two is not valid.
    """
    counts = re.fullmatch(r"\s*(\d{1,3})\s*[xX]\s*(\d{1,3})\s*", corners)
    if counts is None:
        raise SettingsError(
            f"--board {corners!r} is not a size",
            "give columns x rows of inner corners, such as 9x6, or leave it out: it is found in the images",
        )
    return Board(int(counts[1]), int(counts[2]), square_mm / 1000)


def find_corners(image: Image, board: Board) -> Corners:
    """Find the inner corners of a board in an image.

    Returns:
        The corners in the order of `Board.points_m`, with the first inner square white if the board's parity tells;
        empty if the board was not found. Of a board with marks some may be NaN: not seen.
    """
    grey = to_grey(image)
    if board.marks is not None:
        return find_marked(grey, board.columns, board.rows, board.marks)
    corners = _search(grey, board)
    return order_by_colour(corners, grey, board) if len(corners) else corners


def order_by_colour(corners: Corners, grey: Image, board: Board) -> Corners:
    """Give corners the board's own order, as far as its colours determine it.

    Rows run so that the grid is not mirrored. If one count is even and the other odd, half a turn swaps black and
    white; then the square inside the first four corners is the white one. Other boards look the same after half a turn.
    """
    grid = corners.reshape(board.rows, board.columns, 2)
    along, down = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
    if along[0] * down[1] - along[1] * down[0] < 0:
        grid = grid[:, ::-1]
    if (board.columns + board.rows) % 2 == 1 and _brightness(grid, 0, grey) < _brightness(grid, 1, grey):
        grid = grid[::-1, ::-1]
    return np.ascontiguousarray(grid.reshape(-1, 2))


def agree(left: Corners, right: Corners, board: Board) -> Corners:
    """Give the right view's corners the left view's order, where the colours do not determine it.

    The board looks the same after some turns (half a turn; quarter turns of a square board). Of these, take the one
    whose rows and columns point most nearly the same way in both images: neither camera is upside down relative to the
    other.
    """
    if board.marks is not None or len(board.quarter_turns) == 1:
        return right  # the marks or the colours have determined the order
    reference = left.reshape(board.rows, board.columns, 2)
    grid = right.reshape(board.rows, board.columns, 2)
    best = max((np.rot90(grid, turn) for turn in board.quarter_turns), key=lambda turned: _same_way(reference, turned))
    return np.ascontiguousarray(best.reshape(-1, 2))


def _search(grey: Image, board: Board) -> Corners:
    """Return the corners in one of the orders a search may give; empty if the board was not found."""
    largest = max(grey.shape)
    is_photo = largest > _LARGEST_SEARCHED_PX
    size = board.columns, board.rows
    corners = _by_outlines(grey, *shrunk(grey, _PHOTO_OUTLINES_PX / largest if is_photo else 1.0), board)
    if len(corners):
        return corners
    ways = [(side / largest, way) for side, way in _PHOTO_SECTORS]
    for scale, way in ways if is_photo else [(scale, way) for scale in (1.0, _SMALLER) for way in _SECTORS]:
        searched, factors = shrunk(grey, scale)
        found, rough = cv2.findChessboardCornersSB(searched, size, flags=way)
        if found:
            fitted = _fitted(grey, searched, factors, _as_corners(rough), board)
            return np.where(np.isfinite(fitted.px), fitted.px, _enlarged(_as_corners(rough), factors))
    return np.empty((0, 2))


def is_outlined(grey: Image, board: Board) -> bool:
    """Return whether the quick search finds a chessboard; it may be a part of a larger one."""
    return len(_by_outlines(grey, grey, np.ones(2), board)) > 0


def _by_outlines(grey: Image, searched: Image, factors: NDArray[np.float64], board: Board) -> Corners:
    found, rough = cv2.findChessboardCorners(searched, (board.columns, board.rows), flags=_OUTLINES)
    if not found:
        return np.empty((0, 2))
    fitted = _fitted(grey, searched, factors, _as_corners(rough), board)
    return fitted.px if _is_chessboard(fitted, board) else np.empty((0, 2))


def _as_corners(found: object) -> Corners:
    return np.asarray(found, np.float64).reshape(-1, 2)


def _enlarged(corners: Corners, factors: NDArray[np.float64]) -> Corners:
    """Return the full image's pixels. Pixel centres are integers, so the scale is about the image's corner at (-0.5, -0.5)."""
    return np.asarray((corners + 0.5) / factors - 0.5, np.float64)


def _fitted(grey: Image, searched: Image, factors: NDArray[np.float64], rough: Corners, board: Board) -> FittedCorners:
    """Fit corners where they were found, then in the full image if that is larger."""
    shape = (board.rows, board.columns, 2)
    fitted = fit_corners(searched, rough, *steps_between(rough.reshape(shape)))
    if searched is grey:
        return fitted
    start = _enlarged(np.where(np.isfinite(fitted.px), fitted.px, rough), factors)
    return fit_corners(grey, start, *steps_between(start.reshape(shape)))


def _is_chessboard(fitted: FittedCorners, board: Board) -> bool:
    """Return whether edges cross at every corner, black to white and white to black by turns."""
    turns = (-1.0) ** np.add.outer(np.arange(board.rows), np.arange(board.columns)).ravel()
    is_light = fitted.contrast * turns > 0
    return bool(fitted.are_sure().all() and (is_light.all() or not is_light.any()))


def _brightness(grid: Corners, column: int, grey: Image) -> float:
    """Return the mean brightness in the middle of the square right of corner `column` in the first row."""
    middle = grid[:2, column : column + 2].reshape(-1, 2).mean(axis=0)
    reach = max(1, int(np.linalg.norm(grid[0, column + 1] - grid[0, column]) / 6))
    x, y = (int(v) for v in np.rint(middle))
    patch = grey[max(y - reach, 0) : y + reach + 1, max(x - reach, 0) : x + reach + 1]
    return float(patch.mean()) if patch.size else 0.0


def _same_way(first: Corners, second: Corners) -> float:
    """Return how much rows and columns of two (rows, columns, 2) grids point the same way: 2 = exactly, -2 = the opposite way."""
    total = 0.0
    for grid_end in (np.s_[0, -1], np.s_[-1, 0]):
        a, b = first[grid_end] - first[0, 0], second[grid_end] - second[0, 0]
        total += float(a @ b / (np.linalg.norm(a) * np.linalg.norm(b)))
    return total
