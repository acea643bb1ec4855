"""The worker: takes pairs from the queue, has their depth computed and passes the results to the sinks.

Two threads: the worker takes, decodes, rectifies and matches; the finisher computes the points, enters the pair in the books
and hands it over, while the worker is at the next pair. A pair is taken only when the one before is matched, so none grows
old in between (decision 0041).
"""

import logging
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

from common import now
from common.errors import DataError
from common.frame import SpoiledImageError
from common.program.logs import event
from phone_host.model import FramePair, Processed, Result
from phone_host.run.finisher import Finisher
from phone_host.run.ledgerer import Ledgerer, WorkerMarks
from phone_host.run.pipeline import Halfway, Pipeline
from phone_host.run.sinks import Sink
from phone_host.stream.pair_queue import PairQueue

_LOG = logging.getLogger(__name__)

_HOPELESS: Final = 10
"""If this many pairs fail before the first success, the cause is not an occasional spoiled frame."""


@dataclass(frozen=True, slots=True, eq=False)
class _UnderWay:
    """A pair on its way from the worker to the finisher.

    Attributes:
        pair: its frames.
        dequeued_ns: when it was taken.
        depth: what was computed so far.
        computed_ns: when all was computed; 0: not yet.
    """

    pair: FramePair
    dequeued_ns: int
    depth: Halfway | Processed
    computed_ns: int = 0


class Worker:
    """The worker and its finisher.

    Args:
        queue: source of the pairs.
        pipeline: computes their depth.
        ledgerer: keeps the books.
        sinks: take the results.
        most_pairs: the worker ends after this many pairs; 0 for no limit.
        taken: called when a place in the queue becomes free.
    """

    def __init__(
        self,
        queue: PairQueue,
        pipeline: Pipeline,
        ledgerer: Ledgerer,
        sinks: Sequence[Sink],
        *,
        most_pairs: int,
        taken: Callable[[], None],
    ) -> None:
        self._queue, self._pipeline, self._ledgerer, self._sinks = queue, pipeline, ledgerer, tuple(sinks)
        self._most_pairs, self._taken = most_pairs, taken
        self._thread = threading.Thread(target=self._work, name="worker", daemon=True)
        self._finisher: Finisher[_UnderWay] = Finisher("finisher", self._finish)
        self._begun = 0  # pairs handed to the finisher
        self.finished = threading.Event()
        self.failure: Exception | None = None
        self.has_given_up = False
        """Whether a pair is still being computed that nobody waits for. Its result is dropped."""

    def start(self) -> None:
        """Start both threads."""
        self._finisher.start()
        self._thread.start()

    def stop(self, patience_s: float | None = None) -> None:
        """Finish the pairs under way, start none of the waiting ones, and end. The queue must be closed.

        Args:
            patience_s: give up pairs that take longer than this; None: wait for them.
        """
        self.finished.set()
        if not self._have_ended(patience_s):
            self.has_given_up = True
            _LOG.warning(event("pair_given_up", why="the run was stopped while native code computed its depth"))

    def has_ended(self, wait_s: float) -> bool:
        """Wait up to `wait_s` for the worker to end after a closed queue's last pair. Return whether it has ended."""
        return self._have_ended(wait_s)

    def _have_ended(self, wait_s: float | None) -> bool:
        """Wait for both threads together; the worker ends first."""
        began_s = time.monotonic()
        self._thread.join(wait_s)
        if self._thread.is_alive():
            return False
        rest_s = None if wait_s is None else max(0.0, wait_s - (time.monotonic() - began_s))
        return self._finisher.has_ended(rest_s)

    def _work(self) -> None:
        try:
            while (pair := self._queue.take()) is not None:
                dequeued_ns = now.monotonic_ns()
                self._taken()
                if not self.finished.is_set() and not self._has_enough:
                    self._begin(pair, dequeued_ns)
        except Exception as error:  # noqa: BLE001 - a thread's root: the run's root reports it once
            self._fail(error)
        finally:
            self._finisher.end()

    @property
    def _has_enough(self) -> bool:
        """Whether the pairs under way complete the run."""
        return bool(self._most_pairs) and self._begun >= self._most_pairs

    def _fail(self, error: Exception) -> None:
        self.failure = self.failure or error
        self.finished.set()

    def _begin(self, pair: FramePair, dequeued_ns: int) -> None:
        try:
            halfway = self._pipeline.begin(pair)
        except DataError as error:
            self._note_failed(error)
            return
        self._begun += 1
        under_way = _UnderWay(pair, dequeued_ns, halfway)
        if not self._finisher.take(under_way):  # a sink lets the pair before wait: that is no reason to be idle
            self._finisher.put(self._computed(under_way)[0])

    def _computed(self, under_way: _UnderWay) -> tuple[_UnderWay, Processed]:
        depth = under_way.depth
        if not isinstance(depth, Halfway):
            return under_way, depth
        processed = self._pipeline.finish(depth)
        return replace(under_way, depth=processed, computed_ns=now.monotonic_ns()), processed

    def _finish(self, under_way: _UnderWay) -> None:
        """Finish a pair, in the finisher's thread."""
        try:
            self._hand_over(under_way)
        except Exception as error:
            self._fail(error)
            raise

    def _hand_over(self, under_way: _UnderWay) -> None:
        if self.has_given_up:
            return
        computed, processed = self._computed(under_way)
        number = self._ledgerer.processed
        for sink in self._sinks:
            sink.await_place(number)
        marks = WorkerMarks(computed.dequeued_ns, computed.computed_ns, done_ns=now.monotonic_ns())
        result = Result(number, computed.pair, processed, self._ledgerer.enter(computed.pair, processed, marks))
        for sink in self._sinks:
            sink.offer(result)
        if self._most_pairs and number + 1 >= self._most_pairs:
            self.finished.set()

    def _note_failed(self, error: DataError) -> None:
        """Count a pair that could not be processed.

        Spoiled images never end a run, because their sender must not be able to end it. A rig that fits no pair does.
        """
        books = self._ledgerer
        books.enter_failed(error)
        if isinstance(error, SpoiledImageError):
            if self._begun == 0 and books.spoiled == _HOPELESS:
                _LOG.error(event("no_sound_image", count=_HOPELESS, problem=error.problem, remedy=error.remedy))
        elif self._begun == 0 and books.undecodable - books.spoiled > _HOPELESS:
            raise error  # no pair fits: wrong rig or wrong camera
        if books.undecodable.bit_count() == 1:  # the 1st, 2nd, 4th, 8th …: one bad camera must not fill the log
            _LOG.warning(event("pair_failed", count=books.undecodable, problem=error.problem))
