"""The estimate of the board's clock, against simulated clocks whose relation is known exactly."""

import random
from dataclasses import dataclass
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.protocol.session import Echo
from phone_host.sync.clock import MAX_SKEW, ClockEstimate, ClockEstimator, Heard
from tests.support.two_clocks import START_NS, TwoClocks

MS, SECOND_NS = 1_000_000, 1_000_000_000
HOURS_NS = 5 * 3600 * SECOND_NS


@dataclass(frozen=True, slots=True)
class Error:
    """How wrong an estimate was, and how wrong it said it might be, ns."""

    error_ns: float
    uncertainty_ns: int


def error_at(estimate: ClockEstimate, clocks: TwoClocks, board_ns: int) -> Error:
    """The estimate's error for a frame that the board sent at this time of its clock."""
    error = abs(estimate.offset_at(board_ns) - clocks.offset(board_ns))
    return Error(float(error), estimate.uncertainty_at(board_ns))


def run(
    estimator: ClockEstimator,
    clocks: TwoClocks,
    chance: random.Random,
    *,
    from_ns: int = 0,
    seconds: float = 12,
    least_ns: int = 50_000,
    jitter_ns: int = 200_000,
    doubtful_waves: int = 0,
) -> list[Error]:
    """Send waves as the session does (50 ms apart in the first second, then 250 ms); return the errors for a frame after each.

    After at most `doubtful_waves` of them there may be no estimate, because they contradict what was known.
    """
    errors, host_ns, number = [], START_NS + from_ns, from_ns // MS
    end_ns = host_ns + round(seconds * SECOND_NS)
    while host_ns < end_ns:
        number += 1
        echoes, behind_ns = clocks.wave(number, host_ns, chance, least_ns=least_ns, jitter_ns=jitter_ns)
        for echo in echoes:
            estimator.add(echo)
        estimate = estimator.estimate
        assert estimate is not None or doubtful_waves > 0
        if estimate is None:
            doubtful_waves -= 1
        else:
            errors.append(error_at(estimate, clocks, clocks.board(behind_ns + chance.randrange(250 * MS))))
        host_ns += 50 * MS if host_ns - START_NS < SECOND_NS else 250 * MS
    return errors


CLOCKS = st.builds(
    TwoClocks,
    st.integers(START_NS - HOURS_NS, START_NS + HOURS_NS),
    st.fractions(Fraction(-1, 10_000), Fraction(1, 10_000), max_denominator=10**9),
)


@pytest.mark.long
@given(
    CLOCKS,
    st.integers(0, 2**32),
    st.integers(20_000, 2 * MS),
    st.integers(0, 5 * MS),
)
@settings(deadline=None, max_examples=25)
def test_the_true_offset_lies_within_the_uncertainty(
    clocks: TwoClocks, seed: int, least_ns: int, jitter_ns: int
) -> None:
    """With clocks hours apart, up to 100 ppm, and any jitter, the true offset never leaves the stated interval for long."""
    errors = run(ClockEstimator(), clocks, random.Random(seed), least_ns=least_ns, jitter_ns=jitter_ns)
    outside = sum(item.error_ns > item.uncertainty_ns + 1 for item in errors)
    assert outside <= len(errors) * 0.15


@pytest.mark.long
def test_the_stated_uncertainty_is_rarely_wrong() -> None:
    """Over forty runs, with jitter from none to fifty times the least delay, 99.5 % of all errors are within what was stated."""
    errors: list[Error] = []
    for seed in range(40):
        chance = random.Random(seed)
        clocks = TwoClocks(chance.randrange(HOURS_NS), Fraction(chance.randint(-100, 100), 10**6))
        errors += run(ClockEstimator(), clocks, chance, jitter_ns=round(50_000 * chance.choice([0, 1, 5, 50])))
    assert sum(item.error_ns > item.uncertainty_ns + 1 for item in errors) <= 0.005 * len(errors)


def test_error_is_below_half_the_least_round_trip() -> None:
    """On a symmetric link, after the first two seconds, 99 % of all errors are below half of the least round trip."""
    errors: list[float] = []
    for seed in range(12):
        chance = random.Random(seed)
        clocks = TwoClocks(chance.randrange(HOURS_NS), Fraction(chance.randint(-100, 100), 10**6))
        run_errors = run(ClockEstimator(), clocks, chance)
        errors += [item.error_ns for item in run_errors[24:]]
    assert sorted(errors)[int(0.99 * len(errors))] < 50_000


