"""The worker and its finisher: a pair is matched while the one before is handed over, and what happens at the end and at failures."""

import threading
from dataclasses import asdict, replace
from itertools import pairwise
from typing import Any

import numpy as np

from common import now
from common.frame import PixelFormat
from common.ledger import PairLedger
from phone_host.model import Disparity, RectifiedPair, Result, Side
from phone_host.run.ledgerer import Ledgerer
from phone_host.run.pipeline import Pipeline
from phone_host.run.sinks import Sink
from phone_host.run.worker import Worker
from phone_host.stereo.core import StereoCore
from phone_host.stereo.matcher_protocol import Matcher
from phone_host.stream.pair_queue import PairQueue
from phone_host.sync.fifo import FifoSettings
from tests.support.numbered import draw
from tests.support.pictures import encoded
from tests.unit.test_pair_queue import PERIOD_NS, board_frame, camera_of, host_frame


class HeldMatcher:
    """Finds nothing, and not before it may: a matcher that computes for long."""

    def __init__(self) -> None:
        self.begun, self.may_end = threading.Event(), threading.Event()

    def match(self, pair: RectifiedPair) -> Disparity:
        """Wait, then return an empty map."""
        self.begun.set()
        assert self.may_end.wait(60)
        return np.full(pair.left.shape[:2], np.nan, np.float32)


class CountingMatcher:
    """Finds nothing, and tells how many pairs it has begun."""

    def __init__(self) -> None:
        self.changed, self.begun = threading.Condition(), 0

    def match(self, pair: RectifiedPair) -> Disparity:
        """Count, then return an empty map."""
        with self.changed:
            self.begun += 1
            self.changed.notify_all()
        return np.full(pair.left.shape[:2], np.nan, np.float32)

    def await_begun(self, count: int) -> bool:
        """Wait until so many pairs have begun."""
        with self.changed:
            return self.changed.wait_for(lambda: self.begun >= count, 60)


class HeldSink:
    """A sink that misses nothing: it has no place until it may; or fails."""

    failure = None
    accounts = ()

    def __init__(self, error: Exception | None = None) -> None:
        self.may_take, self.results = threading.Event(), list[Result]()
        self._error = error

    def await_place(self, number: int) -> None:
        """Wait; or fail."""
        del number
        if self._error is not None:
            raise self._error
        assert self.may_take.wait(60)

    def offer(self, result: Result) -> None:
        """Keep it."""
        self.results.append(result)

    def finish(self) -> None:
        """Nothing is left to do."""


class Setup:
    """A worker over a queue that holds many pairs."""

    def __init__(self, matcher: Matcher, *sinks: Sink, most_pairs: int = 0) -> None:
        self.books = Ledgerer()
        self.queue = PairQueue(FifoSettings(depth=8), None, PERIOD_NS)
        pipeline = Pipeline(StereoCore(matcher, None, None), Side.LEFT, now.monotonic_ns)
        self.worker = Worker(self.queue, pipeline, self.books, sinks, most_pairs=most_pairs, taken=lambda: None)
        self.queue.begin(camera_of(PERIOD_NS))

    def add(self, pairs: int) -> None:
        """Queue pairs of sound images, one period apart."""
        at_ns, image = now.monotonic_ns(), encoded(".png", draw(1))
        sound: Any = {"width_px": 160, "height_px": 120, "pixel_format": PixelFormat.PNG, "payload": image}
        for number in range(pairs):
            exposed_ns = at_ns - (pairs - number) * PERIOD_NS
            board = board_frame(number, exposed_ns)
            self.queue.add_board(replace(board, message=replace(board.message, **sound)))
            self.queue.add_host(replace(host_frame(number, exposed_ns), **sound))
        self.queue.finish()


