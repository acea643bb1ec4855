"""Marlin's serial protocol: numbered lines with checksums, one under way, resent until it has arrived. Pure: text and times in, text out.

- A line is sent again when the printer asks for it, or when no answer came for some seconds. Its number keeps it from being done twice.
- Heating, homing and waiting may be silent for minutes. Otherwise only `busy`, and temperatures while it heats, extend the wait.
- A printer that asks for what cannot be, a line of the future or its first one, is asked once more: cables spoil numbers, too.
- After a line was sent twice the printer may answer twice. What it asks for then because of the second one is not taken for an error.
- Every wait and every repetition is bounded: a line that makes no progress ends the print.
- Cancelling, here or at the printer, sends nothing more of the print, and switches heaters, fan and motors off.
- A print begins with M85: a printer whose host has died switches itself off. The clock starts again with every command.
Source: the RepRap wiki, "G-code", sections Line number, Checksum, Replies; Marlin's queue.cpp and MarlinCore.cpp (manage_inactivity, kill);
print.md 6 of the project's studies (measured against OctoPrint's and Printrun's senders).
"""

from collections.abc import Iterator
from typing import Final, assert_never

from common.diagnostic import Diagnostic
from phone_host.printers.cooling import CoolingCheck, wake
from phone_host.printers.door import Heat, Phase
from phone_host.printers.gcode import Line, name_of
from phone_host.printers.marlin_reply import HostAction, Reply, ReplyKind, read_reply
from phone_host.printers.marlin_rules import (
    ALIVE_NS,
    NO_FAILURE,
    RESTARTED,
    SECOND_NS,
    SILENT,
    Attempts,
    Guard,
    PlannedLine,
    SenderOptions,
    SentLine,
    ended_there,
    framed,
    is_done_now,
    is_long,
    long_sent,
    no_progress,
    not_finished,
    not_sent_yet,
    patience_ns,
    printer_says,
    still_heating,
)

_START_NS: Final = 3 * SECOND_NS
"""A board that restarts when its port is opened says `start` within this; others say nothing."""

_AFTER_RESEND_NS: Final = SECOND_NS * 3 // 20
"""Most firmware says `ok` behind `Resend`, some do not."""

_MAX_TRIES: Final = 4
"""Of a printer that says nothing at all."""

_MAX_LATE_STARTS: Final = 3
_SAVED: Final = 200
_ASK_NS: Final = 300 * SECOND_NS
"""Between questions for temperatures while it waits: they keep M85 from its end, and find out whether the printer is still there."""


