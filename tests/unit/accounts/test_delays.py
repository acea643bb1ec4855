"""Percentiles of delays in bounded memory."""

import math
import statistics
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.ledger import BoardMarks, HostMarks, PairLedger, StageTimes
from phone_host.accounts.delays import DELAYS, EXACT, SAMPLE, STAGES, DelayStatistics, Sample, Series

LEDGER = PairLedger(
    session="s",
    sequence=0,
    host_sequence=0,
    bytes=9,
    link="tcp",
    board=BoardMarks(exposed_ns=0, grabbed_ns=1, sent_ns=3),
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


def series(values: list[int]) -> Series:
    """A series of these values."""
    filled = Series()
    for value in values:
        filled.add(value)
    return filled


@given(st.lists(st.integers(-(2**50), 2**50), min_size=2, max_size=300))
@settings(deadline=None)
def test_short_series_are_exact(values: list[int]) -> None:
    """Count, greatest, mean, median and percentiles are those of all values."""
    spread = series(values).spread()
    assert (spread.count, spread.max_ns) == (len(values), max(values))
    assert spread.mean_ns == pytest.approx(statistics.fmean(values), rel=1e-12, abs=1e-3)
    assert spread.p50_ns == pytest.approx(statistics.median(values))
    # Python's own percentiles: the 19th of 19 points that cut the values into 20 equal parts, and the 99th of 99.
    assert spread.p95_ns == pytest.approx(statistics.quantiles(values, n=20, method="inclusive")[18])
    assert spread.p99_ns == pytest.approx(statistics.quantiles(values, n=100, method="inclusive")[98])


def test_the_percentiles_of_a_known_series() -> None:
    """For 1 to 101 in any order the median is 51, 95 % lie up to 96, and 99 % up to 100."""
    spread = series([(10 * i) % 101 + 1 for i in range(101)]).spread()  # 101 is prime: each number once
    assert (spread.p50_ns, spread.p95_ns, spread.p99_ns, spread.max_ns, spread.mean_ns) == (51, 96, 100, 101, 51)


def test_percentiles_are_exact_up_to_the_stated_length() -> None:
    """For the 65536 values 0 to 65535 in some order the median lies between 32767 and 32768, and 99 % lie up to 64879.65."""
    values = [(7919 * i) % 65536 for i in range(65536)]  # 7919 is odd: each number once
    spread = series(values).spread()
    assert spread.p50_ns == 32767.5
    assert spread.p99_ns == pytest.approx(64879.65, abs=1e-6)


def test_a_long_series_is_thinned_evenly() -> None:
    """Beyond EXACT memory stays bounded; count, mean and greatest stay exact; percentiles of a smooth series are within 1 %."""
    # 0 to 299 999 in an order that no stride of the thinning follows (a prime that does not divide the length), and one giant.
    count = 300_000
    values = [1_000_000 + (104_729 * i) % count for i in range(count)]
    values[12345] = 10**12
    filled = series(values)
    spread = filled.spread()
    assert (spread.count, spread.max_ns) == (count, 10**12)
    assert spread.mean_ns == pytest.approx(1_149_999.5 + 10**12 / count, rel=1e-5)
    for expected, measured in ((1_150_000, spread.p50_ns), (1_285_000, spread.p95_ns), (1_297_000, spread.p99_ns)):
        assert measured == pytest.approx(expected, rel=0.01)
    assert sum(sys.getsizeof(each) for each in vars(filled).values()) < 8 * EXACT + 1000


@pytest.mark.parametrize("count", [1, 50, EXACT, 2 * EXACT, 5 * EXACT])
def test_the_last_values_are_the_newest(count: int) -> None:
    """The spread of the last 30 values of a rising series covers about the newest 30, however long the series is."""
    newest = range(max(0, count - 30), count)
    filled = series(list(range(count)))
    spread = filled.spread(last=30)
    kept_every = 1 if count <= EXACT else 8
    assert abs(spread.p50_ns - statistics.median(newest)) <= kept_every
    assert count - kept_every <= spread.max_ns < count


def test_nothing_measured_is_nan() -> None:
    """An empty series has no values rather than zeros."""
    spread = Series().spread()
    assert spread.count == 0
    assert all(math.isnan(value) for value in (spread.p50_ns, spread.p99_ns, spread.max_ns, spread.mean_ns))
    assert math.isnan(series([1]).spread(last=0).p50_ns)


def test_each_delay_of_a_ledger_reaches_its_series() -> None:
    """Marks 1, 2, 4, ... ns apart give each delay and stage its own value, and time skews lose their sign."""
    statistic = DelayStatistics()
    statistic.add(LEDGER)
    expected = (1, 2, 4, 8, 16, 32, 63, 1)
    assert tuple(statistic.spread(name).max_ns for name in DELAYS) == expected
    assert tuple(statistic.spread(name).max_ns for name in STAGES) == (1, 2, 3, 4, 5, 6)
    assert statistic.spread("time_skew").p50_ns == 77
    assert statistic.spread("uncertainty").p50_ns == 88


@pytest.mark.parametrize("count", [1, SAMPLE, SAMPLE + 1, 3 * SAMPLE])
def test_a_sample_is_even_and_bounded(count: int) -> None:
    """However many ledgers come, at most SAMPLE are kept, evenly spaced and with the first among them."""
    sample = Sample()
    for number in range(count):
        sample.add(replace(LEDGER, sequence=number))
    numbers = [ledger.sequence for ledger in sample.ledgers]
    assert numbers[0] == 0
    assert count / 4 < len(numbers) * (numbers[1] if len(numbers) > 1 else 1) <= count + 4
    assert len(numbers) <= SAMPLE
    assert len(set(np.diff(numbers))) <= 1


def test_the_mean_length_of_the_frames_needs_a_frame() -> None:
    """Frames of 100 and 300 bytes have a mean of 200; without frames the mean is not known."""
    statistic = DelayStatistics()
    assert math.isnan(statistic.frame_bytes)
    for size in (100, 300):
        statistic.add(replace(LEDGER, bytes=size))
    assert statistic.frame_bytes == 200


def test_a_copy_stays_as_it_was() -> None:
    """Values added later do not reach a copy of the statistics, however many there are."""
    statistic = DelayStatistics()
    for number in range(1, 4):
        statistic.add(replace(LEDGER, uncertainty_ns=number))
    copied = statistic.copy()
    late = replace(LEDGER, uncertainty_ns=1000)
    for _ in range(100):
        statistic.add(late)
    assert (copied.spread("uncertainty").p50_ns, copied.spread("uncertainty").max_ns) == (2, 3)
    assert copied.spread("capture").count == 3
    assert copied.frame_bytes == 9
    assert statistic.spread("uncertainty").p50_ns == 1000
    one = series([1, 2, 3])  # the part of which all statistics are made: thinned after it was copied
    copied_one = one.copy()
    for _ in range(EXACT + 1):
        one.add(1000)
    assert (copied_one.spread().count, copied_one.spread().p50_ns, copied_one.spread().max_ns) == (3, 2, 3)
    assert one.spread().p50_ns == 1000
