"""phone-host target: make a calibration board or an object mat to print."""

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import cv2
import numpy as np

from common.errors import SettingsError, UnavailableError
from common.places import make_folder
from common.program.request import Request, option
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
from phone_host.jobs.output_folders import require_folder, unwritable
from phone_host.jobs.units import length_mm, square_mm
from phone_host.output.atomic import replacing
from phone_host.output.json_text import json_text

EXAMPLES = """  phone-host target chessboard                                # 9x6 inner corners on A4, as large as fits
  phone-host target chessboard --size 7x5 --square 40mm --paper A3 --out print
  phone-host target charuco --size 8x6 --square 28mm --mark 20mm --paper letter
  phone-host target mat --out print                           # to lay objects on: 10x8 squares of 25 mm
  phone-host target chessboard --screen 1920x1080 --diagonal 15.6in    # an image for a screen
"""


_LEAST, _MOST = 3, 100
_MARGIN_SQUARES: Final = 0.5
"""Half a square of white, and the paper's own margin: the detector needs some."""

_MARK_SHARE: Final = 0.72
"""Of a square's side: 18 of 25 mm. A white rim keeps a mark apart from the black squares."""

_LARGEST_MARK: Final = 0.9
_MAT_MM: Final = 25.0
_DEFAULT: Final = {"chessboard": (9, 6), "charuco": (8, 6), "mat": (10, 8)}
_INCH_MM: Final = 25.4
_SCREENS_MM: Final = (50.0, 10_000.0)
"""From a small phone's to a wall's."""

_INCHES: Final = re.compile(r"\s*(\d+\.?\d*)\s*(?:in|\")\s*", re.ASCII | re.IGNORECASE)


def _counts(text: str, option: str, most: int = _MOST, example: str = "9x6") -> tuple[int, int]:
    found = re.fullmatch(r"\s*(\d{1,5})\s*[xX]\s*(\d{1,5})\s*", text)
    if found is None or not all(_LEAST <= int(each) <= most for each in found.groups()):
        raise SettingsError(f"{option} is {text!r}", f"give columns x rows, {_LEAST} to {most} each, such as {example}")
    return int(found[1]), int(found[2])


def _diagonal_mm(text: str, option: str) -> float:
    if text.strip().replace(".", "", 1).isdecimal():
        raise SettingsError(f"{option} is {text!r}", "give its unit, such as 15.6in or 396mm")
    inches = _INCHES.fullmatch(text)
    found_mm = float(inches[1]) * _INCH_MM if inches else length_mm(text, option, "15.6in or 396mm")
    if not _SCREENS_MM[0] <= found_mm <= _SCREENS_MM[1]:
        raise SettingsError(
            f"{option} is {text!r}, which no screen has", "give it with its unit, such as 15.6in or 396mm"
        )
    return found_mm


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetRequest(Request):
    """What target can be told."""

    kind: str = option(
        choices=("chessboard", "charuco", "mat"),
        metavar="chessboard|charuco|mat",
        help="a chessboard; a chessboard with coded marks, of which a part is enough; or the mat that objects are laid on",
    )
    size: tuple[int, int] | None = option(
        "--size",
        read=_counts,
        metavar="9x6",
        help="of a chessboard its inner corners, columns x rows (default 9x6); of charuco and mat its squares (default 8x6; mat 10x8)",
    )
    square_mm: float | None = option(
        "--square",
        read=lambda text, _: square_mm(text),
        metavar="25mm",
        help="side of a square (default: as large as fits; mat 25mm)",
    )
    mark_mm: float | None = option(
        "--mark",
        read=lambda text, name: length_mm(text, name, "18mm"),
        metavar="18mm",
        help="side of a coded mark (default: 0.72 of the square's)",
    )
    family: str = option(
        "--family", choices=("4x4", "5x5", "6x6"), default="5x5", help="ArUco family of the marks (default 5x5)"
    )
    paper: Paper = option(
        "--paper",
        read=lambda text, _: Paper[text],
        type=str.upper,
        choices=("A4", "A3", "LETTER"),
        default="A4",
        help="sheet of paper: A4, A3 or letter (default A4)",
    )
    screen_px: tuple[int, int] | None = option(
        "--screen",
        read=lambda text, name: _counts(text, name, most=20_000, example="1920x1080"),
        metavar="1920x1080",
        help="make an image of a chessboard for a screen of so many pixels, instead",
    )
    diagonal_mm: float | None = option(
        "--diagonal",
        read=_diagonal_mm,
        metavar="15.6in",
        help="of that screen: from it the size of a pixel and a square follows",
    )
    out: Path = option(
        "--out", type=Path, default=Path(), metavar="DIR", help="folder for the files (default: the current folder)"
    )


