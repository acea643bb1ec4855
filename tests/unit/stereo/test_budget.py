"""A time budget is held on simulated machines: it follows at once when they slow down, and never flutters."""

import math
from collections import Counter
from itertools import pairwise
from typing import Final

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from phone_host.model import BudgetReason, Search
from phone_host.stereo.budget import BudgetController, BudgetWanted, Choice, CostModel, Extent, Step, ladder
from phone_host.stereo.matcher_names import BEST_FIRST, AnyMatcher, MatcherName, UsualCost
from tests.support.simulated_machine import MS, Machine, Played, S

VGA: Final = Extent(width_px=640, height_px=480, search=Search(scale=1.0, disparities=96), geometry=None)
BUDGET_NS: Final = 30 * MS


def steps(*matchers: MatcherName, may_scale: bool = True, may_narrow: bool = True) -> tuple[Step, ...]:
    """The ladder of 640x480 px and 96 disparities."""
    named = matchers or (MatcherName.SGBM, MatcherName.BLOCK)
    return ladder(VGA, BudgetWanted(budget_ns=1, matchers=named, may_scale=may_scale, may_narrow=may_narrow))


LADDER: Final = steps()


def changes(pairs: list[Played]) -> list[Played]:
    """The pairs that were matched in another way than the one before."""
    return [now for before, now in pairwise(pairs) if now.step != before.step]


def late(pairs: list[Played], from_s: float = 0.0, budget_ns: int = BUDGET_NS) -> float:
    """The share of the pairs from a moment on that took longer than the budget."""
    seen = [pair for pair in pairs if pair.at_ns >= from_s * S]
    return sum(pair.total_ns > budget_ns for pair in seen) / len(seen)


def best_that_fits(machine: Machine, slowness: float, share: float, budget_ns: int = BUDGET_NS) -> int:
    """The place of the best step that takes at most a share of the budget; beyond the last one if none does."""
    fitting = (place for place, step in enumerate(LADDER) if machine.total_ns(step, slowness) <= share * budget_ns)
    return next(fitting, len(LADDER))


@pytest.mark.parametrize("slowness", [0.05, 0.5, 1.0, 2.0, 3.0])
def test_a_steady_machine_soon_gets_the_best_that_fits(slowness: float) -> None:
    """After 20 s nothing changes, no pair is late, and what is chosen lies between the best with room and the best that fits at all."""
    machine = Machine(slowness=lambda _: slowness)
    pairs, _ = machine.play(BUDGET_NS, LADDER, 60)
    assert not [change for change in changes(pairs) if change.at_ns > 20 * S]
    assert late(pairs, 20) == 0
    place = LADDER.index(pairs[-1].step)
    # 0.75 is where a climb ends; its expectation may be off by the noise of 5 %.
    assert best_that_fits(machine, slowness, 1.0) <= place <= best_that_fits(machine, slowness, 0.68)


def test_a_machine_that_slows_down_by_three_within_30_s_is_followed() -> None:
    """Fewer than 3 % of the pairs are late, the way becomes cheaper step by step, and it is not changed once the machine is steady."""
    machine = Machine(slowness=lambda at_s: 1 + 2 * min(max(at_s - 20, 0) / 30, 1))
    pairs, reasons = machine.play(BUDGET_NS, LADDER, 90)
    assert late(pairs) < 0.03
    places = [LADDER.index(change.step) for change in changes(pairs)]
    assert places == sorted(places)
    assert set(reasons) == {BudgetReason.TOO_SLOW}
    assert not [change for change in changes(pairs) if change.at_ns > 55 * S]


def test_a_machine_that_recovers_gets_its_depth_back() -> None:
    """Three times slower from 20 s to 60 s: left within four pairs, and within 10 s after its end as good as before or next to it."""
    machine = Machine(slowness=lambda at_s: 3.0 if 20 <= at_s < 60 else 1.0)
    pairs, _ = machine.play(BUDGET_NS, LADDER, 120)
    slow = [pair for pair in pairs if 20 * S <= pair.at_ns < 61 * S]
    assert sum(pair.total_ns > BUDGET_NS for pair in slow) <= 4
    before = next(LADDER.index(pair.step) for pair in reversed(pairs) if pair.at_ns < 20 * S)
    after = next(LADDER.index(pair.step) for pair in pairs if pair.at_ns > 70 * S)
    assert before <= after <= before + 1
    assert LADDER.index(slow[-40].step) > after


@pytest.mark.parametrize("numbers", [{300}, {300, 500, 900}, set(range(100, 1500, 50))])
def test_single_slow_pairs_change_nothing(numbers: set[int]) -> None:
    """Pairs that take ten times as long, each alone, are late and nothing else."""
    pairs, reasons = Machine(outliers=frozenset(numbers)).play(BUDGET_NS, LADDER, 60)
    assert reasons == []
    assert sum(pair.total_ns > BUDGET_NS for pair in pairs) == len(numbers)


