"""Works on the newest of several things in a thread of its own; those that come meanwhile replace each other."""

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class Newest(Generic[T]):
    """A thread and one place before it.

    Args:
        name: of the thread.
        work: called with the newest thing, in that thread. After an exception nothing more is done.
    """

    def __init__(self, name: str, work: Callable[[T], None]) -> None:
        self._work = work
        self._changed = threading.Condition()
        self._waiting: list[T] = []
        self._is_ending = False
        self.failure: Exception | None = None
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def offer(self, thing: T) -> None:
        """Hand over a thing in place of one that still waits. Never waits."""
        with self._changed:
            self._waiting = [thing]
            self._changed.notify_all()

    def finish(self, patience_s: float | None = None) -> None:
        """Finish what was handed over, then end.

        Args:
            patience_s: wait no longer than this; the thread ends with the process.
        """
        with self._changed:
            self._is_ending = True
            self._changed.notify_all()
        self._thread.join(patience_s)

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: bool(self._waiting) or self._is_ending)
                if not self._waiting or self.failure is not None:
                    return
                thing = self._waiting.pop()
            try:
                self._work(thing)
            except Exception as error:  # noqa: BLE001 - a thread's root: the live root reports it once
                self.failure = error
                return
