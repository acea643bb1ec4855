"""Draws boards and mats: on a sheet of paper with rulers that show whether the print is to scale, or on a screen. Pure.

A mat and a ChArUco board are chessboards with a coded mark in each white square (Garrido-Jurado et al. 2014; OpenCV's
CharucoBoard, without its legacy pattern). Their corners are those of the squares: the marks only tell which is which.
"""

import math
from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np

from common.errors import SettingsError
from phone_host.calibration.target.marked import MarkFamily
from phone_host.calibration.target.sheet import Ink, Paper, Rectangle, Sheet, Words
from phone_host.model import Image

_MARGIN_MM: Final = 4.8
"""Office printers leave 4.2 mm to 4.6 mm of the paper's edge blank."""

_RULER_MM: Final = 100
_TICK_MM, _LINE_MM = 2.5, 0.2
_RULER_NEEDS_MM: Final = 10.0
"""Between the pattern and the paper's edge: 4.2 mm that printers leave blank, and the ruler."""

_WORDS_MM, _GAP_MM = 2.2, 1.2
_LETTER: Final = 0.72
"""Width of a letter, and a little more than that, in heights of capitals: those of the longest line are 0.63 of it on average."""


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
    family: MarkFamily


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
    dictionary = cv2.aruco.getPredefinedDictionary(board.family.value)
    white = [
        (column, row)
        for row in range(board.squares.rows)
        for column in range(board.squares.columns)
        if (row + column) % 2
    ]
    margin = (board.squares.square_mm - board.mark_mm) / 2
    cells = dictionary.markerSize + 2
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


def largest_square_mm(paper: Paper, columns: int, rows: int, margin_squares: float) -> float:
    """Return the largest side, in whole mm, of squares that fit on a sheet.

    Args:
        paper: the sheet, turned so that the longer side of the board lies along the longer side of the paper.
        columns: squares in a row.
        rows: squares in a column.
        margin_squares: white margin that is kept on each side, in squares.

    Raises:
        SettingsError: not even squares of 1 mm fit.
    """
    short, long_ = paper.value
    more, fewer = max(columns, rows), min(columns, rows)
    side = min(
        (long_ - 2 * _MARGIN_MM) / (more + 2 * margin_squares), (short - 2 * _MARGIN_MM) / (fewer + 2 * margin_squares)
    )
    if side < 1:
        raise SettingsError(
            f"{columns}x{rows} squares do not fit on {paper.name}", "give fewer squares or a larger --paper"
        )
    return float(math.floor(side))


def chessboard_sheet(board: Chessboard, paper: Paper) -> Sheet:
    """Lay out a chessboard; see `_sheet`."""
    inner = f"{board.columns - 1}x{board.rows - 1}"
    what = f"chessboard, {inner} inner corners, squares of {board.square_mm:g} mm"
    then = f"phone-host calibrate left right --square {board.square_mm:g}mm --out rig.yaml"
    return _sheet(board, chessboard_rectangles(board), paper, what, then)


def marked_sheet(board: MarkedBoard, paper: Paper, what: str, then: str) -> Sheet:
    """Lay out a board of marks; see `_sheet`."""
    return _sheet(board.squares, marked_rectangles(board), paper, what, then)


