"""One activity at a time, in a thread of its own. It can be stopped at any moment, and its failure is told, not fatal."""

import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Final

from common.diagnostic import Diagnostic, Severity, diagnostic_of
from common.errors import TandemError
from phone_host.web.source import Activity

_LOG = logging.getLogger(__name__)

_PATIENCE_S: Final = 1.5
"""What is stopped gets so long to end; what waits for a network or a device is then left to itself."""

_WORDS: Final = {
    Activity.ENROLLING: "a board is being enrolled",
    Activity.CHECKING: "the cameras are being checked",
    Activity.CALIBRATING: "a calibration is running",
    Activity.RUNNING: "a run is active",
    Activity.SCANNING: "a scan is running",
    Activity.ENDING: "the last activity is still ending",
}


class StoppedError(Exception):
    """An activity ends because somebody stopped it."""


class Task:
    """One activity.

    Attributes:
        activity: what it does.

    Args:
        activity: what it does.
    """

    def __init__(self, activity: Activity) -> None:
        self.activity = activity
        self._stop = threading.Event()
        self._holds = self.is_left = False

    def stopped(self) -> bool:
        """Whether it shall end."""
        return self._stop.is_set()

    def stop(self) -> None:
        """Ask it to end."""
        self._stop.set()

    def go_on(self) -> None:
        """Raise if it shall end.

        Raises:
            StoppedError: it shall.
        """
        if self.stopped():
            raise StoppedError

    @property
    def may_be_left(self) -> bool:
        """Whether the next activity can begin although this one has not ended."""
        return not self._holds

    @contextmanager
    def held(self) -> Iterator[None]:
        """While the block runs, it holds cameras and files, so that the next activity has to wait for its end."""
        self._holds = True
        try:
            yield
        finally:
            self._holds = False


class Activities:
    """Runs activities.

    Args:
        begins: called before an activity begins, in the thread that asks for it.
        changed: called, from any thread, after each change.
        failed: takes what ended an activity.
    """

    def __init__(
        self, begins: Callable[[], None], changed: Callable[[], None], failed: Callable[[Diagnostic], None]
    ) -> None:
        self._begins, self._changed, self._failed = begins, changed, failed
        self._is_closed = False
        self._lock = threading.Lock()
        self._task: Task | None = None
        self._thread: threading.Thread | None = None

    @property
    def now(self) -> Activity:
        """What goes on."""
        task = self._task
        if task is None:
            return Activity.IDLE
        return Activity.ENDING if task.stopped() else task.activity

    def begin(self, activity: Activity, work: Callable[[Task], None]) -> Diagnostic | None:
        """Begin an activity, unless another one goes on.

        Args:
            activity: what it is.
            work: does it; called in the activity's thread.

        Returns:
            Why it does not begin; None: it does.
        """
        task = Task(activity)
        with self._lock:
            if self._task is not None:
                return Diagnostic(_WORDS[self.now], "stop it, or wait until it ends", Severity.FAIL)
            if self._is_closed:
                return Diagnostic("the program is ending", "start phone-host serve again", Severity.FAIL)
            self._begins()
            self._task = task
            self._thread = threading.Thread(target=self._work, args=(task, work), name=activity.value, daemon=True)
            self._thread.start()
        self._changed()
        return None

    def stop(self, patience_s: float = _PATIENCE_S) -> bool:
        """Stop what goes on.

        Args:
            patience_s: wait so long for its end.

        Returns:
            Whether there was something.
        """
        with self._lock:
            task, thread = self._task, self._thread
        if task is None or thread is None:
            return False
        task.stop()
        self._changed()
        thread.join(patience_s)
        if thread.is_alive() and task.may_be_left:
            self._end(task, is_left=True)
        return True

    def close(self, patience_s: float) -> None:
        """Stop what goes on, and begin nothing more.

        Args:
            patience_s: wait so long for its end.
        """
        with self._lock:
            self._is_closed = True
        self.stop(patience_s)

    def wait(self, patience_s: float) -> None:
        """Wait for the end of what goes on.

        Args:
            patience_s: no longer than this.
        """
        thread = self._thread
        if thread is not None:
            thread.join(patience_s)

    def _work(self, task: Task, work: Callable[[Task], None]) -> None:
        try:
            with suppress(StoppedError):
                work(task)
        except Exception as error:  # noqa: BLE001 - an activity's root: the page tells what happened
            if not isinstance(error, TandemError):
                _LOG.exception("an activity failed")
            if not task.is_left:
                self._failed(diagnostic_of(error))
        finally:
            self._end(task)

    def _end(self, task: Task, *, is_left: bool = False) -> None:
        with self._lock:
            task.is_left = task.is_left or is_left
            if self._task is task:
                self._task = None
        self._changed()
