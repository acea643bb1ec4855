"""The parts of the clock estimate: hulls lose nothing that matters, the strip is exact, the hard bound holds on any link."""

import random
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.protocol.session import Echo
from phone_host.sync.allowed_lines import MAX_SKEW, allowed_lines
from phone_host.sync.clock import ClockEstimator
from phone_host.sync.hull import MOST_POINTS, SKEW_CHANGE, Hull, widening_ns
from tests.support.clock_sim import (
    MS,
    PPM_PER_MINUTE,
    SECOND_NS,
    DriftingClocks,
    Profile,
    heavy_tails,
    loaded_line,
    loopback,
    one_sided,
    standing_queue,
    waves,
    wifi,
)
from tests.support.two_clocks import START_NS, TwoClocks

FACTS = st.lists(
    st.tuples(st.integers(1, 20 * SECOND_NS), st.integers(-MS, MS), st.integers(0, 3 * MS)), min_size=1, max_size=40
)


@pytest.mark.many
@given(FACTS, st.floats(-MAX_SKEW, MAX_SKEW))
@settings(deadline=None, max_examples=150)
def test_the_strip_is_that_of_all_facts(facts: list[tuple[int, int, int]], skew: float) -> None:
    """For a skew, hulls and walk give the same lowest and highest offset as a look at every single widened fact."""
    lower, upper = Hull(), Hull()
    x_ns, times = START_NS, []
    for step_ns, low_ns, gap_ns in facts:
        x_ns += step_ns
        times.append(x_ns)
        lower.add(x_ns, low_ns)
        upper.add(x_ns, -(low_ns + gap_ns))
    low = max(y - skew * (x - x_ns) - widening_ns(x - x_ns) for x, (_, y, _) in zip(times, facts, strict=True))
    high = min(y + gap - skew * (x - x_ns) + widening_ns(x - x_ns) for x, (_, y, gap) in zip(times, facts, strict=True))
    rows = allowed_lines(lower.seen_from(x_ns, 0), upper.seen_from(x_ns, 0), 0.0)
    possible = bool(rows) and rows[0].skew <= skew <= rows[-1].skew
    if possible:
        after = next(i for i, row in enumerate(rows) if row.skew >= skew)
        before = max(0, after - 1)
        width = rows[after].skew - rows[before].skew
        part = (skew - rows[before].skew) / width if width else 0.0
        for found, expected in ((1, low), (2, high)):
            value = rows[before][found] + part * (rows[after][found] - rows[before][found])
            assert value == pytest.approx(expected, abs=0.01)
    else:
        assert high - low < 0.01


def test_a_link_without_noise_does_not_fill_the_memory() -> None:
    """An hour of facts on a straight line, each a corner of the widened hull, leaves a bounded number of points."""
    hull = Hull()
    for second in range(3600):
        hull.add(START_NS + second * SECOND_NS, 5)
    assert len(hull) <= MOST_POINTS


PROFILES: list[Profile] = [
    loopback,
    wifi,
    loaded_line(0.64e6, 2.5 * MS, 1.25 * MS),
    one_sided,
    standing_queue,
    heavy_tails,
]


@pytest.mark.long
@pytest.mark.parametrize("profile", PROFILES, ids=lambda profile: profile.__name__)
def test_the_bound_contains_the_truth_on_any_link(profile: Profile) -> None:
    """Over half a minute of waves and twenty seconds of silence, no error exceeds the bound, however unequal and changeable the two directions are."""
    for seed in range(6):
        chance = random.Random(seed)
        clocks = DriftingClocks(chance, PPM_PER_MINUTE)
        estimator = ClockEstimator()
        for now_ns, echoes in waves(clocks, profile(chance), chance, 30):
            for echo in echoes:
                estimator.add(echo)
            estimate = estimator.estimate
            assert estimate is not None
            for ahead_ns in (-2 * SECOND_NS, -100 * MS, 0, 200 * MS, 20 * SECOND_NS):
                board_ns = clocks.board(max(clocks.start_ns, now_ns + ahead_ns))
                error = abs(estimate.offset_at(board_ns) - clocks.origin_ns - clocks.offset(board_ns))
                moment = estimate.to_host(board_ns)
                assert error <= moment.bound_ns + 1
                assert moment.uncertainty_ns <= moment.bound_ns


