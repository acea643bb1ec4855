"""Where the threads meet: frames of both cameras go in, and pairs come out for the worker.

This module adds a lock and an account to the pure cores.

Conservation: received = paired + orphaned(by reason) + held; paired = taken + dropped(overflow) + waiting. Both hold
    after every call.
"""

import threading
from collections import Counter, deque
from collections.abc import Callable, Iterable
from typing import Final, assert_never

from common import now
from common.camera.image_numbers import ImageNumbers, numbers_told
from common.frame import Frame
from common.protocol.message import CameraDescription, Pacing
from phone_host.diagnostics.image_numbers import MOST_NAMED, FilmWatch, ImageEvidence
from phone_host.model import BoardFrame, FramePair, PairCounts
from phone_host.stream.demand_clock import DemandClock
from phone_host.sync.fifo import Fifo, FifoSettings, Overflow
from phone_host.sync.pairing import BoardOrphan, HostOrphan, OrphanReason, Outcome, Paired, Pairing, PairingSettings
from phone_host.sync.phase import Phase, PhaseMeter
from phone_host.sync.quarantine import Disbelief
from phone_host.sync.stills import PairedBy, PassedOver, StillsPairing

_SIDE_BYTES: Final = 64 * 1024 * 1024
"""Memory limit of each side's held frames, still encoded: 40 s of 50 KB JPEGs at 30 fps, more than any link's delay."""

_SIDE_FRAMES: Final = 4096
"""Limit for the number of each side's held frames: over a minute at 60 fps. 64 MB of tiny frames would be a million."""

_NEWEST: Final = 4
"""Newest board frames kept besides the held ones: a pair nearly always forms before its frame has three successors."""

_LEAST_WAIT_NS: Final = 2_000_000_000
"""A host frame waits at least this long for its partner, even on a fast link.

A link may become slow from one frame to the next. If the right host frame had been evicted by then, the board frame
would get a worse partner. Two seconds of 50 KB JPEGs at 30 fps are 3 MB."""

_SLOWEST_NS: Final = 60_000_000_000
"""Longest link delay for which host frames are kept."""


