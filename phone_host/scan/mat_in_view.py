"""Whether a printed mat is in view of a scan that does not use it. Pure."""

from dataclasses import dataclass
from typing import Final

from phone_host.calibration.target.board_names import family_name
from phone_host.calibration.target.marked import Charuco, MarkFamily
from phone_host.calibration.target.marks_seen import find_marks, squares_of
from phone_host.model import Image
from phone_host.scan.mat import USUAL_MAT, parse_mat
from phone_host.stereo.images import to_grey

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
    """Looks for a printed mat in the first pairs of a scan."""

    def __init__(self) -> None:
        self._pairs = 0
        self._result: MatInView | None = None

    @property
    def result(self) -> MatInView | None:
        """The mat that was found; None: none was."""
        return self._result

    def take(self, left: Image) -> bool:
        """Look for a mat in the next pair, if it is one of those that are searched.

        Args:
            left: its left image, (H, W) grey or (H, W, 3) BGR, uint8.

        Returns:
            Whether a mat was found in this pair, and in none before.
        """
        number, self._pairs = self._pairs, self._pairs + 1
        if self._result is not None or (number >= _FIRST_PAIRS and number & (number - 1)):
            return False
        self._result = mat_in_view(to_grey(left))
        return self._result is not None


def mat_in_view(grey: Image) -> MatInView | None:
    """Find a printed mat of any size in an image: six marks or more that lie as on a ChArUco sheet. None: there is none.

    Args:
        grey: (H, W) uint8.
    """
    usual = parse_mat(USUAL_MAT).board
    assert isinstance(usual.marks, Charuco)
    expected = {usual.marks.family: (usual.columns + 1, usual.rows + 1)}
    for family in _FAMILIES:
        seen = find_marks([grey], [family])
        squares = None if seen is None else squares_of(seen, expected.get(family))
        if squares is not None:
            return MatInView(*squares, family)
    return None
