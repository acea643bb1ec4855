"""Brings a print to a printer on a line: the protocol says what and when, the line carries it."""

import math
from collections.abc import Callable
from contextlib import suppress
from itertools import chain
from typing import Final

from common import now
from common.errors import DataError
from phone_host.printers.door import Job, Wishes
from phone_host.printers.gcode import GcodeFacts, lines_of
from phone_host.printers.gcode import Line as GcodeLine
from phone_host.printers.line import Line, PrinterGoneError, open_line, require_allowed
from phone_host.printers.marlin import SECOND_NS, MarlinSender
from phone_host.printers.printer_uri import LineUri
from phone_host.printers.progress import Ended, Phase, Progress

_TELL_NS: Final = SECOND_NS // 4
_LEAST_WAIT_S, _MOST_WAIT_S = 0.01, 0.1
_MOST_LINE: Final = 4096
"""A printer whose words have no end says nothing."""

_CANCEL_NS: Final = 5 * SECOND_NS
"""Heaters are switched off within a second; a printer that is deaf for so long will not hear it."""

_COLD: Final = ("M104 S0", "M140 S0")
_COLD_NOW: Final = "".join(f"{text}\n" for text in ("M108", *_COLD)).encode()
"""After a failure, without numbers: the printer takes them even where it and we count differently. Whether it hears them, nobody knows."""


class LineDoor:
    """A printer that takes G-code line by line.

    Args:
        uri: where it is.
    """

    def __init__(self, uri: LineUri) -> None:
        self._uri = uri

    def require_ready(self) -> None:
        """See PrinterDoor. The port is not opened: that restarts many boards."""
        require_allowed(self._uri)

    def send(self, job: Job, wishes: Wishes, tell: Callable[[Progress], None]) -> Ended:
        """See PrinterDoor."""
        line = open_line(self._uri)
        try:
            with job.gcode.open(encoding="utf-8", errors="replace") as file:
                cooling = _COLD if job.facts.leaves_hot else ()
                lines = chain(lines_of(file, str(job.gcode)), (GcodeLine(0, text) for text in cooling))
                sender = MarlinSender(lines, now.monotonic_ns())
                send(line, sender, wishes, _telling(sender, job.facts, tell))
        finally:
            line.close()
        done = min(sender.done, job.facts.lines)
        left = f"; {done} of {job.facts.lines} lines were done"
        return Ended(
            phase=sender.phase,
            share=done / job.facts.lines,
            resent=sender.resent,
            problem=sender.problem,
            remedy=sender.remedy + left if sender.phase is Phase.FAILED else "",
            notes=_notes(job.facts) if sender.phase is Phase.DONE else (),
        )


def _notes(facts: GcodeFacts) -> tuple[str, ...]:
    return ("its G-code leaves heaters on: they were switched off",) if facts.leaves_hot else ()


def _unreadable(error: OSError) -> DataError:
    return DataError(f"the G-code cannot be read any more ({error.strerror})", "copy it to this machine's own disk")


def _telling(sender: MarlinSender, facts: GcodeFacts, tell: Callable[[Progress], None]) -> Callable[[], None]:
    began_ns: list[int] = []

    def told() -> None:
        share, now_ns = min(sender.done / facts.lines, 1.0), now.monotonic_ns()
        if share > 0 and not began_ns:
            began_ns.append(now_ns)
        passed_s = (now_ns - began_ns[0]) / SECOND_NS if began_ns else math.nan
        left_s = passed_s * (1 - share) / share if share > 0 else math.nan
        tell(Progress(phase=sender.phase, share=share, seconds_left=left_s, heat=sender.heat, resent=sender.resent))

    return told


def send(line: Line, sender: MarlinSender, wishes: Wishes, tell: Callable[[], None]) -> Phase:
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
        DataError: a line of the file is none of G-code, or cannot be read any more; the heaters are off.
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
        except OSError as error:  # of the file: the protocol opens nothing else
            failure, data = _unreadable(error), b""
            wishes.cancel()
        if data:
            line.write(data)
        if now_ns - told_ns >= _TELL_NS:
            told_ns = now_ns
            tell()
        wait_s = min(max((sender.due_ns - now_ns) / SECOND_NS, 0.0 if data else _LEAST_WAIT_S), _MOST_WAIT_S)
        *lines, rest = (rest + line.read(wait_s)).split(b"\n")
        for each in lines:
            sender.heard(each.decode("ascii", "replace"), now.monotonic_ns())
        rest = rest[-_MOST_LINE:]
    if failure is not None:
        raise failure
    if sender.phase is Phase.FAILED:
        with suppress(PrinterGoneError):
            line.write(_COLD_NOW)
    tell()
    return sender.phase
