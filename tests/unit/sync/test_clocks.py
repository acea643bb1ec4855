"""One clock estimate from several links: the hard bound holds, is never wider than any single link's, and survives the loss of the best link."""

import random
from collections.abc import Iterator
from dataclasses import replace

import pytest

from common.protocol.session import Echo
from phone_host.sync.clock import ClockEstimator, Heard
from phone_host.sync.clocks import LinkClocks, moved
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

SERIAL = loaded_line(0.64e6, 2.5 * MS, 1.25 * MS)


def mixed(
    clocks: DriftingClocks, profiles: tuple[Profile, ...], chance: random.Random, seconds: int
) -> Iterator[tuple[int, list[Echo]]]:
    """The waves of several links to one board, in the order of their ends."""
    told = []
    for link, profile in enumerate(profiles):
        for now_ns, echoes in waves(clocks, profile(chance), chance, seconds):
            told.append((now_ns, [replace(echo, link=link) for echo in echoes]))
    yield from sorted(told, key=lambda wave: wave[0])


@pytest.mark.long
@pytest.mark.parametrize(
    "profiles",
    [(loopback, SERIAL), (wifi, SERIAL), (one_sided, wifi), (standing_queue, one_sided), (heavy_tails, wifi, loopback)],
    ids=lambda profiles: "+".join(profile.__name__ for profile in profiles),
)
def test_the_bound_is_that_of_all_links_and_holds(profiles: tuple[Profile, ...]) -> None:
    """Whatever the links do, the true offset is within the bound, now and later; and the limits are no wider than those of any link alone."""
    for seed in range(4):
        chance = random.Random(seed)
        clocks = DriftingClocks(chance, PPM_PER_MINUTE)
        together, alone = LinkClocks(len(profiles)), [ClockEstimator() for _ in profiles]
        for now_ns, echoes in mixed(clocks, profiles, chance, 20):
            for echo in echoes:
                together.add(echo)
                alone[echo.link].add(echo)
            estimate = together.estimate
            assert estimate is not None
            for ahead_ns in (-100 * MS, 0, 200 * MS, 20 * SECOND_NS):
                board_ns = clocks.board(max(clocks.start_ns, now_ns + ahead_ns))
                error = abs(estimate.offset_at(board_ns) - clocks.origin_ns - clocks.offset(board_ns))
                told = estimate.to_host(board_ns)
                assert error <= told.bound_ns + 2
                assert told.uncertainty_ns <= told.bound_ns
            low_ns, high_ns = estimate.limits_at(estimate.reference_ns)
            for other in alone:
                if other.estimate is not None:
                    own_low_ns, own_high_ns = other.estimate.limits_at(estimate.reference_ns)
                    assert low_ns >= own_low_ns - 1
                    assert high_ns <= own_high_ns + 1


@pytest.mark.long
@pytest.mark.parametrize("runs", [8, pytest.param(100, marks=pytest.mark.slow)])
@pytest.mark.parametrize("second", [SERIAL, wifi], ids=["serial", "wifi"])
def test_the_uncertainty_holds_beside_a_slow_link_and_after_the_swift_one(second: Profile, runs: int) -> None:
    """On nearly symmetric links the stated 99.9 % hold while both are up and after the swift one is lost; what that one taught is kept."""
    errors: list[bool] = []
    for seed in range(runs):
        chance = random.Random(100 + seed)
        clocks = DriftingClocks(chance, PPM_PER_MINUTE)
        together, slow = LinkClocks(2), ClockEstimator()
        lost_ns = clocks.start_ns + 12 * SECOND_NS
        for now_ns, echoes in mixed(clocks, (loopback, second), chance, 20):
            for echo in echoes:
                if echo.link == 1 or now_ns < lost_ns:
                    together.add(echo)
                if echo.link == 1:
                    slow.add(echo)
            if together.estimate is None or now_ns < clocks.start_ns + SECOND_NS:
                continue
            board_ns = clocks.board(now_ns)
            truth = clocks.offset(board_ns)
            error = abs(together.estimate.offset_at(board_ns) - clocks.origin_ns - truth)
            errors.append(error > together.estimate.uncertainty_at(board_ns) + 1)
            if lost_ns + SECOND_NS < now_ns < lost_ns + 4 * SECOND_NS and slow.estimate is not None:
                assert together.estimate.uncertainty_at(board_ns) <= slow.estimate.uncertainty_at(board_ns)
    assert sum(errors) <= max(2, 0.002 * len(errors))


def known_over_two_links(seed: int) -> tuple[LinkClocks, DriftingClocks, int]:
    """Two clocks well known over loopback and Wi-Fi, and the host's time afterwards."""
    chance = random.Random(seed)
    clocks, together = DriftingClocks(chance, PPM_PER_MINUTE), LinkClocks(2)
    for _, echoes in mixed(clocks, (loopback, wifi), chance, 5):
        for echo in echoes:
            together.add(echo)
    assert together.estimate is not None
    return together, clocks, echoes[-1].t3_ns + 100 * MS


