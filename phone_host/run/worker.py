"""The worker: takes pairs from the queue, has their depth computed and passes the results to the sinks."""

import logging
import threading
from collections.abc import Callable, Sequence
from typing import Final, Protocol

from common import now
from common.errors import DataError, SettingsError
from common.frame import SpoiledImageError
from common.program.logs import event
from common.program.out_of_memory import noted_if_out_of_memory
from phone_host.model import FramePair, Result
from phone_host.run.ledgerer import Ledgerer
from phone_host.run.pipeline import Pipeline
from phone_host.run.sinks import Sink

_LOG = logging.getLogger(__name__)

_HOPELESS: Final = 10
"""If this many pairs fail before the first success, the cause is not an occasional spoiled frame."""


class PairSource(Protocol):
    """Where pairs come from: live links, two folders of images or a recording, all by way of a PairQueue."""

    def take(self) -> FramePair | None:
        """Wait for the next pair and return it; None: no further one comes."""


class Worker:
    """The worker thread.

    Args:
        source: of the pairs.
        pipeline: computes their depth.
        ledgerer: keeps the books.
        sinks: take the results.
        most_pairs: the worker ends after this many pairs; 0 for no limit.
        taken: called when a place in the queue becomes free.
    """

    def __init__(
        self,
        source: PairSource,
        pipeline: Pipeline,
        ledgerer: Ledgerer,
        sinks: Sequence[Sink],
        *,
        most_pairs: int,
        taken: Callable[[], None],
    ) -> None:
        self._source, self._pipeline, self._ledgerer, self._sinks = source, pipeline, ledgerer, tuple(sinks)
        self._most_pairs, self._taken = most_pairs, taken
        self._thread = threading.Thread(target=self._work, name="worker", daemon=True)
        self.finished = threading.Event()
        self.failure: Exception | None = None
        self.has_given_up = False
        """Whether a pair is still being computed that nobody waits for. Its result is dropped."""

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self, patience_s: float | None = None) -> None:
        """Finish the current pair, start none of the waiting ones, and end. The source must be closed.

        Args:
            patience_s: give up a pair that takes longer than this; None: wait for it.
        """
        self.finished.set()
        self._thread.join(patience_s)
        if self._thread.is_alive():
            self.has_given_up = True
            _LOG.warning(event("pair_given_up", why="the run was stopped while native code computed its depth"))

    def has_ended(self, wait_s: float) -> bool:
        """Wait up to `wait_s` for the worker to end after a closed queue's last pair. Return whether it has ended."""
        self._thread.join(wait_s)
        return not self._thread.is_alive()

    def _work(self) -> None:
        try:
            # Whoever is given up has nobody left to tell: what he would wake is closed by now.
            while not self.has_given_up and (pair := self._source.take()) is not None:
                dequeued_ns = now.monotonic_ns()
                self._taken()
                if not self.finished.is_set():
                    self._process(pair, dequeued_ns)
        except Exception as error:  # noqa: BLE001 - a thread's root: the run's root reports it once
            self.failure = error
            self.finished.set()

    def _process(self, pair: FramePair, dequeued_ns: int) -> None:
        try:
            with noted_if_out_of_memory(f"pair {self._ledgerer.processed}"):
                processed = self._pipeline.process(pair)
        except (DataError, SettingsError) as error:  # or a --crop that lies outside images of this size
            self._note_failed(error)
            return
        if self.has_given_up:
            return
        computed_ns = now.monotonic_ns()
        number = self._ledgerer.processed
        for sink in self._sinks:
            sink.await_place(number)
        ledger = self._ledgerer.enter(
            pair, processed, dequeued_ns=dequeued_ns, computed_ns=computed_ns, done_ns=now.monotonic_ns()
        )
        result = Result(number, pair, processed, ledger)
        for sink in self._sinks:
            sink.offer(result)
        if self._most_pairs and number + 1 >= self._most_pairs:
            self.finished.set()

    def _note_failed(self, error: DataError | SettingsError) -> None:
        """Count a pair that could not be processed.

        Spoiled images never end a run, because their sender must not be able to end it. A rig that fits no pair does.
        """
        books = self._ledgerer
        books.enter_failed(error)
        if isinstance(error, SpoiledImageError):
            if books.processed == 0 and books.spoiled == _HOPELESS:
                _LOG.error(event("no_sound_image", count=_HOPELESS, problem=error.problem, remedy=error.remedy))
        elif books.processed == 0 and books.undecodable - books.spoiled > _HOPELESS:
            raise error  # no pair fits: wrong rig or wrong camera
        if books.undecodable.bit_count() == 1:  # the 1st, 2nd, 4th, 8th …: one bad camera must not fill the log
            _LOG.warning(event("pair_failed", count=books.undecodable, problem=error.problem))
