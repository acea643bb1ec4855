"""Lays a board or a mat out on a sheet of paper: in its middle, with rulers that show whether the print is to scale. Pure."""

import math
from dataclasses import replace
from typing import Final

from common.errors import SettingsError
from phone_host.calibration.sheets.patterns import Chessboard, MarkedBoard, chessboard_rectangles, marked_rectangles
from phone_host.calibration.sheets.sheet import Paper, Rectangle, Sheet, Words

_MARGIN_MM: Final = 4.8
"""Office printers leave 4.2 mm to 4.6 mm of the paper's edge blank."""

_RULER_MM: Final = 100
_TICK_MM, _LINE_MM = 2.5, 0.2
_RULER_NEEDS_MM: Final = 10.0
"""Between the pattern and the paper's edge: 4.2 mm that printers leave blank, and the ruler."""

_WORDS_MM: Final = 2.2


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
    """Lay out a board of marks; see `_sheet`.

    Args:
        board: the board.
        paper: the sheet.
        what: what it is, in words.
        then: the command that uses it.
    """
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
    words = list[Words]()
    if y >= _RULER_NEEDS_MM:
        top = page_height - y / 2 - _TICK_MM / 2
        rectangles += _ruler(x, top, along=True)
        # Beside the ruler: below it a printer may leave the paper blank.
        words.append(Words(x + _RULER_MM + 3, top + _TICK_MM, f"{_RULER_MM} mm: measure it. {what}", _WORDS_MM))
        words.append(
            Words(x, y / 2 + _WORDS_MM / 2, f"print at 100 %, not fitted to the page; then: {then}", _WORDS_MM)
        )
    if x >= _RULER_NEEDS_MM and height >= _RULER_MM:
        rectangles += _ruler(x / 2 - _TICK_MM / 2, y, along=False)
    return Sheet(what, page_width, page_height, tuple(rectangles), tuple(words))


def _ruler(x_mm: float, y_mm: float, *, along: bool) -> list[Rectangle]:
    """Return a ruler with a tick every 10 mm; the outer edges of the first and the last tick are exactly its length apart."""
    found = [Rectangle(0, _TICK_MM - _LINE_MM, _RULER_MM, _LINE_MM)]
    for at in range(0, _RULER_MM + 1, 10):
        left = min(max(at - _LINE_MM / 2, 0), _RULER_MM - _LINE_MM)
        tick = _TICK_MM if at % 50 == 0 else _TICK_MM * 0.6
        found.append(Rectangle(left, _TICK_MM - tick, _LINE_MM, tick))
    if not along:
        found = [Rectangle(each.y_mm, each.x_mm, each.height_mm, each.width_mm) for each in found]
    return [replace(each, x_mm=each.x_mm + x_mm, y_mm=each.y_mm + y_mm) for each in found]
