"""Runs a print and keeps on disk how far it is; in the caller's thread, or in one of its own."""

import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

from common import now
from common.errors import TandemError, UnavailableError
from common.unfinished import unfinished
from phone_host.printers.door import Ended, Job, Phase, PrinterDoor, Progress, Wishes
from phone_host.printers.journal import Entry, Journal, JournalEntry

_NOTE_NS: Final = 5_000_000_000
_STEP_S: Final = 0.1


@dataclass(frozen=True, slots=True)
class Place:
    """Where something is printed.

    Attributes:
        door: to the printer.
        text: its address, as the user wrote it.
        source: what is printed, as the user named it.
        journal: keeps how far it is, so that a later start can say what became of a killed print, and locks the printer; None: it is no printer.
    """

    door: PrinterDoor
    text: str
    source: str
    journal: Journal | None = None


def printed(place: Place, job: Job, wishes: Wishes, tell: Callable[[Progress], None]) -> Ended:
    """Print something; return when that has ended.

    Args:
        place: where.
        job: what.
        wishes: of the user; any thread may change them.
        tell: called several times a second, in this thread.

    Raises:
        TandemError: it cannot be printed, or the printer is gone; or another print goes to it.
    """
    if place.journal is None:
        return place.door.send(job, wishes, tell)
    entry = place.journal.begin(place.text)
    try:
        return place.door.send(job, wishes, _noting(place, job, tell, entry))
    finally:
        entry.close(is_reported=not wishes.is_left)


def _noting(
    place: Place, job: Job, tell: Callable[[Progress], None], entry: JournalEntry
) -> Callable[[Progress], None]:
    """Return what tells how far a print is, and notes it every few seconds."""
    noted_ns = -_NOTE_NS

    def watched(progress: Progress) -> None:
        nonlocal noted_ns
        tell(progress)
        if now.monotonic_ns() - noted_ns >= _NOTE_NS:
            noted_ns = now.monotonic_ns()
            done = 0 if progress.phase is Phase.SENDING else round(progress.share * job.facts.lines)
            entry.note(Entry(place.source, place.text, done, job.facts.lines, os.getpid()))

    return watched


class RunningPrint:
    """A print in a thread of its own. Every method may be called from any thread, and returns at once.

    Attributes:
        progress: how far it is.
        outcome: how it ended, or the error that ended it; None: it goes on.

    Args:
        place: where.
        job: what; its file stays until the print has ended.
        wishes: of the user; None: those of the methods alone.
        tell: called several times a second, in the print's thread; None: nobody listens.
        over: called once, in the print's thread, with how it ended or with the error that ended it; None: nobody listens.
    """

    def __init__(
        self,
        place: Place,
        job: Job,
        wishes: Wishes | None = None,
        tell: Callable[[Progress], None] | None = None,
        over: Callable[[Ended | TandemError], None] | None = None,
    ) -> None:
        self._place, self._job = place, job
        self._tell, self._told_over = tell, over
        self._wishes, self._is_over = wishes or Wishes(), threading.Event()
        self.progress = Progress(phase=Phase.OPENING)
        self.outcome: Ended | TandemError | None = None
        self._thread = threading.Thread(target=self._run, name="print", daemon=False)

    def start(self) -> None:
        """Begin. The user has been asked before."""
        self._thread.start()

    def pause(self) -> None:
        """Pause it; heaters stay on."""
        self._wishes.pause()

    def go_on(self) -> None:
        """Go on after a pause."""
        self._wishes.go_on()

    def cancel(self) -> None:
        """End it, and switch the heaters off."""
        self._wishes.cancel()

    def toggle_pause(self) -> None:
        """Pause it, or go on."""
        self._wishes.toggle_pause()

    def join(self, wait_s: float | None = None) -> bool:
        """Wait until it has ended; return whether it has. The only method that waits."""
        self._thread.join(wait_s)
        return not self._thread.is_alive()

    def ended(self) -> Ended:
        """Return how it ended; it has.

        Raises:
            TandemError: what ended it.
        """
        assert self.outcome is not None
        if isinstance(self.outcome, TandemError):
            raise self.outcome
        return self.outcome

    def _run(self) -> None:
        with unfinished(self._abandon):
            self.outcome = self._printed()
            self._is_over.set()
        if self._told_over is not None:
            self._told_over(self.outcome)

    def _printed(self) -> Ended | TandemError:
        try:
            return printed(self._place, self._job, self._wishes, self._heard)
        except TandemError as error:
            return error
        except Exception as error:  # noqa: BLE001 - a thread's root: whoever started it is told
            return UnavailableError(f"the print broke off ({type(error).__name__}: {error})", "go and look")

    def _abandon(self) -> str:
        """Let the printer get the lines that cool it: the process ends next, whatever goes on.

        Returns:
            What is to be said of its heaters; empty: they are off.

        Raises:
            TandemError: they must be taken to be on.
        """
        self._wishes.leave()
        if not self._is_over.wait(self._place.door.leaving_s):
            raise UnavailableError(
                f"{self._place.text} has not taken what switches its heaters off", "go and look: they may be on"
            )
        ended = self.ended()
        if ended.phase is Phase.FAILED:
            raise UnavailableError(ended.problem, ended.remedy)
        return "; ".join(ended.notes)

    def _heard(self, progress: Progress) -> None:
        self.progress = progress
        if self._tell is not None:
            self._tell(progress)


@contextmanager
def begun(running: RunningPrint) -> Iterator[None]:
    """Start a print, and leave the block when it has ended. What is raised in the block cancels the print first."""
    running.start()
    try:
        yield
    finally:
        while not running.join(_STEP_S):
            if sys.exception() is not None:
                running.cancel()


def watched(running: RunningPrint, tell: Callable[[Progress], None]) -> Ended:
    """Start a print; return when it has ended.

    Args:
        running: it.
        tell: called several times a second, in this thread; what it raises cancels the print.

    Raises:
        TandemError: see `printed`.
    """
    with begun(running):
        while not running.join(_STEP_S):
            tell(running.progress)
    return running.ended()
