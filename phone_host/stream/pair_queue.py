"""Where the threads meet: frames of both cameras go in, pairs come out for the worker. Adds a lock and an account to the pure cores.

Conservation: received = paired + orphaned(by reason) + held; paired = taken + dropped(overflow) + waiting. Both hold after every call.
"""

import threading
from collections import deque
from collections.abc import Callable, Iterable
from typing import Final, assert_never

from common import now
from common.frame import Frame
from common.protocol.message import CameraDescription, Pacing
from phone_host.model import BoardFrame, FramePair, PairCounts
from phone_host.stream.demand_clock import DemandClock
from phone_host.sync.fifo import Fifo, FifoSettings, Overflow
from phone_host.sync.pairing import BoardOrphan, HostOrphan, OrphanReason, Outcome, Paired, Pairing, PairingSettings
from phone_host.sync.phase import Phase, PhaseMeter
from phone_host.sync.quarantine import Disbelief

_SIDE_BYTES: Final = 64 * 1024 * 1024
"""Frames of each side wait for their partners, still encoded, in at most this much memory: 40 s of 50 KB JPEGs at 30 fps, more than any link delays."""

_SIDE_FRAMES: Final = 4096
"""The same in number: over a minute at 60 fps. Of the smallest frames 64 MB would be a million objects."""

_NEWEST: Final = 4
"""Board frames kept beside those that wait: a pair is nearly always formed before its frame has three successors."""

_LEAST_WAIT_NS: Final = 2_000_000_000
"""A host frame waits at least this long for its partner, also on a swift link: that may become slow from one frame to the next, whose partner then would
have gone and a worse one be taken. Two seconds of 50 KB JPEGs at 30 fps are 3 MB."""

_SLOWEST_NS: Final = 60_000_000_000
"""No link is waited for longer than this."""


