"""Brings a print to a printer: the protocol says what and when, the line carries it."""

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from common import now
from common.errors import DataError
from phone_host.printers.line import Line, PrinterGoneError
from phone_host.printers.marlin import SECOND_NS, Heat, MarlinSender, Phase

_TELL_NS: Final = SECOND_NS // 4
_LEAST_WAIT_S, _MOST_WAIT_S = 0.01, 0.1
_MOST_LINE: Final = 4096
"""A printer whose words have no end says nothing."""

_CANCEL_NS: Final = 5 * SECOND_NS
"""Heaters are switched off within a second; a printer that is deaf for so long will not hear it."""


@dataclass(frozen=True, slots=True)
class Progress:
    """How far a print is.

    Attributes:
        phase: of it.
        done: lines that were taken.
        resent: lines that were sent again.
        heat: temperatures.
    """

    phase: Phase
    done: int
    resent: int
    heat: Heat


class Wishes:
    """What the user wants of a print. Any thread may use it."""

    def __init__(self) -> None:
        self._cancelled, self._paused = threading.Event(), threading.Event()

    def cancel(self) -> None:
        """End it, and switch the heaters off."""
        self._cancelled.set()

    def toggle_pause(self) -> None:
        """Pause it, or go on."""
        if self._paused.is_set():
            self._paused.clear()
        else:
            self._paused.set()

    @property
    def is_cancelled(self) -> bool:
        """Whether it shall end."""
        return self._cancelled.is_set()

    @property
    def is_paused(self) -> bool:
        """Whether it shall wait."""
        return self._paused.is_set()


def send(line: Line, sender: MarlinSender, wishes: Wishes, tell: Callable[[Progress], None]) -> Phase:
    """Send a print until it is done, cancelled or has failed.

    Args:
        line: to the printer; it is not closed.
        sender: the print.
        wishes: of the user.
        tell: called several times a second.

    Returns:
        How it ended.

    Raises:
        PrinterGoneError: the printer is gone.
        DataError: a line of the file is none of G-code; the heaters are off.
    """
    told_ns, rest, cancelled_ns, failure = 0, b"", 0, None
    while not sender.phase.is_over:
        now_ns = now.monotonic_ns()
        if wishes.is_cancelled and not cancelled_ns:
            cancelled_ns = now_ns
            line.write(sender.cancel())
        if cancelled_ns and now_ns - cancelled_ns > _CANCEL_NS:
            raise PrinterGoneError(
                "the printer does not answer any more: nobody knows whether its heaters are off",
                "go and look; switch it off if its display does not say that they are cold",
            )
        if wishes.is_paused:
            sender.pause()
        else:
            sender.resume()
        try:
            data = sender.to_send(now_ns)
        except DataError as error:
            failure, data = error, b""
            wishes.cancel()
        if data:
            line.write(data)
        if now_ns - told_ns >= _TELL_NS:
            told_ns = now_ns
            tell(Progress(sender.phase, sender.done, sender.resent, sender.heat))
        wait_s = min(max((sender.due_ns - now_ns) / SECOND_NS, 0.0 if data else _LEAST_WAIT_S), _MOST_WAIT_S)
        *lines, rest = (rest + line.read(wait_s)).split(b"\n")
        for each in lines:
            sender.heard(each.decode("ascii", "replace"), now.monotonic_ns())
        rest = rest[-_MOST_LINE:]
    if failure is not None:
        raise failure
    tell(Progress(sender.phase, sender.done, sender.resent, sender.heat))
    return sender.phase
