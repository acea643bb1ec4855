"""Answers a tap on the page: where that point lies, and how surely."""

import math
from collections.abc import Callable, Sequence
from typing import Final

from phone_host.run.seen_pair import FoundPoint, Outcome, Point, seen_pair
from phone_host.serve.shelf import Shelf, Shelved
from phone_host.stereo.measured_point import SIGMAS_95, Within, distance_between
from phone_host.web.source import Measured, Newest

_NO_DEPTH: Final = "this pair has no depth in metres: give a calibration, and run"
_GONE: Final = "this pair is no longer in memory: tap again"
_NOTHING: Final = "there is no pair yet: run first"


def answered(shelf: Shelf, points_px: Sequence[Point], number: int | None) -> Measured:
    """Measure points of a pair, as `phone-host measure` does.

    Args:
        shelf: holds the pairs.
        points_px: x, y of one or two points of the rectified left image, px.
        number: of the pair; None: the newest.
    """
    shelved = shelf.newest() if number is None else shelf.numbered(number)
    if shelved is None:
        return _unmeasured(len(points_px), _NOTHING if number is None else _GONE)
    return _measured(shelved, points_px)


class ShelfSource:
    """What every source of the page answers from its shelf."""

    def __init__(self) -> None:
        self._shelf = Shelf()

    def newest(self) -> Newest | None:
        """See Source."""
        found = self._shelf.newest()
        return None if found is None else found.newest

    def subscribe(self, told: Callable[[], None]) -> Callable[[], None]:
        """See Source."""
        return self._shelf.subscribe(told)

    def measure(self, points_px: Sequence[tuple[float, float]], number: int | None) -> Measured:
        """See Source."""
        return answered(self._shelf, points_px, number)


def _unmeasured(count: int, words: str) -> Measured:
    nothing = (None,) * count
    return Measured(places_m=nothing, distances_m=nothing, place_sigmas_m=nothing, words=words)


def _measured(shelved: Shelved, points_px: Sequence[Point]) -> Measured:
    seen = None if shelved.core is None else seen_pair(shelved.core, shelved.newest.result.processed)
    if seen is None:
        return _unmeasured(len(points_px), _NO_DEPTH)
    found = [seen.measured(point) if _is_place(point) else None for point in points_px]
    lengths = [each.point.distance if isinstance(each, FoundPoint) else None for each in found]
    first, second = (*found, None, None)[:2]
    between = (
        distance_between(first.point, second.point)
        if isinstance(first, FoundPoint) and isinstance(second, FoundPoint)
        else None
    )
    return Measured(
        places_m=tuple(_place(each) for each in found),
        distances_m=tuple(None if each is None else each.value_m for each in lengths),
        place_sigmas_m=tuple(None if each is None else _sigma(each) for each in lengths),
        length_m=None if between is None else between.value_m,
        length_sigma_m=None if between is None else _sigma(between),
        words="; ".join(_problem(number, each) for number, each in enumerate(found, 1) if not _is_found(each)),
    )


def _is_place(point: Point) -> bool:
    return all(map(math.isfinite, point))


def _is_found(outcome: Outcome | None) -> bool:
    return isinstance(outcome, FoundPoint)


def _problem(number: int, outcome: Outcome | None) -> str:
    assert not isinstance(outcome, FoundPoint)
    return f"point {number} {'has no depth' if outcome is None else outcome.problem}"


def _place(outcome: Outcome | None) -> tuple[float, float, float] | None:
    if not isinstance(outcome, FoundPoint):
        return None
    x, y, z = map(float, outcome.point.point_m)
    return x, y, z


def _sigma(length: Within) -> float | None:
    """Return the standard uncertainty of which these are the limits; None: it cannot be told from infinity."""
    return (length.high_m - length.low_m) / (2 * SIGMAS_95) if math.isfinite(length.high_m) else None
