"""Why a print on a line has failed, and what to do about it. Pure: words alone."""

from typing import Final

from common.diagnostic import Diagnostic, Severity
from phone_host.printers.marlin_rules import SECOND_NS, Attempts, SentLine

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