class PairQueue:
    """Pairing and FIFO behind one lock. In a run, this is the frame sink (FrameSink).

    Args:
        fifo: depth and overflow policy.
        tolerance_ns: greatest time skew; None for half of the longer frame period.
        host_period_ns: frame period of the host camera.
        demand: says what stamps mean, and is told of each board frame; None: the host camera has a clock.
        time_offset_ns: added to the board's stamps before they are compared with the host's.
        own_images: the images that the host camera replays; None if it does not.
        clock: monotonic, ns: by which frames are given up.
        marking: monotonic, ns: the time of a pair's marks.
    """

    def __init__(
        self,
        fifo: FifoSettings,
        tolerance_ns: int | None,
        host_period_ns: int,
        *,
        demand: DemandClock | None = None,
        time_offset_ns: int = 0,
        own_images: ImageNumbers | None = None,
        clock: Callable[[], int] = now.monotonic_ns,
        marking: Callable[[], int] | None = None,
    ) -> None:
        self._clock, self._marking = clock, marking or clock
        self._settings = fifo
        self._fifo: Fifo[FramePair] = Fifo(fifo)
        self._tolerance_ns = tolerance_ns
        self._host_period_ns = host_period_ns
        self._board_period_ns = 0
        self._film_period_ns = 0  # as the board's hello has it: a board that leaves images out shows the same film
        self._pairing: Pairing[BoardFrame, Frame] | StillsPairing[BoardFrame, Frame] | None = None
        self._changed = threading.Condition()
        self._closed = False
        self._demand = demand or DemandClock(Pacing.CLOCK)
        self._time_offset_ns = time_offset_ns
        self._own_images = own_images
        self._board_images: ImageNumbers | None = None
        self._films = FilmWatch()
        self._board_alone = self._own_alone = 0
        self._board_numbers: list[int] = []
        self._own_numbers: list[int] = []
        self._meter: PhaseMeter | None = None
        self._newest: deque[BoardFrame] = deque(maxlen=_NEWEST)
        self._received = self._host_frames = self._paired = self._dropped = self._taken = 0
        self._board_orphans, self._host_orphans = Counter[str](), Counter[str]()
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
    def is_timeless(self) -> bool:
        """Whether images are shown on demand, so that their stamps are no times."""
        return self._demand.is_timeless

    @property
    def images(self) -> ImageEvidence:
        """What is known of the images if both sides replay files."""
        with self._changed:
            stills = self._demand.stills
            return ImageEvidence(
                paired_by=PairedBy.TIME if stills is None else stills.paired_by,
                board=self._board_images,
                own=self._own_images,
                pairs=self._paired,
                board_alone=self._board_alone,
                own_alone=self._own_alone,
                board_numbers=tuple(self._board_numbers),
                own_numbers=tuple(self._own_numbers),
                why_order=None if stills is None else stills.why_order,
                apart=self._films.apart,
                first_apart=self._films.first_apart,
                board_period_ns=0 if self._demand.is_timeless else self._film_period_ns,
                own_period_ns=0 if self._demand.is_timeless else self._host_period_ns,
            )

    @property
    def phase(self) -> Phase | None:
        """The two cameras' phase now; None while it is unknown, and for images shown on demand."""
        with self._changed:
            return None if self._meter is None or self._demand.is_timeless else self._meter.phase

    @property
    def has_phase(self) -> bool:
        """Whether the two rates have a phase at all."""
        with self._changed:
            return self._meter is not None and self._meter.has_phase and not self._demand.is_timeless

    def restart_phase(self) -> None:
        """Measure the phase anew, because a camera was steered."""
        with self._changed:
            if self._meter is not None:
                self._meter.restart()

    def has_waiting(self) -> bool:
        """Whether a pair waits to be processed."""
        with self._changed:
            return len(self._fifo) > 0

    def free_slots(self) -> int:
        """Return how many more board frames have room in the FIFO. Held board frames count as occupying a place."""
        with self._changed:
            return max(0, self._fifo.free - (self._pairing.held_board if self._pairing else 0))

    def room(self) -> int | None:
        """See FrameSink. A limit applies if the FIFO blocks or the board's camera shows images on demand.

        Otherwise None: pairs that find no place are dropped.
        """
        held_back = self._demand.labels_board or self._settings.overflow is Overflow.BLOCK
        return self.free_slots() if held_back else None

    def begin(self, camera: CameraDescription) -> None:
        """Begin a board session. Board frames of an earlier session find no partner any more.

        If the new session's stamps are labels, old host frames find no partner either.
        """
        told = numbers_told(camera.name)
        self._demand.begin(
            camera.pacing, told, camera.period_ns
        )  # without the lock: it waits for a host image, whose delivery needs it
        board_period_ns = camera.period_ns
        with self._changed:
            self._meter = PhaseMeter(board_period_ns, self._host_period_ns)
            self._board_images = told
            self._film_period_ns = board_period_ns
            self._films.begin(told, self._own_images, by_time=not self._demand.is_timeless)
            if self._pairing is not None:
                self._settle(self._pairing.restart(OrphanReason.STREAM_ENDED))
            if self._pairing is None or board_period_ns != self._board_period_ns or self._demand.labels_board:
                self._board_period_ns = board_period_ns
                if self._pairing is not None:
                    self._settle(self._pairing.finish())
                settings = PairingSettings(self.tolerance_ns, board_period_ns, self._host_period_ns)
                self._pairing = Pairing(settings) if self._demand.stills is None else StillsPairing()

    def void(self) -> None:
        """One of the two clocks may have stood still: pair no frame from before with a frame from after this moment."""
        with self._changed:
            self._newest.clear()
            self._delay_ns = _LEAST_WAIT_NS
            if self._meter is not None:
                self._meter.restart()
            if self._pairing is not None and not self._closed and not self._demand.is_timeless:
                self._settle(self._pairing.void())

    def change_period(self, board_period_ns: int) -> None:
        """Take note of the board camera's new frame period. Held frames stay held.

        Args:
            board_period_ns: time between two of its frames, from now on.
        """
        with self._changed:
            if self._pairing is None or board_period_ns == self._board_period_ns:
                return
            self._board_period_ns = board_period_ns
            self._films.lowered()
            self._meter = PhaseMeter(board_period_ns, self._host_period_ns)
            changed = PairingSettings(self.tolerance_ns, board_period_ns, self._host_period_ns)
            if not self._closed:
                self._settle(self._pairing.change(changed, self._clock()))

    @property
    def history_ns(self) -> int:
        """How far back host frames are kept now, ns. An older board frame finds no partner."""
        return max(_LEAST_WAIT_NS, self._delay_ns) + 2 * max(self._board_period_ns, self._host_period_ns)

    def note_age(self, age_ns: int) -> None:
        """Keep host frames for as long as a board frame of this age needs.

        The age is raised by a quarter as a margin for larger frames, which take longer where the link's rate is the
        limit. The slow decay follows a link that gets faster.
        """
        self._delay_ns = min(_SLOWEST_NS, max(age_ns * 5 // 4, self._delay_ns * 63 // 64))

    def objection(self, frame: BoardFrame) -> Disbelief | None:
        """See FrameSink. Labels cannot be paired with a clock's stamps, and a frame too old has no host frame left."""
        if self._demand.is_one_sided:
            return Disbelief.PACING
        age_ns = frame.received_ns - frame.marks.exposed_ns
        if self._demand.labels_board or age_ns <= self.history_ns:
            return None
        self.note_age(age_ns)  # if the link has become this slow, the next frame finds its partner
        return Disbelief.PAST

    def add_board(self, frame: BoardFrame) -> None:
        """Take a frame of the board. If the host camera shows images on demand, ask it for the partner."""
        stamp_ns = self._demand.stamp_ns(frame.marks.exposed_ns + self._time_offset_ns, frame.offset_ns)
        number = frame.message.sequence
        if (stills := self._demand.stills) is not None:
            # On the board's own clock, on which two labels differ by whole periods.
            wanted = stills.wanted(number, frame.message.marks.exposed_ns)
            self._pass_over(wanted.passed)
            if wanted.index is None:
                self._refuse_number(wanted.number)
                return
            number = wanted.index
        self._add_board(frame, stamp_ns)
        self._demand.frame_came(stamp_ns, number)

    def _refuse_number(self, number: int | None) -> None:
        """Count a board frame of whose number this machine has no image."""
        with self._changed:
            self._received += 1
            self._board_alone += 1
            if number is not None and len(self._board_numbers) < MOST_NAMED:
                self._board_numbers.append(number)
            self._board_orphans[OrphanReason.NO_SUCH_NUMBER.value] += 1

    def _pass_over(self, passed: PassedOver) -> None:
        """Count images of this machine that are never shown, because no board image of their number came."""
        with self._changed:
            self._host_frames += passed.alone + passed.unsent
            self._own_alone += passed.alone
            self._own_numbers += passed.numbers[: MOST_NAMED - len(self._own_numbers)]
            for reason, images in (OrphanReason.NO_SUCH_NUMBER, passed.alone), (OrphanReason.NO_PARTNER, passed.unsent):
                if images:
                    self._host_orphans[reason.value] += images

    def own_image_missing(self) -> None:
        """The image that the host camera was asked for is spoiled. Its board frame finds no other partner."""
        with self._changed:
            if isinstance(self._pairing, StillsPairing):
                self._settle(self._pairing.unanswered())

    def board_ended(self) -> None:
        """The board has shown its last image. Stills of this machine that nobody asked for stay without a partner."""
        if (stills := self._demand.stills) is not None and not self._closed:
            self._pass_over(stills.unshown)

    def _add_board(self, frame: BoardFrame, stamp_ns: int) -> None:
        with self._changed:
            assert self._pairing is not None
            self._received += 1
            if self._closed:
                self._board_orphans[OrphanReason.STREAM_ENDED.value] += 1
                return
            self.note_age(self._clock() - frame.marks.exposed_ns)  # includes the wait for an echo
            self._board_bytes += len(frame.message.payload)
            self._newest.append(frame)
            if self._meter is not None:
                self._meter.add_board(stamp_ns)
            self._settle(self._pairing.add_board(stamp_ns, frame, self._clock()))
            while self._board_bytes > _SIDE_BYTES or self._pairing.held_board > _SIDE_FRAMES:
                self._settle(self._pairing.evict_oldest_board())

    def add_host(self, frame: Frame) -> None:
        """Take a frame of the host camera."""
        with self._changed:
            self._host_frames += 1
            if self._pairing is None or self._closed:
                self._host_orphans[OrphanReason.STREAM_ENDED.value if self._closed else "no_board"] += 1
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
        """Let time pass: settle frames that have waited long enough."""
        with self._changed:
            if self._pairing is not None and not self._closed:
                now_ns = self._clock()
                self._settle(self._pairing.decide(now_ns))
                self._evict(now_ns)

    def finish(self) -> None:
        """No frame will follow: settle all held frames, let the worker take the waiting pairs, then let it end."""
        with self._changed:
            if self._pairing is not None:
                self._settle(self._pairing.finish())
            self._closed = True
            self._changed.notify_all()

    def take(self) -> FramePair | None:
        """Wait for the oldest pair and return it. Return None when no more will come."""
        with self._changed:
            while not len(self._fifo) and not self._closed:
                self._changed.wait()
            if not len(self._fifo):
                return None
            self._taken += 1
            return self._fifo.take()

    def _evict(self, now_ns: int) -> None:
        assert self._pairing is not None
        if self._demand.is_timeless or isinstance(self._pairing, StillsPairing):
            return
        longer_ns = max(self._board_period_ns, self._host_period_ns)
        self._settle(self._pairing.evict_host(now_ns - max(_LEAST_WAIT_NS, self._delay_ns) - 2 * longer_ns))
        # Host frames arrive as soon as their camera gives them: a board frame without a partner by now never gets one.
        self._settle(self._pairing.evict_board(now_ns - self._delay_ns - 2 * longer_ns - self.tolerance_ns))

    def _settle(self, outcomes: Iterable[Outcome[BoardFrame, Frame]]) -> None:
        for outcome in outcomes:
            match outcome:
                case Paired(board, host, time_skew_ns):
                    self._host_bytes -= len(host.payload)
                    self._board_bytes -= len(board.message.payload)
                    paired_ns = self._marking()
                    self._paired += 1
                    self._films.pair(board.message.sequence, host.sequence)
                    pair = FramePair(
                        board=board,
                        host=host,
                        time_skew_ns=time_skew_ns,
                        paired_ns=paired_ns,
                        queued_ns=self._marking(),
                        before=self._before(board),
                    )
                    self._dropped += len(self._fifo.put(pair))
                    self._changed.notify()
                case BoardOrphan(frame, reason):
                    self._board_bytes -= len(frame.message.payload)
                    self._board_orphans[reason.value] += 1
                case HostOrphan(own, reason):
                    self._host_bytes -= len(own.payload)
                    self._host_orphans[reason.value] += 1
                case _:
                    assert_never(outcome)

    def _before(self, frame: BoardFrame) -> BoardFrame | None:
        """Return the newest board frame of the same session that was exposed before this one."""
        session, exposed_ns = frame.message.session, frame.marks.exposed_ns
        older = (f for f in self._newest if f.message.session == session and f.marks.exposed_ns < exposed_ns)
        return max(older, key=lambda f: f.marks.exposed_ns, default=None)
