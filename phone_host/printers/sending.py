"""Brings a print to a printer on a line: the protocol says what and when, the line carries it.

Rule: whatever ends a print, an answer, an error, a signal or a failure of this program, goes through `send`, and so through its `finally`: unless
the printer itself has confirmed the end, the lines that switch its heaters off are written before anything else is done.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from typing import Final, assert_never

from common import now
from common.errors import DataError, TandemError
from phone_host.printers.cooling import heaters_off, last_lines
from phone_host.printers.door import Ended, Job, Phase, Progress, Wishes
from phone_host.printers.gcode import GcodeFacts, action_of, ignored_note, lines_of
from phone_host.printers.gcode import Line as GcodeLine
from phone_host.printers.line import GOODBYE_S, WRITE_S, Line, PrinterGoneError, open_line, require_allowed
from phone_host.printers.marlin import MarlinSender
from phone_host.printers.marlin_reply import HostAction
from phone_host.printers.marlin_rules import SECOND_NS, UNREPORTED, SenderOptions
from phone_host.printers.printer_uri import LineUri

_TELL_NS: Final = SECOND_NS // 4
_LEAST_WAIT_S, _MOST_WAIT_S = 0.01, 0.1
_MOST_LINE: Final = 4096
"""A printer whose words have no end says nothing."""

_CANCEL_NS: Final = 5 * SECOND_NS
"""A printer that hears switches its heaters off within a second; for one that waits for a temperature the lines lie in its buffer then."""

_LAST_S: Final = 1.0
"""For the lines that cool, where even the machine's own buffer is full."""

LEAVING_S: Final = WRITE_S + _LAST_S + GOODBYE_S + 1.0
"""From a user who leaves until the lines that cool are written: a line that does not move first, then these, and a second of a busy machine."""

_INACTIVITY_S: Final = 900
"""A printer that gets no command for so long kills itself (M85): longer than any wait of ours (10 min) and than the pause between two
questions while a print is paused (5 min), so that only a dead host, a dead cable or a stopped process lets it come to that."""

_UNPROVED: Final = (
    "the lines that switch heaters off were written, and their answer was not awaited: see that the printer cools"
)


class LineDoor:
    """A printer that takes G-code line by line.

    Args:
        uri: where it is.
        max_busy_s: the longest time that it may take for one line, s.
    """

    leaving_s = LEAVING_S

    def __init__(self, uri: LineUri, max_busy_s: float = 3600.0) -> None:
        self._uri, self._max_busy_ns = uri, round(max_busy_s * SECOND_NS)

    def require_ready(self) -> None:
        """See PrinterDoor. The port is not opened: that restarts many boards."""
        require_allowed(self._uri)

    def send(self, job: Job, wishes: Wishes, tell: Callable[[Progress], None]) -> Ended:
        """See PrinterDoor."""
        off = heaters_off(job.facts.tools, has_chamber=job.facts.has_chamber)
        options = SenderOptions(off, _INACTIVITY_S if job.facts.heats else 0, self._max_busy_ns, heats=job.facts.heats)
        try:
            file = job.gcode.open(encoding="utf-8-sig", errors="replace")
        except OSError as error:
            raise _unreadable(error) from None
        with file:
            line = open_line(self._uri)
            try:
                cooling = off if job.facts.leaves_hot else ()
                commands = _FileCommands(wishes)
                lines = chain(_whole(file, job, commands), (GcodeLine(0, text) for text in cooling))
                sender = MarlinSender(lines, now.monotonic_ns(), options)
                send(line, sender, wishes, _telling(sender, job.facts, commands, tell))
            finally:
                line.close()
        return _ended(sender, job.facts, commands)


def _ended(sender: MarlinSender, facts: GcodeFacts, commands: "_FileCommands") -> Ended:
    done = min(sender.done, facts.lines)
    is_left = not sender.phase.is_over
    notes = (_UNPROVED,) if is_left else (UNREPORTED,) if sender.cooling.is_unreported else ()
    if sender.phase is Phase.DONE and facts.leaves_hot:
        notes = ("its G-code leaves heaters on: they were switched off", *notes)
    notes = (*notes, *commands.notes, *ignored_note(facts.host_commands))
    left = f"; {done} of {facts.lines} lines were done"
    return Ended(
        phase=Phase.CANCELLED if is_left else sender.phase,
        share=done / facts.lines,
        resent=sender.resent,
        problem=sender.failure.message,
        remedy=sender.failure.remedy + left if sender.phase is Phase.FAILED else "",
        notes=notes,
    )


class _FileCommands:
    """Obeys what the G-code itself wants of its host: the lines that begin with `@`.

    Attributes:
        message: why it pauses; empty: it does not.
        notes: on what was obeyed.
    """

    def __init__(self, wishes: Wishes) -> None:
        self._wishes = wishes
        self._is_new = False
        self.message, self.notes = "", tuple[str, ...]()

    def obey(self, name: str) -> None:
        """Take a command of the file; others than those that are known do nothing."""
        match action_of(name):
            case HostAction.CANCEL:
                self._wishes.cancel()
                self.notes = (f"its G-code ended it (@{name})",)
            case HostAction.PAUSE:
                self.message = f"its G-code pauses (@{name})"
                self._wishes.pause()
            case HostAction.RESUME:
                self._wishes.go_on()
            case HostAction.SHOW | HostAction.NONE:
                return
            case _ as unknown:
                assert_never(unknown)
        self._is_new = True

    def hold_back(self) -> Iterator[GcodeLine]:
        """Yield a harmless line behind a command, so that it works before the next line of the print goes out."""
        if self._is_new:
            self._is_new = False
            yield GcodeLine(0, "M105")

    def words(self, phase: Phase) -> str:
        """Return what is shown of a pause, as long as it lasts."""
        if phase is Phase.PRINTING and not self._wishes.is_paused:
            self.message = ""
        return self.message


