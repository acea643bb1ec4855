"""The processing of a pair: decode, interpolate if asked, and let the stereo core compute its depth. Each stage is timed. The worker takes pairs from the queue and passes the results to the sinks."""

import logging
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final, Protocol, TypeVar

from common import now
from common.errors import DataError, SettingsError
from common.frame import Frame, SpoiledImageError
from common.imagesize.head import MOST_PIXELS
from common.ledger import StageTimes
from common.orientation import UPRIGHT, Orientation
from common.program.logs import event
from common.program.out_of_memory import noted_if_out_of_memory
from phone_host.model import BoardFrame, FramePair, Image, Processed, RectifiedPair, Result, Side
from phone_host.run.ledgerer import Ledgerer
from phone_host.run.pair_budget import PairBudget
from phone_host.run.sinks import Sink
from phone_host.stereo.core import StereoCore
from phone_host.stereo.images import WHOLE
from phone_host.stereo.interpolate import LARGEST_FRACTION, Interpolator
from phone_host.stereo.raw_images import EncodedImage, decode_frame, decode_frames

T = TypeVar("T")
Size = tuple[int, int]


class Pipeline:
    """The stereo pipeline.

    Args:
        core: rectification, matching and reprojection; None to decode only (delays without depth).
        board_side: which view the board's frame is.
        clock: returns CLOCK_MONOTONIC, ns.
        interpolator: interpolates the board's image to the moment of the host's; None to leave it unchanged.
        most_pixels: largest accepted image size of either camera, pixels.
        budget: holds a time budget for each pair; None: there is none.
        host_orientation: how the host camera's images become upright; a board's frame says that itself.
    """

    def __init__(
        self,
        core: StereoCore | None,
        board_side: Side,
        clock: Callable[[], int],
        interpolator: Interpolator | None = None,
        most_pixels: int = MOST_PIXELS,
        *,
        budget: PairBudget | None = None,
        host_orientation: Orientation = UPRIGHT,
    ) -> None:
        self._budget = budget
        self._host_orientation = host_orientation
        self._most_pixels = most_pixels
        self._interpolator = interpolator
        self._core = core
        self._board_side = board_side
        self._clock = clock

    def process(self, pair: FramePair) -> Processed:
        """Compute a pair's depth.

        Raises:
            SpoiledImageError: a frame's bytes are not a whole image, or its size is not believed.
            DataError: the cameras' image sizes do not fit the rig.
        """
        board, host = _of_board(pair.board), self._of_host(pair.host)
        start_ns = self._clock()
        whole_px: tuple[Size, Size] = (0, 0), (0, 0)  # of both upright images as they are stored
        by = WHOLE

        def reductions(board_px: Size, host_px: Size) -> tuple[int, int]:
            """Check both sizes before anything is decoded; return by how much each image may be decoded smaller."""
            nonlocal whole_px, by
            whole_px = self._in_sides(board_px, host_px)
            if self._core is not None:
                by = self._in_sides(*self._core.reductions(*whole_px))
            return by

        board_image, host_image = decode_frames(board, host, self._most_pixels, reductions)
        decoded_ns = self._clock()
        board_image = self._at_host_time(pair, board_image, by[0])
        interpolated_ns = self._clock()
        left, right = self._in_sides(board_image, host_image)
        if self._core is None:
            processed = Processed(RectifiedPair(left, right), None, None, StageTimes())
        else:
            choice = None if self._budget is None else self._budget.choice(*whole_px)
            processed = self._core.compute(left, right, self._clock, whole_px=whole_px, choice=choice)
        stages = replace(processed.stages, decode=decoded_ns - start_ns, interpolate=interpolated_ns - decoded_ns)
        if self._budget is not None:
            end_ns = self._clock()
            self._budget.add(end_ns - start_ns, stages.match, end_ns)
        return replace(processed, stages=stages)

    def _of_host(self, frame: Frame) -> EncodedImage:
        return EncodedImage(
            payload=memoryview(frame.payload),
            pixel_format=frame.pixel_format,
            width_px=frame.width_px,
            height_px=frame.height_px,
            name=f"host frame {frame.sequence}",
            orientation=self._host_orientation,
        )

    def _in_sides(self, board: T, host: T) -> tuple[T, T]:
        """Return (left, right). Only this function knows which camera is which."""
        return (board, host) if self._board_side is Side.LEFT else (host, board)

    def _at_host_time(self, pair: FramePair, image: Image, reduction: int) -> Image:
        """Return the board's image as it would look at the host's exposure.

        If the previous frame is missing, too far away in time or spoiled, return the image unchanged.
        """
        if self._interpolator is None or pair.before is None:
            return image
        fraction = pair.time_skew_ns / (pair.board.marks.exposed_ns - pair.before.marks.exposed_ns)
        if abs(fraction) > LARGEST_FRACTION:
            return image
        try:
            earlier = decode_frame(_of_board(pair.before), self._most_pixels, reduction)
        except DataError:
            return image
        return self._interpolator.back(earlier, image, fraction) if earlier.shape == image.shape else image


def _of_board(frame: BoardFrame) -> EncodedImage:
    message = frame.message
    return EncodedImage(
        payload=memoryview(message.payload),
        pixel_format=message.pixel_format,
        width_px=message.width_px,
        height_px=message.height_px,
        name=f"board frame {message.sequence}",
        asked_px=frame.asked_px,
        orientation=frame.orientation,
    )


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
