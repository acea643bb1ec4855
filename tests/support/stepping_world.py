"""A board, a host and their cameras in simulated time. Their clocks step, sleep and are lied about; the world knows each image's true exposure time.

Both roles of the session, the reception with its border, and the pair queue are the real ones; the wires preserve order
and have latency. True time runs evenly; each machine's clock is true time plus a shift. A sleeping machine does not run
and its clock stands still; a stopped program does not run but its clock goes on.
"""

import random
from collections import deque
from dataclasses import dataclass, replace
from typing import Final

from common.frame import Frame
from common.ledger import BoardMarks
from common.protocol.board_session import BoardSession
from common.protocol.message import (
    BoardCounts,
    FrameMessage,
    Lane,
    Message,
    Ping,
    Pong,
)
from common.protocol.session import MS, Outgoing, connection_name
from phone_host.model import BoardFrame
from phone_host.stream.frame_sink import LinkFacts
from phone_host.stream.pair_queue import PairQueue
from phone_host.stream.reception import Reception
from phone_host.sync.fifo import FifoSettings, Overflow
from phone_host.sync.quarantine import Disbelief
from tests.support.samples import CAMERA, FRAME, shot
from tests.support.sent_frames import frame_outgoing
from tests.support.witness import PERIOD_NS, Witness, WrongPair

_STEP_NS: Final = 5 * MS
_BOARD_GRABS_NS: Final = 4 * MS
_HOST_PHASE_NS: Final = 3 * MS
_CAMERA = replace(CAMERA, period_ns=PERIOD_NS)
_NAMES: Final = {lane: connection_name(0, lane.name.encode()) for lane in Lane}


@dataclass(slots=True)
class Machine:
    """A machine's clock, and until when (true time, ns) it or its program does not run."""

    shift_ns: int
    asleep_until_ns: int = 0
    stopped_until_ns: int = 0
    slept_ns: int = 0
    told: bool = False


