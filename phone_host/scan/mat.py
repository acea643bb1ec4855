"""The printed mat that objects are laid on: which one, where its corners are seen, and whether one is in view that nobody uses. Pure.

A mat is a ChArUco sheet. Its axes: the origin in the sheet's middle, x along its rows, y away from its last row, z up, out of the paper.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.errors import SettingsError
from phone_host.calibration.target.board_names import board_name, family_name, named_board
from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.marked import Charuco, MarkFamily, marked_corners
from phone_host.calibration.target.marks_seen import find_marks, squares_of
from phone_host.model import Image
from phone_host.scan.blocks import Box
from phone_host.stereo.images import to_grey

Floats = NDArray[np.float64]

USUAL_MAT: Final = "10x8:25mm:18mm:5x5"
"""The sheet of `phone-host target mat`: squares, side of a square, side of a mark, family."""

_KIND: Final = "charuco:"

ABOVE_M: Final = 0.0025
"""What is lower is the sheet: paper is not flat to a millimetre, and neither is its depth."""

_HEIGHT_SHARE: Final = 2.0
"""Of the longer side of the sheet: higher things do not stand on it."""


@dataclass(frozen=True, slots=True)
class Mat:
    """A sheet to lay objects on.

    Attributes:
        board: its corners, with marks that tell them apart.
    """

    board: Board

    @property
    def name(self) -> str:
        """As `parse_mat` reads it."""
        return board_name(self.board).removeprefix(_KIND)

    @property
    def size_m(self) -> tuple[float, float]:
        """Width and height of the printed squares, m."""
        return (self.board.columns + 1) * self.board.square_m, (self.board.rows + 1) * self.board.square_m

    @property
    def room(self) -> Box:
        """The room above it, in its axes."""
        width, height = self.size_m
        return Box((-width / 2, -height / 2, ABOVE_M), (width / 2, height / 2, _HEIGHT_SHARE * max(width, height)))

    def points_m(self) -> Floats:
        """Return its corners in the order of `Board.points_m`, (N, 3), m, in the mat's axes."""
        board = self.board
        middle = np.array([board.columns - 1, board.rows - 1, 0]) * board.square_m / 2
        return np.asarray((board.points_m() - middle) * [1.0, -1.0, 1.0], np.float64)


def parse_mat(text: str) -> Mat:
    """Read a mat.

    Args:
        text: squares, side of a square, side of a mark and ArUco family, as in "10x8:25mm:18mm:5x5".

    Raises:
        SettingsError: it is none.
    """
    name = text.strip().lower().removeprefix(_KIND)
    try:
        return Mat(named_board(_KIND + name, None))
    except SettingsError as error:
        raise SettingsError(
            f"--mat is {text!r}",
            f"give squares, side of a square, side of a mark and family, as in --mat {USUAL_MAT}, the sheet of `phone-host target mat`",
        ) from error


@dataclass(frozen=True, slots=True, eq=False)
class MatCorners:
    """The mat's corners in both images of a rectified pair.

    Attributes:
        left_px: (N, 2) px, NaN = not seen.
        right_px: (N, 2) px, likewise.
    """

    left_px: Floats
    right_px: Floats

    @property
    def counts(self) -> tuple[int, int]:
        """How many are seen, left and right."""
        return _count(self.left_px), _count(self.right_px)


def mat_corners(left: Image, right: Image, mat: Mat) -> MatCorners:
    """Find a mat's corners in a rectified pair, (H, W) uint8 grey each."""
    return MatCorners(_found(left, mat), _found(right, mat))


def _found(grey: Image, mat: Mat) -> Floats:
    board = mat.board
    assert board.marks is not None
    return marked_corners(grey, board.columns, board.rows, board.marks)


def _count(corners: Floats) -> int:
    return int(np.isfinite(corners).all(axis=1).sum())


_FIRST_PAIRS: Final = 5
"""These are searched, and then pairs 8, 16, 32 ...: so a long scan costs hardly more than a short one."""

_FAMILIES: Final = (MarkFamily.ARUCO_5X5, MarkFamily.ARUCO_4X4, MarkFamily.ARUCO_6X6)
"""Of mats, that of `phone-host target mat` first."""


@dataclass(frozen=True, slots=True)
class MatInView:
    """A printed mat that a pair shows.

    Attributes:
        columns: squares in a row.
        rows: squares in a column, as far as they are in view.
        family: of its marks.
    """

    columns: int
    rows: int
    family: MarkFamily

    @property
    def option(self) -> str:
        """The option that uses it; sides that an image does not tell are left to the user."""
        usual = parse_mat(USUAL_MAT).board
        assert isinstance(usual.marks, Charuco)
        if (self.columns, self.family) == (usual.columns + 1, usual.marks.family) and self.rows <= usual.rows + 1:
            return "--mat"
        return f"--mat {self.columns}xROWS:SQUARE:MARK:{family_name(self.family).removeprefix('ArUco ')}"


class MatDetector:
    """Looks for a printed mat in the first pairs of a scan.

    Attributes:
        result: the mat that was found; None: none was.
    """

    def __init__(self) -> None:
        self._pairs = 0
        self.result: MatInView | None = None

    def take(self, left: Image) -> bool:
        """Look for a mat in the next pair, if it is one of those that are searched.

        Args:
            left: its left image, (H, W) grey or (H, W, 3) BGR, uint8.

        Returns:
            Whether a mat was found in this pair, and in none before.
        """
        number, self._pairs = self._pairs, self._pairs + 1
        if self.result is not None or (number >= _FIRST_PAIRS and number & (number - 1)):
            return False
        self.result = mat_in_view(to_grey(left))
        return self.result is not None


def mat_in_view(grey: Image) -> MatInView | None:
    """Find a printed mat of any size in a grey image (H, W): six marks or more that lie as on a ChArUco sheet. None: there is none."""
    usual = parse_mat(USUAL_MAT).board
    assert isinstance(usual.marks, Charuco)
    expected = {usual.marks.family: (usual.columns + 1, usual.rows + 1)}
    for family in _FAMILIES:
        seen = find_marks([grey], [family])
        squares = None if seen is None else squares_of(seen, expected.get(family))
        if squares is not None:
            return MatInView(*squares, family)
    return None