class PairQueue:
    """Pairing and FIFO behind one lock: the sink of a board's frames (FrameSink) in a run.

    Args:
        fifo: depth and overflow policy.
        tolerance_ns: greatest time skew; None for half of the longer frame period.
        host_period_ns: time between two frames of the own camera.
        demand: what stamps mean, and whom to tell of each board frame; None: the own camera has a clock.
        time_offset_ns: added to the board's stamps before they are compared with the host's.
        clock: monotonic, ns.
    """

    def __init__(
        self,
        fifo: FifoSettings,
        tolerance_ns: int | None,
        host_period_ns: int,
        *,
        demand: DemandClock | None = None,
        time_offset_ns: int = 0,
        clock: Callable[[], int] = now.monotonic_ns,
    ) -> None:
        self._clock = clock
        self._settings = fifo
        self._fifo: Fifo[FramePair] = Fifo(fifo)
        self._tolerance_ns = tolerance_ns
        self._host_period_ns = host_period_ns
        self._board_period_ns = 0
        self._pairing: Pairing[BoardFrame, Frame] | None = None
        self._changed = threading.Condition()
        self._closed = False
        self._demand = demand or DemandClock(Pacing.CLOCK)
        self._time_offset_ns = time_offset_ns
        self._meter: PhaseMeter | None = None
        self._newest: deque[BoardFrame] = deque(maxlen=_NEWEST)
        self._received = self._host_frames = self._paired = self._dropped = self._taken = 0
        self._board_orphans: dict[str, int] = {}
        self._host_orphans: dict[str, int] = {}
        self._host_bytes = self._board_bytes = 0
        self._delay_ns = _LEAST_WAIT_NS

    @property
    def tolerance_ns(self) -> int:
        """Greatest time skew of a pair, ns; 0 before the board's period is known."""
        longer_ns = max(self._board_period_ns, self._host_period_ns)
        return self._tolerance_ns if self._tolerance_ns is not None else longer_ns // 2

    @property
    def counts(self) -> PairCounts:
        """The account now."""
        with self._changed:
            return PairCounts(
                received=self._received,
                host_frames=self._host_frames,
                paired=self._paired,
                dropped=self._dropped,
                taken=self._taken,
                waiting=len(self._fifo),
                held_board=self._pairing.held_board if self._pairing else 0,
                held_host=self._pairing.held_host if self._pairing else 0,
                board_orphans=tuple(self._board_orphans.items()),
                host_orphans=tuple(self._host_orphans.items()),
            )

    @property
    def phase(self) -> Phase | None:
        """The two cameras' phase now; None while it is not known, and for images shown on demand."""
        with self._changed:
            return None if self._meter is None or self._demand.is_timeless else self._meter.phase

    @property
    def has_phase(self) -> bool:
        """Whether the two rates have a phase at all."""
        with self._changed:
            return self._meter is not None and self._meter.has_phase and not self._demand.is_timeless

    def restart_phase(self) -> None:
        """Measure the phase anew: a camera was steered."""
        with self._changed:
            if self._meter is not None:
                self._meter.restart()

    def free_slots(self) -> int:
        """How many more board frames have a place, counting those that wait for their partner."""
        with self._changed:
            return max(0, self._fifo.free - (self._pairing.held_board if self._pairing else 0))

    def room(self) -> int | None:
        """See FrameSink: a queue that blocks, and a camera that waits for room, are held back; else pairs that find no place are dropped."""
        held_back = self._demand.labels_board or self._settings.overflow is Overflow.BLOCK
        return self.free_slots() if held_back else None

    def begin(self, camera: CameraDescription) -> None:
        """A board session begins: frames of an earlier one find no partner any more; beside labels, not even the own camera's old ones do."""
        self._demand.begin(camera.pacing)  # without the lock: it waits for an own image, which is delivered here
        board_period_ns = camera.period_ns
        with self._changed:
            self._meter = PhaseMeter(board_period_ns, self._host_period_ns)
            if self._pairing is not None:
                self._settle(self._pairing.restart(OrphanReason.STREAM_ENDED))
            if self._pairing is None or board_period_ns != self._board_period_ns or self._demand.labels_board:
                self._board_period_ns = board_period_ns
                if self._pairing is not None:
                    self._settle(self._pairing.finish())
                self._pairing = Pairing(PairingSettings(self.tolerance_ns, board_period_ns, self._host_period_ns))

    def void(self) -> None:
        """One of the two clocks may have stood still: no frame from before is paired with one from after it."""
        with self._changed:
            self._newest.clear()
            self._delay_ns = _LEAST_WAIT_NS
            if self._meter is not None:
                self._meter.restart()
            if self._pairing is not None and not self._closed and not self._demand.is_timeless:
                self._settle(self._pairing.void())

    def change_period(self, board_period_ns: int) -> None:
        """The board's camera has another rate from now on; frames that wait for their partners go on waiting.

        Args:
            board_period_ns: time between two of its frames.
        """
        with self._changed:
            if self._pairing is None or board_period_ns == self._board_period_ns:
                return
            self._board_period_ns = board_period_ns
            self._meter = PhaseMeter(board_period_ns, self._host_period_ns)
            changed = PairingSettings(self.tolerance_ns, board_period_ns, self._host_period_ns)
            if not self._closed:
                self._settle(self._pairing.change(changed, self._clock()))

    @property
    def history_ns(self) -> int:
        """How far back own frames are kept now, ns: an older board frame finds no partner."""
        return max(_LEAST_WAIT_NS, self._delay_ns) + 2 * max(self._board_period_ns, self._host_period_ns)

    def note_age(self, age_ns: int) -> None:
        """Keep own frames for as long as a board frame of this age needs.

        Where bytes take the time a frame that is a fifth larger comes as much later; the slow decay follows a link that gets faster.
        """
        self._delay_ns = min(_SLOWEST_NS, max(age_ns * 5 // 4, self._delay_ns * 63 // 64))

    def objection(self, frame: BoardFrame) -> Disbelief | None:
        """See FrameSink: labels have no partner beside a camera with a clock, and no own frame is kept for one that is too old."""
        if self._demand.is_one_sided:
            return Disbelief.PACING
        age_ns = frame.received_ns - frame.marks.exposed_ns
        if self._demand.labels_board or age_ns <= self.history_ns:
            return None
        self.note_age(age_ns)  # if the link has become so slow the next one finds its partner
        return Disbelief.PAST

    def add_board(self, frame: BoardFrame) -> None:
        """Take a frame of the board, and ask for its partner where the own camera waits for that."""
        stamp_ns = self._demand.stamp_ns(frame.marks.exposed_ns + self._time_offset_ns, frame.offset_ns)
        self._add_board(frame, stamp_ns)
        self._demand.frame_came(stamp_ns, frame.message.sequence)

    def _add_board(self, frame: BoardFrame, stamp_ns: int) -> None:
        with self._changed:
            assert self._pairing is not None
            self._received += 1
            if self._closed:
                self._count(self._board_orphans, OrphanReason.STREAM_ENDED.value)
                return
            self.note_age(self._clock() - frame.marks.exposed_ns)  # the wait for an echo included
            self._board_bytes += len(frame.message.payload)
            self._newest.append(frame)
            if self._meter is not None:
                self._meter.add_board(stamp_ns)
            self._settle(self._pairing.add_board(stamp_ns, frame, self._clock()))
            while self._board_bytes > _SIDE_BYTES or self._pairing.held_board > _SIDE_FRAMES:
                self._settle(self._pairing.evict_oldest_board())

    def add_host(self, frame: Frame) -> None:
        """Take a frame of the own camera."""
        with self._changed:
            self._host_frames += 1
            if self._pairing is None or self._closed:
                self._count(self._host_orphans, OrphanReason.STREAM_ENDED.value if self._closed else "no_board")
                return
            now_ns = self._clock()
            if self._meter is not None:
                self._meter.add_host(frame.exposed.ns)
            self._host_bytes += len(frame.payload)
            self._settle(self._pairing.add_host(frame.exposed.ns, frame, now_ns))
            self._evict(now_ns)
            while self._host_bytes > _SIDE_BYTES or self._pairing.held_host > _SIDE_FRAMES:
                self._settle(self._pairing.evict_oldest_host())

    def tick(self) -> None:
        """Let time pass: settle what has waited long enough."""
        with self._changed:
            if self._pairing is not None and not self._closed:
                now_ns = self._clock()
                self._settle(self._pairing.decide(now_ns))
                self._evict(now_ns)

    def finish(self) -> None:
        """No frame will follow: settle all, let the worker take what waits, then tell it to end."""
        with self._changed:
            if self._pairing is not None:
                self._settle(self._pairing.finish())
            self._closed = True
            self._changed.notify_all()

    def take(self) -> FramePair | None:
        """Wait for the oldest pair; None when there will be none any more."""
        with self._changed:
            while not len(self._fifo) and not self._closed:
                self._changed.wait()
            if not len(self._fifo):
                return None
            self._taken += 1
            return self._fifo.take()

    def _evict(self, now_ns: int) -> None:
        assert self._pairing is not None
        if self._demand.is_timeless:
            return
        longer_ns = max(self._board_period_ns, self._host_period_ns)
        self._settle(self._pairing.evict_host(now_ns - max(_LEAST_WAIT_NS, self._delay_ns) - 2 * longer_ns))
        # A host frame is here as soon as its camera gave it; a board frame without one after this time never gets one.
        self._settle(self._pairing.evict_board(now_ns - self._delay_ns - 2 * longer_ns - self.tolerance_ns))

    def _settle(self, outcomes: Iterable[Outcome[BoardFrame, Frame]]) -> None:
        for outcome in outcomes:
            match outcome:
                case Paired(board, host, time_skew_ns):
                    self._host_bytes -= len(host.payload)
                    self._board_bytes -= len(board.message.payload)
                    paired_ns = self._clock()
                    self._paired += 1
                    pair = FramePair(
                        board=board,
                        host=host,
                        time_skew_ns=time_skew_ns,
                        paired_ns=paired_ns,
                        queued_ns=self._clock(),
                        before=self._before(board),
                    )
                    self._dropped += len(self._fifo.put(pair))
                    self._changed.notify()
                case BoardOrphan(frame, reason):
                    self._board_bytes -= len(frame.message.payload)
                    self._count(self._board_orphans, reason.value)
                case HostOrphan(own, reason):
                    self._host_bytes -= len(own.payload)
                    self._count(self._host_orphans, reason.value)
                case _:
                    assert_never(outcome)

    def _before(self, frame: BoardFrame) -> BoardFrame | None:
        """The newest board frame of the same session that was exposed before this one."""
        session, exposed_ns = frame.message.session, frame.marks.exposed_ns
        older = (f for f in self._newest if f.message.session == session and f.marks.exposed_ns < exposed_ns)
        return max(older, key=lambda f: f.marks.exposed_ns, default=None)

    @staticmethod
    def _count(account: dict[str, int], reason: str) -> None:
        account[reason] = account.get(reason, 0) + 1
