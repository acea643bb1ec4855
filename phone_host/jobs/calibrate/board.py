"""The board of phone-host calibrate: named by the user and checked in the images, or found in them."""

from dataclasses import dataclass
from typing import Final

from common.errors import DataError
from common.imagesize.head import size_text
from phone_host.calibration.target.board_names import named_board, no_square
from phone_host.calibration.target.board_size import require_marks_of, require_size, size_in_files
from phone_host.calibration.target.corners import Board
from phone_host.report.calibration_report import Known, Origin
from phone_host.run.progress_bar import busy_bar
from phone_host.stereo.view_files import ViewFiles

AUTO: Final = "auto"

_COUNT_CORNERS: Final = (
    "check --board: it counts inner corners, one less than the squares each way (10x7 squares are --board 9x6); or take 15 or"
    " more pairs with the whole board sharp in both images"
)
_COUNT_MARKS: Final = (
    "check --board: it counts squares (of an AprilGrid tags) and names the marks' family; or take 15 or more pairs with the"
    " marks sharp in both images"
)


@dataclass(frozen=True, slots=True)
class Named:
    """What the options say of the board.

    Attributes:
        board: the board; None: it is to be found.
        square_mm: side of its squares, mm.
    """

    board: Board | None
    square_mm: float


def named(board: str, square_mm: float | None) -> Named:
    """Read --board and --square.

    Args:
        board: "auto", inner corners such as "9x6", or the name of a board with marks.
        square_mm: side of one square, mm; None: not given.

    Raises:
        SettingsError: one of the two is not valid, or a chessboard has no square.
    """
    if board.strip().lower() == AUTO:
        if square_mm is None:
            raise no_square()
        Board(3, 3, square_mm / 1000)  # refuses a square that no board has before images are read
        return Named(None, square_mm)
    known = named_board(board, square_mm)
    return Named(known, known.square_m * 1e3)


def board_in(files: ViewFiles, named: Named, most_pixels: int) -> Known:
    """Find the board's size in some images, or check there the one that was named.

    Args:
        files: the pairs of files.
        named: what the options say.
        most_pixels: an image that claims more is passed over.

    Raises:
        DataError: no size was named, and the images do not tell it.
        SettingsError: the images show a board of another size than was named.
    """
    with busy_bar("looking at the board"):
        if named.board is not None:
            if named.board.marks is not None:
                return Known(require_marks_of(files, named.board, most_pixels), Origin.OPTION)
            require_size(files, (named.board.columns, named.board.rows), most_pixels)
            return Known(named.board, Origin.OPTION)
        columns, rows = size_in_files(files, most_pixels)
    return Known(Board(columns, rows, named.square_mm / 1000), Origin.IMAGES)


def unseen_remedy(files: ViewFiles, board: Board, most_pixels: int) -> str:
    """Say what to do where a board was hardly found: for one with marks also what the images show instead.

    Args:
        files: the pairs of files.
        board: the board that was looked for.
        most_pixels: an image that claims more is passed over.
    """
    if board.marks is None:
        return _COUNT_CORNERS
    try:
        size = size_text(size_in_files(files, most_pixels))
    except DataError as error:
        return f"{error.problem}: {_COUNT_MARKS}"
    return f"these images show a chessboard of {size} inner corners: leave --board out, and give --square"
