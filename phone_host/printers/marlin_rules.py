"""How long a printer is waited for, how often a line is repeated, what shows that it works, and in which words a print has failed. Pure.

Every limit is one of time or count, so that no printer, whatever it says, is waited for without an end.
"""

import re
from dataclasses import dataclass
from typing import Final

from common.diagnostic import Diagnostic, Severity
from phone_host.printers.cooling import heaters_off
from phone_host.printers.gcode import name_of
from phone_host.printers.marlin_reply import Reply, ReplyKind

SECOND_NS: Final = 1_000_000_000

USUAL_NS: Final = 4 * SECOND_NS
"""Marlin says that it is busy every 2 s; what is silent for twice that has lost a line or an answer."""

ALIVE_NS: Final = 9 * SECOND_NS
"""After a sign that the line is being done: M113 sets how often Marlin says so, 2 s unless somebody changes it."""

LONG_NS: Final = 600 * SECOND_NS
_HEATING: Final = frozenset({"M109", "M116", "M190", "M191", "M303"})
_LONG: Final = _HEATING | {"G4", "G28", "G29", "G30", "G33", "G34", "G76", "M0", "M1", "M226", "M400", "M600"}
"""What may take minutes without a word."""

_UNGUARD: Final = "M85 S0"
_FOR_PEOPLE: Final = frozenset({"M0", "M1", "M226", "M600", "M601"})
_DWELL: Final = re.compile(r"G0*4\s*([SP])\s*(\d+)", re.IGNORECASE)
_LONG_DWELL_S: Final = 300

_FREE_REQUESTS: Final = 2
_SLOWER_NS: Final = SECOND_NS // 10
_SLOWEST_NS: Final = SECOND_NS
"""Requests beyond the free ones are served after a wait that doubles from the one to the other: 20 of them take 15 s."""

_MAX_REQUESTS: Final = 20
"""Without progress. On a cable that spoils every third line, one line of 10^9 needs as many."""

_MAX_TIMEOUTS: Final = 8

_MOST_AHEAD: Final = 8
"""Lines that we may be ahead of a printer that has answered too often before its first line came."""


def framed(number: int, text: str) -> bytes:
    """Return a line as it travels: with its number and the exclusive or of its bytes."""
    numbered = f"N{number} {text}".encode()
    checksum = 0
    for byte in numbered:
        checksum ^= byte
    return numbered + b"*%d\n" % checksum


def is_long(text: str) -> bool:
    """Return whether a line may take minutes without a word."""
    return name_of(text) in _LONG


def patience_ns(text: str, usual_ns: int) -> int:
    """Return how long the answer to a line is waited for, ns.

    Args:
        text: of the line.
        usual_ns: for a line that takes no time, ns.
    """
    return LONG_NS if is_long(text) else usual_ns


def is_done_now(text: str, reply: Reply) -> bool:
    """Return whether a reply shows that a line is being done: it says `busy`, or a heater that the line waits for is on its way.

    Temperatures alone show nothing: M155 reports them whatever is done, and so does `wait`.
    """
    name = name_of(text)
    is_heating = reply.is_heating or (name == "M303" and bool(reply.heat))
    return reply.kind is ReplyKind.BUSY or (name in _HEATING and is_heating)


def is_unknown(reply: Reply) -> bool:
    """Return whether a printer says that it does not know a command, as Marlin, Klipper or RepRapFirmware do."""
    words = reply.text.lower()
    return "unknown command" in words or "not supported" in words


def may_outlast_guard(text: str) -> bool:
    """Return whether a line may wait for longer than the printer's own guard against a dead host: for people, or by its number."""
    if name_of(text) in _FOR_PEOPLE:
        return True
    dwell = _DWELL.match(text)
    return dwell is not None and int(dwell[2]) > _LONG_DWELL_S * (1000 if dwell[1].upper() == "P" else 1)


@dataclass(frozen=True, slots=True)
class SenderOptions:
    """How a print is sent.

    Attributes:
        off: lines that switch off what the print heats.
        inactivity_s: the printer stops and switches its heaters off when no command came for so long, s; 0: that is left alone.
        max_busy_ns: the longest time that one line may take, ns.
        usual_ns: how long the answer to a line that takes no time is waited for, ns.
        heats: whether the print heats: then the printer is asked at its end whether a heater is on.
    """

    off: tuple[str, ...] = heaters_off()
    inactivity_s: int = 0
    max_busy_ns: int = 3600 * SECOND_NS
    usual_ns: int = USUAL_NS
    heats: bool = False


@dataclass(frozen=True, slots=True)
class PlannedLine:
    """A line as it may be requested again.

    Attributes:
        text: without its number.
        is_print: whether it is of the print, and not of ours.
    """

    text: str
    is_print: bool = False


@dataclass(slots=True)
class SentLine:
    """The line that is under way.

    Attributes:
        number: its own.
        line: what it says.
        due_ns: when it is sent again without an answer.
        tries: times that it was sent again.
        is_requested: whether the printer has requested it.
    """

    number: int
    line: PlannedLine
    due_ns: int = 0
    tries: int = 0
    is_requested: bool = False


