"""Marlin's serial protocol: numbered lines with checksums, one under way, resent until it has arrived. Pure: text and times in, text out.

- A line is sent again when the printer asks for it, or when no answer came for some seconds. Its number keeps it from being done twice.
- Heating, homing and waiting may be silent for minutes; whatever the printer says meanwhile is a sign of life.
- After a line was sent twice the printer may answer twice. What it asks for then because of the second one is not taken for an error.
- Cancelling sends nothing more of the print, and switches heaters, fan and motors off.
Source: the RepRap wiki, "G-code", sections Line number, Checksum, Replies; Marlin's queue.cpp; print.md 6 of the project's studies (measured
against OctoPrint's and Printrun's senders).
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from phone_host.printers.gcode import Line, name_of
from phone_host.printers.progress import Heat, Phase

SECOND_NS: Final = 1_000_000_000

_USUAL_NS: Final = 4 * SECOND_NS
"""Marlin says that it is busy every 2 s; what is silent for twice that has lost a line or an answer."""

_LONG_NS: Final = 600 * SECOND_NS
_LONG: Final = frozenset(
    {
        "G4",
        "G28",
        "G29",
        "G30",
        "G33",
        "G34",
        "G76",
        "M0",
        "M1",
        "M109",
        "M116",
        "M190",
        "M191",
        "M226",
        "M303",
        "M400",
        "M600",
    }
)
"""What may take minutes without a word."""

_START_NS: Final = 3 * SECOND_NS
"""A board that restarts when its port is opened says `start` within this; others say nothing."""

_AFTER_RESEND_NS: Final = SECOND_NS * 3 // 20
"""Most firmware says `ok` behind `Resend`, some do not."""

_MOST_TRIES: Final = 4
_KEPT: Final = 200
_OFF: Final = ("M104 S0", "M140 S0", "M107", "M84")
_WAKE: Final = "M108"
"""Ends waiting for a temperature, where the firmware hears it at once."""

_FATAL: Final = re.compile(r"halted|kill\(\)|thermal|heating failed|maxtemp|mintemp|stopped|emergency", re.IGNORECASE)
_ASKED: Final = re.compile(r"(?:resend|rs)[: ]+N?(\d{1,9})(?!\d)", re.IGNORECASE)
_ORDER: Final = re.compile(r"line number is not|expected line", re.IGNORECASE)
_HEAT: Final = re.compile(r"\b(T|B)\d?:\s*(-?\d{1,5}(?:\.\d+)?)\s*/\s*(-?\d{1,5}(?:\.\d+)?)")
"""A cable spoils what the printer says, too: only numbers are taken for numbers."""


@dataclass(slots=True)
class _Sent:
    """The line that is under way."""

    number: int
    text: str
    due_ns: int = 0
    tries: int = 0
    is_asked_again: bool = False


def framed(number: int, text: str) -> bytes:
    """Return a line as it travels: with its number and the exclusive or of its bytes."""
    numbered = f"N{number} {text}".encode()
    checksum = 0
    for byte in numbered:
        checksum ^= byte
    return numbered + b"*%d\n" % checksum


class MarlinSender:
    """Sends the lines of a print.

    Attributes:
        phase: how far it is.
        done: lines that the printer has taken.
        resent: lines that were sent again.
        heat: the last temperatures that were told.
        problem: why it failed, in words; empty: it did not.
        remedy: what to do about it.

    Args:
        lines: of the print.
        now_ns: when its port was opened.
    """

    def __init__(self, lines: Iterator[Line], now_ns: int) -> None:
        self._lines = lines
        self._opened_ns = now_ns
        self._queue: list[str] = []
        self._kept: dict[int, str] = {}
        self._number = 0
        self._under_way: _Sent | None = None
        self._ghosts = 0
        self._refused_order = False
        self._awaited_ok_ns = 0
        self._swallow_ok = False
        self._again: list[int] = []
        self._last_heard_ns = now_ns
        self.phase = Phase.OPENING
        self.done = self.resent = 0
        self.heat = Heat()
        self.problem = self.remedy = ""

    @property
    def may_pause(self) -> bool:
        """Whether there is something to pause."""
        return self.phase is Phase.PRINTING

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
        self.phase = Phase.CANCELLING
        self._queue = list(_OFF)
        if self._under_way is not None:  # should it be asked for again, nothing of the print goes out any more
            self._kept[self._under_way.number] = _OFF[0]
        self._under_way, self._again, self._awaited_ok_ns = None, [], 0
        self._ghosts = 0
        return f"{_WAKE}\n".encode()

    def heard(self, text: str, now_ns: int) -> None:
        """Take a line of the printer.

        Args:
            text: without its end.
            now_ns: when it came.
        """
        said = text.strip()
        if not said or self.phase.is_over:
            return
        self._last_heard_ns = now_ns
        self._note_heat(said)
        lower = said.lower()
        if lower.startswith("start"):
            self._started(now_ns)
        elif lower.startswith(("error", "!!")):
            self._complained(said)
        elif found := _ASKED.match(said):
            self._asked(int(found[1]), now_ns)
        elif lower.startswith("ok"):
            self._acknowledged(now_ns)
        elif self._under_way is not None:  # busy, temperatures, echoes: it lives
            self._under_way.due_ns = now_ns + _patience_ns(self._under_way.text)

    def to_send(self, now_ns: int) -> bytes:
        """Return what is to be sent now; empty: nothing.

        Args:
            now_ns: the time.
        """
        if self.phase.is_over:
            return b""
        if self.phase is Phase.OPENING:
            if now_ns - self._opened_ns < _START_NS:
                return b""
            self._begin()
        if self._under_way is not None:
            return self._sent_again(now_ns)
        if now_ns < self._awaited_ok_ns:
            return b""
        return self._sent_next(now_ns)

    @property
    def due_ns(self) -> int:
        """When `to_send` has something again, unless the printer says something before; a time in the past: now."""
        if self.phase is Phase.OPENING:
            return self._opened_ns + _START_NS
        if self._under_way is not None:
            return self._awaited_ok_ns if self._under_way.is_asked_again else self._under_way.due_ns
        return self._awaited_ok_ns

    def _begin(self) -> None:
        self.phase = Phase.PRINTING
        self._queue = ["M110 N0"]

    def _started(self, now_ns: int) -> None:
        if self.phase is Phase.OPENING:
            self._opened_ns = now_ns - _START_NS
        else:
            self._fail(
                "the printer has restarted",
                "see whether its power supply or its cable is at fault; its heaters are off",
            )

    def _complained(self, said: str) -> None:
        if _FATAL.search(said) or said.startswith("!!"):
            self._fail(f"the printer says: {said[:120]}", "see what its display says; it has to be restarted")
        else:
            self._refused_order = bool(_ORDER.search(said))

    def _asked(self, number: int, now_ns: int) -> None:
        """The printer wants a line: the one under way, an older one, or, if that had arrived, the next."""
        under_way, refused_order = self._under_way, self._refused_order
        self._refused_order = False
        if under_way is None:
            if self._ghosts:
                self._ghosts, self._swallow_ok = self._ghosts - 1, True
            return
        if number == under_way.number + 1:  # it had arrived, its answer was lost
            self._ghosts = max(self._ghosts - 1, 0)
            self._arrived(now_ns)
            self._swallow_ok, self._awaited_ok_ns = True, now_ns + _AFTER_RESEND_NS
        elif number == under_way.number and self._ghosts and refused_order:
            self._ghosts, self._swallow_ok = self._ghosts - 1, True
        elif number in self._kept or number == under_way.number:
            self._go_back(number, now_ns)
        elif number > under_way.number:
            self._fail(
                f"the printer asks for line {number}, which was not sent yet",
                "another program may be using its port: end it; see whether its heaters are off",
            )
        else:
            self._fail(
                f"the printer asks for line {number}, long after it was sent",
                "see whether its heaters are off, and its cable sound",
            )

    def _go_back(self, number: int, now_ns: int) -> None:
        under_way = self._under_way
        assert under_way is not None
        if number < under_way.number:
            self._again = [*range(number + 1, under_way.number + 1), *self._again]
            self.done -= under_way.number - number
            self._under_way = under_way = _Sent(number, self._kept[number], tries=under_way.tries)
        under_way.is_asked_again = True
        self._swallow_ok = True
        self._awaited_ok_ns = now_ns + _AFTER_RESEND_NS

    def _acknowledged(self, now_ns: int) -> None:
        if self._swallow_ok:
            self._swallow_ok = False
            self._awaited_ok_ns = now_ns
            return
        if self._under_way is not None:
            self._arrived(now_ns)

    def _arrived(self, now_ns: int) -> None:
        under_way = self._under_way
        assert under_way is not None
        self._under_way = None
        self._awaited_ok_ns = now_ns
        self.done += under_way.number > 0 and self.phase is not Phase.CANCELLING

    def _sent_again(self, now_ns: int) -> bytes:
        under_way = self._under_way
        assert under_way is not None
        if under_way.is_asked_again:
            if now_ns < self._awaited_ok_ns:
                return b""
            under_way.is_asked_again = self._swallow_ok = False
        elif now_ns < under_way.due_ns:
            return b""
        else:
            self._ghosts += 1
        under_way.tries += 1
        if under_way.tries >= _MOST_TRIES and now_ns - self._last_heard_ns > _USUAL_NS:
            self._fail(
                "the printer does not answer",
                "see whether it is on and its cable is plugged in, whether the baud rate is right, and whether its heaters are off",
            )
            return b""
        self.resent += 1
        return self._on_its_way(under_way, now_ns)

    def _sent_next(self, now_ns: int) -> bytes:
        self._swallow_ok = False
        if self._again:
            number = self._again.pop(0)
            self._under_way = _Sent(number, self._kept[number])
            return self._on_its_way(self._under_way, now_ns)
        if self.phase is Phase.PAUSED:
            return b""
        if self._queue:
            text = self._queue.pop(0)
        elif self.phase is Phase.CANCELLING:
            self.phase = Phase.CANCELLED
            return b""
        elif (line := next(self._lines, None)) is not None:
            text = line.text
        else:
            self.phase = Phase.DONE
            return b""
        self._under_way = _Sent(self._number, text)
        self._number += 1
        return self._on_its_way(self._under_way, now_ns)

    def _on_its_way(self, sent: _Sent, now_ns: int) -> bytes:
        self._kept[sent.number] = sent.text
        self._kept.pop(sent.number - _KEPT, None)
        sent.due_ns = now_ns + _patience_ns(sent.text)
        return framed(sent.number, sent.text)

    def _note_heat(self, said: str) -> None:
        told = {letter: (float(now), float(goal)) for letter, now, goal in _HEAT.findall(said)}
        if told:
            self.heat = Heat(told.get("T", self.heat.nozzle), told.get("B", self.heat.bed))

    def _fail(self, problem: str, remedy: str) -> None:
        self.phase, self.problem, self.remedy = Phase.FAILED, problem, remedy


def _patience_ns(text: str) -> int:
    return _LONG_NS if name_of(text) in _LONG else _USUAL_NS
