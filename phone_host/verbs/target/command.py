"""phone-host target: make a calibration board or an object mat to print."""

import argparse
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from common.errors import SettingsError, UnavailableError
from common.places import make_folder
from common.program.terminal import say
from phone_host.calibration.target.board_names import FAMILIES, require_marks
from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.sheet import Paper, Sheet, pdf, svg
from phone_host.calibration.target.sheet_layout import (
    Chessboard,
    MarkedBoard,
    ScreenBoard,
    chessboard_sheet,
    largest_square_mm,
    marked_sheet,
    screen_board,
)
from phone_host.output.atomic import replacing
from phone_host.output.json_text import json_text
from phone_host.verbs.output_folders import require_folder, unwritable
from phone_host.verbs.units import length_mm, square_mm

_LEAST, _MOST = 3, 100
_MARGIN_SQUARES: Final = 0.5
"""Half a square of white, and the paper's own margin: the detector needs some."""

_MARK_SHARE: Final = 0.72
"""Of a square's side: 18 of 25 mm. A white rim keeps a mark apart from the black squares."""

_LARGEST_MARK: Final = 0.9
_MAT_MM: Final = 25.0
_DEFAULT: Final = {"chessboard": "9x6", "charuco": "8x6", "mat": "10x8"}
_INCH_MM: Final = 25.4
_SCREENS_MM: Final = (50.0, 10_000.0)
"""From a small phone's to a wall's."""

