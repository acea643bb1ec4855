"""Sinks take the results of a run. Each has a bounded queue and its own thread, so a slow sink never delays a pair.

Rules: a sink gets a result once its pair is done. If its queue is full, the result is dropped and counted under the
sink's name. A sink that `waits` loses nothing: the worker waits for a place before it marks the pair as done, and this
time counts as the pair's stage `write`.
"""

import threading
from collections import deque
from collections.abc import Callable
from typing import Any, Final, Generic, Protocol, TypeVar

from common import now
from phone_host.accounts.delays import Series, SinkAccount
from phone_host.accounts.image_motion import MotionMeter
from phone_host.model import Result, Side
from phone_host.stream.demand_clock import DemandClock

T = TypeVar("T")

DEPTH: Final = 2
"""Results queued for a sink: the one in progress and one more. Each holds its images and cloud, 7 MB at 640x480."""


class NotWrittenError(Exception):
    """Raised by a queue's `take` function: this item could not be written. It is counted, and the next one is tried."""


class Sink(Protocol):
    """Takes results.

    The worker's thread calls it, except `finish`: the run's root calls that after the worker ended.
    """

    def await_place(self, number: int) -> None:
        """Wait until there is a place for the result with this number. A sink that does not wait returns at once."""

    def offer(self, result: Result) -> None:
        """Take a result, or drop and count it. Never waits."""

    def finish(self) -> None:
        """Finish the results taken so far, then end."""

    @property
    def failure(self) -> Exception | None:
        """The error that the sink failed with. From then on it drops everything."""

    @property
    def accounts(self) -> tuple[SinkAccount, ...]:
        """The account of each of its queues, as copies."""


class SinkQueue(Generic[T]):
    """A bounded queue and the thread that empties it.

    Attributes:
        failure: the error that `take` raised. From then on everything is dropped.

    Args:
        name: its name in report.json.
        take: called with each item in the queue's thread. After any exception but NotWrittenError the queue stops.
        depth: greatest number of items in the queue.
        waits: whether `await_place` waits.
        clock: monotonic, ns.
    """

    def __init__(
        self,
        name: str,
        take: Callable[[T], None],
        *,
        depth: int = DEPTH,
        waits: bool = False,
        clock: Callable[[], int] = now.monotonic_ns,
    ) -> None:
        self._name, self._take, self._depth, self._waits, self._clock = name, take, depth, waits, clock
        self._items: deque[tuple[T, int]] = deque()  # with the time since which each waits, ns
        self._changed = threading.Condition()
        self._finishing = False
        self._written = self._dropped = self._failed = 0
        self._delay = Series()
        self.failure: Exception | None = None
        self._thread = threading.Thread(target=self._run, name=f"sink {name}", daemon=True)
        self._started = False

    def await_place(self) -> None:
        """Wait until there is a place, if this queue waits. With a single thread that offers, the place stays free."""
        if self._waits:
            with self._changed:
                self._changed.wait_for(lambda: len(self._items) < self._depth or self.failure is not None)

    def offer(self, item: T) -> bool:
        """Take an item. Never waits.

        Returns:
            Whether the item was taken. If not, it was dropped and counted.
        """
        with self._changed:
            if len(self._items) >= self._depth or self.failure is not None or self._finishing:
                self._dropped += 1
                return False
            self._items.append((item, self._clock()))
            self._changed.notify_all()
            if not self._started:  # a run that never begins leaves no thread
                self._started = True
                self._thread.start()
            return True

    def finish(self) -> None:
        """Finish the queued items, then end. May be called again."""
        with self._changed:
            self._finishing = True
            self._changed.notify_all()
        if self._started:
            self._thread.join()

    @property
    def account(self) -> SinkAccount:
        """The account so far, as a copy."""
        with self._changed:
            written, dropped, failed, waiting = self._written, self._dropped, self._failed, len(self._items)
            delay = self._delay.copy()
        spread = delay.spread()  # outside the lock: percentiles take milliseconds
        return SinkAccount(
            name=self._name, written=written, dropped=dropped, failed=failed, waiting=waiting, delay=spread
        )

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: bool(self._items) or self._finishing)
                if not self._items:
                    return
                item, since_ns = self._items[0]  # it keeps its place until it is done, because the bound limits memory
            has_failed = False
            try:
                self._take(item)
            except NotWrittenError:
                has_failed = True
            except Exception as error:  # noqa: BLE001 - a thread's root: the run's root reports it once
                with self._changed:
                    self.failure = error
                    self._dropped += len(self._items)
                    self._items.clear()
                    self._changed.notify_all()
                return
            with self._changed:
                self._items.popleft()
                self._failed += has_failed
                if not has_failed:
                    self._written += 1
                    self._delay.add(self._clock() - since_ns)
                self._changed.notify_all()


class OneQueueSink:
    """What sinks with one queue have in common."""

    def __init__(self, queue: SinkQueue[Any]) -> None:
        self._queue = queue

    def await_place(self, number: int) -> None:
        """See Sink; all results are alike."""
        del number
        self._queue.await_place()

    def offer(self, result: Result) -> None:
        """See Sink."""
        self._queue.offer(result)

    def finish(self) -> None:
        """See Sink."""
        self._queue.finish()

    @property
    def failure(self) -> Exception | None:
        """See Sink."""
        return self._queue.failure

    @property
    def accounts(self) -> tuple[SinkAccount, ...]:
        """See Sink."""
        return (self._queue.account,)


class FunctionSink(OneQueueSink):
    """A sink that calls a function with each result.

    Args:
        name: its name in report.json.
        take: the function, called in the sink's thread.
        depth: greatest number of results in the queue.
        waits: whether it must not miss any result.
    """

    def __init__(self, name: str, take: Callable[[Result], None], *, depth: int = DEPTH, waits: bool = False) -> None:
        super().__init__(SinkQueue(name, take, depth=depth, waits=waits))


class MotionSink(FunctionSink):
    """Measures how fast the host camera's image moves. The board's is not used: it may have been interpolated to another moment.

    Args:
        board_side: which view the board's camera is.
        demand: tells whether the run's images are stills: these do not move, so what was not measured is no loss.
    """

    def __init__(self, board_side: Side, demand: DemandClock) -> None:
        super().__init__("motion", self._measure)
        self._is_board_left, self._demand, self.meter = board_side is Side.LEFT, demand, MotionMeter()

    @property
    def accounts(self) -> tuple[SinkAccount, ...]:
        """See Sink; of stills there is none."""
        return () if self._demand.is_timeless else super().accounts

    def _measure(self, result: Result) -> None:
        pair = result.processed.pair
        seen = pair.right if self._is_board_left else pair.left
        self.meter.add(seen, result.ledger.host.exposed_ns, result.ledger.done_ns)
