"""Which images of two streams belong together, as numbers that each of two programs finds in the same file for itself. Pure.

A pair is two images that are each other's nearest in time, within half of the longer period. Both get the same number; images between
have numbers of their own.
"""

from bisect import bisect_left
from collections.abc import Sequence
from typing import Final

_BETWEEN: Final = 16
"""Numbers for each image of the first stream. A second camera that is faster than 15 times the first is none that pairs."""


def nearest(stamps_ns: Sequence[int], at_ns: int) -> int:
    """Return the place of the stamp that is nearest to a time; the stamps ascend, and there is one."""
    after = bisect_left(stamps_ns, at_ns)
    around = range(max(0, after - 1), min(len(stamps_ns), after + 1))
    return min(around, key=lambda place: abs(stamps_ns[place] - at_ns))


def numbers_of_two(first_ns: Sequence[int], second_ns: Sequence[int], most_ns: int) -> tuple[list[int], list[int]]:
    """Return a number for each image of both streams, ascending.

    Args:
        first_ns: exposures of the first stream, ascending.
        second_ns: exposures of the second stream, ascending.
        most_ns: greatest time between two images that belong together.
    """
    first = [_BETWEEN * (place + 1) for place in range(len(first_ns))]
    second: list[int] = []
    for place, at_ns in enumerate(second_ns):
        lowest = second[-1] + 1 if second else 0
        mate = nearest(first_ns, at_ns) if first_ns else -1
        is_pair = mate >= 0 and abs(first_ns[mate] - at_ns) <= most_ns and nearest(second_ns, first_ns[mate]) == place
        if is_pair:
            second.append(max(lowest, first[mate]))
            continue
        before = bisect_left(first_ns, at_ns)
        second.append(max(lowest, _BETWEEN * before + 1))
    return first, second
