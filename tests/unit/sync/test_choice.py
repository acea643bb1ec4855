"""The choice of the link that carries: the youngest frames, an order of preference, no flapping. Simulated time."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from phone_host.sync.choice import MEMORY_NS, MOST_MEMORY_NS, MOST_PROOF_NS, PROOF_NS, LinkChoice

MS = 1_000_000
SECOND_NS = 1000 * MS
STEP_NS = 100 * MS


class Links:
    """Simulated links, each with a round trip, what a frame takes beyond half of it, and whether frames get through.

    Args:
        round_trips_ns: of each.
        frames_ns: of each.
    """

    def __init__(self, round_trips_ns: list[float], frames_ns: list[float]) -> None:
        self.choice = LinkChoice(len(round_trips_ns))
        self.round_trips_ns, self.frames_ns = round_trips_ns, frames_ns
        self.now_ns = 10**12
        self.carrier = 0
        self.grabbed = 0
        self.changes: list[tuple[int, int]] = []
        self.stuck: set[int] = set()
        self.chance = random.Random(1)
        for link in range(len(round_trips_ns)):
            self.choice.up(link, self.now_ns)
        self.choice.carries(0, self.now_ns)

    def run(self, duration_ns: int, jitter: float = 0.0) -> None:
        """Let time pass, and follow the choice."""
        end_ns = self.now_ns + duration_ns
        while self.now_ns < end_ns:
            self.now_ns += STEP_NS
            self.grabbed += 3
            for link, round_trip_ns in enumerate(self.round_trips_ns):
                self.choice.echo(link, round(round_trip_ns * (1 + jitter * self.chance.random())), self.now_ns)
            self.choice.account(self.grabbed, self.now_ns, has_credit=True)
            if self.carrier not in self.stuck:
                transit_ns = self.round_trips_ns[self.carrier] / 2 + self.frames_ns[self.carrier]
                self.choice.frame(self.carrier, round(transit_ns * (1 + jitter * self.chance.random())), self.now_ns)
            best = self.choice.best(self.now_ns)
            if best is not None:
                self.carrier = best
                self.changes.append((self.now_ns, best))
                self.choice.carries(best, self.now_ns)


def test_the_link_of_the_youngest_frames_carries() -> None:
    """A link with a longer round trip that carries frames faster is found by trying: of 400 ms and 60 ms, 60 ms wins and stays."""
    links = Links([4 * MS, 20 * MS], [400 * MS, 50 * MS])
    links.run(2 * MEMORY_NS - SECOND_NS, jitter=0.3)
    assert [link for _, link in links.changes] == [1]


def test_of_links_alike_the_first_carries() -> None:
    """If ages differ by only a few ms the order decides: the stream returns to the first link no sooner than a second after that is up again."""
    links = Links([2 * MS, MS], [6 * MS, MS])
    links.choice.down(0, links.now_ns)
    links.choice.carries(1, links.now_ns)
    links.carrier = 1
    links.run(5 * SECOND_NS)
    assert links.carrier == 1
    back_ns = links.now_ns
    links.choice.up(0, back_ns)
    links.run(5 * SECOND_NS)
    assert links.carrier == 0
    assert (
        PROOF_NS <= links.changes[0][0] - back_ns <= 2 * PROOF_NS + 2 * STEP_NS
    )  # it failed once, so it must prove itself twice as long
    assert len(links.changes) == 1


def test_a_link_whose_frames_are_stuck_gives_way() -> None:
    """If the board grabs and nothing comes, the other link takes over within two seconds, even though the first one's echoes are swift."""
    links = Links([MS, 30 * MS], [5 * MS, 100 * MS])
    links.run(5 * SECOND_NS)
    assert links.carrier == 0
    links.stuck.add(0)
    begin_ns = links.now_ns
    links.run(2 * SECOND_NS)
    assert links.changes[0][1] == 1
    assert links.changes[0][0] - begin_ns <= 2 * SECOND_NS


def test_a_link_that_stays_stuck_is_tried_ever_more_seldom() -> None:
    """In ten minutes a link that is always stuck comes to be tried only about once in two minutes, not every second."""
    links = Links([MS, 30 * MS], [5 * MS, 30 * MS])
    links.stuck.add(0)
    links.run(600 * SECOND_NS)
    tries = [now_ns for now_ns, link in links.changes if link == 0]
    assert 5 <= len(tries) <= 16
    assert tries[-1] - tries[-2] >= MOST_PROOF_NS


