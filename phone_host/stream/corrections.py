"""Corrections of a camera's phase on their way from the thread that orders them to the thread that applies them."""

import threading


class Corrections:
    """The sum of the corrections that are ordered but not yet applied.

    Each correction is relative to the camera's present phase, so two corrections equal one of their sum. One number
    therefore holds any number of corrections and loses none.

    Attributes:
        is_due: whether there is a correction to apply. Read without the lock.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._later_ns = 0
        self.is_due = False

    def add(self, later_ns: int) -> None:
        """Let the camera expose later by `later_ns`, in addition to what is already due."""
        with self._lock:
            self._later_ns += later_ns
            self.is_due = self._later_ns != 0

    def take(self) -> int:
        """Return the sum that is due, ns, and reset it: the caller applies it. 0: nothing is due."""
        with self._lock:
            later_ns, self._later_ns = self._later_ns, 0
            self.is_due = False
            return later_ns