def echo_at(clocks: DriftingClocks, host_ns: int, wave: int, link: int, jump_ns: int = 0) -> Echo:
    """An echo of 2 ms, after the board's clock has jumped."""
    board_ns = clocks.board(host_ns + MS) + jump_ns
    return Echo(wave=wave, t0_ns=host_ns, t1_ns=board_ns, t2_ns=board_ns, t3_ns=host_ns + 2 * MS, link=link)


def test_a_jump_that_one_link_confirms_is_one_for_all() -> None:
    """After a clock has jumped by 3 s nothing is known until three waves agree over the link that is heard, though the other link still stands by the old time."""
    together, clocks, host_ns = known_over_two_links(7)
    jump_ns = 3 * SECOND_NS
    heard = [together.add(echo_at(clocks, host_ns + wave * 50 * MS, 10**6 + wave, 1, jump_ns)) for wave in range(3)]
    assert heard == [Heard.DOUBTED, Heard.DOUBTED, Heard.STEPPED]
    after = together.estimate
    assert after is not None
    board_ns = clocks.board(host_ns) + jump_ns
    assert after.offset_at(board_ns) + board_ns == pytest.approx(host_ns, abs=10 * MS)


def test_a_new_link_that_lies_is_not_believed() -> None:
    """A link that was not heard before and contradicts the others puts everything in doubt; the other link's next echo ends the doubt."""
    together, clocks, host_ns = known_over_two_links(8)
    together.void()
    assert together.in_doubt
    for wave in range(3):
        together.add(echo_at(clocks, host_ns + wave * 50 * MS, 10**6 + wave, 0))
    before = together.estimate
    assert before is not None
    assert together.add(echo_at(clocks, host_ns + 200 * MS, 10**6, 1, 3600 * SECOND_NS)) is Heard.DOUBTED
    assert together.in_doubt
    assert together.add(echo_at(clocks, host_ns + 250 * MS, 10**6 + 9, 0)) is Heard.AGREED
    after = together.estimate
    assert after is not None
    board_ns = clocks.board(host_ns)
    assert after.offset_at(board_ns) == pytest.approx(before.offset_at(board_ns), abs=2 * MS)


def test_a_doubt_goes_with_the_link_that_could_settle_it() -> None:
    """When the link that contradicted goes down, the other link's knowledge counts again with its next echo."""
    together, clocks, host_ns = known_over_two_links(9)
    assert together.add(echo_at(clocks, host_ns, 10**6, 1, SECOND_NS)) is Heard.DOUBTED
    together.down(1)
    assert together.add(echo_at(clocks, host_ns + 50 * MS, 10**6, 0)) is Heard.AGREED
    assert together.estimate is not None


def test_an_estimate_told_at_another_moment_says_no_more_than_before() -> None:
    """Moving an estimate to another moment narrows neither its limits nor its uncertainty at any time."""
    chance = random.Random(3)
    clocks = DriftingClocks(chance, PPM_PER_MINUTE)
    estimator = ClockEstimator()
    for _, echoes in waves(clocks, wifi(chance), chance, 5):
        for echo in echoes:
            estimator.add(echo)
    estimate = estimator.estimate
    assert estimate is not None
    for by_ns in (-2 * SECOND_NS, SECOND_NS, 60 * SECOND_NS):
        shifted = moved(estimate, estimate.reference_ns + by_ns)
        for look_ns in (-5 * SECOND_NS, 0, 30 * SECOND_NS, 120 * SECOND_NS):
            board_ns = estimate.reference_ns + look_ns
            assert shifted.offset_at(board_ns) == pytest.approx(estimate.offset_at(board_ns), abs=2)
            assert shifted.limits_at(board_ns)[0] <= estimate.limits_at(board_ns)[0] + 2
            assert shifted.limits_at(board_ns)[1] >= estimate.limits_at(board_ns)[1] - 2
            assert shifted.uncertainty_at(board_ns) >= estimate.uncertainty_at(board_ns) - 2


def test_a_link_that_goes_takes_its_doubt_along() -> None:
    """A doubt that only one link's echoes could settle ends when that link goes down: the next echo of any other decides."""
    chance = random.Random(3)
    clocks = DriftingClocks(chance, PPM_PER_MINUTE)
    together = LinkClocks(2)
    told = list(mixed(clocks, (loopback, loopback), chance, 8))
    for _, echoes in told[:-4]:
        for echo in echoes:
            together.add(echo)
    assert (together.round_trip_ns(0) or 0) > 0
    assert LinkClocks(2).round_trip_ns(0) is None
    liar = next(echo for echo in told[-4][1])
    together.add(replace(liar, t1_ns=liar.t1_ns + 3600 * SECOND_NS, t2_ns=liar.t2_ns + 3600 * SECOND_NS))
    doubted = together.in_doubt
    together.down(liar.link)
    for _, echoes in told[-3:]:
        for echo in echoes:
            if echo.link != liar.link:
                together.add(echo)
    assert (doubted, together.in_doubt) == (True, False)
    assert together.estimate is not None
