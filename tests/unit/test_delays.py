"""Percentiles of delays in bounded memory."""

import math
import statistics

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.ledger import BoardMarks, HostMarks, PairLedger, StageTimes
from phone_host.measure.delays import DELAYS, EXACT, STAGES, DelayStatistics, Series


def series(values: list[int]) -> Series:
    """A series of these values."""
    filled = Series()
    for value in values:
        filled.add(value)
    return filled


@given(st.lists(st.integers(-(2**50), 2**50), min_size=1, max_size=300))
@settings(deadline=None)
def test_short_series_are_exact(values: list[int]) -> None:
    """Count, greatest, mean and median are those of all values; the percentiles are numpy's."""
    spread = series(values).spread()
    assert (spread.count, spread.max_ns) == (len(values), max(values))
    assert spread.mean_ns == pytest.approx(statistics.fmean(values), abs=1e-3)
    assert spread.p50_ns == pytest.approx(statistics.median(values))
    assert spread.p95_ns == pytest.approx(float(np.percentile(values, 95)))
    assert spread.p99_ns == pytest.approx(float(np.percentile(values, 99)))


def test_percentiles_are_exact_up_to_the_stated_length() -> None:
    """With EXACT values that are a permutation of 0..EXACT-1 the percentiles are the linear ranks."""
    values = [(7919 * i) % EXACT for i in range(EXACT)]  # 7919 is odd and EXACT a power of two: each number once
    spread = series(values).spread()
    assert spread.p50_ns == (EXACT - 1) / 2
    assert spread.p99_ns == pytest.approx(0.99 * (EXACT - 1))


def test_a_long_series_is_thinned_evenly() -> None:
    """Beyond EXACT, memory stays bounded, count, mean and greatest stay exact, and percentiles of a smooth series are within 1 %."""
    count = 5 * EXACT
    values = [1_000_000 + round(500_000 * math.sin(i / 5000) + i) for i in range(count)]
    values[12345] = 10**12
    filled = series(values)
    spread = filled.spread()
    assert (spread.count, spread.max_ns) == (count, 10**12)
    assert spread.mean_ns == pytest.approx(sum(values) / count)
    for percent, measured in ((50, spread.p50_ns), (95, spread.p95_ns), (99, spread.p99_ns)):
        assert measured == pytest.approx(float(np.percentile(values, percent)), rel=0.01)
    assert len(filled._values) <= EXACT


@pytest.mark.parametrize("count", [1, 50, EXACT, 2 * EXACT, 5 * EXACT])
def test_the_last_values_are_the_newest(count: int) -> None:
    """The spread of the last 30 values of a rising series is about the newest 30, however long the series is."""
    newest = range(max(0, count - 30), count)
    filled = series(list(range(count)))
    spread = filled.spread(last=30)
    kept_every = 1 if count <= EXACT else 8
    assert abs(spread.p50_ns - statistics.median(newest)) <= kept_every
    assert count - kept_every <= spread.max_ns < count


def test_nothing_measured_is_nan() -> None:
    """An empty series has no values, not zeros."""
    spread = Series().spread()
    assert spread.count == 0
    assert all(math.isnan(value) for value in (spread.p50_ns, spread.p99_ns, spread.max_ns, spread.mean_ns))
    assert math.isnan(series([1]).spread(last=0).p50_ns)


def test_each_delay_of_a_ledger_reaches_its_series() -> None:
    """Marks 1, 2, 4, ... ns apart give each delay and stage its own value, and time skews lose their sign."""
    board = BoardMarks(exposed_ns=0, grabbed_ns=1, sent_ns=3)
    ledger = PairLedger(
        session="s",
        sequence=0,
        host_sequence=0,
        bytes=9,
        link="tcp",
        board=board,
        received_ns=7,
        paired_ns=9,
        queued_ns=15,
        dequeued_ns=31,
        done_ns=63,
        previous_done_ns=14,
        stages=StageTimes(decode=1, interpolate=2, rectify=3, match=4, reproject=5, write=6),
        time_skew_ns=-77,
        offset_ns=0,
        uncertainty_ns=88,
        host=HostMarks(exposed_ns=0, grabbed_ns=0),
    )
    statistic = DelayStatistics()
    statistic.add(ledger)
    expected = (1, 2, 4, 8, 16, 32, 63, 1)
    assert tuple(statistic.spread(name).max_ns for name in DELAYS) == expected
    assert tuple(statistic.spread(name).max_ns for name in STAGES) == (1, 2, 3, 4, 5, 6)
    assert statistic.spread("time_skew").p50_ns == 77
    assert statistic.spread("uncertainty").p50_ns == 88
