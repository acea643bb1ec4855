"""Decisions when echoes contradict each other or say nothing: one clock over one link, over several, and the border that relies on them."""

import random
from dataclasses import replace
from fractions import Fraction

import pytest

from common.ledger import BoardMarks
from common.protocol.message import BoardCounts
from common.protocol.session import Echo
from phone_host.accounts.link_account import LinkAccount, LinkTally, SessionAccount
from phone_host.stream.border import Admitted, Arrival, Border
from phone_host.sync.allowed_lines import Spacing, allowed_lines, believe
from phone_host.sync.clock import ClockEstimator, Heard
from phone_host.sync.clocks import LinkClocks
from phone_host.sync.quarantine import Disbelief
from tests.support.samples import CAMERA
from tests.support.session_world import frame
from tests.support.two_clocks import START_NS, TwoClocks

MS, SECOND_NS = 1_000_000, 1_000_000_000
SAME = TwoClocks(START_NS, Fraction(0))


def echo(wave: int, at_ns: int, there_ns: int, back_ns: int, off_ns: int = 0) -> Echo:
    """An echo between clocks that agree, except that the board claims to be `off_ns` ahead; with these delays there and back."""
    board_ns = at_ns + there_ns + off_ns
    return Echo(wave=wave, t0_ns=at_ns, t1_ns=board_ns, t2_ns=board_ns, t3_ns=at_ns + there_ns + back_ns)


def learnt() -> tuple[ClockEstimator, int]:
    """An estimator that has known two equal clocks for ten seconds, to 0.1 ms; and the time at the end."""
    estimator, chance = ClockEstimator(), random.Random(1)
    for number in range(40):
        for one in SAME.wave(number, START_NS + number * 250 * MS, chance, least_ns=100_000, jitter_ns=50_000)[0]:
            estimator.add(one)
    return estimator, START_NS + 10 * SECOND_NS


def test_slow_echoes_vote_a_lie_down() -> None:
    """One echo that is 6 ms off ends the estimate. Slow echoes fit it as well as they fit the truth, but their middle is the truth, and the second of their waves restores it."""
    estimator, now_ns = learnt()
    lie = echo(100, now_ns, 100_000, 100_000, off_ns=6 * MS)
    slow = [echo(101 + k, now_ns + (k + 1) * 50 * MS, 20 * MS, 20 * MS) for k in range(2)]
    told = [(estimator.add(one), estimator.estimate is None) for one in (lie, *slow)]
    assert told == [(Heard.DOUBTED, True), (Heard.DOUBTED, True), (Heard.AGREED, False)]
    estimate = estimator.estimate
    assert estimate is not None
    assert abs(estimate.offset_at(now_ns)) < 0.1 * MS


def test_facts_that_fit_one_by_one_and_not_together_begin_anew() -> None:
    """An echo that the board kept for two minutes, at one edge of the possible when it came and at the other when it left, fits no steady clock: then only that echo is believed."""
    clocks, estimator, chance = TwoClocks(START_NS, Fraction(-350, 10**6)), ClockEstimator(), random.Random(2)
    for number in range(5):
        for one in clocks.wave(number, START_NS + number * 250 * MS, chance, least_ns=50_000, jitter_ns=0)[0]:
            estimator.add(one)
    before = estimator.estimate
    assert before is not None
    came_ns, left_ns = START_NS + 10 * SECOND_NS, START_NS + 130 * SECOND_NS
    most_ns, least_ns = before.limits_at(came_ns)[1], before.limits_at(left_ns)[0]
    kept = Echo(wave=99, t0_ns=came_ns + most_ns - 1, t1_ns=came_ns, t2_ns=left_ns, t3_ns=left_ns + least_ns + 1)
    assert estimator.add(kept) is Heard.AGREED
    after = estimator.estimate
    assert after is not None
    assert not estimator.is_confirmed
    assert most_ns - 2 <= after.offset_at(left_ns) <= least_ns + 2


