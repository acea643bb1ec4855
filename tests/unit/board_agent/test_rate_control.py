"""The ladder of a camera's modes, and the choice among them, on simulated links of any rate and on simulated time."""

import random
from dataclasses import dataclass, field, replace
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from board_agent.outbox import Outbox
from board_agent.rate_control import RateControl, Way, ladder, ways
from common.camera.base import Mode, Offers
from common.errors import SettingsError
from common.frame import PixelFormat
from tests.support.samples import shot

MS = 1_000_000
S = 1_000_000_000
FRAME = shot(0, 0, "board", size_px=(8, 8), pixel_format=PixelFormat.GREY, payload=bytes(64))

OFFERS = Offers((50 * MS, 100 * MS, 200 * MS, 400 * MS), (90, 68, 41))
"""20, 10, 5 and 2.5 frames a second; three qualities."""


def size_bytes(mode: Mode) -> float:
    """The mean size of a mode's images; the shares are those of libjpeg's tables to a tenth."""
    return {90: 30_000.0, 68: 15_000.0, 41: 9_000.0, 0: 30_000.0}[mode.quality]


def load(mode: Mode) -> float:
    """What a mode needs of the link, bytes/s."""
    return size_bytes(mode) * S / mode.period_ns


@dataclass
class Street:
    """A camera, its outbox and a link of some rate, on one clock.

    Attributes:
        modes: the ladder.
        bytes_per_s: what the link carries.
        spread: by which share sizes vary around their mean.
        steps: when the mode changed, and to which index.
    """

    modes: tuple[Mode, ...]
    bytes_per_s: float
    spread: float = 0.0
    link: int | None = 0
    seed: int = 1
    now_ns: int = 0
    steps: list[tuple[int, int]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.control = RateControl(self.modes)
        self.outbox = Outbox()
        self.chance = random.Random(self.seed)
        self.free_ns = self.frame_ns = 0

    def run(self, seconds: float) -> None:
        """Let time pass."""
        end_ns = self.now_ns + round(seconds * S)
        while self.now_ns < end_ns:
            waits = self.outbox.waiting is not None
            self.now_ns = min(self.frame_ns, self.free_ns) if waits and self.free_ns > self.now_ns else self.frame_ns
            if self.now_ns >= self.frame_ns:
                self.outbox.put(FRAME, has_host=self.link is not None)
                self.frame_ns += self.control.mode.period_ns
            if self.outbox.waiting is not None and self.now_ns >= self.free_ns:
                size = size_bytes(self.control.mode) * (1 + self.chance.uniform(-self.spread, self.spread))
                self.outbox.sent()
                self.free_ns = self.now_ns + round(size / self.bytes_per_s * S)
            if self.control.is_due(self.now_ns) and self.control.update(self.outbox.counts, self.link, self.now_ns):
                self.steps.append((self.now_ns, self.control.rung.index))

    def mostly(self, seconds: float) -> int:
        """Run on; returns the rung that was in use for most of the time."""
        begin_ns, before = self.now_ns, self.control.rung.index
        done = len(self.steps)
        self.run(seconds)
        times = [(begin_ns, before), *self.steps[done:], (self.now_ns, -1)]
        spent: dict[int, int] = {}
        for (start_ns, index), (stop_ns, _) in pairwise(times):
            spent[index] = spent.get(index, 0) + stop_ns - start_ns
        return max(spent, key=lambda index: spent[index])


MODES = ladder(OFFERS, {Way.QUALITY, Way.RATE}, 2.5)


def test_quality_gives_way_before_the_rate() -> None:
    """The ladder lowers first the quality at the full rate, then the rate to its minimum, then the size if that is allowed; each rung needs less."""
    periods, qualities = OFFERS.periods_ns, OFFERS.qualities
    assert [(mode.period_ns, mode.quality) for mode in MODES] == [
        (periods[0], qualities[0]),
        (periods[0], qualities[1]),
        (periods[0], qualities[2]),
        (periods[1], qualities[2]),
        (periods[2], qualities[2]),
        (periods[3], qualities[2]),
    ]
    assert all(load(above) > load(below) for above, below in pairwise(MODES))
    assert ladder(OFFERS, {Way.QUALITY, Way.RATE}, 5) == MODES[:5]
    assert ladder(OFFERS, {Way.QUALITY, Way.RATE}, 0) == MODES[:3]
    assert ladder(OFFERS, {Way.RATE}, 0) == MODES[:1]
    assert ladder(OFFERS, (), 2.5) == MODES[:1]
    sized = replace(OFFERS, sizes_px=((640, 480), (320, 240), (160, 120)))
    whole = ladder(sized, set(Way), 2.5)
    assert [replace(mode, size_px=(0, 0)) for mode in whole] == [*MODES, MODES[-1], MODES[-1]]
    assert [mode.size_px for mode in whole] == [(640, 480)] * len(MODES) + [(320, 240), (160, 120)]
    assert [mode.size_px for mode in ladder(sized, {Way.QUALITY}, 0)] == [(640, 480)] * 3
    assert ladder(Offers((50 * MS, 100 * MS)), {Way.QUALITY, Way.RATE}, 10) == (Mode(50 * MS), Mode(100 * MS))
    assert ladder(Offers(), {Way.QUALITY, Way.RATE}, 10) == ()


def test_what_gives_way_is_read_from_names() -> None:
    """Names are taken in any order, and an unknown one is refused by name."""
    assert ways(["rate", "quality"]) == {Way.QUALITY, Way.RATE}
    assert ways([]) == frozenset()
    with pytest.raises(SettingsError, match="'colour'"):
        ways(["rate", "colour"])


@pytest.mark.long
@settings(max_examples=60, deadline=None)
@given(st.floats(10_000, 1_200_000), st.floats(0, 0.3), st.integers(0, 99))
def test_a_constant_link_is_found_out_and_left_in_peace(bytes_per_s: float, spread: float, seed: int) -> None:
    """On a link of any constant rate the camera ends on the highest rung that the link carries, or on the lowest, and seldom leaves it."""
    street = Street(MODES, bytes_per_s, spread, seed=seed)
    street.run(120)
    kept = street.mostly(600)
    carried = [index for index, mode in enumerate(MODES) if load(mode) <= 0.88 * bytes_per_s]
    overloaded = [index for index, mode in enumerate(MODES) if load(mode) * 0.8 >= bytes_per_s]
    assert kept <= (carried[0] if carried else len(MODES) - 1)
    assert kept >= min((overloaded[-1] + 1) if overloaded else 0, len(MODES) - 1)
    # In any minute there are at most the way down once, and three failed trials.
    times = [time_ns for time_ns, _ in street.steps]
    for first, time_ns in enumerate(times):
        within = sum(1 for later_ns in times[first:] if later_ns < time_ns + 60 * S)
        assert within <= len(MODES) - 1 + 6
    assert all(abs(b - a) == 1 for (_, a), (_, b) in pairwise(street.steps))


@pytest.mark.long
@settings(max_examples=30, deadline=None)
@given(st.sampled_from([20_000.0, 60_000.0, 150_000.0]), st.floats(0, 0.2), st.integers(0, 99))
def test_trials_become_rare(bytes_per_s: float, spread: float, seed: int) -> None:
    """On a link whose rate is far from every rung's there are at most four failed trials in the ten minutes after the first five trials."""
    street = Street(MODES, bytes_per_s, spread, seed=seed)
    street.run(300)
    before = len(street.steps)
    street.run(600)
    assert len(street.steps) - before <= 8


@pytest.mark.parametrize("slow_s", [20.0, 60.0, 600.0])
def test_it_recovers_with_the_link(slow_s: float) -> None:
    """After a slow time on the link the camera is back at full mode within the longest time between two trials plus 15 s for each rung."""
    street = Street(MODES, 20_000.0)
    street.run(slow_s)
    assert street.control.rung.index >= 3
    street.bytes_per_s = 1e7
    street.run(300 + 15 * len(MODES))
    assert street.control.rung.index == 0
    carried = street.outbox.counts.sent
    street.run(10)
    assert street.outbox.counts.sent - carried >= 199


def test_a_new_link_is_tried_soon() -> None:
    """However far apart the trials on the old link were, on a new link the first one follows within ten seconds; until then the rung stays."""
    street = Street(MODES, 20_000.0)
    street.run(600)
    kept = street.control.rung.index
    street.link, street.bytes_per_s = 1, 1e7
    street.run(3)
    assert street.control.rung.index == kept
    street.run(7)
    assert street.control.rung.index < kept


def test_a_hiccup_changes_nothing() -> None:
    """On a fast link that stalls for 0.8 s now and then the mode is unchanged."""
    street = Street(MODES, 1e7)
    for _ in range(20):
        street.run(7)
        street.free_ns = street.now_ns + 800 * MS
    assert street.steps == []


def test_without_a_link_nothing_changes() -> None:
    """While no host takes frames, the rung stays, however many frames are dropped."""
    street = Street(MODES, 1e7, link=None)
    street.run(60)
    assert street.steps == []
    assert street.control.rung.last == 5
