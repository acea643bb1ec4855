"""A chessboard as an image for a screen, one image pixel to a screen pixel. Pure."""

import math
from dataclasses import dataclass

import numpy as np

from common.errors import SettingsError
from phone_host.model import Image


@dataclass(frozen=True, slots=True)
class ScreenBoard:
    """A chessboard on a screen.

    Attributes:
        image: (H, W) uint8, the whole screen.
        square_px: side of a square, px.
        square_mm: the same, mm; NaN if the screen's diagonal is not known.
        pitch_mm: width of a pixel, mm; NaN likewise.
    """

    image: Image
    square_px: int
    square_mm: float
    pitch_mm: float


def screen_board(columns: int, rows: int, size_px: tuple[int, int], diagonal_mm: float = math.nan) -> ScreenBoard:
    """Draw a chessboard that fills a screen but for a margin of one square.

    Args:
        columns: squares in a row.
        rows: squares in a column.
        size_px: the screen's width and height, px.
        diagonal_mm: of what the screen shows, mm; its pixels are square.

    Raises:
        SettingsError: the screen is too small for so many squares.
    """
    width, height = size_px
    side = min(width // (columns + 2), height // (rows + 2))
    if side < 8:
        raise SettingsError(
            f"{columns}x{rows} squares do not fit on a screen of {width}x{height} px", "give fewer squares"
        )
    image = np.full((height, width), 255, np.uint8)
    left, top = (width - columns * side) // 2, (height - rows * side) // 2
    squares = (np.indices((rows, columns)).sum(axis=0) % 2 * 255).astype(np.uint8)
    image[top : top + rows * side, left : left + columns * side] = np.kron(squares, np.ones((side, side), np.uint8))
    pitch_mm = diagonal_mm / math.hypot(width, height)
    return ScreenBoard(image, side, side * pitch_mm, pitch_mm)
