"""What boards and mats look like: rectangles in millimetres from their upper left corner. Pure.

A mat and a ChArUco board are chessboards with a coded mark in each white square (Garrido-Jurado et al. 2014; OpenCV's
CharucoBoard, without its legacy pattern). Their corners are those of the squares: the marks only tell which is which.
"""

from dataclasses import dataclass
from enum import Enum
from typing import Final

import cv2
import numpy as np

from phone_host.calibration.sheets.sheet import Ink, Rectangle


class Family(Enum):
    """A family of coded marks; its value is how many bits a side has."""

    ARUCO_4X4 = 4
    ARUCO_5X5 = 5
    ARUCO_6X6 = 6


DICTIONARIES: Final = {
    Family.ARUCO_4X4: cv2.aruco.DICT_4X4_1000,
    Family.ARUCO_5X5: cv2.aruco.DICT_5X5_1000,
    Family.ARUCO_6X6: cv2.aruco.DICT_6X6_1000,
}


@dataclass(frozen=True, slots=True)
class Chessboard:
    """A chessboard: squares in a row and in a column, and their side, mm."""

    columns: int
    rows: int
    square_mm: float


@dataclass(frozen=True, slots=True)
class MarkedBoard:
    """A chessboard whose white squares hold coded marks.

    Attributes:
        squares: the chessboard.
        mark_mm: side of a mark, its black border included.
        family: of the marks; they are numbered from 0, row by row.
    """

    squares: Chessboard
    mark_mm: float
    family: Family


def chessboard_rectangles(board: Chessboard) -> list[Rectangle]:
    """Return the black squares; the upper left one is black."""
    side = board.square_mm
    return [
        Rectangle(column * side, row * side, side, side)
        for row in range(board.rows)
        for column in range(board.columns)
        if (row + column) % 2 == 0
    ]


def marked_rectangles(board: MarkedBoard) -> list[Rectangle]:
    """Return the black squares, and the marks as black squares with white bits."""
    found = chessboard_rectangles(board.squares)
    dictionary = cv2.aruco.getPredefinedDictionary(DICTIONARIES[board.family])
    white = [
        (column, row)
        for row in range(board.squares.rows)
        for column in range(board.squares.columns)
        if (row + column) % 2
    ]
    margin = (board.squares.square_mm - board.mark_mm) / 2
    cells = board.family.value + 2
    for number, (column, row) in enumerate(white):
        x, y = (each * board.squares.square_mm + margin for each in (column, row))
        found.append(Rectangle(x, y, board.mark_mm, board.mark_mm))
        bits = np.asarray(cv2.aruco.generateImageMarker(dictionary, number, cells, borderBits=1)) > 0
        found += _runs(bits, x, y, board.mark_mm / cells)
    return found


def _runs(bits: np.ndarray, x_mm: float, y_mm: float, cell_mm: float) -> list[Rectangle]:
    """Return white bits as rows and as columns of them: painted twice, so that no seam shows where two touch."""
    found = []
    for lines, is_row in ((bits, True), (bits.T, False)):
        for index, line in enumerate(lines):
            edges = np.flatnonzero(np.diff(np.concatenate([[False], line, [False]]).astype(int)))
            for start, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
                along, across = (start * cell_mm, index * cell_mm)
                length = (end - start) * cell_mm
                found.append(
                    Rectangle(x_mm + along, y_mm + across, length, cell_mm, Ink.WHITE)
                    if is_row
                    else Rectangle(x_mm + across, y_mm + along, cell_mm, length, Ink.WHITE)
                )
    return found