class SteppingWorld:
    """The world.

    Args:
        latency_ns: of the wires.
        jitter: frames take up to this part of the latency longer, everything else up to a quarter of that.
        seed: for everything that is left to chance.
    """

    def __init__(self, latency_ns: int, jitter: float, seed: int) -> None:
        self._chance = random.Random(seed)
        self.latency_ns, self._jitter = latency_ns, jitter
        self.answers_echoes = True
        self.wave = 0
        self.true_ns = 10**13
        self.host = Machine(-(10**12))
        self.board = Machine(7 * 10**12)
        self.lives = 0
        self.boot_id = "boot"
        self._wires: dict[str, dict[Lane, deque[tuple[int, Message]]]] = {
            to: {lane: deque() for lane in Lane} for to in ("board", "host")
        }
        self._outbox: Frame | None = None
        self._sent = self._grabbed = self._sequence = self._host_sequence = 0
        self._board_shot_ns = self._host_shot_ns = self.true_ns
        self.queue = _WatchedQueue(self)
        facts = [LinkFacts("tcp", dict(_NAMES), self_paced=False)]
        self.reception = Reception(facts, "host", self.queue, self._host_says)
        self._new_board()
        self.witness = Witness(self._apart_ns)

    def host_clock(self) -> int:
        """What the host's CLOCK_MONOTONIC shows."""
        return self.true_ns + self.host.shift_ns

    def board_clock(self) -> int:
        """What the board's CLOCK_MONOTONIC shows."""
        return self.true_ns + self.board.shift_ns

    # Events.

    def run(self, duration_ns: int) -> None:
        """Let true time pass."""
        end_ns = self.true_ns + duration_ns
        while self.true_ns < end_ns:
            self.true_ns += _STEP_NS
            self._wake()
            self._shoot()
            self._deliver("board")
            self._run_board()
            self._deliver("host")
            self._run_host()
            while self.queue.has_waiting():
                pair = self.queue.take()
                assert pair is not None
                self.witness.judge(pair, self.queue.tolerance_ns)

    def step(self, which: Machine, by_ns: int) -> None:
        """A clock steps while everything runs. A frame in the board's outbox then has marks of both clocks, undetectably: it is lost here."""
        which.shift_ns += by_ns
        if which is self.board:
            self._outbox = None
        self.witness.stepped(self.true_ns)

    def sleep(self, which: Machine, duration_ns: int, *, told: bool) -> None:
        """A machine sleeps: it does not run, and its clock stands still. When it wakes, its kernel reports the sleep or does not.

        Messages under way to a host that is not told look as if they had just arrived, undetectably (decision 0009,
        11): they are lost here, and earlier arrivals are not judged.
        """
        if which is self.host and not told:
            self.witness.slept_untold(self.host_clock())
        which.asleep_until_ns = self.true_ns + duration_ns
        which.told |= told

    def stop(self, which: Machine, duration_ns: int) -> None:
        """A program is stopped; its machine's clock goes on."""
        which.stopped_until_ns = self.true_ns + duration_ns

    def lose(self, lane: Lane, to: str) -> None:
        """Silently lose the oldest message under way."""
        wire = self._wire(lane, to)
        if wire:
            wire.popleft()

    def repeat(self, lane: Lane, to: str) -> None:
        """Deliver the oldest message under way twice."""
        wire = self._wire(lane, to)
        if wire:
            wire.appendleft(wire[0])

    def break_lane(self, lane: Lane) -> None:
        """A connection breaks: both sides are told, and messages under way are lost."""
        self._wire(lane, "board").clear()
        self._wire(lane, "host").clear()
        for outgoing in self._board.unreachable(_NAMES[lane]):
            self._board_says(outgoing)
        self.reception.interrupted(_NAMES[lane], self.host_clock())

    def restart_board(self) -> None:
        """The board's program dies and starts again; its machine's clock goes on."""
        self._new_board()
        for lane in Lane:
            self.break_lane(lane)

    def lie(self, message: Message) -> None:
        """The board says something extra, on the lane where it belongs."""
        self._wire(Lane.FRAMES if isinstance(message, FrameMessage) else Lane.CONTROL, "host").append(
            (self.true_ns, message)
        )

    def false_frame(self, by_ns: int) -> FrameMessage:
        """A frame that the board might send next, with wrong stamps; its image is exposed now."""
        board_ns = self.board_clock()
        self.witness.board_exposed(self._board.session, 10**9 + self._sequence, self.true_ns - _BOARD_GRABS_NS)
        self.witness.sent(self._board.session, 10**9 + self._sequence, self._apart_ns + 2 * PERIOD_NS)
        marks = BoardMarks(
            exposed_ns=board_ns - _BOARD_GRABS_NS + by_ns, grabbed_ns=board_ns + by_ns, sent_ns=board_ns + by_ns
        )
        return replace(
            FRAME,
            session=self._board.session,
            sent_index=self._sent,
            sequence=10**9 + self._sequence,
            width_px=640,
            height_px=480,
            marks=marks,
        )

    # Observation.

    @property
    def board_session(self) -> str:
        """Of the board's process now."""
        return self._board.session

    @property
    def _apart_ns(self) -> int:
        """How far the board's clock is ahead of the host's."""
        return self.board.shift_ns - self.host.shift_ns

    def check_accounts(self) -> None:
        """Check that frames and pairs are conserved."""
        counts, account = self.queue.counts, self.reception.account
        assert counts.received == counts.paired + sum(n for _, n in counts.board_orphans) + counts.held_board
        received = sum(session.received for session in account.sessions)
        dropped = sum(count for reason, count in account.disbelieved.items() if reason is not Disbelief.CREDIT)
        waiting = self.reception.held
        assert received == counts.received + account.no_clock + dropped + waiting

    def is_suspect(self, pair: WrongPair) -> bool:
        """Whether the report names a pair's frame as one that had passed before a step was noticed."""
        return any(
            told.session == pair.session and told.first <= pair.sequence <= told.last
            for told in self.reception.account.suspects
        )

    @property
    def _swift_ns(self) -> int:
        """The longest time that an answer takes if it waits nowhere."""
        return round(2 * self.latency_ns * (1 + self._jitter / 4)) + 4 * _STEP_NS

    def frame_arrived(self) -> None:
        """Judge the clock's estimate after a frame that the queue took."""
        estimate = self.reception.estimate
        assert estimate is not None
        self.witness.bounded(estimate.bound_at(self.board_clock()))

    # The behaviour of both sides' shells.

    def _is_there(self, machine: Machine) -> bool:
        return self.true_ns >= max(machine.asleep_until_ns, machine.stopped_until_ns)

    def _wake(self) -> None:
        """Clocks of sleeping machines stand still; a machine that wakes is told first of all."""
        for machine in (self.host, self.board):
            if self.true_ns < machine.asleep_until_ns:
                machine.shift_ns -= _STEP_NS
                machine.slept_ns += _STEP_NS
                self.witness.stepped(self.true_ns)
            elif machine.told and machine.slept_ns and self._is_there(machine):
                self._tell_sleep(machine)
            elif self._is_there(machine) and machine.slept_ns:
                machine.slept_ns = 0
                if machine is self.host:
                    for lane in Lane:
                        self._wire(lane, "host").clear()

    def _tell_sleep(self, machine: Machine) -> None:
        if machine is self.host:
            self.reception.slept(machine.slept_ns, self.host_clock())
        else:
            self.lives += 1
            self.boot_id = f"boot-{self.lives}"
            self._outbox = None
            self._board.begin_clock(self.boot_id)
        machine.slept_ns, machine.told = 0, False

    def _new_board(self) -> None:
        self.lives += 1
        self._sent = self._grabbed = self._sequence = 0
        self._outbox = None
        self._board = BoardSession(f"board-{self.lives}", self.boot_id, _CAMERA)

    def _wire(self, lane: Lane, to: str) -> deque[tuple[int, Message]]:
        return self._wires[to][lane]

    def _put(self, lane: Lane, to: str, message: Message) -> None:
        part = self._jitter if isinstance(message, FrameMessage) else self._jitter / 4
        took_ns = self.latency_ns + round(self.latency_ns * part * self._chance.random())
        wire = self._wire(lane, to)
        wire.append((max(self.true_ns + took_ns, wire[-1][0] if wire else 0), message))

    def _shoot(self) -> None:
        while self._board_shot_ns + PERIOD_NS + _BOARD_GRABS_NS <= self.true_ns:
            self._board_shot_ns += PERIOD_NS
            if self.true_ns > self.board.asleep_until_ns:
                exposed_ns = self._board_shot_ns + self.board.shift_ns
                self._outbox = shot(
                    self._sequence, exposed_ns, "board", grabbed_ns=exposed_ns + _BOARD_GRABS_NS, size_px=(640, 480)
                )
                self.witness.board_exposed(self._board.session, self._sequence, self._board_shot_ns)
                self._sequence += 1
                self._grabbed += 1
        while self._host_shot_ns + PERIOD_NS + _HOST_PHASE_NS <= self.true_ns:
            self._host_shot_ns += PERIOD_NS
            if self.true_ns > self.host.asleep_until_ns and self._is_there(self.host):
                true_ns = self._host_shot_ns + _HOST_PHASE_NS
                self.witness.host_exposed(self._host_sequence, true_ns)
                self.queue.add_host(shot(self._host_sequence, true_ns + self.host.shift_ns, size_px=(640, 480)))
                self._host_sequence += 1

    def _deliver(self, to: str) -> None:
        if not self._is_there(self.board if to == "board" else self.host):
            return
        for lane, wire in self._wires[to].items():
            while wire and wire[0][0] <= self.true_ns:
                _, message = wire.popleft()
                if to == "board":
                    answers = self._board.receive(_NAMES[lane], message, self.board_clock(), self._counts)
                    for outgoing in answers:
                        self._board_says(outgoing)
                else:
                    if isinstance(message, Pong):
                        self.witness.answered(message.wave, self.true_ns, self._swift_ns)
                    self.reception.receive(_NAMES[lane], message, self.host_clock())

    @property
    def _counts(self) -> BoardCounts:
        return BoardCounts(self._grabbed, self._sent)

    def _run_board(self) -> None:
        if not self._is_there(self.board):
            return
        now_ns = self.board_clock()
        if self._outbox is not None and self._board.has_credit:
            outgoing = frame_outgoing(self._board, self._outbox)
            self._board_says(outgoing)
            self._board.sent(now_ns)
            self._sent += 1
            self._outbox = None
        if now_ns >= self._board.due_ns:
            for outgoing in self._board.tick(now_ns, self._counts):
                self._board_says(outgoing)

    def _run_host(self) -> None:
        if self._is_there(self.host):
            self.reception.tick(self.host_clock())

    def _board_says(self, outgoing: Outgoing) -> None:
        message = outgoing.message
        if isinstance(message, FrameMessage):
            self.witness.sent(message.session, message.sequence, self._apart_ns)
            message = replace(message, marks=replace(message.marks, sent_ns=self.board_clock()))
        elif isinstance(message, Pong):
            if not self.answers_echoes:
                return
            message = replace(message, t2_ns=self.board_clock())
        self._put(_lane(outgoing.connection), "host", message)

    def _host_says(self, outgoing: Outgoing) -> None:
        message = outgoing.message
        if isinstance(message, Ping):
            self.wave = message.wave
            message = replace(message, t0_ns=self.host_clock())
            self.witness.asked(message.wave, self.true_ns, self._apart_ns)
        self._put(_lane(outgoing.connection), "board", message)


def _lane(connection: bytes) -> Lane:
    return next(lane for lane, name in _NAMES.items() if name == connection)


class _WatchedQueue(PairQueue):
    """The host's pair queue, whose world looks at the clock after each frame."""

    def __init__(self, world: SteppingWorld) -> None:
        super().__init__(FifoSettings(64, Overflow.DROP_OLDEST), None, PERIOD_NS, clock=world.host_clock)
        self._world = world

    def add_board(self, frame: BoardFrame) -> None:
        """See PairQueue."""
        super().add_board(frame)
        self._world.frame_arrived()