_INCHES: Final = re.compile(r"\s*(\d+\.?\d*)\s*(?:in|\")\s*", re.ASCII | re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class _Made:
    """Files as they are to be written, and what the user does next."""

    files: dict[str, bytes]
    square_mm: float
    lines: tuple[str, ...]


def run(options: argparse.Namespace) -> int:
    """Lay the board out, write the files, say how to print and to use them."""
    columns, rows = _counts(options.size or _DEFAULT[options.kind], "--size")
    require_folder(options.out)
    made = _on_screen(options, columns, rows) if options.screen else _on_paper(options, columns, rows)
    _spare(options.out, made)
    try:
        make_folder(options.out)
        for name, content in made.files.items():
            with replacing(options.out / name, durable=True) as file:
                file.write(content)
    except OSError as error:
        raise unwritable(options.out, error) from error
    files = [str(options.out / name) for name in made.files]
    if options.json:
        side = made.square_mm if math.isfinite(made.square_mm) else None
        print(json_text({"command": "target", "files": files, "square_mm": side}))
    else:
        say([f"written to {' and '.join(files)}", *made.lines])
    return 0


def _spare(out: Path, made: _Made) -> None:
    """Refuse to replace a file that is not the same board.

    Raises:
        UnavailableError: there is one.
    """
    for name, content in made.files.items():
        path = out / name
        try:
            is_other = path.exists() and path.read_bytes() != content
        except OSError:
            is_other = True
        if is_other:
            raise UnavailableError(f"{path} is another file, and would be replaced", "move it, or name another --out")


def _on_paper(options: argparse.Namespace, columns: int, rows: int) -> _Made:
    if options.diagonal:
        raise SettingsError("--diagonal is of a screen", "give --screen, such as --screen 1920x1080, or leave it out")
    paper = Paper[options.paper]
    thing: tuple[str, ...] = ()
    if options.kind == "chessboard":
        side = _side_mm(options, paper, columns + 1, rows + 1)
        if options.mark:
            raise SettingsError("a chessboard has no marks", "leave --mark out, or make charuco")
        sheet = chessboard_sheet(Chessboard(columns + 1, rows + 1, side), paper)
        board, size, mark = "", f"{columns}x{rows}", 0.0
    else:
        side = _MAT_MM if options.kind == "mat" and not options.square else _side_mm(options, paper, columns, rows)
        mark = length_mm(options.mark, "--mark", "18mm") if options.mark else _usual_mark_mm(side)
        if not 0.3 * side <= mark <= _LARGEST_MARK * side:
            raise SettingsError(
                f"--mark {mark:g}mm does not fit a square of {side:g} mm", "give 0.3 to 0.9 of its side"
            )
        require_marks(columns, rows, options.family)
        size = f"{columns}x{rows}"
        name = f"{size}:{side:g}mm:{mark:g}mm:{options.family}"
        board = f"--board charuco:{name} "
        if options.kind == "mat":
            thing = (f"then    phone-host scan left/ right/ --mat {name} --calibration rig.yaml --out cup",)
        use = f"phone-host calibrate left right {board}--out rig.yaml"
        what = f"{options.kind}, {size} squares of {side:g} mm, marks {mark:g} mm, ArUco {options.family}"
        sheet = marked_sheet(
            MarkedBoard(Chessboard(columns, rows, side), mark, FAMILIES[options.family]), paper, what, use
        )
    marks = "" if options.kind == "chessboard" else f"-{mark:g}mm-{options.family}"
    stem = f"{options.kind}-{size}-{side:g}mm{marks}-{paper.name.lower()}"
    return _Made(_files(stem, sheet), side, (*_paper_lines(board, side, sheet.check), *thing))


def _usual_mark_mm(side: float) -> float:
    """Return whole millimetres, where a square has room for them."""
    return float(math.floor(_MARK_SHARE * side)) or round(_MARK_SHARE * side, 1)


def _files(stem: str, sheet: Sheet) -> dict[str, bytes]:
    return {f"{stem}.pdf": pdf(sheet), f"{stem}.svg": svg(sheet).encode("ascii")}


def _paper_lines(board: str, side: float, check: str) -> tuple[str, ...]:
    square = "" if board else f"--square {side:g}mm "
    return (
        f"print it at 100 %, not fitted to the page, and measure {check}",
        "glue it to something flat and stiff: glass, acrylic, a picture frame",
        f"then    phone-host calibrate left/ right/ {board}{square}--out rig.yaml",
    )


def _on_screen(options: argparse.Namespace, columns: int, rows: int) -> _Made:
    if options.kind != "chessboard":
        raise SettingsError(
            f"--screen shows chessboards, not {options.kind}", "make a chessboard, or leave --screen out"
        )
    if options.square:
        raise SettingsError("a screen's squares follow from its pixels", "leave --square out, and give --diagonal")
    diagonal_mm = _diagonal_mm(options.diagonal) if options.diagonal else math.nan
    width, height = _counts(options.screen, "--screen", most=20_000, example="1920x1080")
    board = screen_board(columns + 1, rows + 1, (width, height), diagonal_mm)
    encoded = np.asarray(cv2.imencode(".png", board.image)[1]).tobytes()
    name = f"chessboard-{columns}x{rows}-{width}x{height}.png"
    return _Made({name: encoded}, board.square_mm, _screen_lines(board))


def _screen_lines(board: ScreenBoard) -> tuple[str, ...]:
    show = "show it full screen at 100 %, one image pixel to a screen pixel, without any scaling of the desktop"
    if math.isnan(board.square_mm):
        ask = f"measure ten squares with a ruler, or give --diagonal: a square is {board.square_px} pixels"
        return show, ask, "then    phone-host calibrate left/ right/ --square ... --out rig.yaml"
    square = f"{board.square_px}px*{board.pitch_mm:.4f}mm"
    return (
        show,
        f"a square is {board.square_px} pixels of {board.pitch_mm:.4f} mm: {board.square_mm:.2f} mm; check it with a ruler",
        f"then    phone-host calibrate left/ right/ --square '{square}' --out rig.yaml",
    )


def _diagonal_mm(text: str) -> float:
    if text.strip().replace(".", "", 1).isdecimal():
        raise SettingsError(f"--diagonal is {text!r}", "give its unit, such as 15.6in or 396mm")
    inches = _INCHES.fullmatch(text)
    found_mm = float(inches[1]) * _INCH_MM if inches else length_mm(text, "--diagonal", "15.6in or 396mm")
    if not _SCREENS_MM[0] <= found_mm <= _SCREENS_MM[1]:
        raise SettingsError(
            f"--diagonal is {text!r}, which no screen has", "give it with its unit, such as 15.6in or 396mm"
        )
    return found_mm


def _side_mm(options: argparse.Namespace, paper: Paper, columns: int, rows: int) -> float:
    if options.square:
        side_mm = square_mm(options.square)
        Board(_LEAST, _LEAST, side_mm / 1000)  # refuses a square that no board has
        return side_mm
    return largest_square_mm(paper, columns, rows, _MARGIN_SQUARES)


def _counts(text: str, option: str, most: int = _MOST, example: str = "9x6") -> tuple[int, int]:
    found = re.fullmatch(r"\s*(\d{1,5})\s*[xX]\s*(\d{1,5})\s*", text)
    if found is None or not all(_LEAST <= int(each) <= most for each in found.groups()):
        raise SettingsError(f"{option} is {text!r}", f"give columns x rows, {_LEAST} to {most} each, such as {example}")
    return int(found[1]), int(found[2])
