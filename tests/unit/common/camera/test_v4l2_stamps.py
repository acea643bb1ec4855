"""From kernel stamps to exposure mid-points, and the measured frame rate."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.camera import v4l2_abi as abi
from common.camera.v4l2_stamps import (
    RateMeter,
    StampClock,
    StampSource,
    Timing,
    estimated_readout_ns,
    exposure_midpoint_ns,
    is_trusted,
    stamp_clock,
    stamp_source,
)

_MS = 1_000_000
_PERIOD_NS = 33_333_333


def test_flags_as_seen_on_real_drivers() -> None:
    """The drivers uvcvideo (0x12001), vivid (0x2001) and v4l2loopback (0x1) are distinguished by clock and by the moment of the stamp."""
    assert stamp_clock(0x12001) is StampClock.MONOTONIC
    assert stamp_source(0x12001, "uvcvideo") is StampSource.FIRST_PACKET
    assert stamp_clock(0x2001) is StampClock.MONOTONIC
    assert stamp_source(0x2001, "vivid") is StampSource.END_OF_FRAME
    assert stamp_clock(0x1) is StampClock.UNKNOWN
    assert stamp_clock(abi.BUF_FLAG_TIMESTAMP_COPY) is StampClock.COPY
    assert stamp_source(abi.BUF_FLAG_TSTAMP_SRC_SOE, "some-sensor") is StampSource.START_OF_EXPOSURE


@given(
    start_ns=st.integers(0, 10**15),
    exposure_ns=st.integers(0, 500 * _MS),
    readout_ns=st.integers(0, 50 * _MS),
    latency_ns=st.integers(0, 30 * _MS),
)
def test_every_driver_gives_the_same_midpoint(
    start_ns: int, exposure_ns: int, readout_ns: int, latency_ns: int
) -> None:
    """One exposure, stamped by three drivers at its start, at its end and on arrival, has one mid-point: that of the middle row, within 1 ns."""
    truth_ns = start_ns + (readout_ns + exposure_ns) / 2
    end_ns = start_ns + readout_ns + exposure_ns
    on_time, late = Timing("sensor", readout_ns), Timing("uvcvideo", readout_ns, latency_ns)
    for stamp_ns, source, timing in (
        (start_ns, StampSource.START_OF_EXPOSURE, on_time),
        (end_ns, StampSource.END_OF_FRAME, on_time),
        (end_ns + latency_ns, StampSource.FIRST_PACKET, late),
    ):
        assert abs(exposure_midpoint_ns(stamp_ns, source, timing, exposure_ns) - truth_ns) <= 1


def test_an_unknown_exposure_counts_as_none() -> None:
    """If the camera does not report its exposure, only half the readout is subtracted."""
    timing = Timing("uvcvideo", 16 * _MS)
    assert exposure_midpoint_ns(100 * _MS, StampSource.FIRST_PACKET, timing, None) == 92 * _MS


def test_the_readout_is_taken_as_half_the_shortest_period() -> None:
    """A camera of 30 frames a second is assumed to read out for 16.7 ms: off by 16.7 ms at most, whatever its shutter."""
    assert estimated_readout_ns(_PERIOD_NS) == pytest.approx(16.67 * _MS, rel=1e-3)


@pytest.mark.parametrize("clock", list(StampClock))
def test_no_stamp_of_the_future_is_trusted(clock: StampClock) -> None:
    """A frame that has been received was not taken later, whatever its flags say."""
    assert not is_trusted(1_000_000_001, clock, 1_000_000_000)
    assert is_trusted(1_000_000_000, clock, 1_000_000_000)


def test_an_unnamed_clock_is_trusted_only_near_now() -> None:
    """Stamps of an unnamed clock count as CLOCK_MONOTONIC if they are recent; zeros and wall time do not. A named clock's stamp may be old."""
    now_ns = 50_000 * 1_000_000_000
    fresh_ns, old_ns, wall_ns = now_ns - 20 * _MS, now_ns - 3_000 * _MS, 1_790_000_000 * 1_000_000_000
    for clock in (StampClock.UNKNOWN, StampClock.COPY):
        assert is_trusted(fresh_ns, clock, now_ns)
        assert not any(is_trusted(stamp_ns, clock, now_ns) for stamp_ns in (0, old_ns, wall_ns))
    assert is_trusted(old_ns, StampClock.MONOTONIC, now_ns)
    assert not is_trusted(wall_ns, StampClock.MONOTONIC, now_ns)


def test_the_rate_is_measured_through_gaps_and_jitter() -> None:
    """Lost frames and single late stamps do not change the measured period."""
    meter = RateMeter()
    for number in range(60):
        if number % 7 != 3:
            late_ns = 20 * _MS if number % 10 == 5 else 0
            meter.add(number * _PERIOD_NS + late_ns, number)
    assert meter.period_ns == _PERIOD_NS
    assert not meter.differs_from(_PERIOD_NS)
    assert meter.differs_from(_PERIOD_NS // 2)


def test_a_pause_is_no_period() -> None:
    """The time between two streams does not count, and fewer than eight periods give no measurement."""
    meter = RateMeter()
    for number in range(8):
        meter.add(number * _PERIOD_NS, number)
    assert meter.period_ns is None
    meter.restart()
    meter.add(10**12, 0)
    assert meter.period_ns is None
    meter.add(10**12 + _PERIOD_NS, 1)
    assert meter.period_ns == _PERIOD_NS


def test_a_driver_that_does_not_count_gives_no_rate() -> None:
    """Sequence numbers that stand still or go back give no period."""
    meter = RateMeter()
    for number in range(40):
        meter.add(number * _PERIOD_NS, 0)
    assert meter.period_ns is None
