"""The newest results of the last run, by number: what the page shows and measures in.

A run hands over references: nothing is copied or encoded in its threads. Of older results only what measuring needs is kept.
"""

import logging
import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from common.program.logs import event
from phone_host.accounts.delays import SinkAccount
from phone_host.model import Processed, Result
from phone_host.stereo.core import StereoCore
from phone_host.web.source import Newest

_LOG = logging.getLogger(__name__)

_MOST: Final = 32
"""A second of pairs: who taps on the page means a pair that was sent some moments ago."""

_MOST_BYTES: Final = 128 << 20
"""A phone has memory for that; 32 pairs of 640x480 take 100 MB."""


@dataclass(frozen=True, slots=True, eq=False)
class Shelved:
    """A result on the shelf.

    Attributes:
        newest: the result and its number.
        core: what computed its depth; None: it has none.
    """

    newest: Newest
    core: StereoCore | None


class Shelf:
    """Keeps the newest results, and tells whoever wants to know. Any thread may use it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._kept: deque[Shelved] = deque()
        self._number = 0
        self._told: dict[object, Callable[[], None]] = {}

    def put(self, result: Result, core: StereoCore | None, begun: int = 0) -> None:
        """Take a result.

        Args:
            result: of a run.
            core: what computed it.
            begun: number of its run.
        """
        with self._lock:
            self._number += 1
            if self._kept:
                self._kept[-1] = _lean(self._kept[-1])
            self._kept.append(Shelved(Newest(self._number, result, begun), core))
            held = sum(_bytes(each.newest.result.processed) for each in self._kept)
            while len(self._kept) > 1 and (len(self._kept) > _MOST or held > _MOST_BYTES):
                held -= _bytes(self._kept.popleft().newest.result.processed)
        self.tell()

    def clear(self) -> None:
        """Something new begins: what an earlier run left, and all that computed it, is needed no more. Numbers go on."""
        with self._lock:
            self._kept.clear()

    def newest(self) -> Shelved | None:
        """Return the newest result; None: there was none."""
        with self._lock:
            return self._kept[-1] if self._kept else None

    def numbered(self, number: int) -> Shelved | None:
        """Return the result with a number; None: it is gone."""
        with self._lock:
            return next((each for each in self._kept if each.newest.number == number), None)

    def subscribe(self, told: Callable[[], None]) -> Callable[[], None]:
        """Have a function called whenever something is new; return a function that ends this."""
        key = object()
        with self._lock:
            self._told[key] = told
        return lambda: self._forget(key)

    def tell(self) -> None:
        """Call whoever wants to know. A viewer that fails must not end a run: it is told no more."""
        for key, told in list(self._told.items()):
            try:
                told()
            except Exception as error:  # noqa: BLE001 - whatever it is, it is the viewer's
                self._forget(key)
                _LOG.error(event("viewer_failed", cause=error))

    def _forget(self, key: object) -> None:
        with self._lock:
            self._told.pop(key, None)


class PageSink:
    """The page's sink: it has one place, which the newest result takes. So there is no queue, no thread and no drop to count.

    Args:
        shelf: takes the results.
        core: of the run.
        begun: number of the run.
    """

    def __init__(self, shelf: Shelf, core: StereoCore | None, begun: int = 0) -> None:
        self._shelf, self._core, self._begun = shelf, core, begun

    def await_place(self, number: int) -> None:
        """See Sink."""

    def offer(self, result: Result) -> None:
        """See Sink."""
        self._shelf.put(result, self._core, self._begun)

    def finish(self) -> None:
        """See Sink."""

    @property
    def failure(self) -> Exception | None:
        """See Sink."""
        return None

    @property
    def accounts(self) -> tuple[SinkAccount, ...]:
        """See Sink."""
        return ()


def _lean(shelved: Shelved) -> Shelved:
    """Leave away what measuring does not need: the cloud is the larger half."""
    newest = shelved.newest
    processed = replace(newest.result.processed, cloud=None, confidence=None)
    return Shelved(replace(newest, result=replace(newest.result, processed=processed)), shelved.core)


def _bytes(processed: Processed) -> int:
    arrays = (processed.pair.left, processed.pair.right, processed.disparity, processed.cloud)
    return sum(array.nbytes for array in arrays if array is not None)
