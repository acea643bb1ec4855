"""Checks in some images, several at a time, which size of chessboard fits them: what was seen of a board may be a part of it.

A detector that grows a lattice ends early at glare, a hand or a narrow margin, and in many images at the same row. The detector that
looks for a size finds it there nevertheless. It finds parts of a board, too; so the largest size that fits is the board's.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Final, TypeVar

import cv2

from phone_host.calibration.target.corners import Board, find_corners, is_outlined
from phone_host.model import Image

A = TypeVar("A")
B = TypeVar("B")

_MOST_THREADS: Final = 4
"""Each may hold an image of 50 megapixels (150 MB) and its copies."""


def side_by_side(work: Callable[[A], B], things: Sequence[A], advance: Callable[[], None] = lambda: None) -> list[B]:
    """Do the same to all things.

    Args:
        work: what to do; must not touch what another call changes.
        things: to what.
        advance: called in this thread after each, in order, for a progress bar.

    Returns:
        The results, in the order of the things.

    Raises:
        Exception: whatever `work` raises first; what has not begun is not done.
    """
    results: list[B] = []
    with ThreadPoolExecutor(min(_MOST_THREADS, max(1, cv2.getNumberOfCPUs())), thread_name_prefix="boards") as pool:
        waiting = [pool.submit(work, each) for each in things]
        try:
            for each in waiting:
                results.append(each.result())
                advance()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return results


Inner = tuple[int, int]
"""How many inner corners a chessboard has each way: the larger count first."""

ENOUGH: Final = 4
"""So many images tell. Of 174 images of four real rigs the quick search finds the right size in all, a larger one in one."""

_FIRST: Final = 2
"""A size that fits none of so many is given up: 30 ms each, where it is not found."""

_ANY_SIDE_M: Final = 0.01
_LEAST, _MOST = 3, 100


@dataclass(frozen=True, slots=True)
class Fits:
    """Some images, and what fits them.

    Attributes:
        images: (H, W) uint8 each, small, in which a part of a board was seen; the best first.
    """

    images: Sequence[Image]
    _counts: dict[Inner, int] = field(default_factory=dict)

    def count(self, size: Inner) -> int:
        """Return how many images a size fits; 0 if the first ones show none."""
        if size not in self._counts:
            self._counts[size] = self._counted(size)
        return self._counts[size]

    def holds(self, size: Inner) -> bool:
        """Return whether a size fits more than half of the images."""
        return 2 * self.count(size) > len(self.images)

    def grown(self, size: Inner) -> Inner:
        """Return the largest size that holds and of which the given one is a part; the given one, if there is none."""
        while True:
            columns, rows = size
            larger = (_sized(columns + 1, rows), _sized(columns, rows + 1), _sized(columns + 1, rows + 1))
            best = max(larger, key=self.count)  # of equals the first: one step at a time
            if not self.holds(best):
                return size
            size = best

    def rivals(self, size: Inner, other: Inner) -> bool:
        """Return whether a size fits half as many images as another one: of some it fits one in 26 by mistake."""
        board = Board(*size, _ANY_SIDE_M)
        return 2 * sum(side_by_side(lambda image: is_outlined(image, board), self.images)) >= self.count(other) > 0

    def shows(self, board: Board) -> bool:
        """Return whether the full search finds a board in any of the images."""
        return any(side_by_side(lambda image: len(find_corners(image, board)) > 0, self.images))

    def _counted(self, size: Inner) -> int:
        if not _LEAST <= min(size) <= max(size) <= _MOST:
            return 0
        board = Board(*size, _ANY_SIDE_M)
        first = sum(side_by_side(lambda image: is_outlined(image, board), self.images[:_FIRST]))
        return first and first + sum(side_by_side(lambda image: is_outlined(image, board), self.images[_FIRST:]))


def _sized(columns: int, rows: int) -> Inner:
    return max(columns, rows), min(columns, rows)
