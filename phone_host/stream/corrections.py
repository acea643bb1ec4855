"""Corrections of a camera's phase on their way from the thread that orders them to the one that has them carried out."""

import threading


class Corrections:
    """The sum of what was ordered and is not carried out yet.

    Each correction is relative to where the camera stands, so that two of them are one of their sum: none is lost, and one number holds
    any amount of them.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._later_ns = 0

    def add(self, later_ns: int) -> None:
        """Let the camera expose later by so much, beside what is due already."""
        with self._lock:
            self._later_ns += later_ns

    @property
    def is_due(self) -> bool:
        """Whether there is something to carry out; a look without the lock."""
        return self._later_ns != 0

    def take(self) -> int:
        """Give what is due, ns, and forget it: the caller carries it out. 0: nothing is due."""
        with self._lock:
            later_ns, self._later_ns = self._later_ns, 0
            return later_ns