def test_a_pair_is_matched_while_the_one_before_is_handed_over() -> None:
    """A sink keeps the first pair: the second is matched meanwhile, the third is not even taken.

    Then all come out in order, and the wait stands in the stages, which are never longer than processing.
    """
    matcher, sink = CountingMatcher(), HeldSink()
    setup = Setup(matcher, sink)
    setup.add(4)
    setup.worker.start()
    assert matcher.await_begun(2)
    assert (setup.books.processed, setup.queue.counts.waiting) == (0, 2)
    held_ns = now.monotonic_ns()
    sink.may_take.set()
    assert setup.worker.has_ended(60)
    assert setup.worker.failure is None
    assert [result.number for result in sink.results] == [0, 1, 2, 3]
    ledgers = [result.ledger for result in sink.results]
    assert [ledger.sequence for ledger in ledgers] == [0, 1, 2, 3]
    for ledger in ledgers:
        stages = sum(asdict(ledger.stages).values())
        assert 0 < stages <= ledger.processing_ns
        delays = ledger.capture_ns + ledger.outbox_ns + ledger.propagation_ns + ledger.pairing_ns
        assert delays + ledger.queuing_ns + ledger.processing_ns == ledger.end_to_end_ns
    assert ledgers[0].dequeued_ns + ledgers[0].stages.write <= ledgers[0].done_ns
    assert ledgers[0].done_ns >= held_ns
    assert ledgers[1].dequeued_ns < ledgers[0].done_ns  # they overlapped
    assert all(a.done_ns <= b.done_ns for a, b in pairwise(ledgers))
    assert all(a.dequeued_ns + _until_matched(a) <= b.dequeued_ns for a, b in pairwise(ledgers))


def _until_matched(ledger: PairLedger) -> int:
    """From taking a pair to its match, ns."""
    return ledger.stages.decode + ledger.stages.rectify + ledger.stages.match


def test_no_more_pairs_are_begun_than_were_asked_for() -> None:
    """With --pairs 2 and five waiting, two are matched and two come out, although the first is handed over late."""
    matcher, sink = CountingMatcher(), HeldSink()
    setup = Setup(matcher, sink, most_pairs=2)
    setup.add(5)
    setup.worker.start()
    assert matcher.await_begun(2)
    sink.may_take.set()
    assert setup.worker.has_ended(60)
    assert (matcher.begun, setup.books.processed, len(sink.results)) == (2, 2, 2)
    assert setup.worker.finished.is_set()


def test_a_failure_while_handing_over_ends_the_run() -> None:
    """What a sink raises is the worker's failure; both threads end, and no other pair comes out."""
    error = OSError("no room")
    setup = Setup(CountingMatcher(), HeldSink(error))
    setup.add(5)
    setup.worker.start()
    assert setup.worker.has_ended(60)
    assert setup.worker.failure is error
    assert setup.worker.finished.is_set()
    assert setup.books.processed == 0


def test_a_stop_finishes_both_pairs_under_way() -> None:
    """A run that is stopped while one pair is handed over and the next is matched gives both, and none of the waiting ones."""
    matcher, sink = CountingMatcher(), HeldSink()
    setup = Setup(matcher, sink)
    setup.add(5)
    setup.worker.start()
    assert matcher.await_begun(2)
    setup.worker.finished.set()
    sink.may_take.set()
    setup.worker.stop()
    assert (setup.books.processed, setup.worker.has_given_up) == (2, False)


def test_a_stopped_run_gives_up_a_pair_that_takes_long() -> None:
    """`stop` returns while the matcher still computes; when it is done, nothing is entered in the books."""
    matcher, books = HeldMatcher(), Ledgerer()
    queue = PairQueue(FifoSettings(), None, PERIOD_NS)
    pipeline = Pipeline(StereoCore(matcher, None, None), Side.LEFT, now.monotonic_ns)
    worker = Worker(queue, pipeline, books, (), most_pairs=0, taken=lambda: None)
    queue.begin(camera_of(PERIOD_NS))
    at_ns, image = now.monotonic_ns(), encoded(".png", draw(1))
    worker.start()
    sound: Any = {"width_px": 160, "height_px": 120, "pixel_format": PixelFormat.PNG, "payload": image}
    board = board_frame(0, at_ns)
    queue.add_board(replace(board, message=replace(board.message, **sound)))
    queue.add_host(replace(host_frame(0, at_ns), **sound))
    assert matcher.begun.wait(60)
    queue.finish()
    worker.stop(0.01)
    assert worker.has_given_up
    matcher.may_end.set()
    worker.stop()
    assert worker.has_ended(60)
    assert (books.processed, worker.failure) == (0, None)