def _whole(file: Iterable[str], job: Job, commands: _FileCommands) -> Iterator[GcodeLine]:
    """Yield the lines of a file.

    Raises:
        DataError: a line is none of G-code, or the file is another than the one that was examined: nobody knows whether it ends cold.
    """
    count = 0
    for line in lines_of(file, str(job.gcode), obey=commands.obey):
        yield from commands.hold_back()
        count += 1
        if count > job.facts.lines:
            break
        yield line
    yield from commands.hold_back()
    if count != job.facts.lines:
        raise DataError(f"{job.gcode} was changed while it was printed", "print it again, from a copy")


def _unreadable(error: OSError) -> DataError:
    return DataError(f"the G-code cannot be read any more ({error.strerror})", "copy it to this machine's own disk")


def _telling(
    sender: MarlinSender, facts: GcodeFacts, commands: _FileCommands, tell: Callable[[Progress], None]
) -> Callable[[], None]:
    began_ns: list[int] = []

    def told() -> None:
        share, now_ns = min(sender.done / facts.lines, 1.0), now.monotonic_ns()
        if share > 0 and not began_ns:
            began_ns.append(now_ns)
        passed_s = (now_ns - began_ns[0]) / SECOND_NS if began_ns else math.nan
        left_s = passed_s * (1 - share) / share if share > 0 else math.nan
        tell(
            Progress(
                phase=sender.phase,
                share=share,
                seconds_left=left_s,
                heat=sender.heat,
                resent=sender.resent,
                message=sender.message or commands.words(sender.phase),
            )
        )

    return told


def send(line: Line, sender: MarlinSender, wishes: Wishes, tell: Callable[[], None]) -> Phase:
    """Send a print until it is done, cancelled or has failed. Unless the printer has confirmed the end, the lines that cool it are written.

    Args:
        line: to the printer; it is not closed.
        sender: the print.
        wishes: of the user.
        tell: called several times a second.

    Returns:
        How it ended; CANCELLING: the user did not wait for the printer's answer.

    Raises:
        PrinterGoneError: the printer is gone, or does not answer, or the machine has not taken the lines that cool.
        DataError: a line of the file is none of G-code, or cannot be read any more; the heaters are off.
    """
    is_written = True
    try:
        _exchange(line, sender, wishes, tell)
    finally:
        if sender.phase not in {Phase.DONE, Phase.CANCELLED} and not sender.cooling.is_confirmed:
            is_written = line.offer(last_lines(sender.off), _LAST_S)
    if not is_written:
        problem = f"{sender.failure.message}, and " if sender.failure.message else ""
        raise PrinterGoneError(
            f"{problem}the lines that switch the printer's heaters off could not be written",
            "go and look; switch it off if its display does not say that they are cold",
        )
    tell()
    return sender.phase


def _exchange(line: Line, sender: MarlinSender, wishes: Wishes, tell: Callable[[], None]) -> None:
    """Exchange lines with the printer until the print is over, or the user leaves.

    Raises:
        PrinterGoneError: the printer is gone, or does not answer.
        DataError: see `send`; the print was cancelled.
    """
    told_ns, rest, cancelled_ns = 0, b"", 0
    failure: TandemError | None = None
    while not sender.phase.is_over and not wishes.is_left:
        now_ns = now.monotonic_ns()
        if wishes.is_cancelled and (wake := sender.cancel()):
            line.write(wake)
        if sender.phase is Phase.CANCELLING:
            cancelled_ns = cancelled_ns or now_ns
            if now_ns - cancelled_ns > _CANCEL_NS:
                _require_cold(sender)
                sender.finish_cancelling()
                break
        (sender.pause if wishes.is_paused else sender.resume)()
        try:
            data = sender.to_send(now_ns)
        except (DataError, OSError) as error:  # the protocol opens nothing but the file
            failure, data = error if isinstance(error, DataError) else _unreadable(error), b""
            wishes.cancel()
        if data:
            line.write(data)
        if now_ns - told_ns >= _TELL_NS:
            told_ns = now_ns
            tell()
        wait_s = min(max((sender.due_ns - now_ns) / SECOND_NS, 0.0 if data else _LEAST_WAIT_S), _MOST_WAIT_S)
        *lines, rest = (rest + line.read(wait_s)).split(b"\n")
        for each in lines:
            _obey(sender.heard(each.decode("ascii", "replace"), now.monotonic_ns()), wishes)
        rest = rest[-_MOST_LINE:]
    if failure is not None and sender.phase is Phase.FAILED:  # it may be hot, too
        raise DataError(f"{failure.problem}; {sender.failure.message}", f"{failure.remedy}; {sender.failure.remedy}")
    if failure is not None:
        raise failure


def _require_cold(sender: MarlinSender) -> None:
    if not sender.cooling.is_confirmed:
        raise PrinterGoneError(
            "the printer does not answer any more: the lines that switch its heaters off were written, but it may not have read them",
            "go and look; switch it off if its display does not say that they are cold",
        )


def _obey(action: HostAction, wishes: Wishes) -> None:
    """Take a pause at the printer's display as one of the user's, so that either can end it."""
    if action is HostAction.PAUSE:
        wishes.pause()
    elif action is HostAction.RESUME:
        wishes.go_on()
