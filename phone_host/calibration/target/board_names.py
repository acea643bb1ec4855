"""Boards as people write them: inner corners of a chessboard, a ChArUco board, an AprilGrid. Pure."""

import math
import re
from typing import Final, assert_never

from common.errors import SettingsError
from phone_host.calibration.target.corners import Board, parse_board
from phone_host.calibration.target.marked import AprilGrid, Charuco, MarkFamily

FAMILIES: Final = {"4x4": MarkFamily.ARUCO_4X4, "5x5": MarkFamily.ARUCO_5X5, "6x6": MarkFamily.ARUCO_6X6}
"""By their names on the command line."""

_LENGTH: Final = r"(\d+(?:\.\d+)?)\s*mm"
_CHARUCO: Final = re.compile(
    rf"charuco:(\d{{1,3}})x(\d{{1,3}}):{_LENGTH}:{_LENGTH}:([456]x[456])(:legacy)?", re.IGNORECASE
)
_GRID: Final = re.compile(rf"aprilgrid:(\d{{1,2}})x(\d{{1,2}}):{_LENGTH}:{_LENGTH}", re.IGNORECASE)
_LEGACY: Final = ":legacy"
_LEAST_TAGS: Final = 2
_TAGS: Final = 587
"""In the family 36h11."""

MOST_MARKS: Final = 1000
"""In each ArUco family that is used here."""

_MOST_STRETCH: Final = 0.1
"""Printed "fit to page" a board is up to 7 % smaller."""


def named_board(text: str, square_mm: float | None) -> Board:
    """Read a board.

    Args:
        text: inner corners such as "9x6"; "charuco:10x8:25mm:18mm:5x5" (squares, side of a square, side of a mark, ArUco
            family; ":legacy" behind it: `Charuco.is_legacy`); or "aprilgrid:6x6:30mm:9mm" (tags, side of a tag, gap between two).
        square_mm: side of a square, or of a tag, as it was measured; None: as the board's name says.

    Raises:
        SettingsError: it names no board, a chessboard without a square, or a side that is far from the measured one.
    """
    name = text.strip().lower()
    if name.startswith("charuco"):
        return _charuco(name, square_mm)
    if name.startswith("aprilgrid"):
        return _april_grid(name, square_mm)
    if square_mm is None:
        raise no_square()
    return parse_board(text, square_mm)


def board_name(board: Board) -> str:
    """Write a board as `named_board` reads it."""
    side_mm = board.square_m * 1e3
    match board.marks:
        case None:
            return f"{board.columns}x{board.rows}"
        case Charuco(family, share, is_legacy):
            words = next(word for word, each in FAMILIES.items() if each is family)
            return f"charuco:{board.columns + 1}x{board.rows + 1}:{side_mm:.8g}mm:{side_mm * share:.8g}mm:{words}{_LEGACY if is_legacy else ''}"
        case AprilGrid(share):
            return f"aprilgrid:{board.columns // 2}x{board.rows // 2}:{side_mm:.8g}mm:{side_mm * share:.8g}mm"
        case _:
            assert_never(board.marks)


def family_name(family: MarkFamily) -> str:
    """Write a family of marks in words."""
    return next((f"ArUco {word}" for word, each in FAMILIES.items() if each is family), "AprilTag 36h11")


def no_square() -> SettingsError:
    """Make the error for a chessboard whose square is not known: how to measure it, on paper and on a screen."""
    return SettingsError(
        "--square is missing: the side of one square",
        "measure ten squares with a ruler and divide, as in --square 25mm; on a screen, pixels times the width of one, as"
        " in --square '120px*0.1794mm'",
    )


def require_marks(columns: int, rows: int, family: str) -> None:
    """Check that a family, named in words, has a mark for each white square of a chessboard of so many squares.

    Raises:
        SettingsError: it has fewer.
    """
    marks = columns * rows // 2
    if marks > MOST_MARKS:
        raise SettingsError(
            f"{columns}x{rows} squares hold {marks} marks, and the family {family} has {MOST_MARKS}",
            "give fewer squares",
        )


def _charuco(name: str, square_mm: float | None) -> Board:
    found = _CHARUCO.fullmatch(name)
    if found is None or found[5] not in FAMILIES or not 0.3 <= _share(found) <= 0.9:
        raise SettingsError(
            f"--board {name!r} is no ChArUco board",
            "give squares, side of a square, side of a mark and family, as in charuco:10x8:25mm:18mm:5x5",
        )
    columns, rows = int(found[1]), int(found[2])
    require_marks(columns, rows, found[5])
    marks = Charuco(FAMILIES[found[5]], _share(found), is_legacy=bool(found[6]) and rows % 2 == 0)
    return Board(columns - 1, rows - 1, _side_mm(float(found[3]), square_mm) / 1000, marks)


def _april_grid(name: str, square_mm: float | None) -> Board:
    found = _GRID.fullmatch(name)
    if found is None or min(int(found[1]), int(found[2])) < _LEAST_TAGS or not 0.1 <= _share(found) <= 1:
        raise SettingsError(
            f"--board {name!r} is no AprilGrid", "give tags, side of a tag and gap, as in aprilgrid:6x6:30mm:9mm"
        )
    across, down = int(found[1]), int(found[2])
    if across * down > _TAGS:
        raise SettingsError(f"{across}x{down} tags are {across * down}, the family has {_TAGS}", "give fewer")
    return Board(2 * across, 2 * down, _side_mm(float(found[3]), square_mm) / 1000, AprilGrid(_share(found)))


def _share(found: re.Match[str]) -> float:
    """Return the second length of a name as a share of the first; NaN where there is none."""
    side, other = float(found[3]), float(found[4])
    return other / side if side > 0 else math.nan


def _side_mm(named_mm: float, square_mm: float | None) -> float:
    """Return the side as it was measured, or as the name says; a print may be enlarged or shrunk a little.

    Raises:
        SettingsError: the two are no one board's.
    """
    if square_mm is None:
        return named_mm
    if abs(square_mm / named_mm - 1) > _MOST_STRETCH:
        raise SettingsError(
            f"--square is {square_mm:g} mm, and --board says {named_mm:g} mm",
            "measure it again, or leave --square out if --board is right",
        )
    return square_mm
