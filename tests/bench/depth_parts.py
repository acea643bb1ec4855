"""Where in the rendered rooms a matcher is wrong: `python -m tests.bench.depth_parts [MATCHER...]`, 3WAY beside it.

For each kind of surface over all rooms: its share of the pixels that both cameras see, how many of them have a value,
bad2 of these, and wrong2 and right2 of all.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tests.bench.depth_accuracy import ANCHORS, MakeMatcher, by_maker, matching
from tests.bench.depth_rooms import PARTS, Room, rooms


@dataclass(frozen=True, slots=True)
class PartRow:
    """One kind of surface over all rooms, %."""

    part: str
    share: float
    density: float
    bad2: float
    wrong2: float
    right2: float


def evaluate_parts(matcher: str | MakeMatcher, seen: Sequence[Room]) -> list[PartRow]:
    """Match the rooms and count by surface.

    Args:
        matcher: a name (ours, or an anchor's), or a callable that makes a matcher from N.
        seen: the rooms.
    """
    match = matching(matcher) if isinstance(matcher, str) else by_maker(matcher)
    counts = np.zeros((3, len(PARTS)))
    for room in seen:
        found = match(room.left, room.right, room.disparities)
        counted = np.isfinite(room.truth)
        has = counted & (np.nan_to_num(found) > 0)
        off = has & (np.abs(found - room.truth) > 2)
        counts += [np.bincount(room.parts[mask], minlength=len(PARTS)) for mask in (counted, has, off)]
    rows = []
    for number, part in enumerate(PARTS):
        pixels, values, errors = counts[:, number].tolist()
        if pixels:
            bad2 = 100 * errors / values if values else 100.0
            shares = (100 * count / pixels for count in (errors, values - errors))
            rows.append(PartRow(part, 100 * pixels / counts[0].sum(), 100 * values / pixels, bad2, *shares))
    return rows


def main() -> None:
    """Print the tables."""
    seen = list(rooms())
    for name in (ANCHORS[0], *(sys.argv[1:] or ["sgbm"])):
        print(f"{name:10}   share density    bad2  wrong2  right2")
        for row in evaluate_parts(name, seen):
            print(
                f"  {row.part:10}{row.share:6.1f}  {row.density:6.1f}  {row.bad2:6.1f}  {row.wrong2:6.1f}  {row.right2:6.1f}"
            )


if __name__ == "__main__":
    main()
