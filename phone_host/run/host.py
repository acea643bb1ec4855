"""The host's composition root: receiver and own camera -> pair queue -> worker -> results, each in its thread."""

import logging
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path
from typing import Final

from common import now
from common.camera.base import Camera
from common.errors import DataError
from common.frame import FrameFault, SpoiledImageError
from common.imagesize import MOST_PIXELS
from common.ledger import PairLedger
from common.link.base import Link
from common.program.logs import event
from common.protocol.message import Pacing, Steering
from phone_host.measure.delays import DelayStatistics, Sample
from phone_host.measure.image_motion import MotionMeter
from phone_host.measure.run_facts import RunFacts, concerns
from phone_host.measure.trust import Concern, Doubt
from phone_host.model import FramePair, Processed, Side, TimeOffset
from phone_host.run.pipeline import Pipeline
from phone_host.run.results import Results
from phone_host.stereo.core import StereoCore
from phone_host.stereo.interpolate import Interpolator
from phone_host.stream.await_board import BoardPatience
from phone_host.stream.demand_clock import DemandClock
from phone_host.stream.own_camera import OwnCamera
from phone_host.stream.pair_queue import PairQueue
from phone_host.stream.receiver import Receiver
from phone_host.sync.fifo import FifoSettings
from phone_host.sync.phase import Alignment, PhaseController, Whose

_LOG = logging.getLogger(__name__)

_STEP_S: Final = 0.05
_LAST_PARTNER_NS: Final = 1_000_000_000
"""After a stream's end the other one gets this long to deliver the last partners."""

_TRUST_NS: Final = 1_000_000_000
_RECENT: Final = 60
"""Once a second the last 60 pairs are judged: two seconds at 30 per second."""

_HOPELESS: Final = 10
"""This many pairs in a row that cannot be processed, and none that could: it is not a spoiled frame now and then."""


class EndReason(Enum):
    """Why a run ended."""

    PAIRS_REACHED = "pairs_reached"
    STREAM_ENDED = "stream_ended"
    STOPPED = "stopped"


@dataclass(frozen=True, slots=True)
class HostSettings:
    """What a run does, beside its camera, link and core.

    Attributes:
        board_side: which view the board's camera is.
        tolerance_ns: greatest time skew of a pair; None for half of the longer frame period.
        fifo: depth and overflow policy.
        pairs: end after this many processed pairs; 0 for no limit.
        wait_ns: an absent board is waited for this long; None for ever.
        out: folder for results; None to write none.
        save_every: every which pair is saved; 0 for none.
        time_offset: between the two cameras' stamps.
        interpolate: whether the board's image is taken to the moment of the host's before anything else is done with it.
        steered: the cameras that may be steered until both expose together; none: the phase stays as it is.
        most_pixels: neither camera may have more.
    """

    board_side: Side = Side.LEFT
    tolerance_ns: int | None = None
    fifo: FifoSettings = field(default_factory=FifoSettings)
    pairs: int = 0
    wait_ns: int | None = None
    out: Path | None = None
    save_every: int = 30
    time_offset: TimeOffset = field(default_factory=TimeOffset)
    interpolate: bool = False
    steered: frozenset[Whose] = frozenset()
    most_pixels: int = MOST_PIXELS


