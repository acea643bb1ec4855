"""Whether the times of a stream's images can be true, and which images of two streams belong together. Pure.

Stamps of other programs are claims: drivers leave them zero, copy one to all, or count in another unit. What cannot be true is never used.
"""

import statistics
from bisect import bisect_left
from collections.abc import Sequence
from enum import Enum
from itertools import pairwise
from typing import Final

NS: Final = 1_000_000_000
MIN_HZ: Final = 0.1
MAX_HZ: Final = 1000.0
"""Images per second that a camera for stereo can have, with room on both sides."""


class StampFault(Enum):
    """Why the times of a stream's images cannot be true, in words."""

    ZERO = "are zero"
    EQUAL = "are equal for several images"
    BACKWARDS = "run backwards"
    TOO_SLOW = "are further apart than 10 s"
    TOO_FAST = "are closer together than 1 ms"


def stamp_fault(stamps_ns: Sequence[int], *, is_zero_a_time: bool = False) -> StampFault | None:
    """Return why the times of one stream cannot be true.

    Args:
        stamps_ns: the times of its images in the order in which they came, ns since any moment.
        is_zero_a_time: whether they may count from the first image on, as data sets do.

    Returns:
        The fault; None: they can be true.
    """
    if 0 in stamps_ns and not is_zero_a_time:
        return StampFault.ZERO
    between = [after - before for before, after in pairwise(stamps_ns)]
    if not between:
        return None
    if min(between) < 0:
        return StampFault.BACKWARDS
    if min(between) == 0:
        return StampFault.EQUAL
    rate_hz = NS / statistics.median(between)
    if rate_hz < MIN_HZ:
        return StampFault.TOO_SLOW
    return StampFault.TOO_FAST if rate_hz > MAX_HZ else None


def nearest(stamps_ns: Sequence[int], at_ns: int) -> int:
    """Return the place of the stamp that is nearest to a time; the stamps ascend, and there is one."""
    after = bisect_left(stamps_ns, at_ns)
    around = range(max(0, after - 1), min(len(stamps_ns), after + 1))
    return min(around, key=lambda place: abs(stamps_ns[place] - at_ns))


def pairs_of_two(first_ns: Sequence[int], second_ns: Sequence[int], most_ns: int) -> list[tuple[int, int]]:
    """Return the places of images that are each other's nearest in time, in order.

    Args:
        first_ns: exposures of the first stream, ascending.
        second_ns: exposures of the second stream, ascending.
        most_ns: greatest time between two images that belong together.
    """
    found = []
    for place, at_ns in enumerate(first_ns):
        mate = nearest(second_ns, at_ns) if second_ns else -1
        if mate >= 0 and abs(second_ns[mate] - at_ns) <= most_ns and nearest(first_ns, second_ns[mate]) == place:
            found.append((place, mate))
    return found
