"""The door to a printer: the one way in which a print goes to any of them, whether line by line, to a server, or into a file. How far it is, all of them say in the same words."""

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Protocol

from phone_host.printers.gcode import GcodeFacts


class Phase(Enum):
    """How far a print is."""

    OPENING = "opening"
    SENDING = "sending"
    PRINTING = "printing"
    PAUSED = "paused"
    CANCELLING = "cancelling"
    DONE = "done"
    CANCELLED = "cancelled"
    FAILED = "failed"

    @property
    def is_over(self) -> bool:
        """Whether nothing more is sent."""
        return self in {Phase.DONE, Phase.CANCELLED, Phase.FAILED}


@dataclass(frozen=True, slots=True)
class Heat:
    """What the printer tells of its temperatures, degrees C; NaN is never told, 0 is a heater that is off.

    Attributes:
        nozzle: of the nozzle, and where it shall go.
        bed: of the bed, likewise.
    """

    nozzle: tuple[float, float] = (0.0, 0.0)
    bed: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How far a print is.

    Attributes:
        phase: of it.
        share: of the print that is done, 0..1; while it is sent to a server, of the file.
        seconds_left: until it is done, s; NaN: nobody knows.
        heat: temperatures.
        resent: lines that were sent again.
        message: what the printer shows or waits for; empty: nothing.
    """

    phase: Phase
    share: float = 0.0
    seconds_left: float = math.nan
    heat: Heat = Heat()
    resent: int = 0
    message: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ended:
    """How a print has ended.

    Attributes:
        phase: DONE, CANCELLED or FAILED.
        share: of the print that is done, 0..1.
        resent: lines that were sent again.
        problem: why it failed, in words; empty: it did not.
        remedy: what to do about it.
        notes: what else is to be said of it, one sentence each.
    """

    phase: Phase
    share: float
    resent: int = 0
    problem: str = ""
    remedy: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Job:
    """What is to be printed."""

    gcode: Path
    name: str
    facts: GcodeFacts


class Wishes:
    """What the user wants of a print. Any thread may use it."""

    def __init__(self) -> None:
        self._cancelled, self._paused = threading.Event(), threading.Event()
        self._is_left = False
        self._left: Callable[[], None] = lambda: None

    def cancel(self) -> None:
        """End it, and switch the heaters off."""
        self._cancelled.set()

    def leave(self) -> None:
        """End it, ask for the heaters to be switched off, and do not wait for the answer. It takes no lock: a signal's handler may call it."""
        self._is_left = True
        self._left()

    def when_left(self, call: Callable[[], None]) -> None:
        """Have something called by `leave`, in its thread: it breaks off what the print waits for. It must take no lock."""
        self._left = call

    def pause(self) -> None:
        """Pause it."""
        self._paused.set()

    def go_on(self) -> None:
        """Go on after a pause."""
        self._paused.clear()

    def toggle_pause(self) -> None:
        """Pause it, or go on."""
        if self._paused.is_set():
            self._paused.clear()
        else:
            self._paused.set()

    def wait_cancelled(self, wait_s: float) -> bool:
        """Wait some time, or until it shall end; return whether it shall."""
        return self._cancelled.wait(wait_s) or self._is_left

    @property
    def is_cancelled(self) -> bool:
        """Whether it shall end."""
        return self._is_left or self._cancelled.is_set()

    @property
    def is_left(self) -> bool:
        """Whether nobody waits for the printer's answer any more."""
        return self._is_left

    @property
    def is_paused(self) -> bool:
        """Whether it shall wait."""
        return self._paused.is_set()


class PrinterDoor(Protocol):
    """A printer, however it is reached.

    Attributes:
        leaving_s: the longest time from `Wishes.leave` until `send` returns, with the last lines or requests written, s.
    """

    leaving_s: float

    def require_ready(self) -> None:
        """See whether it would take a print now, as far as that is known without starting anything.

        Raises:
            TandemError: it would not; the words say why, and what helps.
        """

    def send(self, job: Job, wishes: Wishes, tell: Callable[[Progress], None]) -> Ended:
        """Print something, and `tell` several times a second how it goes. It returns when that has ended.

        Raises:
            TandemError: it cannot be printed, or the printer is gone.
        """
