"""Durations over time as a picture: all of few, the farthest of many."""

import numpy as np

from phone_host.svg.plot_times import Durations, over_time


def durations(count: int) -> Durations:
    """A series of 33 ms with one outlier of 500 ms."""
    values = np.full(count, 33e6, np.float64)
    if count:
        values[count // 3] = 500e6
    return Durations("left", 0, np.arange(count, dtype=np.float64) * np.float64(0.033), values)


def test_nothing_measured_is_said() -> None:
    """A series without values, and no series at all."""
    for series in ((), (durations(0),)):
        assert "nothing was measured" in over_time(series, "time between images", 600)


def test_few_values_are_all_drawn_and_of_many_the_farthest_is_kept() -> None:
    """Each point tells its time and value; of 5000 values 600 are drawn, the outlier among them."""
    few = over_time((durations(30), durations(0)), "time between images", 600)
    assert few.count("<title>left, at") == 30
    assert "at 0.33 s: 500\u202fms" in few
    many = over_time((durations(5000),), "time between images", 600)
    assert many.count("<title>left, at") == 600
    assert ": 500\u202fms" in many