def test_skew_is_found() -> None:
    """After a minute the skew is known within its stated uncertainty, which is a few ppm."""
    for ppm in (-100, -3, 0, 60, 100):
        clocks = TwoClocks(START_NS, Fraction(ppm, 10**6))
        estimator = ClockEstimator()
        run(estimator, clocks, random.Random(ppm), seconds=60)
        estimate = estimator.estimate
        assert estimate is not None
        # offset(b) = (b - b0) / (1 + s) - b + const: its change per board ns is 1 / (1 + s) - 1.
        assert abs(estimate.skew - float(1 / (1 + clocks.skew) - 1)) <= estimate.skew_uncertainty < 5e-6


@pytest.mark.parametrize("jump_ns", [-20 * SECOND_NS, -SECOND_NS, -20 * MS, 20 * MS, SECOND_NS, 3600 * SECOND_NS])
@pytest.mark.parametrize("pause_ns", [250 * MS, 60 * SECOND_NS])
def test_a_jump_is_doubted_at_once_and_believed_when_confirmed(jump_ns: int, pause_ns: int) -> None:
    """When a clock jumps (a phone that slept), nothing is known for two waves; the third gives the new offset, and so do all that follow."""
    chance = random.Random(jump_ns)
    clocks = TwoClocks(START_NS + SECOND_NS, Fraction(80, 10**6))
    estimator = ClockEstimator()
    run(estimator, clocks, chance, seconds=15)
    jumped = TwoClocks(clocks.board_start_ns + jump_ns, clocks.skew)
    errors = run(estimator, jumped, chance, from_ns=15 * SECOND_NS + pause_ns, seconds=10, doubtful_waves=2)
    assert all(item.error_ns < MS for item in errors)
    assert sum(item.error_ns > item.uncertainty_ns for item in errors) <= 1


@pytest.mark.parametrize("echoes", [1, 5])
@pytest.mark.parametrize("lie_ns", [-3600 * SECOND_NS, -20 * MS, 20 * MS, 3600 * SECOND_NS])
def test_a_wave_that_lies_is_never_believed(lie_ns: int, echoes: int) -> None:
    """One echo, or a whole wave, that is 20 ms or an hour off leaves the clock in doubt until the next wave; then the earlier estimate holds again."""
    chance = random.Random(lie_ns)
    clocks = TwoClocks(START_NS + SECOND_NS, Fraction(80, 10**6))
    estimator = ClockEstimator()
    run(estimator, clocks, chance, seconds=15)
    told, behind_ns = clocks.wave(10**6, START_NS + 15 * SECOND_NS, chance, least_ns=50_000, jitter_ns=0, echoes=echoes)
    for echo in told:
        lie = Echo(
            wave=echo.wave, t0_ns=echo.t0_ns, t1_ns=echo.t1_ns + lie_ns, t2_ns=echo.t2_ns + lie_ns, t3_ns=echo.t3_ns
        )
        assert estimator.add(lie) is Heard.DOUBTED
        assert estimator.estimate is None
        assert estimator.in_doubt
    true, _ = clocks.wave(10**6 + 1, behind_ns + 50 * MS, chance, least_ns=50_000, jitter_ns=0, echoes=1)
    assert estimator.add(true[0]) is Heard.AGREED
    assert estimator.estimate is not None
    assert error_at(estimator.estimate, clocks, true[0].t1_ns).error_ns < 50_000


def test_a_clock_that_is_steered_interrupts_nothing() -> None:
    """A clock that slews by a millisecond within a second (NTP at full speed and more) is not quite consistent with itself, and is believed all the same."""
    chance, estimator = random.Random(9), ClockEstimator()
    clocks = TwoClocks(START_NS, Fraction(0))
    run(estimator, clocks, chance, seconds=15)
    for number in range(20):
        slewed = TwoClocks(clocks.board_start_ns + number * 50_000, clocks.skew)
        at_ns = START_NS + 15 * SECOND_NS + number * 50 * MS
        for echo in slewed.wave(10**6 + number, at_ns, chance, least_ns=50_000, jitter_ns=10_000)[0]:
            assert estimator.add(echo) is Heard.AGREED
        estimate = estimator.estimate
        assert estimate is not None
        assert error_at(estimate, slewed, slewed.board(at_ns)).error_ns < MS


