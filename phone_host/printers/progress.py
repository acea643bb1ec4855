"""How far a print is: the words that every way to a printer uses. Pure."""

import math
from dataclasses import dataclass
from enum import Enum


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
