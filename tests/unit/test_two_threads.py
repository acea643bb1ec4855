"""Two things at once."""

import threading

import pytest

from phone_host.stereo.two_threads import in_two_threads


def test_both_results_come_and_both_run_at_once() -> None:
    """Each waits for the other, so it would never end if one ran after the other."""
    meet = threading.Barrier(2, timeout=60)
    first, second = in_two_threads(lambda: (meet.wait(), "a")[1], lambda: (meet.wait(), "b")[1])
    assert (first, second) == ("a", "b")


def test_errors_of_either_come_out() -> None:
    """The caller sees what went wrong, after both have ended; the first's error if both fail."""
    ended: list[int] = []
    with pytest.raises(ZeroDivisionError):
        in_two_threads(lambda: ended.append(1), lambda: 1 // 0)
    assert ended == [1]
    with pytest.raises(ValueError, match="nothing"):
        in_two_threads(lambda: int("nothing"), lambda: 1 // 0)