def test_a_machine_that_goes_up_and_down_makes_it_patient() -> None:
    """Slowness of 1 and 3 in turn, 4 s each, for four minutes: at most a change in ten seconds, and ever fewer."""
    machine = Machine(slowness=lambda at_s: 3.0 if int(at_s / 4) % 2 else 1.0)
    pairs, _ = machine.play(BUDGET_NS, LADDER, 240)
    early, later = ([c for c in changes(pairs) if (c.at_ns < 120 * S) is first] for first in (True, False))
    assert len(early) <= 15
    assert len(later) <= 6
    assert late(pairs) < 0.02


def test_a_budget_that_cannot_be_reached_gets_the_best_of_the_fastest() -> None:
    """Decoding alone takes longer than the budget: the controller says so, stays, and narrows no search that gains nothing."""
    machine = Machine(rest_ns=20e6)
    controller = BudgetController(4 * MS, LADDER, 0)
    seen = Counter[Step]()
    for number in range(1, 600):
        step = controller.step
        seen[step] += 1
        match_ns = round(machine.match_ns(step))
        controller.add(20 * MS + match_ns, match_ns, number * S // 30)
    assert controller.is_missed
    assert controller.processing_ns > 4 * MS
    fastest_ns = min(map(machine.total_ns, LADDER))
    assert machine.total_ns(controller.step) <= 1.15 * fastest_ns
    assert controller.step.choice.disparities == 96
    assert len(seen) <= 4


@settings(deadline=None, max_examples=60)
@given(
    step_ns=st.floats(0.05, 20),
    pixel_ns=st.floats(0, 500),
    block_ns=st.floats(0.05, 20),
    rest_ms=st.floats(0, 40),
    budget_ms=st.integers(1, 200),
)
# Nothing is expected to hold these budgets, because nothing that was measured is like the cheapest steps, which do.
@example(step_ns=20.0, pixel_ns=2.63, block_ns=20.0, rest_ms=15.25, budget_ms=23)
@example(step_ns=15.92, pixel_ns=89.9, block_ns=19.78, rest_ms=8.59, budget_ms=20)
def test_what_was_measured_too_slow_is_not_tried_again(
    step_ns: float, pixel_ns: float, block_ns: float, rest_ms: float, budget_ms: int
) -> None:
    """On any steady machine no step that is too slow is entered twice and after a minute nothing changes, where one holds the budget with room to spare; where none does, tries become rare."""
    costs: dict[AnyMatcher, UsualCost] = {
        MatcherName.SGBM: UsualCost(step_ns=step_ns, pixel_ns=pixel_ns),
        MatcherName.BLOCK: UsualCost(step_ns=block_ns, pixel_ns=1.0),
    }
    budget_ns = budget_ms * MS
    machine = Machine(costs=costs, rest_ns=rest_ms * 1e6, noise=0.0, period_ns=S // 10)
    pairs, _ = machine.play(budget_ns, LADDER, 90)
    entered = Counter(change.step for change in changes(pairs))
    fitting = [step for step in LADDER if machine.total_ns(step) <= budget_ns]
    if fitting:
        assert all(entered[step] <= 1 for step in LADDER if machine.total_ns(step) > budget_ns)
    has_room = any(machine.total_ns(step) <= 0.9 * budget_ns for step in LADDER)
    assert sum(change.at_ns > 60 * S for change in changes(pairs)) <= (0 if has_room else 1)


def test_new_evidence_opens_a_step_again() -> None:
    """Full size seems to fit and does not: it is tried once. When the machine becomes 1.7 times as fast, it is tried again, and holds."""
    two = (LADDER[0], LADDER[3])
    # All work is in the disparities, so full size is 7.5 times half of it, not 4.2 times as with the usual ratio.
    machine = Machine(
        costs={MatcherName.SGBM: UsualCost(step_ns=10.0, pixel_ns=0.0)},
        slowness=lambda at_s: 0.12 if at_s < 60 else 0.07,
        noise=0.0,
    )
    pairs, reasons = machine.play(BUDGET_NS, two, 120)
    assert machine.total_ns(two[0], 0.12) > BUDGET_NS > machine.total_ns(two[0], 0.07)
    assert reasons == [BudgetReason.ROOM, BudgetReason.TOO_SLOW, BudgetReason.ROOM]
    assert sum(pair.at_ns < 60 * S for pair in pairs if pair.step == two[0]) <= 5
    assert pairs[-1].step == two[0]


@pytest.mark.parametrize("ratio", [0.0, 10.0, 100.0, 300.0])
def test_the_model_learns_what_a_pixel_costs_besides(ratio: float) -> None:
    """From three measured steps the others are foretold to 15 %, whatever the ratio of the two terms."""
    scaled = steps(MatcherName.SGBM, may_narrow=False)
    machine = Machine(costs={MatcherName.SGBM: UsualCost(step_ns=2.0, pixel_ns=2.0 * ratio)})
    model = CostModel()
    for step in (scaled[7], scaled[4], scaled[1]):
        for _ in range(12):
            model.observe(step, machine.match_ns(step))
    for step in scaled[1:]:
        assert model.expected_ns(step) == pytest.approx(machine.match_ns(step), rel=0.15)


def test_a_slower_machine_is_expected_to_be_slower_everywhere() -> None:
    """Once a step is known, twice its time means twice the time of every step."""
    model = CostModel()
    for _ in range(20):
        model.observe(LADDER[3], 10e6)
    before = [model.expected_ns(step) for step in LADDER]
    for _ in range(20):
        model.observe(LADDER[3], 20e6)
    assert [model.expected_ns(step) for step in LADDER] == pytest.approx([2 * value for value in before])


def test_the_first_pair_after_a_change_does_not_count() -> None:
    """It pays for new buffers: 500 ms, then 10 ms each; nothing changes before there is patience for a climb."""
    controller = BudgetController(BUDGET_NS, LADDER, 0)
    assert controller.add(500 * MS, 400 * MS, 0) is None
    assert all(controller.add(25 * MS, 20 * MS, number * 33 * MS) is None for number in range(1, 40))


def test_the_ladder_goes_from_the_whole_to_the_smallest() -> None:
    """All of the size, smaller ones, at the smallest a narrower search; then the next matcher. Ranges are multiples of 16."""
    assert [step.choice.matcher for step in LADDER] == [MatcherName.SGBM] * 10 + [MatcherName.BLOCK] * 10
    first = [(step.width_px, step.height_px, step.choice.disparities) for step in LADDER[:10]]
    assert first[0] == (640, 480, 96)
    assert first[3] == (320, 240, 96)
    assert first[7:] == [(160, 120, 96), (160, 120, 80), (160, 120, 48)]
    assert LADDER[3].searched == 48


@pytest.mark.parametrize(("may_scale", "may_narrow", "count"), [(False, False, 1), (True, False, 8), (False, True, 3)])
def test_what_the_user_fixed_stays(count: int, *, may_scale: bool, may_narrow: bool) -> None:
    """Sizes, ranges or both are those of the first step."""
    found = steps(MatcherName.BLOCK, may_scale=may_scale, may_narrow=may_narrow)
    assert len(found) == count
    assert may_scale or {step.choice.scale for step in found} == {1.0}
    assert may_narrow or {step.choice.disparities for step in found} == {96}
    assert {step.choice.matcher for step in found} == {MatcherName.BLOCK}


def test_small_images_do_not_become_tiny() -> None:
    """160x120 px may be matched at half of the size, 80x60 px, and not at less; 40x30 px only as they are."""

    def smallest(width_px: int, height_px: int) -> int:
        extent = Extent(width_px=width_px, height_px=height_px, search=Search(disparities=16), geometry=None)
        return ladder(extent, BudgetWanted(budget_ns=1, matchers=(MatcherName.SGBM,)))[-1].height_px

    assert (smallest(160, 120), smallest(40, 30)) == (60, 30)


def test_every_matcher_of_ours_has_a_place_in_the_order() -> None:
    """Or it would never be chosen."""
    assert set(BEST_FIRST) == set(MatcherName)


def test_a_choice_is_one_key() -> None:
    """Equal choices share what a core has made for them."""
    one, same = (Choice(matcher=MatcherName.SGBM, scale=0.5, disparities=64) for _ in range(2))
    assert {one: 1}[same] == 1


@pytest.mark.parametrize("budget_ms", [4, 12])
def test_a_busy_machine_that_cannot_hold_the_budget_settles(budget_ms: int) -> None:
    """Times that vary by the whole of themselves, all or most pairs late: a change in five seconds at most, and ever fewer."""
    pairs, _ = Machine(noise=1.0).play(budget_ms * MS, LADDER, 120)
    assert len([change for change in changes(pairs) if change.at_ns <= 60 * S]) <= 12
    assert len([change for change in changes(pairs) if change.at_ns > 60 * S]) <= 6


@pytest.mark.parametrize(("slower_by_s", "most"), [(math.inf, 6), (30.0, 10)])
def test_noise_of_a_busy_machine_does_not_make_it_flutter(slower_by_s: float, most: int) -> None:
    """Times that vary by a third: less than a change in ten seconds; in six while the machine becomes three times slower."""
    pairs, _ = Machine(noise=0.3, slowness=lambda at_s: 1 + at_s / slower_by_s).play(BUDGET_NS, LADDER, 60)
    assert len(changes(pairs)) <= most