def _sheet(board: Chessboard, pattern: list[Rectangle], paper: Paper, what: str, then: str) -> Sheet:
    """Put a pattern into the middle of a sheet, turned as the pattern lies.

    Raises:
        SettingsError: it is larger than the sheet.
    """
    short, long_ = paper.value
    width, height = board.columns * board.square_mm, board.rows * board.square_mm
    page_width, page_height = (long_, short) if width >= height else (short, long_)
    x, y = (page_width - width) / 2, (page_height - height) / 2
    if min(x, y) < _MARGIN_MM:
        room = f"{page_width - 2 * _MARGIN_MM:g} x {page_height - 2 * _MARGIN_MM:g} mm"
        raise SettingsError(
            f"a board of {width:g} x {height:g} mm does not fit on {paper.name} ({room})",
            "give a smaller --square, fewer squares or a larger --paper",
        )
    rectangles = [replace(each, x_mm=each.x_mm + x, y_mm=each.y_mm + y) for each in pattern]
    rulers = [
        edge >= _RULER_NEEDS_MM and from_mm + _RULER_MM <= whole_mm - _MARGIN_MM
        for edge, from_mm, whole_mm in ((y, x, page_width), (x, y, page_height))
    ]
    check = _check(rulers, width, height)
    told = (f"measure {check}", what, f"print at 100 %, not fitted to the page; then: {then}")
    words = list[Words]()
    if rulers[0]:
        ruler, words = _ruler_and_words((page_width, page_height), (x, y), told)
        rectangles += ruler
        if rulers[1]:
            rectangles += [
                _turned(each, page_height) for each in _ruler(page_height - y - _RULER_MM, (x - _TICK_MM) / 2)
            ]
    elif rulers[1]:
        # As on a page that lies on its side: words run upwards.
        ruler, words = _ruler_and_words((page_height, page_width), (y, x), told)
        rectangles += [_turned(each, page_height) for each in ruler]
        words = [replace(each, x_mm=each.y_mm, y_mm=page_height - each.x_mm, is_upward=True) for each in words]
    return Sheet(what, page_width, page_height, check, tuple(rectangles), tuple(words))


def _check(rulers: list[bool], width_mm: float, height_mm: float) -> str:
    """Say what to measure on the print, both ways: the board itself where it leaves no room for a ruler."""
    match rulers:
        case [True, True]:
            return f"both rulers: {_RULER_MM} mm"
        case [True, False]:
            return f"the ruler, {_RULER_MM} mm, and the board, {height_mm:g} mm high"
        case [False, True]:
            return f"the ruler, {_RULER_MM} mm, and the board, {width_mm:g} mm wide"
        case _:
            return f"the board: {width_mm:g} x {height_mm:g} mm"


def _ruler_and_words(
    page_mm: tuple[float, float], edge_mm: tuple[float, float], told: tuple[str, str, str]
) -> tuple[list[Rectangle], list[Words]]:
    """Return a ruler below the board with the first words beside it, where printers leave no paper blank, and the others above the board.

    Args:
        page_mm: width and height of the page.
        edge_mm: between the board and the page's edge, beside it and above it.
        told: the words.
    """
    x, y = edge_mm
    top = page_mm[1] - y / 2 - _TICK_MM / 2
    height = min(_WORDS_MM, (y - _MARGIN_MM - 2 * _GAP_MM) / 2)
    lines = [(x + _RULER_MM + 3, top + _TICK_MM, told[0])]
    lines += [(x, _MARGIN_MM + index * (height + _GAP_MM) + height, text) for index, text in enumerate(told[1:])]
    return _ruler(x, top), [
        Words(at, base, text, min(height, (page_mm[0] - _MARGIN_MM - at) / (_LETTER * len(text))))
        for at, base, text in lines
    ]


def _turned(each: Rectangle, page_mm: float) -> Rectangle:
    """Turn a rectangle with its page, a quarter clockwise back; `page_mm` is the page's height after it."""
    return replace(
        each,
        x_mm=each.y_mm,
        y_mm=page_mm - each.x_mm - each.width_mm,
        width_mm=each.height_mm,
        height_mm=each.width_mm,
    )


def _ruler(x_mm: float, y_mm: float) -> list[Rectangle]:
    """Return a ruler with a tick every 10 mm; the outer edges of the first and the last tick are exactly its length apart."""
    found = [Rectangle(x_mm, y_mm + _TICK_MM - _LINE_MM, _RULER_MM, _LINE_MM)]
    for at in range(0, _RULER_MM + 1, 10):
        left = min(max(at - _LINE_MM / 2, 0), _RULER_MM - _LINE_MM)
        tick = _TICK_MM if at % 50 == 0 else _TICK_MM * 0.6
        found.append(Rectangle(x_mm + left, y_mm + _TICK_MM - tick, _LINE_MM, tick))
    return found


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