class Host:
    """One run of the host.

    Args:
        settings: what to do.
        camera: the own camera, open.
        links: open links to the board, the preferred one first.
        core: the stereo core; None to measure pairs and delays only.
        on_pair: told of each processed pair and its ledger, in the worker's thread; for live views and for checks against truth.
    """

    def __init__(
        self,
        settings: HostSettings,
        camera: Camera,
        links: Sequence[Link],
        core: StereoCore | None,
        on_pair: Callable[[Processed, PairLedger], None] | None = None,
    ) -> None:
        self.settings = settings
        self.delays = DelayStatistics()
        self.sample = Sample()
        self.last: Processed | None = None
        self.results = Results(settings.out, settings.save_every)
        own = camera.description
        demand = DemandClock(own.pacing)
        self.queue = PairQueue(
            settings.fifo,
            settings.tolerance_ns,
            own.period_ns,
            demand=demand,
            time_offset_ns=settings.time_offset.offset_ns,
        )
        self.source = OwnCamera(camera, self.queue.add_host, demand)
        self.receiver = Receiver(links, now.random_id(), self.queue)
        interpolator = Interpolator() if settings.interpolate else None
        self._pipeline = Pipeline(core, settings.board_side, now.monotonic_ns, interpolator, settings.most_pixels)
        self.motion = MotionMeter()
        self._own = own
        self._known_doubts: frozenset[Doubt] = frozenset()
        self._trust_due_ns = 0
        self._on_pair = on_pair
        self._worker = threading.Thread(target=self._work, name="worker", daemon=True)
        self._controller: PhaseController | None = None
        self._steered_session = ""
        self._finished = threading.Event()
        self._failure: Exception | None = None
        self.processed = 0
        self.undecodable = 0
        self._spoiled: Counter[FrameFault] = Counter()
        self.started_ns = now.monotonic_ns()
        self.first_done_ns = self.last_done_ns = 0

    def run(self, stop: Callable[[], bool], watch: Callable[[], None] | None = None) -> EndReason:
        """Run until the pairs are reached, a stream ends or `stop` says so.

        Args:
            stop: asked several times a second.
            watch: called as often, for a live view.

        Returns:
            Why it ended.

        Raises:
            UnavailableError: no board within the time, or it does not talk to this host.
            DataError: the streams' images do not fit the rig.
        """
        self._worker.start()
        self.receiver.start()
        self.source.start()
        try:
            return self._watch(stop, watch)
        finally:
            self._finished.set()  # the pair in hand is finished, those that still wait are not begun
            self.source.stop()
            self.queue.finish()
            self._worker.join()
            self.receiver.stop()  # last: the worker wakes it

    @property
    def alignment(self) -> Alignment | None:
        """How the steering of a camera stands; None where it was not asked for."""
        return None if self._controller is None else self._controller.alignment

    def facts(self, ended: str) -> RunFacts:
        """Give everything a report is made of, now.

        Args:
            ended: why the run ended, or how it stands.
        """
        return RunFacts(
            ended=ended,
            processed=self.processed,
            undecodable=self.undecodable,
            seconds=(self.last_done_ns - self.first_done_ns) / 1e9,
            delays=self.delays,
            counts=self.queue.counts,
            link=self.receiver.account,
            estimate=self.receiver.estimate,
            tolerance_ns=self.queue.tolerance_ns,
            fifo=self.settings.fifo,
            unwritten=self.results.unwritten,
            spoiled=self.source.spoiled,
            skipped=self.source.skipped,
            own_future=self.source.from_the_future,
            time_offset=self.settings.time_offset,
            phase=self.queue.phase,
            alignment=self.alignment,
            camera=self.source.health,
            period_ns=self._period_ns,
            motion_px_s=self.motion.px_s,
            width_px=self.motion.width_px,
            interpolated=self.settings.interpolate,
            spoiled_images=tuple((fault.value, count) for fault, count in list(self._spoiled.items())),
            stamps_exact=self._stamps_are_exact,
        )

    @property
    def _stamps_are_exact(self) -> bool:
        """Whether both cameras' stamps are right by definition; an absent board's are not doubted."""
        hello = self.receiver.hello
        return self._own.has_exact_stamps and (hello is None or hello.camera.has_exact_stamps)

    @property
    def _period_ns(self) -> int:
        """Of the slower camera, ns; 0 where one gives images on demand, or before the board is known."""
        hello = self.receiver.hello
        if hello is None or Pacing.DEMAND in {hello.camera.pacing, self._own.pacing}:
            return 0
        return max(hello.camera.period_ns, self._own.period_ns)

    def concerns(self) -> tuple[Concern, ...]:
        """What makes the depth of the last pairs wrong."""
        return concerns(self.facts("running"), _RECENT)

    def _watch_trust(self, now_ns: int) -> None:
        """Log each reason not to trust the depth when it comes, and when it has gone."""
        if now_ns < self._trust_due_ns:
            return
        self._trust_due_ns = now_ns + _TRUST_NS
        found = {concern.doubt: concern for concern in self.concerns()}
        for doubt in found.keys() - self._known_doubts:
            concern = found[doubt]
            _LOG.warning(event("depth_doubtful", doubt=doubt.value, problem=concern.sentence, remedy=concern.remedy))
        for doubt in self._known_doubts - found.keys():
            _LOG.info(event("depth_trusted", doubt=doubt.value))
        self._known_doubts = frozenset(found)

    def _watch(self, stop: Callable[[], bool], watch: Callable[[], None] | None) -> EndReason:
        patience = BoardPatience(self.settings.wait_ns, now.monotonic_ns())
        ending_since_ns: int | None = None
        while not self._finished.wait(_STEP_S):
            now_ns = now.monotonic_ns()
            self._raise_failures()
            self._align(now_ns)
            self._watch_trust(now_ns)
            if watch is not None:
                watch()
            if stop():
                return EndReason.STOPPED
            present = self.receiver.connected or self.receiver.ended
            patience.look(now_ns, self.receiver.refused, present=present)
            if self.receiver.ended or self.source.ended:
                ending_since_ns = now_ns if ending_since_ns is None else ending_since_ns
                if self._all_paired() or now_ns - ending_since_ns > _LAST_PARTNER_NS:
                    return self._drain(stop, watch)
        self._raise_failures()
        return EndReason.PAIRS_REACHED

    def _align(self, now_ns: int) -> None:
        """Steer a camera where that was asked for and is due; another life of the board is steered anew."""
        hello = self.receiver.hello
        if not self.settings.steered or hello is None or not self.receiver.connected:
            return
        if self._controller is None or hello.session != self._steered_session:
            self._steered_session = hello.session
            ways = (Whose.BOARD, hello.camera.steering), (Whose.HOST, self.source.steering)
            board, own = (way if whose in self.settings.steered else Steering.NONE for whose, way in ways)
            self._controller = PhaseController(board, own, has_phase=self.queue.has_phase)
        state = self._controller.alignment.state
        correction = self._controller.update(now_ns, self.queue.phase)
        if correction is not None:
            steer = self.receiver.steer if correction.whose is Whose.BOARD else self.source.steer
            steer(correction.later_ns)
            self.queue.restart_phase()
        alignment = self._controller.alignment
        if alignment.state is not state or correction is not None:
            _LOG.info(event("phase", state=alignment.state.value, words=alignment.words))

    def _drain(self, stop: Callable[[], bool], watch: Callable[[], None] | None) -> EndReason:
        """Let the worker finish the pairs that wait; no frame will follow."""
        self.queue.finish()
        while self._worker.is_alive():
            self._worker.join(_STEP_S)
            if watch is not None:
                watch()
            if stop():
                return EndReason.STOPPED
        self._raise_failures()
        reached = self.settings.pairs and self.processed >= self.settings.pairs
        return EndReason.PAIRS_REACHED if reached else EndReason.STREAM_ENDED

    def _all_paired(self) -> bool:
        counts = self.queue.counts
        return self.receiver.ended and (counts.held_board == 0 or (self.source.ended and counts.held_host == 0))

    def _raise_failures(self) -> None:
        for failure in (self._failure, self.receiver.failure, self.source.failure):
            if failure is not None:
                raise failure

    def _work(self) -> None:
        try:
            while (pair := self.queue.take()) is not None:
                dequeued_ns = now.monotonic_ns()
                self.receiver.wake()  # a place is free
                if not self._finished.is_set():
                    self._process(pair, dequeued_ns)
        except Exception as error:  # noqa: BLE001 - a thread's root: the run's root reports it once
            self._failure = error
            self._finished.set()

    def _process(self, pair: FramePair, dequeued_ns: int) -> None:
        try:
            processed = self._pipeline.process(pair)
        except DataError as error:
            self._note_failed(error)
            return
        before_write_ns = now.monotonic_ns()
        self.results.save_pair(self.processed, processed)
        done_ns = now.monotonic_ns()
        ledger = self._ledger(pair, processed, dequeued_ns, before_write_ns, done_ns)
        self.results.append(ledger)
        self.delays.add(ledger)
        self.sample.add(ledger)
        self.last = processed
        self.first_done_ns = self.first_done_ns or done_ns
        self.last_done_ns = done_ns
        self.processed += 1
        # The host's own image: the board's may have been interpolated to another moment.
        seen = processed.pair.right if self.settings.board_side is Side.LEFT else processed.pair.left
        self.motion.add(seen, pair.host.exposed.ns, done_ns)
        if self._on_pair is not None:
            self._on_pair(processed, ledger)
        if self.settings.pairs and self.processed >= self.settings.pairs:
            self._finished.set()

    def _note_failed(self, error: DataError) -> None:
        """Count a pair that could not be processed. Spoiled images never end a run: whoever sends them must not be able to; a rig that fits no pair does."""
        self.undecodable += 1
        if isinstance(error, SpoiledImageError):
            self._spoiled[error.fault] += 1
            if self.processed == 0 and self._spoiled.total() == _HOPELESS:
                _LOG.error(event("no_sound_image", count=_HOPELESS, problem=error.problem, remedy=error.remedy))
        elif self.processed == 0 and self.undecodable - self._spoiled.total() > _HOPELESS:
            raise error  # not one pair fits: wrong rig, wrong camera
        if self.undecodable.bit_count() == 1:  # the 1st, 2nd, 4th, 8th …: one bad camera must not fill the log
            _LOG.warning(event("pair_failed", count=self.undecodable, problem=error.problem))

    def _ledger(
        self, pair: FramePair, processed: Processed, dequeued_ns: int, before_write_ns: int, done_ns: int
    ) -> PairLedger:
        board = pair.board
        return PairLedger(
            session=board.message.session,
            sequence=board.message.sequence,
            host_sequence=pair.host.sequence,
            bytes=len(board.message.payload),
            link=board.link,
            board=board.marks,
            received_ns=board.received_ns,
            paired_ns=pair.paired_ns,
            queued_ns=pair.queued_ns,
            dequeued_ns=dequeued_ns,
            done_ns=done_ns,
            previous_done_ns=self.last_done_ns or pair.queued_ns,
            stages=replace(processed.stages, write=done_ns - before_write_ns),
            time_skew_ns=pair.time_skew_ns,
            offset_ns=board.offset_ns,
            uncertainty_ns=board.uncertainty_ns,
        )