class MarlinSender:
    """Sends the lines of a print.

    Attributes:
        phase: how far it is.
        done: lines of the print that the printer has taken.
        resent: lines that were sent again.
        heat: the last temperatures that were reported.
        message: what the printer shows or waits for; empty: nothing.
        failure: why it failed; NO_FAILURE: it did not.
        off: lines that switch off what the print heats.
        cooling: whether the printer has done them.
    """

    def __init__(self, lines: Iterator[Line], now_ns: int, options: SenderOptions | None = None) -> None:
        self._lines, self._options = lines, options or SenderOptions()
        self.off, self.cooling = self._options.off, CoolingCheck(self._options.off)
        self._opened_ns = now_ns
        self._queue: list[PlannedLine] = []
        self._saved: dict[int, PlannedLine] = {}
        self._number = self._ghosts = self._late_starts = 0
        self._attempts = Attempts()
        self._under_way: SentLine | None = None
        self._began_ns = self._last_sent_ns = now_ns
        self._refused_order = self._swallow_ok = self._is_deaf = self._is_first = self._is_doubted = False
        self._awaited_ok_ns, self._last_heard_ns = 0, now_ns
        self._again: list[int] = []
        self._urgent, self._ended_there = b"", ""
        self._guard = Guard(self._options.inactivity_s)
        self.phase = Phase.OPENING
        self.done = self.resent = 0
        self.heat = Heat()
        self.message, self.failure = "", NO_FAILURE

    def pause(self) -> None:
        """Send nothing more for now; heaters stay on."""
        if self.phase is Phase.PRINTING:
            self.phase = Phase.PAUSED

    def resume(self) -> None:
        """Go on."""
        if self.phase is Phase.PAUSED:
            self.phase = Phase.PRINTING

    def cancel(self) -> bytes:
        """End the print; return what must be sent at once."""
        if self.phase.is_over or self.phase is Phase.CANCELLING:
            return b""
        self._is_first = self._is_first or self.phase is Phase.OPENING
        self._number = 0 if self._is_first else self._number
        self.phase = Phase.CANCELLING
        self._queue = [PlannedLine(text) for text in (*("M110 N0",) * self._is_first, *self.cooling.begin(), "M84")]
        # A printer that waits for a temperature hears later: a second copy would make it drop what stands behind the first.
        self._is_deaf = self._under_way is not None and is_long(self._under_way.line.text)
        # Whatever is requested, nothing of the print goes out any more.
        self._saved = dict.fromkeys(self._saved, PlannedLine(self.off[0]))
        self._under_way, self._again, self._awaited_ok_ns = None, [], 0
        self._ghosts, self._attempts = 0, Attempts()
        return wake()

    def finish_cancelling(self) -> None:
        """End it: what cools was confirmed, or the printer says that it heats all the same; the rest is not waited for."""
        if self._ended_there and not self.cooling.hot:
            self._fail(ended_there(self._ended_there, is_cold=not self.cooling.is_unreported))
        else:
            self._end(Phase.CANCELLED)

    def heard(self, text: str, now_ns: int) -> HostAction:
        """Take a line of the printer; return what its display wants, which is already done here."""
        reply = read_reply(text)
        if not (reply.text or reply.name) or self.phase.is_over:
            return HostAction.NONE
        self._last_heard_ns = now_ns
        self._note_heat(reply)
        match reply.kind:
            case ReplyKind.START:
                self._started(now_ns)
            case ReplyKind.FATAL:
                self._fail(printer_says(reply.text))
            case ReplyKind.ERROR:
                self._refused_order = reply.is_about_order
                self._note_unguarded(reply)
            case ReplyKind.RESEND:
                self._resend(reply.number, now_ns)
            case ReplyKind.OK:
                self._acknowledged(now_ns)
            case ReplyKind.ACTION:
                self._act(reply)
            case ReplyKind.BUSY | ReplyKind.OTHER:
                self._note_life(reply, now_ns)
            case _:
                assert_never(reply.kind)
        return reply.action

    def to_send(self, now_ns: int) -> bytes:
        """Return what is to be sent now; empty: nothing."""
        urgent, self._urgent = self._urgent, b""
        if self.phase.is_over or urgent:
            return urgent
        if self.phase is Phase.OPENING:
            if now_ns - self._opened_ns < _START_NS:
                return b""
            self._begin()
        if self._under_way is not None:
            return self._sent_again(self._under_way, now_ns)
        if now_ns < self._awaited_ok_ns:
            return b""
        return self._sent_next(now_ns)

    @property
    def due_ns(self) -> int:
        """When `to_send` has something again, unless the printer says something before; a time in the past: now."""
        if self.phase is Phase.OPENING:
            return self._opened_ns + _START_NS
        if self._under_way is not None:
            return self._awaited_ok_ns if self._under_way.is_requested else self._under_way.due_ns
        if self.phase is Phase.PAUSED and not self._again:
            return self._last_sent_ns + _ASK_NS
        return self._awaited_ok_ns

    def _begin(self) -> None:
        self.phase = Phase.PRINTING
        self._is_first = True
        self._queue = [PlannedLine(text) for text in ("M110 N0", *self._guard.begin())]

    def _started(self, now_ns: int) -> None:
        if self.phase is Phase.OPENING:
            self._opened_ns = now_ns - _START_NS
        elif self._is_first and self._late_starts < _MAX_LATE_STARTS:  # it was still starting when the first line went
            self._late_starts += 1
            if self._under_way is not None:
                self._queue, self._under_way = [self._under_way.line, *self._queue], None
            self._number = 0
        else:
            self._fail(RESTARTED)

    def _act(self, reply: Reply) -> None:
        """Do what the printer's display wants."""
        match reply.action:
            case HostAction.CANCEL:
                if self.phase is not Phase.CANCELLING:
                    words = "" if reply.name == "cancel" else f" ({reply.name})"
                    self._ended_there = f"the print was ended at the printer{words}"
                    self._urgent = self.cancel()
            case HostAction.PAUSE:
                self.message = "paused at the printer" if reply.name.startswith("pause") else reply.name
                self.pause()
            case HostAction.RESUME:
                self.message = ""
                self.resume()
            case HostAction.SHOW:
                self.message = reply.text
            case HostAction.NONE:
                return
            case _:
                assert_never(reply.action)

    def _note_life(self, reply: Reply, now_ns: int) -> None:
        """Wait longer for the line under way where the printer shows that it is being done."""
        under_way = self._under_way
        if under_way is None:
            return
        text = under_way.line.text
        self._note_unguarded(reply)
        if is_done_now(text, reply):
            under_way.due_ns = now_ns + ALIVE_NS
            self._attempts.timeouts = 0
        if reply.kind is ReplyKind.BUSY:
            minutes = (now_ns - self._began_ns) // (60 * SECOND_NS)
            self.message = f"{reply.text} ({name_of(text) or text}, {minutes} min)"

    def _note_unguarded(self, reply: Reply) -> None:
        """Remember that the printer does not know M85."""
        if self._under_way is not None and self._guard.note_unknown(self._under_way.line.text, reply):
            self.message = "this printer has no M85: if this machine fails, its heaters stay on"

    def _resend(self, number: int, now_ns: int) -> None:
        """The printer wants a line: the one under way, an older one, or, if that had arrived, the next."""
        under_way, refused_order = self._under_way, self._refused_order
        self._refused_order = False
        if under_way is None:
            if self._ghosts:
                self._ghosts, self._swallow_ok = self._ghosts - 1, True
            return
        if under_way.number < number <= self._number:  # all before it had arrived, its answer was lost
            self._ghosts = max(self._ghosts - 1, 0)
            self.done += sum(self._saved[old].is_print for old in self._again if old < number)
            self._again = [old for old in self._again if old >= number]
            self._arrived(now_ns, is_answered=False)
            self.cooling.note_arrival(number - 1)
            self._swallow_ok, self._awaited_ok_ns = True, now_ns + _AFTER_RESEND_NS
        elif number == under_way.number and self._ghosts and refused_order:
            self._ghosts, self._swallow_ok = self._ghosts - 1, True
        elif number in self._saved and not self._attempts.are_begun_again(number):
            self._go_back(under_way, number, now_ns)
        elif not under_way.is_requested:
            self._doubt(under_way, number, now_ns)

    def _doubt(self, under_way: SentLine, number: int, now_ns: int) -> None:
        """Ask a printer once more that wants what cannot be sent. The cable may have spoiled the number; an honest printer says another one then."""
        if not self._is_doubted:
            self._is_doubted = True
            self._go_back(under_way, under_way.number, now_ns)
        elif self._attempts.are_begun_again(number):
            self._fail(RESTARTED)
        else:
            self._fail(not_sent_yet(number) if number > self._number else long_sent(number))

    def _go_back(self, under_way: SentLine, number: int, now_ns: int) -> None:
        is_new = not under_way.is_requested
        self.cooling.note_request(number)
        if number < under_way.number:
            self._again = [*range(number + 1, under_way.number + 1), *self._again]
            self.done -= sum(self._saved[back].is_print for back in range(number, under_way.number))
            self._under_way = under_way = SentLine(number, self._saved[number], tries=under_way.tries)
        self._swallow_ok = True
        under_way.is_requested = True
        if is_new:  # served once, however often it is repeated meanwhile
            self._attempts.requests += 1
            self._awaited_ok_ns = max(now_ns + _AFTER_RESEND_NS, self._attempts.not_before_ns(self._last_sent_ns))

    def _acknowledged(self, now_ns: int) -> None:
        under_way = self._under_way
        # A line that is to be sent again has not arrived, however often the printer says so.
        if self._swallow_ok or (under_way is not None and under_way.is_requested):
            self._swallow_ok = False
            self._awaited_ok_ns = max(now_ns, self._attempts.not_before_ns(self._last_sent_ns))
            return
        if under_way is not None:
            self._arrived(now_ns)

    def _arrived(self, now_ns: int, *, is_answered: bool = True) -> None:
        under_way = self._under_way
        assert under_way is not None
        self._under_way = None
        self._awaited_ok_ns = now_ns
        self._is_first = False
        self.done += under_way.line.is_print
        self.cooling.note_arrival(under_way.number)
        self._queue[:0] = [PlannedLine(text) for text in self.cooling.lines_after(under_way.line.text)]
        if not self._attempts.note_arrival(under_way.number, is_answered=is_answered):
            return
        self._is_doubted = False
        if self.message.startswith("busy: "):
            self.message = ""

    def _sent_again(self, under_way: SentLine, now_ns: int) -> bytes:
        if now_ns - self._began_ns > self._options.max_busy_ns:
            self._fail(not_finished(under_way.line.text, self._options.max_busy_ns))
            return b""
        if under_way.is_requested:
            if now_ns < self._awaited_ok_ns:
                return b""
            under_way.is_requested = self._swallow_ok = False
        elif now_ns < under_way.due_ns or (self._is_deaf and self.phase is Phase.CANCELLING):
            return b""
        else:
            self._ghosts += 1
            self._attempts.timeouts += 1
        under_way.tries += 1
        if under_way.tries >= _MAX_TRIES and now_ns - self._last_heard_ns > self._options.usual_ns:
            self._fail(SILENT)
            return b""
        if self._is_given_up(under_way):
            return b""
        self.resent += 1
        return self._on_its_way(under_way, now_ns)

    def _is_given_up(self, sent: SentLine) -> bool:
        """Return whether lines were repeated too often, which ends the print."""
        if self._attempts.are_too_many:
            self._fail(no_progress(sent, self._attempts))
        return self._attempts.are_too_many

    def _sent_next(self, now_ns: int) -> bytes:
        self._swallow_ok = False
        if self._again:
            number = self._again.pop(0)
            sent = SentLine(number, self._saved[number])
            return b"" if self._is_given_up(sent) else self._on_its_way(sent, now_ns)
        line = self._next_line(now_ns)
        return b"" if line is None else self._sent_new(line, now_ns)

    def _next_line(self, now_ns: int) -> PlannedLine | None:
        """Return the line that follows; None: nothing, because it waits or is over."""
        if self.phase is Phase.PAUSED:
            return PlannedLine("M105") if now_ns - self._last_sent_ns >= _ASK_NS else None
        if self._queue:
            return self._queue.pop(0)
        if self.phase is not Phase.CANCELLING:
            if (line := next(self._lines, None)) is not None:
                self._queue = [PlannedLine(text, is_print=text == line.text) for text in self._guard.around(line.text)]
                return self._queue.pop(0)
            if self._options.heats and (asks := self.cooling.ask()):
                return PlannedLine(asks)
        if not self.cooling.hot and (ends := self._guard.end()):  # a printer that heats all the same keeps its guard
            return PlannedLine(ends)
        if self.phase is Phase.CANCELLING:
            self.finish_cancelling()
        else:
            self._end(Phase.DONE)
        return None

    def _sent_new(self, line: PlannedLine, now_ns: int) -> bytes:
        sent = SentLine(self._number, line)
        self.cooling.note_sent(sent.number, line.text)
        self._number += 1
        self._began_ns = now_ns
        return self._on_its_way(sent, now_ns)

    def _on_its_way(self, sent: SentLine, now_ns: int) -> bytes:
        self._under_way = sent
        self._saved[sent.number] = sent.line
        self._saved.pop(sent.number - _SAVED, None)
        sent.due_ns = now_ns + patience_ns(sent.line.text, self._options.usual_ns)
        self._last_sent_ns = now_ns
        return framed(sent.number, sent.line.text)

    def _note_heat(self, reply: Reply) -> None:
        self.cooling.note_heat(reply.heat)
        read = {letter: (now, goal) for letter, now, goal in reversed(reply.heat)}  # the tool in use comes first
        if read:
            self.heat = Heat(read.get("T", self.heat.nozzle), read.get("B", self.heat.bed))

    def _end(self, phase: Phase) -> None:
        """End the print as it was meant to, unless the printer says that a heater is on."""
        if self.cooling.hot:
            self._fail(still_heating(self.cooling.hot))
        else:
            self.phase = phase

    def _fail(self, failure: Diagnostic) -> None:
        self.phase, self.failure = Phase.FAILED, failure