def test_a_long_silence_is_no_jump() -> None:
    """After a minute without echoes the first wave makes the estimate right again; until then it stated its growing uncertainty honestly."""
    chance = random.Random(1)
    clocks = TwoClocks(START_NS, Fraction(-90, 10**6))
    estimator = ClockEstimator()
    run(estimator, clocks, chance)
    estimate = estimator.estimate
    assert estimate is not None
    late = error_at(estimate, clocks, clocks.board(START_NS + 72 * SECOND_NS))
    assert late.error_ns <= late.uncertainty_ns
    errors = run(estimator, clocks, chance, from_ns=72 * SECOND_NS, seconds=5)
    assert all(item.error_ns <= item.uncertainty_ns for item in errors)


@pytest.mark.parametrize("queue_ns", [500 * MS, 5 * SECOND_NS])
def test_a_link_that_fills_up_does_not_make_forget(queue_ns: int) -> None:
    """When all echoes of a minute wait seconds behind frames in one direction, the error stays below 200 ppm of that minute."""
    clocks = TwoClocks(START_NS - SECOND_NS, Fraction(50, 10**6))
    estimator = ClockEstimator()
    run(estimator, clocks, random.Random(2), seconds=15)
    for number in range(240):
        t0 = START_NS + 15 * SECOND_NS + number * 250 * MS
        t1 = t0 + 50_000
        t3 = t1 + queue_ns + (number * 7919 % 100) * MS  # the way back is full, and the queue's length changes
        estimator.add(
            Echo(wave=10**6 + number, t0_ns=t0, t1_ns=clocks.board(t1), t2_ns=clocks.board(t1) + 10, t3_ns=t3)
        )
        estimate = estimator.estimate
        assert estimate is not None
        found = error_at(estimate, clocks, clocks.board(t3))
        assert found.error_ns <= found.uncertainty_ns + 1
        assert found.error_ns < 200e-6 * (60 + 15) * SECOND_NS


def test_nothing_heard_is_nothing_known() -> None:
    """Before the first echo there is no estimate, and echoes whose times run backwards do not count."""
    estimator = ClockEstimator()
    assert estimator.estimate is None
    estimator.add(Echo(wave=1, t0_ns=100, t1_ns=5, t2_ns=6, t3_ns=99))
    estimator.add(Echo(wave=1, t0_ns=100, t1_ns=6, t2_ns=5, t3_ns=200))
    estimator.add(Echo(wave=1, t0_ns=100, t1_ns=5, t2_ns=50, t3_ns=120))
    assert estimator.estimate is None


@given(st.integers(-(2**60), 2**60), st.integers(0, 10**9), st.integers(0, 10**9), st.integers(0, 10**9))
@settings(deadline=None)
def test_one_echo_bounds_the_offset(offset_ns: int, there_ns: int, work_ns: int, back_ns: int) -> None:
    """Whatever its two delays, one echo bounds the true offset by half of its round trip, and the skew by its physical limit."""
    t0 = 10**12
    t1 = t0 + there_ns - offset_ns
    estimator = ClockEstimator()
    estimator.add(Echo(wave=1, t0_ns=t0, t1_ns=t1, t2_ns=t1 + work_ns, t3_ns=t0 + there_ns + work_ns + back_ns))
    estimate = estimator.estimate
    assert estimate is not None
    assert estimate.round_trip_ns == there_ns + back_ns
    # The board's work lies between the two facts: each limit and its rate may be off by the drift meanwhile; four times
    # are rounded outwards.
    slack_ns = 4 * MAX_SKEW * work_ns + 4
    assert abs(estimate.offset_at(t1) - offset_ns) <= estimate.bound_at(t1) + 1
    assert estimate.bound_at(t1) <= (there_ns + back_ns) / 2 + slack_ns
    assert 0 < estimate.uncertainty_at(t1) <= estimate.bound_at(t1)
    assert 0 < estimate.skew_uncertainty <= 2 * MAX_SKEW
