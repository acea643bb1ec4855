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

_WORDS_MM, _GAP_MM = 2.2, 1.2
_LETTER: Final = 0.72
"""Width of a letter, and a little more than that, in heights of capitals: those of the longest line are 0.63 of it on average."""


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
