"""Finds a board fast enough for moving pictures: small, and near where it was.

What it finds is good to half a pixel, which tells whether a view is wanted and still. The corners of a view that is taken are found
anew, as `calibrate` does it in files.
"""

from collections import Counter, deque
from typing import Final

import cv2
import numpy as np

from common.errors import DataError, SettingsError
from common.imagesize.head import size_text
from phone_host.calibration.target.board_fits import ENOUGH, Fits, Inner, side_by_side
from phone_host.calibration.target.board_names import board_name
from phone_host.calibration.target.board_size import (
    Vote,
    size_in_pictures,
    size_seen,
    small_for_sizes,
    whole_size_seen,
)
from phone_host.calibration.target.corners import Board, Corners, agree, find_corners, order_by_colour
from phone_host.calibration.target.marks_seen import find_marks, require_marks
from phone_host.calibration.target.small_picture import shrunk
from phone_host.model import Image

_SEARCHED_PX: Final = 480
"""Longer side of what is searched: 10 ms for each image. Squares of 10 px are found."""

_AROUND: Final = 0.35
"""A board is looked for in its former place, widened by this share of its size."""

_NONE: Final = np.empty((0, 2))

_MARKS_PX: Final = 1280
"""Longer side of what is searched for marks of any family."""

_PATIENT_LOOKS: Final = 12
"""A board of the given size that is not found so often may have another size."""


class BoardFinder:
    """Finds one board in pair after pair."""

    def __init__(self, board: Board) -> None:
        self._board = board
        self._former: list[Corners] = [_NONE, _NONE]

    def find(self, left: Image, right: Image) -> tuple[Corners, Corners]:
        """Find the board in both images of a pair, roughly.

        Returns:
            The corners in both, (N, 2) px, each empty if it was not found.
        """
        seen = side_by_side(
            lambda side: self._near(side[0], side[1]), list(zip((left, right), self._former, strict=True))
        )
        if len(seen[0]) and len(self._former[0]):
            seen[0] = agree(self._former[0], seen[0], self._board)
        seen[1] = _paired(seen[0], seen[1], self._board)
        self._former = seen
        return seen[0], seen[1]

    def find_exactly(self, left: Image, right: Image) -> tuple[Corners, Corners]:
        """Find the board in both images of a pair, as exactly as `calibrate` does. Arguments and result as those of `find`."""
        one, other = side_by_side(lambda grey: find_corners(grey, self._board), (left, right))
        return one, _paired(one, other, self._board)

    def _near(self, grey: Image, former: Corners) -> Corners:
        """Look where the board was, then everywhere."""
        if self._board.marks is not None:
            return find_corners(grey, self._board)
        if len(former):
            x0, y0, x1, y1 = _around(former, grey)
            found = self._in(grey[y0:y1, x0:x1])
            if len(found):
                found += (x0, y0)
                return found
        return self._in(grey)

    def _in(self, grey: Image) -> Corners:
        searched, factors = shrunk(grey, min(1.0, _SEARCHED_PX / max(grey.shape)))
        size = self._board.columns, self._board.rows
        found, corners = cv2.findChessboardCornersSB(searched, size, flags=cv2.CALIB_CB_NORMALIZE_IMAGE)
        if not found:
            return _NONE
        ordered = order_by_colour(np.asarray(corners, np.float64).reshape(-1, 2), searched, self._board)
        return (ordered + 0.5) / factors - 0.5


_APART_LOOKS: Final = 8
_PICTURES: Final = 12
"""A board whose margin is never seen, as it may have none, is counted in so many pictures that are so many looks apart: some ten seconds."""


