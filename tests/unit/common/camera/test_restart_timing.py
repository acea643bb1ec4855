"""When to start a camera again so that it exposes at a wanted phase, with stamps and starts of which some come late."""

import random

import pytest

from common.camera.v4l2_stamps import RestartTiming, typical_phase

MS = 1_000_000
LATENCY_NS = 130 * MS


def stream(
    timing: RestartTiming, start_ns: int, late_ns: int, period_ns: int, chance: random.Random
) -> tuple[int, int]:
    """Start a camera, let it show 20 frames and return its first and its last true exposure. Every fourth stamp comes up to 30 ms late."""
    timing.started(start_ns)
    first_ns = start_ns + late_ns + LATENCY_NS
    for number in range(20):
        scatter_ns = round(chance.uniform(5, 30) * MS) if number % 4 == 3 else 0
        timing.exposed([first_ns + number * period_ns + scatter_ns])
    return first_ns, first_ns + 19 * period_ns


@pytest.mark.parametrize("period_ns", [100 * MS, 66_666_667, 33_333_333])
def test_one_late_start_does_not_spoil_the_next(period_ns: int) -> None:
    """Every fifth start comes 40 ms late: after three good ones, each start that is itself on time gives the wanted phase to 1 ms."""
    chance = random.Random(5)
    timing = RestartTiming()
    first_ns, last_ns = stream(timing, 10**12, 0, period_ns, chance)
    for turn in range(1, 40):
        later_ns = chance.randrange(period_ns)
        start_ns = timing.start_for(later_ns, last_ns + 50 * MS, period_ns)
        assert start_ns is not None
        assert 0 <= start_ns - last_ns - 50 * MS < period_ns
        wanted_ns, late_ns = first_ns + later_ns, 40 * MS if turn % 5 == 4 else 0
        first_ns, last_ns = stream(timing, start_ns, late_ns, period_ns, chance)
        off_ns = (first_ns - late_ns - wanted_ns + period_ns // 2) % period_ns - period_ns // 2
        assert abs(off_ns) < MS, (turn, off_ns)


def test_without_a_frame_no_start_is_known() -> None:
    """A stream that has shown nothing yet, also one that was just started again, gives no moment to start."""
    timing = RestartTiming()
    assert timing.start_for(5, 0, 100) is None
    timing.started(1000)
    timing.exposed([1130])
    assert timing.start_for(5, 1200, 100) == 1205
    timing.started(1205)
    assert timing.start_for(5, 1300, 100) is None


def test_the_typical_phase_is_that_of_most_moments() -> None:
    """Moments a little before and after a multiple of the period share a phase; one that is far off does not move it."""
    assert typical_phase([998, 1102, 1201, 1250, 1301], 100) == 1301


@pytest.mark.parametrize("late_ms", [10, 16, 17, 20, 25, 30])
@pytest.mark.parametrize("count", [5, 14, 15])
def test_a_last_moment_that_is_late_does_not_count(late_ms: int, count: int) -> None:
    """Whatever part of a period the newest of several moments is late, the phase is that of the others to 2 ms."""
    chance, period_ns = random.Random(late_ms), 33_333_333
    for _ in range(50):
        moments_ns = [10**12 + number * period_ns + round(chance.uniform(-1, 1) * MS) for number in range(count)]
        moments_ns[-1] += late_ms * MS
        off_ns = (typical_phase(moments_ns, period_ns) - 10**12 + period_ns // 2) % period_ns - period_ns // 2
        assert abs(off_ns) < 2 * MS