@pytest.mark.many
@given(
    st.integers(0, 2**32),
    st.integers(-(2**50), 2**50),
    st.fractions(Fraction(-2, 10_000), Fraction(2, 10_000), max_denominator=10**9),
    st.lists(st.tuples(st.integers(0, 10**9), st.integers(0, 10**8), st.integers(0, 10**8)), min_size=1, max_size=60),
)
@settings(deadline=None, max_examples=150)
def test_no_delays_whatever_break_the_bound(
    seed: int, board_start_ns: int, skew: Fraction, delays: list[tuple[int, int, int]]
) -> None:
    """With any delays and pauses the true offset stays within the bound after every echo, and no echo counts as a contradiction."""
    chance = random.Random(seed)
    clocks = TwoClocks(board_start_ns, skew)
    estimator, host_ns, lowest_rtt_ns = ClockEstimator(), START_NS, 2**62
    for number, (pause_ns, there_ns, back_ns) in enumerate(delays):
        t0 = host_ns + pause_ns
        t1 = t0 + there_ns
        t2 = t1 + 1000
        host_ns = t2 + back_ns + 1
        estimator.add(Echo(wave=number // 3, t0_ns=t0, t1_ns=clocks.board(t1), t2_ns=clocks.board(t2), t3_ns=host_ns))
        lowest_rtt_ns = min(lowest_rtt_ns, there_ns + back_ns)
        estimate = estimator.estimate
        assert estimate is not None
        board_ns = clocks.board(host_ns + chance.randrange(SECOND_NS))
        assert abs(estimate.offset_at(board_ns) - clocks.offset(board_ns)) <= estimate.bound_at(board_ns) + 1
        assert estimate.round_trip_ns <= lowest_rtt_ns + 2 or number >= 60


def test_a_single_false_echo_is_an_excursion() -> None:
    """An echo that contradicts all others has no lasting effect: after the next wave the estimate is what it was before."""
    clocks, chance = TwoClocks(START_NS, Fraction(30, 10**6)), random.Random(5)
    estimator = ClockEstimator()
    host_ns = behind_ns = START_NS
    for number in range(60):
        echoes, behind_ns = clocks.wave(number, host_ns, chance, least_ns=50_000, jitter_ns=50_000)
        for echo in echoes:
            estimator.add(echo)
        host_ns += 250 * MS
    before = estimator.estimate
    assert before is not None
    estimator.add(
        Echo(
            wave=1000,
            t0_ns=behind_ns,
            t1_ns=clocks.board(behind_ns) + SECOND_NS,
            t2_ns=clocks.board(behind_ns) + SECOND_NS,
            t3_ns=host_ns,
        )
    )
    echoes, behind_ns = clocks.wave(1001, host_ns, chance, least_ns=50_000, jitter_ns=50_000)
    for echo in echoes:
        estimator.add(echo)
    after = estimator.estimate
    assert after is not None
    assert abs(after.offset_at(clocks.board(behind_ns)) - clocks.offset(clocks.board(behind_ns))) < 20_000
    assert after.skew == pytest.approx(before.skew, abs=2e-6)


def test_the_skew_survives_a_jump() -> None:
    """A phone that slept keeps its crystal: a second after the jump the skew is known as well as before."""
    estimator, chance = ClockEstimator(), random.Random(8)
    host_ns = START_NS
    for jump_ns in (0, 5 * SECOND_NS):
        clocks = TwoClocks(START_NS + jump_ns, Fraction(80, 10**6))
        for number in range(5 if jump_ns else 200):
            for echo in clocks.wave(host_ns // MS + number, host_ns, chance, least_ns=50_000, jitter_ns=50_000)[0]:
                estimator.add(echo)
            host_ns += 250 * MS
    estimate = estimator.estimate
    assert estimate is not None
    assert estimate.skew == pytest.approx(-80e-6, abs=8e-6)


def test_old_facts_fade() -> None:
    """If the skew may have changed by s within a minute, the offset a minute ago is known no more exactly than s times that minute, halved."""
    assert widening_ns(60e9) == pytest.approx(SKEW_CHANGE * 60e9 * 60e9 / 2)
    assert widening_ns(-60e9) == widening_ns(60e9) == pytest.approx(30_000)
