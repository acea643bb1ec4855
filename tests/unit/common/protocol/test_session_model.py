"""Whatever happens to clocks, programs and links, in any order: no pair has images of different moments, and every frame is accounted for."""

import hypothesis.strategies as st
import pytest
from hypothesis import settings
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from common.protocol.message import Knock, Lane, Pong
from common.protocol.session import MS
from phone_host.sync.quarantine import Disbelief
from tests.support.stepping_world import Machine, SteppingWorld
from tests.support.witness import PERIOD_NS

pytestmark = pytest.mark.many

SECOND_NS = 1000 * MS
FAR_NS = st.one_of(
    st.integers(2 * PERIOD_NS, SECOND_NS), st.sampled_from([2 * SECOND_NS, 7 * SECOND_NS, 13 * SECOND_NS])
)
NEAR_NS = st.integers(5 * MS, 2 * PERIOD_NS - 1)


class Happenings(RuleBasedStateMachine):
    """Every event that may happen between two machines."""

    world: SteppingWorld
    usual: int

    @initialize(
        latency_ns=st.sampled_from([MS // 2, 20 * MS, 150 * MS]),
        jitter=st.sampled_from([0.0, 0.3, 2.0]),
        seed=st.integers(0, 99),
    )
    def begin(self, latency_ns: int, jitter: float, seed: int) -> None:
        """Two machines that have exchanged hellos."""
        self.world = SteppingWorld(latency_ns, jitter, seed)
        self.world.run(2500 * MS)
        before = self.world.witness.pairs
        self.world.run(2 * SECOND_NS)
        self.usual = self.world.witness.pairs - before

    def machine(self, *, of_board: bool) -> Machine:
        """One of the two machines."""
        return self.world.board if of_board else self.world.host

    @rule(duration_ns=st.integers(20 * MS, 1500 * MS))
    def time_passes(self, duration_ns: int) -> None:
        """Nothing happens for a while."""
        self.world.run(duration_ns)

    @rule(by_ns=FAR_NS, back=st.booleans())
    def the_boards_clock_steps(self, *, by_ns: int, back: bool) -> None:
        """By two periods or more, either way."""
        self.world.step(self.world.board, -by_ns if back else by_ns)

    @rule(by_ns=NEAR_NS, back=st.booleans())
    def the_boards_clock_steps_a_little(self, *, by_ns: int, back: bool) -> None:
        """By less than two periods, either way; two steps between two echoes could cancel, and nobody would ever know."""
        if not self.world.witness.unsettled:
            self.world.step(self.world.board, -by_ns if back else by_ns)

    @rule(by_ns=st.one_of(FAR_NS, NEAR_NS))
    def the_hosts_clock_steps(self, by_ns: int) -> None:
        """Forward: CLOCK_MONOTONIC never goes back."""
        if not self.world.witness.unsettled:
            self.world.step(self.world.host, by_ns)

    @rule(of_board=st.booleans(), duration_ns=st.one_of(FAR_NS, NEAR_NS), told=st.booleans())
    def a_machine_sleeps(self, *, of_board: bool, duration_ns: int, told: bool) -> None:
        """Its clock stands still; its kernel reports that, or does not. If no echo can have proven it before the clock's life ends, nobody can judge it."""
        if self.world.witness.unsettled or self.world.reception.estimate is None:
            return
        self.world.sleep(self.machine(of_board=of_board), duration_ns, told=told)
        self.world.run(duration_ns)

    @rule(of_board=st.booleans(), both=st.booleans(), duration_ns=st.integers(50 * MS, 5 * SECOND_NS))
    def a_program_is_stopped(self, *, of_board: bool, both: bool, duration_ns: int) -> None:
        """One of the two, or both at once."""
        for machine in (self.world.board, self.world.host):
            if both or machine is self.machine(of_board=of_board):
                self.world.stop(machine, duration_ns)
        self.world.run(duration_ns)

    @rule(lane=st.sampled_from(Lane), to=st.sampled_from(["board", "host"]))
    def a_message_is_lost(self, lane: Lane, to: str) -> None:
        """Silently."""
        self.world.lose(lane, to)

    @rule(lane=st.sampled_from(Lane), to=st.sampled_from(["board", "host"]))
    def a_message_comes_twice(self, lane: Lane, to: str) -> None:
        """As from a transport that delivers twice."""
        self.world.repeat(lane, to)

    @rule(lane=st.sampled_from(Lane))
    def a_connection_breaks(self, lane: Lane) -> None:
        """Both sides are notified."""
        self.world.break_lane(lane)

    @rule()
    def the_board_restarts(self) -> None:
        """A new life on the same clock."""
        self.world.restart_board()

    @rule(by_ns=st.sampled_from([-3600 * SECOND_NS, -10 * SECOND_NS, 10 * SECOND_NS, 3600 * SECOND_NS, 2**61]))
    def a_stamp_lies(self, by_ns: int) -> None:
        """The stamps of one frame are off by seconds or more."""
        self.world.lie(self.world.false_frame(by_ns))

    @rule(by_ns=st.sampled_from([-3600 * SECOND_NS, -SECOND_NS, SECOND_NS, 3600 * SECOND_NS]), wave=st.integers(0, 500))
    def an_echo_lies(self, by_ns: int, wave: int) -> None:
        """An answer in a wave, perhaps the present one, gives a false time."""
        told_ns, asked_ns = self.world.board_clock() + by_ns, self.world.host_clock() - MS
        self.world.lie(Pong(wave=wave, t0_ns=asked_ns, t1_ns=told_ns, t2_ns=told_ns))

    @rule()
    def a_stray_knock(self) -> None:
        """The board says that it does not know the host."""
        self.world.lie(Knock(Lane.CONTROL, self.world.board_session))

    @invariant()
    def no_wrong_pair(self) -> None:
        """After a step of two periods no pair is wrong; after a smaller one none from the first answered echo on."""
        if not hasattr(self, "world"):
            return
        assert all(pair.excusable for pair in self.world.witness.wrong), self.world.witness.wrong

    @invariant()
    def accounts_conserve(self) -> None:
        """Received frames are paired, orphaned, held, or dropped by reason."""
        if hasattr(self, "world"):
            self.world.check_accounts()

    def teardown(self) -> None:
        """At the end pairs come again, and each wrong one is reported as suspect."""
        if not hasattr(self, "world"):
            return
        self.world.run(6 * SECOND_NS)
        before = self.world.witness.pairs
        self.world.run(2 * SECOND_NS)
        assert self.world.witness.pairs - before >= 0.2 * self.usual, "pairs come again"
        self.world.check_accounts()
        self.no_wrong_pair()
        unnamed = [pair for pair in self.world.witness.wrong if not self.world.is_suspect(pair)]
        assert unnamed == []


TestHappenings = pytest.mark.long(Happenings.TestCase)
TestHappenings.settings = settings(deadline=None, max_examples=25, stateful_step_count=15)


@pytest.mark.parametrize("seed", range(12))
def test_a_step_that_hides_in_a_slow_link(seed: int) -> None:
    """Frames that take 30 to 120 ms cannot show a step of 67 to 90 ms. They wait for an echo, and no pair is wrong, not even before it comes."""
    world = SteppingWorld(30 * MS, 3.0, seed)
    world.run(2500 * MS + seed * 41 * MS)
    world.step(world.board, 2 * PERIOD_NS + seed * 2 * MS)
    world.run(3 * SECOND_NS)
    assert world.witness.wrong == []
    before = world.witness.pairs
    world.run(2 * SECOND_NS)
    assert world.witness.pairs > before


@pytest.mark.parametrize("latency_ns", [300 * MS, 700 * MS, 1500 * MS])
def test_a_link_that_becomes_slow(latency_ns: int) -> None:
    """If a round trip becomes longer than the time between two waves, and longer than the wait for a wave, echoes still count and pairs come."""
    world = SteppingWorld(20 * MS, 0.3, 1)
    world.run(3 * SECOND_NS)
    world.latency_ns = latency_ns
    world.run(5 * SECOND_NS)
    before = world.witness.pairs
    world.run(20 * SECOND_NS)
    assert world.witness.pairs - before >= 20 * SECOND_NS // (4 * latency_ns)
    assert world.witness.wrong == []
    assert world.reception.account.clock_steps == 0


def test_a_board_that_answers_no_echo_is_named() -> None:
    """A board sends frames and answers no echo: from the first unusual frame on none is believed, and each is counted by its reason."""
    world = SteppingWorld(2 * MS, 0.0, 1)
    world.run(3 * SECOND_NS)
    world.answers_echoes = False
    world.latency_ns = 120 * MS
    world.run(200 * MS)
    world.latency_ns = 2 * MS
    before = world.witness.pairs
    world.run(30 * SECOND_NS)
    assert world.witness.pairs - before <= 8
    assert world.reception.account.disbelieved[Disbelief.UNPROVEN] >= 8
    world.check_accounts()
    world.answers_echoes = True
    world.run(2 * SECOND_NS)
    before = world.witness.pairs
    world.run(1 * SECOND_NS)
    assert world.witness.pairs - before >= 25


@pytest.mark.long
@pytest.mark.parametrize("lane", Lane)
@pytest.mark.parametrize("after_ms", range(0, 150, 15))
def test_a_connection_that_breaks_in_a_doubt_forgets_no_step(lane: Lane, after_ms: int) -> None:
    """A machine slept for a moment, and its connection breaks soon after: each wrong pair is still reported as suspect."""
    world = SteppingWorld(1 * MS, 0.0, 1)
    world.run(2700 * MS)
    world.step(world.board, -30 * MS)
    while not world.reception.account.clock_doubts:
        world.run(5 * MS)
    world.run(after_ms * MS)
    world.break_lane(lane)
    world.run(3 * SECOND_NS)
    assert world.reception.account.clock_steps == 1
    assert all(world.is_suspect(pair) for pair in world.witness.wrong)
    assert world.reception.account.suspects


@pytest.mark.parametrize("seed", range(10))
def test_a_wave_that_lies_is_not_confirmed_by_slow_echoes(seed: int) -> None:
    """Honest echoes that are so slow that a lie fits them as well do not make the lie true."""
    world = SteppingWorld(60 * MS, 4.0, seed)
    world.run(4 * SECOND_NS)
    told_ns, asked_ns = world.board_clock() + 180 * MS, world.host_clock() - MS
    world.lie(Pong(wave=world.wave, t0_ns=asked_ns, t1_ns=told_ns, t2_ns=told_ns))
    world.run(4 * SECOND_NS)
    assert world.reception.account.clock_steps == 0
    assert world.witness.wrong == []