@dataclass(slots=True)
class Attempts:
    """How often the lines since the last progress were sent again.

    Attributes:
        requests: times that the printer requested one.
        timeouts: times that no answer came, since the last one that did.
        highest: number of the last line that arrived for the first time.
    """

    requests: int = 0
    timeouts: int = 0
    highest: int = -1

    def note_arrival(self, number: int, *, is_answered: bool) -> bool:
        """Take a line that has arrived; return whether that is progress. An older line that arrives again is none.

        Args:
            number: its own.
            is_answered: whether the printer has said `ok`; else only what it asked for showed that the line was there.
        """
        if number <= self.highest:
            return False
        self.highest = number
        self.requests = 0
        self.timeouts = 0 if is_answered else self.timeouts
        return True

    def not_before_ns(self, sent_ns: int) -> int:
        """Return when a line that was requested may go again: later and later, so that a mad printer gets some copies, not thousands."""
        extra = self.requests - _FREE_REQUESTS
        return sent_ns + min(_SLOWER_NS << extra, _SLOWEST_NS) if extra > 0 else 0

    def are_begun_again(self, number: int) -> bool:
        """Return whether a request shows that the printer has restarted without a word: its first line is wanted long after it was taken."""
        return number <= 1 and self.highest > _MOST_AHEAD

    @property
    def are_too_many(self) -> bool:
        """Whether there were so many that the printer will not take the line."""
        return self.requests > _MAX_REQUESTS or self.timeouts > _MAX_TIMEOUTS


@dataclass(slots=True)
class Guard:
    """The printer's own guard against a host that has died: M85.

    Attributes:
        inactivity_s: the printer kills itself when no command came for so long, s; 0: that is left alone.
        is_on: whether it was switched on.
    """

    inactivity_s: int
    is_on: bool = False

    def begin(self) -> tuple[str, ...]:
        """Return what switches it on."""
        self.is_on = self.inactivity_s > 0
        return (f"M85 S{self.inactivity_s}",) if self.is_on else ()

    def end(self) -> str:
        """Return what switches it off; empty: it is not on."""
        was_on, self.is_on = self.is_on, False
        return _UNGUARD if was_on else ""

    def around(self, text: str) -> tuple[str, ...]:
        """Return a line of the print; where it may outlast the guard, between those that switch it off and on."""
        if not (self.is_on and may_outlast_guard(text)):
            return (text,)
        return _UNGUARD, text, *self.begin()

    def note_unknown(self, text: str, reply: Reply) -> bool:
        """Return whether a reply to a line says that the printer has no such guard; it is not used again then."""
        is_missing = self.inactivity_s > 0 and text == f"M85 S{self.inactivity_s}" and is_unknown(reply)
        if is_missing:
            self.inactivity_s, self.is_on = 0, False
        return is_missing


NO_FAILURE: Final = Diagnostic("", severity=Severity.OK)


def _failed(message: str, remedy: str) -> Diagnostic:
    return Diagnostic(message, remedy, Severity.FAIL)


RESTARTED: Final = _failed(
    "the printer has restarted",
    "see whether its power supply or its cable is at fault, and whether its heaters are off",
)
SILENT: Final = _failed(
    "the printer does not answer",
    "see whether it is on and its cable is plugged in, whether the baud rate is right, and whether its heaters are off",
)
_CABLE: Final = "see whether its cable is sound and its baud rate right, and whether its heaters are off"


UNREPORTED: Final = "the printer has answered the lines that switch heaters off, and does not report their target temperatures: check that it cools"


def ended_there(words: str, *, is_cold: bool) -> Diagnostic:
    """Return what somebody has done at the printer."""
    return _failed(words, f"{'heaters, fan and motors are off' if is_cold else UNREPORTED}; start it again")


def still_heating(heaters: str) -> Diagnostic:
    """Return that the printer heats though it was told twice to switch its heaters off."""
    return _failed(
        f"the printer has confirmed that its heaters are off, but still heats ({heaters})",
        "go and look; switch it off at its plug",
    )


def printer_says(words: str) -> Diagnostic:
    """Return the printer's own last words."""
    return _failed(f"the printer says: {words}", "see what its display says; it has to be restarted")


def not_sent_yet(number: int) -> Diagnostic:
    """Return that the printer wants a line of the future."""
    return _failed(
        f"the printer asks for line {number}, which was not sent yet",
        "another program may be using its port: end it; see whether its heaters are off",
    )


def long_sent(number: int) -> Diagnostic:
    """Return that the printer wants a line which is not kept any more."""
    return _failed(
        f"the printer asks for line {number}, long after it was sent",
        "see whether its heaters are off, and its cable sound",
    )


def no_progress(sent: SentLine, attempts: Attempts) -> Diagnostic:
    """Return that a line was sent so often in vain, or that line after line arrives and is not answered."""
    times = attempts.requests + attempts.timeouts
    if attempts.timeouts > sent.tries:  # lines before it were not answered, either
        return _failed(f"the printer takes the lines, and {attempts.timeouts} answers in a row were lost", _CABLE)
    return _failed(f"the printer does not take line {sent.number}, which was sent {times} times", _CABLE)


def not_finished(text: str, max_busy_ns: int) -> Diagnostic:
    """Return that the printer is busy with a line for too long."""
    return _failed(
        f"the printer has not finished {text} within {max_busy_ns / (60 * SECOND_NS):g} min",
        "see what its display says; max_busy_minutes in the table [printers] of the settings file allows more",
    )
