"""Does the same to many things, several at a time. What it calls lets go of Python's lock: decoding, OpenCV."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Final, TypeVar

import cv2

A = TypeVar("A")
B = TypeVar("B")

_MOST: Final = 4
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
    with ThreadPoolExecutor(min(_MOST, max(1, cv2.getNumberOfCPUs())), thread_name_prefix="boards") as pool:
        waiting = [pool.submit(work, each) for each in things]
        try:
            for each in waiting:
                results.append(each.result())
                advance()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return results