@dataclass(frozen=True, slots=True)
class _Made:
    """Files as they are to be written, and what the user does next."""

    files: dict[str, bytes]
    square_mm: float
    lines: tuple[str, ...]


def run(request: TargetRequest) -> int:
    """Lay the board out, write the files, say how to print and to use them."""
    columns, rows = request.size or _DEFAULT[request.kind]
    require_folder(request.out)
    made = (_on_paper if request.screen_px is None else _on_screen)(request, columns, rows)
    _spare(request.out, made)
    try:
        make_folder(request.out)
        for name, content in made.files.items():
            with replacing(request.out / name, durable=True) as file:
                file.write(content)
    except OSError as error:
        raise unwritable(request.out, error) from error
    files = [str(request.out / name) for name in made.files]
    if request.as_json:
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


def _on_paper(request: TargetRequest, columns: int, rows: int) -> _Made:
    if request.diagonal_mm is not None:
        raise SettingsError("--diagonal is of a screen", "give --screen, such as --screen 1920x1080, or leave it out")
    paper = request.paper
    thing: tuple[str, ...] = ()
    if request.kind == "chessboard":
        side = _side_mm(request, paper, columns + 1, rows + 1)
        if request.mark_mm is not None:
            raise SettingsError("a chessboard has no marks", "leave --mark out, or make charuco")
        sheet = chessboard_sheet(Chessboard(columns + 1, rows + 1, side), paper)
        board, size, mark = "", f"{columns}x{rows}", 0.0
    else:
        side = (
            _MAT_MM if request.kind == "mat" and request.square_mm is None else _side_mm(request, paper, columns, rows)
        )
        mark = request.mark_mm or _usual_mark_mm(side)
        if not 0.3 * side <= mark <= _LARGEST_MARK * side:
            raise SettingsError(
                f"--mark {mark:g}mm does not fit a square of {side:g} mm", "give 0.3 to 0.9 of its side"
            )
        require_marks(columns, rows, request.family)
        size = f"{columns}x{rows}"
        name = f"{size}:{side:g}mm:{mark:g}mm:{request.family}"
        board = f"--board charuco:{name} "
        if request.kind == "mat":
            thing = (f"then    phone-host scan left/ right/ --mat {name} --calibration rig.yaml --out cup",)
        use = f"phone-host calibrate left right {board}--out rig.yaml"
        what = f"{request.kind}, {size} squares of {side:g} mm, marks {mark:g} mm, ArUco {request.family}"
        sheet = marked_sheet(
            MarkedBoard(Chessboard(columns, rows, side), mark, FAMILIES[request.family]), paper, what, use
        )
    marks = "" if request.kind == "chessboard" else f"-{mark:g}mm-{request.family}"
    stem = f"{request.kind}-{size}-{side:g}mm{marks}-{paper.name.lower()}"
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


def _on_screen(request: TargetRequest, columns: int, rows: int) -> _Made:
    if request.kind != "chessboard":
        raise SettingsError(
            f"--screen shows chessboards, not {request.kind}", "make a chessboard, or leave --screen out"
        )
    if request.square_mm is not None:
        raise SettingsError("a screen's squares follow from its pixels", "leave --square out, and give --diagonal")
    diagonal_mm = math.nan if request.diagonal_mm is None else request.diagonal_mm
    width, height = request.screen_px or (0, 0)
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


def _side_mm(request: TargetRequest, paper: Paper, columns: int, rows: int) -> float:
    if request.square_mm is not None:
        Board(_LEAST, _LEAST, request.square_mm / 1000)  # refuses a square that no board has
        return request.square_mm
    return largest_square_mm(paper, columns, rows, _MARGIN_SQUARES)
