"""A thread that finishes what the worker has begun, one thing at a time, so that the worker can begin the next meanwhile."""

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")


class Finisher(Generic[T]):
    """One place, and the thread that empties it. The place is taken until what lies in it is finished.

    So at most two things are under way, one begun and one being finished, and each is at most one behind.

    Args:
        name: of the thread.
        finish: called with each item in the thread, in order. After an exception nothing more is finished.
    """

    def __init__(self, name: str, finish: Callable[[T], None]) -> None:
        self._finish = finish
        self._changed = threading.Condition()
        self._item: T | None = None
        self._has_item = self._ending = False
        self.failure: Exception | None = None
        """What `finish` raised."""
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def take(self, item: T) -> bool:
        """Take an item if the one before is finished. Never waits; after a failure the item is dropped.

        Returns:
            Whether it was taken or dropped.
        """
        with self._changed:
            if self.failure is not None:
                return True
            if self._has_item:
                return False
            self._item, self._has_item = item, True
            self._changed.notify_all()
            return True

    def put(self, item: T) -> None:
        """Wait until the item before is finished, then take this one, or drop it after a failure."""
        with self._changed:  # reentrant
            self._changed.wait_for(lambda: self.take(item))

    def end(self) -> None:
        """No item will follow: the thread ends after the last one."""
        with self._changed:
            self._ending = True
            self._changed.notify_all()

    def has_ended(self, wait_s: float | None) -> bool:
        """Wait up to `wait_s`, or for as long as it takes, for the thread to end. Return whether it has ended."""
        self._thread.join(wait_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._has_item or self._ending)
                if not self._has_item:
                    return
                item, self._item = self._item, None  # a finished item's arrays are freed at once
            try:
                self._finish(item)  # type: ignore[arg-type]  # an item may be None by its own type
            except Exception as error:  # noqa: BLE001 - a thread's root: its owner reports it
                with self._changed:
                    self.failure = error
                    self._changed.notify_all()
                return
            del item
            with self._changed:
                self._has_item = False
                self._changed.notify_all()
