"""Recognises boards of coded marks (ChArUco, AprilGrid) where a chessboard, or another such board, was looked for. Pure.

A mark's number tells its place on a board that has so many columns. Seen through any camera the right places lie under one
homography, lenses aside; those of a board with other columns do not, because its rows end elsewhere.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import cv2
import numpy as np

from common.errors import SettingsError
from phone_host.calibration.target.board_names import board_name, family_name
from phone_host.calibration.target.corners import Board
from phone_host.calibration.target.marked import AprilGrid, Charuco, Corners, MarkFamily
from phone_host.model import Image

_BORDERS: Final = {MarkFamily.APRILTAG_36H11: (2, 1)}
"""Bits of black around the code: Kalibr prints two, all others one."""

_LEAST: Final = 3
"""In noise single marks of the large 4x4 family are seen; never several in one image."""

_LEAST_PLACED: Final = 6
"""So many marks, not all in two rows, tell where rows end."""

_MARGIN: Final = 2
"""So many marks more must one arrangement explain. With an odd number of columns the two differ at the ends of rows alone."""

_COLUMNS: Final = range(3, 41)
_NEAR: Final = 0.3
"""Of the distance to the nearest other mark: lenses bend a board by less, and a wrong place is off by a whole one."""

_EXPLAINED, _UNEXPLAINED = 0.8, 0.7
"""Shares of the marks. With too few or too many columns at most some two thirds of the marks fit: those before the ends of rows."""


@dataclass(frozen=True, slots=True)
class SeenMarks:
    """The marks of one family in some images: of each image the middles by number, px."""

    family: MarkFamily
    middles_px: tuple[dict[int, Corners], ...]

    @property
    def words(self) -> str:
        """Which family, in words."""
        return f"marks of the family {family_name(self.family)}"


def find_marks(images: Sequence[Image | None], families: Sequence[MarkFamily] = tuple(MarkFamily)) -> SeenMarks | None:
    """Find the marks that most images show; None: there are none. Images that could not be read are None."""
    seen = {family: tuple(_marks(grey, family) for grey in images if grey is not None) for family in families}
    counts = {family: sum(map(len, middles)) for family, middles in seen.items()}
    best = max(counts, key=counts.__getitem__)
    return SeenMarks(best, seen[best]) if counts[best] else None


def require_marks(seen: SeenMarks | None, board: Board) -> Board:
    """Check that marks are those of a board; what cannot be told passes.

    ChArUco boards of OpenCV before 4.6 and of calib.io are recognised by where their marks lie.

    Returns:
        The board, with the arrangement that the marks have.

    Raises:
        SettingsError: they are of another family, or of a board of another size.
    """
    if seen is None or board.marks is None:
        return board
    given = board.marks.family if isinstance(board.marks, Charuco) else MarkFamily.APRILTAG_36H11
    is_charuco = seen.family is not MarkFamily.APRILTAG_36H11
    wanted = _counted(board)
    board = _as_arranged(seen, board) if seen.family is given else board
    found = _size(seen, wanted if seen.family is given else None, is_legacy=_is_legacy(board))
    if seen.family is given and found in {None, wanted}:
        return board
    size = "" if found is None else f" and {found[0]}x{found[1]} {'squares' if is_charuco else 'tags'}"
    kind = "charuco" if is_charuco else "aprilgrid"
    right = f"{kind}:{'COLUMNSxROWS' if found is None else f'{found[0]}x{found[1]}'}"
    sides = board_name(board).split(":")[2:4] if isinstance(board.marks, Charuco) is is_charuco else ["25mm", "18mm"]
    family = [family_name(seen.family).removeprefix("ArUco ")] if is_charuco else []
    raise SettingsError(
        f"these boards have {seen.words}{size}, --board says {board_name(board)}",
        f"give --board {':'.join([right, *sides, *family])}, with its sides as you measure them",
    )


def squares_of(seen: SeenMarks, expected: tuple[int, int] | None) -> tuple[int, int] | None:
    """Return squares in a row and in a column of the ChArUco sheet that shows these marks, as far as they are seen; None: they lie as on no sheet.

    Args:
        seen: the marks.
        expected: a size that is right unless the marks contradict it; None: there is none.
    """
    return _size(seen, expected, is_legacy=False)


def _is_legacy(board: Board) -> bool:
    return isinstance(board.marks, Charuco) and board.marks.is_legacy


def _as_arranged(seen: SeenMarks, board: Board) -> Board:
    """Return the board with the arrangement that explains the marks of more images; as it is where that cannot be told."""
    columns, rows = _counted(board)
    if not isinstance(board.marks, Charuco) or rows % 2:
        return board
    votes = Counter[bool]()
    for middles in seen.middles_px:
        if len(middles) >= _LEAST_PLACED:
            fits = {
                legacy: len(_fitting(middles, columns, is_charuco=True, is_legacy=legacy)) for legacy in (False, True)
            }
            best = max(fits, key=fits.__getitem__)
            if fits[best] >= _EXPLAINED * len(middles) and fits[best] - fits[not best] >= _MARGIN:
                votes[best] += 1
    is_legacy = votes.most_common(1)[0][0] if votes else board.marks.is_legacy
    return replace(board, marks=replace(board.marks, is_legacy=is_legacy))


def _marks(grey: Image, family: MarkFamily) -> dict[int, Corners]:
    """Return the middles of several marks, (2,) px, by their numbers; nothing where there are fewer."""
    dictionary = cv2.aruco.getPredefinedDictionary(family.value)
    for border in _BORDERS.get(family, (1,)):
        parameters = cv2.aruco.DetectorParameters()
        parameters.markerBorderBits = border
        corners, ids, _ = cv2.aruco.ArucoDetector(dictionary, parameters).detectMarkers(grey)
        numbers = [int(number) for number in np.asarray(ids).ravel()] if len(corners) else []
        if len(set(numbers)) >= _LEAST:
            middles = [np.asarray(four, np.float64).reshape(4, 2).mean(axis=0) for four in corners]
            return dict(zip(numbers, middles, strict=True))
    return {}


def _counted(board: Board) -> tuple[int, int]:
    """Return squares or tags in a row and in a column."""
    if isinstance(board.marks, AprilGrid):
        return board.columns // 2, board.rows // 2
    return board.columns + 1, board.rows + 1


def _size(seen: SeenMarks, wanted: tuple[int, int] | None, *, is_legacy: bool) -> tuple[int, int] | None:
    """Return squares or tags in a row and in a column, as far as they are seen; None: it cannot be told.

    Args:
        seen: the marks.
        wanted: a size that is right unless the marks contradict it; None: there is none.
        is_legacy: the arrangement of the marks at that size.
    """
    is_charuco = seen.family is not MarkFamily.APRILTAG_36H11
    votes, last = Counter[int](), Counter[int]()
    for middles in seen.middles_px:
        fitting = _columns(middles, None if wanted is None else wanted[0], is_charuco=is_charuco, is_legacy=is_legacy)
        if fitting is not None:
            votes[fitting[0]] += 1
            last[fitting[0]] = max(last[fitting[0]], fitting[1])
    if not votes:
        return None
    columns = votes.most_common(1)[0][0]
    rows = int(_places([last[columns]], columns, is_charuco=is_charuco)[0, 1]) + 1
    if wanted is not None and columns == wanted[0] and rows <= wanted[1]:
        return wanted  # the last rows may not be in the picture
    return columns, rows


def _columns(
    middles: dict[int, Corners], wanted: int | None, *, is_charuco: bool, is_legacy: bool
) -> tuple[int, int] | None:
    """Return how many columns explain the marks of an image, and the last mark that is so explained; None: it cannot be told."""
    if len(middles) < _LEAST_PLACED:
        return None
    least = _EXPLAINED * len(middles)
    given = [] if wanted is None else _fitting(middles, wanted, is_charuco=is_charuco, is_legacy=is_legacy)
    if wanted is not None and len(given) >= least:
        return wanted, max(given)
    fits = {
        columns: max(
            (
                _fitting(middles, columns, is_charuco=is_charuco, is_legacy=legacy)
                for legacy in ((False, True) if is_charuco else (False,))
            ),
            key=len,
        )
        for columns in _COLUMNS
    }
    best = max(fits, key=lambda columns: len(fits[columns]))
    others = max(len(fits[each]) for each in fits if each != best)
    if len(fits[best]) < least or others > _UNEXPLAINED * len(fits[best]):
        return None
    return best, max(fits[best])


def _fitting(middles: dict[int, Corners], columns: int, *, is_charuco: bool, is_legacy: bool) -> list[int]:
    """Return the numbers of the marks that lie where a board with so many columns has them."""
    numbers = list(middles)
    plan, found = (
        _places(numbers, columns, is_charuco=is_charuco, is_legacy=is_legacy),
        np.array(list(middles.values())),
    )
    if np.linalg.matrix_rank(plan - plan.mean(axis=0)) < plan.shape[1]:
        return []
    apart = np.linalg.norm(found[:, np.newaxis] - found, axis=2)
    np.fill_diagonal(apart, np.inf)
    view, inside = cv2.findHomography(plan, found, cv2.RANSAC, _NEAR * float(np.median(apart.min(axis=1))))
    if np.ndim(view) == 0:
        return []
    return [number for number, is_inside in zip(numbers, inside.ravel(), strict=True) if is_inside]


def _places(numbers: list[int], columns: int, *, is_charuco: bool, is_legacy: bool = False) -> Corners:
    """Return column and row of marks, (N, 2): row by row, of a ChArUco board on the white squares alone."""
    if not is_charuco:
        return np.array([(number % columns, number // columns) for number in numbers], np.float64)
    rows = 2 * max(numbers) // columns + 2
    white = [(column, row) for row in range(rows) for column in range(columns) if (row + column + is_legacy) % 2]
    return np.array([white[number] for number in numbers], np.float64)
