"""Which images of two streams belong together, so that two programs that open the same file find the same pairs each for itself. Pure."""

from bisect import bisect_left
from collections.abc import Sequence


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
