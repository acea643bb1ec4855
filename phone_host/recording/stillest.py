"""Which moments of a film are worth a picture: those at which least moved. Pure.

A camera's rows are not exposed at once, and two cameras not at one moment: what moves then is bent, or stands in two places.
"""

import math
from collections.abc import Sequence
from typing import Final

NS: Final = 1_000_000_000
_LEAST_NS: Final = NS
"""A person who shows a board holds each pose for about two seconds."""

MOST: Final = 100
"""More views add nothing to a calibration, and cost a minute."""


def stillest(stamps_ns: Sequence[int], changes: Sequence[float]) -> list[int]:
    """Return the places of one moment for each second: the one at which least moved.

    Args:
        stamps_ns: of the moments, ascending.
        changes: how much each image differs from the one before; NaN: it cannot be told. As many as moments.

    Returns:
        Ascending; at most `MOST`: of a longer film one for each hundredth of it.
    """
    if not stamps_ns:
        return []
    begin_ns = stamps_ns[0]
    every_ns = max(_LEAST_NS, -(-(stamps_ns[-1] - begin_ns + 1) // MOST))
    best: dict[int, tuple[float, int]] = {}
    for place, at_ns in enumerate(stamps_ns):
        around = [change for change in changes[place : place + 2] if not math.isnan(change)]
        found = max(around, default=math.inf), place
        slot = (at_ns - begin_ns) // every_ns
        best[slot] = min(found, best.get(slot, found))
    return [place for _, place in best.values()]