def test_the_only_line_that_fits_all_facts_is_the_answer() -> None:
    """Facts above and below that touch at two moments leave a single line: through (-1 s, 3 us) and (0, 5 us), 2 ppm."""
    points = [(-1e9, 3000.0), (0.0, 5000.0)]
    rows = allowed_lines(points, [(age, -value) for age, value in points], 0.0)
    belief = believe(rows, Spacing(1000.0, 1000.0, 5), -SECOND_NS / 2, 0.0)
    assert belief.skew == pytest.approx(2e-6)
    assert belief.offset_ns == pytest.approx(5000.0)


def test_an_echo_that_runs_backwards_is_none() -> None:
    """If the first thing heard cannot be an echo, nothing is known over any link and nothing is in doubt; an honest echo then gives the estimate."""
    clocks = LinkClocks(2)
    bad = replace(echo(1, START_NS, MS, MS), t2_ns=START_NS)
    assert clocks.add(bad) is Heard.NOTHING
    assert (clocks.estimate, clocks.in_doubt) == (None, False)
    assert clocks.add(echo(2, START_NS + MS, MS, MS)) is Heard.AGREED
    assert clocks.estimate is not None


# The border.


class Gate:
    """A border over two links, and its account."""

    def __init__(self) -> None:
        self.account = LinkAccount(links=(LinkTally("tcp"), LinkTally("serial")))
        self.session = SessionAccount("life", BoardCounts(), BoardCounts())
        self.account.sessions.append(self.session)
        self.border = Border(self.account, lambda: None)
        self.now_ns = START_NS
        self.wave = 0

    def learn(self, link: int, off_ns: int = 0, waves: int = 1) -> list[Admitted]:
        """Hear waves of echoes over a link, 50 ms apart, 0.1 ms each way; return the frames that they prove."""
        proven = []
        for _ in range(waves):
            self.now_ns += 50 * MS
            self.wave += 1
            proven += self.border.learn(replace(echo(self.wave, self.now_ns, 100_000, 100_000, off_ns), link=link))
        return proven

    def arrival(self) -> Arrival:
        """A frame that comes over the first link."""
        marks = BoardMarks(exposed_ns=self.now_ns - 5 * MS, grabbed_ns=self.now_ns - 2 * MS, sent_ns=self.now_ns - MS)
        return Arrival(
            frame=replace(frame("life", 7), marks=marks),
            link=0,
            account=self.session,
            camera=CAMERA,
            received_ns=self.now_ns,
        )

    def show(self) -> int:
        """Let a frame come; return how many pass, now or with the echo behind it."""
        return (self.border.admit(self.arrival()) is not None) + len(self.learn(0))


def test_a_frame_before_the_first_echo_is_counted_by_itself() -> None:
    """A frame that comes before anything is known of the clock is dropped and counted as such, not as disbelieved."""
    gate = Gate()
    assert gate.border.admit(gate.arrival()) is None
    assert (gate.account.no_clock, gate.account.disbelieved.total()) == (1, 0)
    gate.learn(0)
    assert gate.show() == 1


def test_a_board_that_boots_while_its_clock_is_in_doubt_leaves_suspects() -> None:
    """The doubt about a clock that is gone is never settled: frames that passed after the last echo that agreed are named as suspect."""
    gate = Gate()
    gate.learn(0, waves=5)
    gate.border.passed(gate.arrival().frame)
    gate.learn(0, off_ns=SECOND_NS)
    assert gate.border.estimate is None
    assert not gate.account.suspects
    gate.border.other_clock()
    assert [(suspects.session, suspects.frames) for suspects in gate.account.suspects] == [("life", 1)]


def test_while_one_link_is_in_doubt_an_echo_of_the_other_proves_nothing() -> None:
    """While a link contradicts itself no frame passes over either link, until the first one has said which of its echoes lied."""
    gate = Gate()
    for link in (0, 1):
        gate.learn(link, waves=5)
    gate.learn(0, off_ns=SECOND_NS)
    assert gate.learn(1) == []
    assert gate.border.estimate is None
    assert gate.border.admit(gate.arrival()) is None
    assert gate.account.disbelieved == {Disbelief.CLOCK: 1}
    gate.learn(0)
    assert gate.show() == 1
    assert gate.account.clock_steps == 0