def test_no_camera_no_blame() -> None:
    """A board that grabs nothing owes nothing: the carrier stays."""
    links = Links([MS, MS], [5 * MS, 5 * MS])
    links.run(2 * SECOND_NS)
    for _ in range(100):
        links.now_ns += STEP_NS
        for link in range(2):
            links.choice.echo(link, MS, links.now_ns)
        links.choice.account(links.grabbed, links.now_ns, has_credit=True)
        assert links.choice.best(links.now_ns) is None


def test_a_slow_link_is_tried_again_after_a_while() -> None:
    """A link that was slow when tried and has become swift is found again within five minutes."""
    links = Links([MS, 10 * MS], [900 * MS, 20 * MS])
    links.run(1000 * SECOND_NS)
    assert links.carrier == 1
    links.frames_ns[0] = MS
    links.run(MOST_MEMORY_NS + 5 * SECOND_NS)
    assert links.carrier == 0


def test_a_link_that_stays_slow_is_tried_ever_more_seldom() -> None:
    """In half an hour a link that is always slow is tried about ten times, and towards the end once in five minutes."""
    links = Links([MS, 10 * MS], [900 * MS, 20 * MS])
    links.run(1800 * SECOND_NS)
    tries = [now_ns for now_ns, link in links.changes if link == 0]
    assert 5 <= len(tries) <= 12
    assert tries[-1] - tries[-2] >= MOST_MEMORY_NS


def test_a_stall_keeps_a_good_link_out_for_seconds_only() -> None:
    """If the preferred link was left because a stalled machine held up its frames for two seconds, it carries again within 15 s."""
    links = Links([MS, 10 * MS], [5 * MS, 5 * MS])
    links.run(60 * SECOND_NS)
    assert links.carrier == 0
    links.frames_ns[0] = 900 * MS
    links.run(2 * SECOND_NS)
    assert links.carrier == 1
    links.frames_ns[0] = 5 * MS
    links.run(15 * SECOND_NS)
    assert links.carrier == 0


@given(
    st.lists(st.tuples(st.floats(0.1, 200), st.floats(0.1, 3000)), min_size=2, max_size=4),
    st.floats(0, 0.15),
)
@settings(deadline=None, max_examples=60)
def test_links_that_stay_as_they_are_are_not_changed_for_ever(kinds: list[tuple[float, float]], jitter: float) -> None:
    """With steady links each one is tried at most once per memory time, and the last choice is within the margins of the best."""
    links = Links([round_trip * MS for round_trip, _ in kinds], [frame * MS for _, frame in kinds])
    links.run(2 * MEMORY_NS - SECOND_NS, jitter)
    assert len(links.changes) <= 2 * len(kinds)
    ages_ns = [(round_trip / 2 + frame) * MS for round_trip, frame in kinds]
    assert ages_ns[links.carrier] * 0.7 * 0.8 <= min(ages_ns) * (1 + jitter) ** 2 + 12 * MS + jitter * max(ages_ns)


@pytest.mark.parametrize("late_ns", [3 * SECOND_NS])
def test_a_link_that_is_not_heard_is_not_chosen(late_ns: int) -> None:
    """A preferred link whose echoes have been missing for three seconds does not take over, however good it was."""
    choice = LinkChoice(2)
    for link in range(2):
        choice.up(link, 0)
    choice.carries(1, 0)
    choice.echo(0, MS, 0)
    for now_ns in range(late_ns, late_ns + 5 * SECOND_NS, STEP_NS):
        choice.echo(1, MS, now_ns)
        choice.frame(1, 2 * MS, now_ns)
        assert choice.best(now_ns) is None


def test_a_late_frame_of_the_link_before_pays_no_debt_of_the_new_one() -> None:
    """After a switch, frames under way on the old link still come. The new link gives way all the same if no frame comes over it."""
    choice = LinkChoice(2)
    for link in range(2):
        choice.up(link, 0)
    choice.carries(0, 0)
    chosen = []
    for number in range(1, 41):
        now_ns = number * STEP_NS
        for link in range(2):
            choice.echo(link, MS, now_ns)
        choice.account(number, now_ns, has_credit=True)
        choice.frame(1, 5 * MS, now_ns)
        chosen.append(choice.best(now_ns))
    assert 1 in chosen
