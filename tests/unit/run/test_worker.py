"""The worker at its end: a pair that native code still computes holds up nobody, and its result is dropped."""

import threading
from dataclasses import replace
from typing import Any

import numpy as np

from common import now
from common.frame import PixelFormat
from phone_host.model import Disparity, RectifiedPair, Side
from phone_host.run.ledgerer import Ledgerer
from phone_host.run.pipeline import Pipeline, Worker
from phone_host.stereo.core import StereoCore
from phone_host.stream.pair_queue import PairQueue
from phone_host.sync.fifo import FifoSettings
from tests.support.numbered import draw
from tests.support.pictures import encoded
from tests.unit.stream.test_pair_queue import PERIOD_NS, board_frame, camera_of, host_frame


class HeldMatcher:
    """Finds nothing, and not before it may: a matcher that computes for long."""

    def __init__(self) -> None:
        self.begun, self.may_end = threading.Event(), threading.Event()

    def match(self, pair: RectifiedPair) -> Disparity:
        """Wait, then return an empty map."""
        self.begun.set()
        assert self.may_end.wait(60)
        return np.full(pair.left.shape[:2], np.nan, np.float32)


def test_a_stopped_run_gives_up_a_pair_that_takes_long() -> None:
    """`stop` returns while the matcher still computes; when it is done, nothing is entered in the books and no waiting pair is taken."""
    matcher, books = HeldMatcher(), Ledgerer()
    queue = PairQueue(FifoSettings(), None, PERIOD_NS)
    pipeline = Pipeline(StereoCore(matcher, None, None), Side.LEFT, now.monotonic_ns)
    taken: list[int] = []
    worker = Worker(queue, pipeline, books, (), most_pairs=0, taken=lambda: taken.append(1))
    queue.begin(camera_of(PERIOD_NS))
    at_ns, image = now.monotonic_ns(), encoded(".png", draw(1))
    worker.start()
    sound: Any = {"width_px": 160, "height_px": 120, "pixel_format": PixelFormat.PNG, "payload": image}
    board = board_frame(0, at_ns)
    queue.add_board(replace(board, message=replace(board.message, **sound)))
    queue.add_host(replace(host_frame(0, at_ns), **sound))
    assert matcher.begun.wait(60)
    queue.add_board(replace(board_frame(1, at_ns + PERIOD_NS), message=replace(board.message, sequence=1, **sound)))
    queue.add_host(replace(host_frame(1, at_ns + PERIOD_NS), **sound))
    queue.finish()
    worker.stop(0.01)
    assert worker.has_given_up
    matcher.may_end.set()
    worker.stop()
    assert worker.has_ended(60)
    assert (books.processed, worker.failure, taken) == (0, None, [1])