class SizeFinder:
    """Finds out which chessboard a person shows, from pair after pair.

    Whole boards count: the first one that is seen is often half outside. A board without a white margin never looks whole; it is
    counted as in files, once there are enough pictures of it.

    Args:
        square_m: side of its squares, m.
        apart_looks: one picture in so many looks is kept, for a board without a margin.
        pictures: so many of them tell.
    """

    def __init__(self, square_m: float, *, apart_looks: int = _APART_LOOKS, pictures: int = _PICTURES) -> None:
        self._square_m, self._apart_looks, self._enough = square_m, apart_looks, pictures
        self._vote = Vote(0, Counter())
        self._seen: deque[Image] = deque(maxlen=ENOUGH)
        self._looks = 0
        self._pictures: list[Image] = []

    def find(self, left: Image, right: Image) -> Board | None:
        """Look at a pair; return the board once enough of them agree.

        Raises:
            DataError: the person shows a board of coded marks.
        """
        sizes = side_by_side(whole_size_seen, (left, right))
        self._vote = Vote(self._vote.asked + 2, self._vote.sizes + Counter(size for size in sizes if size is not None))
        self._seen.extend(small_for_sizes(grey) for grey, size in zip((left, right), sizes, strict=True) if size)
        size = self._vote.leader if self._vote.is_over else self._without_margin(left)
        if size is None:
            return None
        # What grows a lattice ends at glare or a hand, and in picture after picture at the same row.
        if self._seen:
            size = Fits(tuple(self._seen)).grown(size)
        if marks := find_marks([left, right]):
            raise DataError(f"this is no chessboard: it has {marks.words}", "name that board with --board; see --help")
        return Board(*size, self._square_m)

    def _without_margin(self, grey: Image) -> Inner | None:
        self._looks += 1
        if self._looks % self._apart_looks or size_seen(grey) is None:
            return None
        self._pictures.append(small_for_sizes(grey))
        if len(self._pictures) < self._enough:
            return None
        pictures, self._pictures = self._pictures, []
        return size_in_pictures(pictures)


class SizeCheck:
    """Notices that a person shows a chessboard of another size than was given, or other marks."""

    def __init__(self, board: Board) -> None:
        self._board = board
        self._finder = SizeFinder(board.square_m)
        self._looks = 0

    def missed(self, left: Image, right: Image) -> None:
        """Take note of a pair in which the board was not found.

        Raises:
            SettingsError: several pairs show a board of another size, or one shows other marks.
        """
        self._looks += 1
        if self._looks < _PATIENT_LOOKS:
            return
        if self._board.marks is not None:
            if self._looks % _PATIENT_LOOKS == 0:  # all families take 0.2 s
                self._require_marks(left, right)
            return
        shown = self._finder.find(left, right)
        given: Inner = (self._board.columns, self._board.rows)
        if shown is not None and {shown.columns, shown.rows} != set(given):
            size = size_text((shown.columns, shown.rows))
            raise SettingsError(
                f"this board has {size} inner corners, --board says {size_text(given)}",
                f"give --board {size}, or leave --board out",
            )

    def _require_marks(self, left: Image, right: Image) -> None:
        seen = find_marks([shrunk(grey, min(1.0, _MARKS_PX / max(grey.shape)))[0] for grey in (left, right)])
        shown = require_marks(seen, self._board)
        if shown != self._board:
            raise SettingsError(
                f"this board's marks are arranged otherwise than --board {board_name(self._board)} says",
                f"give --board {board_name(shown)}: OpenCV before 4.6 and calib.io begin with a white square (legacy)",
            )


def _paired(left: Corners, right: Corners, board: Board) -> Corners:
    return agree(left, right, board) if len(left) and len(right) else right


def _around(corners: Corners, grey: Image) -> tuple[int, int, int, int]:
    low, high = np.nanmin(corners, axis=0), np.nanmax(corners, axis=0)
    margin = (high - low).max() * _AROUND
    height, width = grey.shape
    x0, y0 = np.maximum(low - margin, 0).astype(int)
    x1, y1 = np.minimum(high + margin + 1, (width, height)).astype(int)
    return int(x0), int(y0), int(x1), int(y1)
