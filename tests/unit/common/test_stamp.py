"""Stamps: times that know their clock."""

from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import ClockMismatchError
from common.stamp import HOST_CLOCK, Stamp, board_clock

NANOSECONDS = st.integers(-(2**70), 2**70)


@given(NANOSECONDS, NANOSECONDS)
@settings(deadline=None)
def test_difference_undoes_plus(ns: int, duration_ns: int) -> None:
    """The time from a stamp to the one a duration later is exactly that duration, for any size."""
    stamp = Stamp(ns, "a")
    assert stamp.plus(duration_ns) - stamp == duration_ns
    assert stamp.plus(duration_ns).clock == "a"


@given(NANOSECONDS, NANOSECONDS)
@settings(deadline=None)
def test_order_on_one_clock_is_that_of_the_numbers(first_ns: int, second_ns: int) -> None:
    """Stamps of one clock compare as their nanoseconds do."""
    first, second = Stamp(first_ns, "a"), Stamp(second_ns, "a")
    assert (first < second) == (first_ns < second_ns)
    assert (first <= second) == (first_ns <= second_ns)
    assert (first > second) == (first_ns > second_ns)
    assert (first == second) == (first_ns == second_ns)


@pytest.mark.parametrize("mixed", [Stamp.__sub__, Stamp.__lt__, Stamp.__le__])
def test_two_clocks_never_mix(mixed: Callable[[Stamp, Stamp], object]) -> None:
    """Subtracting or ordering stamps of two clocks raises, even for equal numbers."""
    with pytest.raises(ClockMismatchError, match=r"board:1.*host"):
        mixed(Stamp(5, board_clock("1")), Stamp(5, HOST_CLOCK))


def test_equal_numbers_of_two_clocks_are_not_equal() -> None:
    """The same number on another clock is another time, and each boot has its own clock."""
    assert Stamp(5, board_clock("1")) != Stamp(5, board_clock("2"))
