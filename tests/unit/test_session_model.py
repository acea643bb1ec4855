"""Whatever happens to clocks, programs and wires, in any order: no pair of images of different moments, and every frame accounted for."""

import hypothesis.strategies as st
import pytest
from hypothesis import settings
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from common.protocol.message import Knock, Lane, Pong
from common.protocol.session import MS
from tests.support.stepping_world import PERIOD_NS, Machine, SteppingWorld

SECOND_NS = 1000 * MS
FAR_NS = st.one_of(
    st.integers(2 * PERIOD_NS, SECOND_NS), st.sampled_from([2 * SECOND_NS, 7 * SECOND_NS, 13 * SECOND_NS])
)
NEAR_NS = st.integers(5 * MS, 2 * PERIOD_NS - 1)


class Happenings(RuleBasedStateMachine):
    """Everything that may happen between two machines."""

    world: SteppingWorld

    @initialize(
        latency_ns=st.sampled_from([MS // 2, 20 * MS, 150 * MS]),
        jitter=st.sampled_from([0.0, 0.3, 2.0]),
        seed=st.integers(0, 99),
    )
    def begin(self, latency_ns: int, jitter: float, seed: int) -> None:
        """Two machines that have met."""
        self.world = SteppingWorld(latency_ns, jitter, seed)
        self.world.run(2500 * MS)

    def machine(self, *, of_board: bool) -> Machine:
        """One of the two."""
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
        """By less than two periods, either way; two steps between two echoes could undo each other, and nobody would ever know."""
        if not self.world.unsettled:
            self.world.step(self.world.board, -by_ns if back else by_ns)

    @rule(by_ns=st.one_of(FAR_NS, NEAR_NS))
    def the_hosts_clock_steps(self, by_ns: int) -> None:
        """Forward: CLOCK_MONOTONIC never goes back."""
        if not self.world.unsettled:
            self.world.step(self.world.host, by_ns)

    @rule(of_board=st.booleans(), duration_ns=st.one_of(FAR_NS, NEAR_NS), told=st.booleans())
    def a_machine_sleeps(self, *, of_board: bool, duration_ns: int, told: bool) -> None:
        """Its clock stands still; its kernel tells, or does not. What no echo can have proven before the clock's life ends nobody can judge."""
        if self.world.unsettled or self.world.reception.estimate is None:
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
        """Without a sound."""
        self.world.lose(lane, to)

    @rule(lane=st.sampled_from(Lane), to=st.sampled_from(["board", "host"]))
    def a_message_comes_twice(self, lane: Lane, to: str) -> None:
        """As from a transport that delivers again."""
        self.world.repeat(lane, to)

    @rule(lane=st.sampled_from(Lane))
    def a_connection_breaks(self, lane: Lane) -> None:
        """Both sides are told."""
        self.world.break_lane(lane)

    @rule()
    def the_board_restarts(self) -> None:
        """A new life on the same clock."""
        self.world.restart_board()

    @rule(by_ns=st.sampled_from([-3600 * SECOND_NS, -10 * SECOND_NS, 10 * SECOND_NS, 3600 * SECOND_NS, 2**61]))
    def a_stamp_lies(self, by_ns: int) -> None:
        """One frame's stamps are off by seconds or more."""
        self.world.lie(self.world.false_frame(by_ns))

    @rule(by_ns=st.sampled_from([-3600 * SECOND_NS, -SECOND_NS, SECOND_NS, 3600 * SECOND_NS]), wave=st.integers(0, 500))
    def an_echo_lies(self, by_ns: int, wave: int) -> None:
        """An answer of a wave, perhaps of the present one, tells another time."""
        told_ns, asked_ns = self.world.board_clock() + by_ns, self.world.host_clock() - MS
        self.world.lie(Pong(wave, asked_ns, told_ns, told_ns))

    @rule()
    def a_stray_knock(self) -> None:
        """The board says that it does not know the host."""
        self.world.lie(Knock(Lane.CONTROL, self.world._board.session))

    @invariant()
    def no_wrong_pair(self) -> None:
        """After a step of two periods none is wrong; after a smaller one none from the first answered echo on."""
        if not hasattr(self, "world"):
            return
        assert all(pair.excusable for pair in self.world.wrong), self.world.wrong

    @invariant()
    def accounts_conserve(self) -> None:
        """Received is paired, orphaned, held, or dropped by name."""
        if hasattr(self, "world"):
            self.world.check_accounts()

    def teardown(self) -> None:
        """In the end pairs come again, and each wrong one is named as suspect."""
        if not hasattr(self, "world"):
            return
        self.world.run(6 * SECOND_NS)
        before = self.world.pairs
        self.world.run(2 * SECOND_NS)
        assert self.world.pairs - before >= 2, "pairs come again"
        self.world.check_accounts()
        self.no_wrong_pair()
        unnamed = [pair for pair in self.world.wrong if not self.world.is_suspect(pair)]
        assert unnamed == []


TestHappenings = Happenings.TestCase
TestHappenings.settings = settings(deadline=None, max_examples=25, stateful_step_count=15)


@pytest.mark.parametrize("seed", range(12))
def test_a_step_that_hides_in_a_slow_link(seed: int) -> None:
    """Frames that take 30 to 120 ms cannot show a step of 67 to 90 ms: they wait for an echo, and no pair is wrong, also before it comes."""
    world = SteppingWorld(30 * MS, 3.0, seed)
    world.run(2500 * MS + seed * 41 * MS)
    world.step(world.board, 2 * PERIOD_NS + seed * 2 * MS)
    world.run(3 * SECOND_NS)
    assert world.wrong == []
    assert world.reception.account.clock_steps == 1
    before = world.pairs
    world.run(2 * SECOND_NS)
    assert world.pairs > before
