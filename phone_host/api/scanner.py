"""A running scan as a context manager and an iterable, and the sink that the calling program reads."""

import threading
from collections import deque
from collections.abc import Iterator, Mapping
from types import TracebackType
from typing import Final, Self

from common import now
from common.camera.base import Camera
from common.diagnostic import diagnostic_of
from common.link.base import Link
from common.protocol.message import Pacing
from phone_host.accounts.delays import Series, SinkAccount
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.jobs.run import Opened
from phone_host.model import Result
from phone_host.recording.playback import Playback
from phone_host.run.host_settings import EndReason

_DEPTH: Final = 2


class Scanner:
    """A running scan: a context manager and an iterable of results, in the order of the pairs. Made by `open_scanner`.

    Args:
        opened: the run.
        told: content of settings.json.
        lossless: whether the program gets every result.
    """

    def __init__(self, opened: Opened, told: Mapping[str, object], *, lossless: bool) -> None:
        camera = opened.camera
        assert not isinstance(camera, Playback)  # no argument asks for one
        self._results = _ResultQueue(waits=lossless or camera.description.pacing is Pacing.DEMAND)
        self._prepared = opened.prepared((), [self._results], told)
        self._opened: tuple[Camera | Link, ...] = (camera, *opened.links)
        self._was_entered = False
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="scanner", daemon=True)
        self._failure: BaseException | None = None
        self._is_failure_told = False
        self.ended: EndReason | None = None
        self.is_complete = True
        """After the run: whether the results folder holds everything that was asked for."""

    def __enter__(self) -> Self:
        if self._was_entered:
            raise RuntimeError("a scanner runs once: open another")
        self._was_entered = True
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stopping.set()
        self._results.leave()
        self._thread.join()
        if error is None:
            self._tell_failure()

    def _tell_failure(self) -> None:
        """Raise the error that ended the run, but only once."""
        if self._failure is not None and not self._is_failure_told:
            self._is_failure_told = True
            raise self._failure

    def close(self) -> None:
        """Release camera, links and folder of a scanner that was never entered. An entered one releases them itself."""
        if not self._was_entered:
            self._was_entered = True
            self._prepared.host.abandon()
            for item in self._opened:
                item.close()

    def __iter__(self) -> Iterator[Result]:
        """Yield results until the run ends.

        Raises:
            TandemError: as in `phone-host run`: no board, images that do not fit the rig, or a lost link.
            RuntimeError: called outside `with`.
        """
        if not self._was_entered:
            raise RuntimeError("the scan has not begun: use `with open_scanner(…) as scanner`")
        while (result := self._results.take()) is not None:
            yield result
        self._thread.join()
        self._tell_failure()

    def snapshot(self) -> RunSnapshot:
        """Return delays, accounts, clock, doubts and drops as of now, or as of the end of the run."""
        host = self._prepared.host
        if self._failure is not None:
            return host.snapshot("failed", diagnostic_of(self._failure))
        return host.snapshot("running" if self.ended is None else self.ended.value)

    def _run(self) -> None:
        run = self._prepared
        try:
            self.ended = run.host.run(self._stopping.is_set)
        except BaseException as error:  # noqa: BLE001 - a thread's root: the iterator raises it
            self._failure = error
        try:
            over = run.ended(self.ended) if self.ended else run.failed(diagnostic_of(self._failure or RuntimeError()))
            self.is_complete = over.is_complete
        except Exception as error:  # noqa: BLE001 - as above
            self._failure = self._failure or error
        finally:
            self._results.finish()


class _ResultQueue:
    """The sink that the calling program reads. When full, it drops the oldest result, or waits if `waits` is set."""

    def __init__(self, *, waits: bool) -> None:
        self._waits = waits
        self._items: deque[tuple[Result, int]] = deque()
        self._changed = threading.Condition()
        self._ended = self._left = False
        self._given = self._dropped = 0
        self._delay = Series()

    def await_place(self, number: int) -> None:
        """See Sink."""
        del number  # all are alike
        if self._waits:
            with self._changed:
                self._changed.wait_for(lambda: len(self._items) < _DEPTH or self._left)

    def offer(self, result: Result) -> None:
        """See Sink."""
        with self._changed:
            if self._left:
                return
            if len(self._items) >= _DEPTH:
                self._items.popleft()
                self._dropped += 1
            self._items.append((result, now.monotonic_ns()))
            self._changed.notify_all()

    def take(self) -> Result | None:
        """Return the oldest result; wait if there is none. Return None at the end of the run."""
        with self._changed:
            self._changed.wait_for(lambda: bool(self._items) or self._ended)
            if not self._items:
                return None
            result, since_ns = self._items.popleft()
            self._given += 1
            self._delay.add(now.monotonic_ns() - since_ns)
            self._changed.notify_all()
            return result

    def leave(self) -> None:
        """Accept no more results: the program has left the `with` block."""
        with self._changed:
            self._left = True
            self._changed.notify_all()

    def finish(self) -> None:
        """See Sink."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    @property
    def failure(self) -> Exception | None:
        """See Sink; it cannot fail."""
        return None

    @property
    def accounts(self) -> tuple[SinkAccount, ...]:
        """See Sink."""
        with self._changed:
            given, dropped, waiting, delay = self._given, self._dropped, len(self._items), self._delay.copy()
        spread = delay.spread()
        return (SinkAccount(name="program", written=given, dropped=dropped, failed=0, waiting=waiting, delay=spread),)
