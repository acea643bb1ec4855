"""When the images of a data set were exposed: what its names and files say, in which unit, or a rate. Pure.

A number is no time because a file says so: its unit is the one in which it is a date between 1990 and 2100, else the only one in which the images
come at a rate that a camera can have. Where several are left, nobody guesses.
"""

import math
import statistics
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal, InvalidOperation
from enum import Enum
from itertools import pairwise
from typing import Final

from common.errors import DataError
from common.recording.mcap_records import Damage
from common.recording.stamps import MAX_HZ, MIN_HZ, NS, stamp_fault

EPOCH_NS: Final = 946_684_800 * NS
"""1 January 2000: from when images count of which nothing but their rate is known."""

_FIRST_DATE_S: Final = 631_152_000
_LAST_DATE_S: Final = 4_102_444_800
"""1990 and 2100: a date lies between them in one unit only."""

_LONGEST: Final = 40


class Unit(Enum):
    """A unit of time, as `--stamps-in` names it."""

    S = "s"
    MS = "ms"
    US = "us"
    NS = "ns"

    @property
    def ns(self) -> int:
        """How long it is, ns."""
        return {Unit.S: NS, Unit.MS: 1_000_000, Unit.US: 1000, Unit.NS: 1}[self]


def numbers_in(texts: Sequence[str], name: str) -> list[Decimal]:
    """Read times as numbers.

    Args:
        texts: the times, as they are written.
        name: of the file, for the error.

    Raises:
        DataError: one is no number.
    """
    found = []
    for text in texts:
        try:
            number = Decimal(text.strip())
        except InvalidOperation:
            number = Decimal("NaN")
        if not number.is_finite() or abs(number) >= 2**62:
            raise DataError(f"{name}: {text[:_LONGEST]!r} is no time", "give seconds, or whole nanoseconds")
        found.append(number)
    return found


def times_ns(numbers: Sequence[Decimal], unit: Unit | None, name: str, *, are_times: bool = True) -> list[int]:
    """Return times in ns.

    Args:
        numbers: of one camera's images, in their order.
        unit: in which they are; None: what is plausible.
        name: of the file or folder, for errors.
        are_times: whether they are known to be times; else only dates are taken for some.

    Raises:
        DataError: the unit is not known, or they cannot be true.
    """
    known = unit or _unit(numbers, name, are_times=are_times)
    found = [round(number * known.ns) for number in numbers]
    fault = stamp_fault(found, is_zero_a_time=True)
    if fault is not None:
        raise DataError(
            f"{name}: the times {fault.value}, taken as {known.value}",
            "give their unit as --stamps-in s|ms|us|ns, or the rate as --fps N",
        )
    if max(map(abs, found), default=0) >= 2**62:
        raise DataError(f"{name}: the times are beyond all dates", "give their unit as --stamps-in s|ms|us|ns")
    return found


def _unit(numbers: Sequence[Decimal], name: str, *, are_times: bool) -> Unit:
    if not numbers:
        return Unit.S
    dated = dated_unit(numbers)
    if dated is not None:
        return dated
    if not are_times:
        raise DataError(
            f"the images in {name} have no times",
            "give --times FILE, one time a line, the rate as --fps N, or the unit of the names as --stamps-in s|ms|us|ns",
        )
    if any(number != number.to_integral_value() for number in numbers):
        return Unit.S
    usual = usual_step(numbers)
    likely = [unit for unit in Unit if usual > 0 and MIN_HZ <= NS / (float(usual) * unit.ns) <= MAX_HZ]
    if len(likely) != 1:
        raise DataError(f"{name} does not say in which unit its times are", "give it as --stamps-in s|ms|us|ns")
    return likely[0]


def dated_unit(numbers: Sequence[Decimal]) -> Unit | None:
    """Return the unit in which all numbers are dates; None: there is none."""
    for unit in Unit:
        if all(_FIRST_DATE_S <= number * unit.ns / NS < _LAST_DATE_S for number in numbers):
            return unit
    return None


def usual_step(numbers: Sequence[Decimal]) -> Decimal:
    """Return the lower median of the differences of neighbours; 0 for less than two numbers."""
    return statistics.median_low([after - before for before, after in pairwise(numbers)] or [Decimal(0)])


def at_rate(places: Iterable[int], fps: float) -> list[int]:
    """Return the times of images that came at a rate, ns; that of place 0 is EPOCH_NS.

    Args:
        places: of the images in their order, from 0.
        fps: images per second.
    """
    return [EPOCH_NS + math.floor(place * NS / fps + 0.5) for place in places]


@dataclass(frozen=True, slots=True)
class ImportAccount:
    """What was imported.

    Attributes:
        images: how many images each side has.
        remarks: what was used instead of times that cannot be true, in words.
        unused: why a topic is not used, by topic.
        damages: where something is missing in the source.
    """

    images: Mapping[str, int]
    remarks: tuple[str, ...] = ()
    unused: Mapping[str, str] = field(default_factory=dict)
    damages: tuple[Damage, ...] = ()


Size = tuple[int, int]


def usual_size(sizes_px: Sequence[Size | None]) -> Size | None:
    """Return the size that most images have, the first of those that are equally frequent.

    Args:
        sizes_px: width and height of each image, px; None: not known.

    Returns:
        The size; None: no size is known.
    """
    counts = Counter(size for size in sizes_px if size is not None)
    return max(counts, key=counts.__getitem__, default=None)
