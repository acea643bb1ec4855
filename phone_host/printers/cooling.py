"""The lines that make a printer cold, whatever ended the print. Pure.

Whether a printer that was told to cool does so: it has answered what cools, and it reports no heater with a goal above zero.

- An answer may belong to the line before: only the answer to the last line that cools confirms all of them.
- A printer may answer and heat all the same. M105 asks for the goals; where one is above zero, all is sent once more.
Source: Marlin's G-code index (M104, M105, M107, M108, M140, M141; https://marlinfw.org/meta/gcode).
"""

from collections.abc import Iterable
from typing import Final

MAX_TOOL: Final = 15
"""Highest tool whose heater is switched off by its number; Marlin has at most 8."""

_WAKE: Final = "M108"
"""Ends waiting for a temperature, where the firmware hears it at once (EMERGENCY_PARSER)."""

_CHAMBER: Final = "M141 S0"


def heaters_off(tools: Iterable[int] = (), *, has_chamber: bool = False) -> tuple[str, ...]:
    """Return the lines that switch every heater off, the hottest first.

    Args:
        tools: numbers of the tools that the print heats; the one in use is always switched off.
        has_chamber: whether the print heats a chamber.
    """
    others = tuple(f"M104 T{tool} S0" for tool in sorted(set(tools) - {0}) if 0 < tool <= MAX_TOOL)
    first = ("M104 T0 S0",) if others else ()
    return ("M104 S0", *first, *others, "M140 S0", *((_CHAMBER,) if has_chamber else ()))


def last_lines(off: tuple[str, ...]) -> bytes:
    """Return the bytes for a printer that may count or listen otherwise than we think: without numbers, all at once.

    A printer takes them whatever number it expects, and keeps them in its buffer while it waits for a temperature. They begin with an end
    of line, because the line before may have been cut.
    """
    chamber = () if _CHAMBER in off else (_CHAMBER,)
    return "".join(f"{text}\n" for text in ("", _WAKE, *off, *chamber, _FAN_OFF)).encode()


def wake() -> bytes:
    """Return the bytes that end a wait for a temperature, where the firmware hears them at once."""
    return f"{_WAKE}\n".encode()


_FAN_OFF: Final = "M107"
"""Last of the lines that cool: heaters come first."""

_ASK: Final = "M105"
_MAX_ASKS: Final = 3
"""The answer to the first may still be the one to a line before it; some firmware reports no goals at all."""

_UNSENT: Final = 1 << 60
_NAMES: Final = {"T": "nozzle", "B": "bed", "C": "chamber"}


class CoolingCheck:
    """Watches the lines that cool."""

    def __init__(self, off: tuple[str, ...]) -> None:
        self._off = off
        self._last_number, self._confirmed = _UNSENT, -1
        self._goals: dict[str, float] = {}
        self._asked = 0
        self._is_begun = self._is_repeated = False

    def begin(self) -> tuple[str, ...]:
        """Return the lines that cool, and the one that asks for the goals afterwards."""
        self._is_begun, self._is_repeated, self._asked = True, False, 0
        self._last_number, self._goals = _UNSENT, {}
        return *self._off, _FAN_OFF, _ASK

    def ask(self) -> str:
        """Return what asks for the goals where the print itself has cooled; empty: they were asked for."""
        was_begun, self._is_begun = self._is_begun, True
        return "" if was_begun else _ASK

    @property
    def is_confirmed(self) -> bool:
        """Whether the printer has answered every line that cools, and reports no heater that is still on."""
        return self._confirmed >= self._last_number and not self.hot

    @property
    def is_unreported(self) -> bool:
        """Whether the printer was asked for its goals and has reported none."""
        return self._is_begun and not self._goals

    @property
    def hot(self) -> str:
        """The heaters that the printer reports to be on, with their goals, in words; empty: none."""
        return ", ".join(f"{_NAMES[key]} {goal:.0f} C" for key, goal in self._goals.items() if goal > 0)

    def note_sent(self, number: int, text: str) -> None:
        """Take a line that is sent for the first time."""
        if self._is_begun and text == _FAN_OFF:
            self._last_number = number
        elif self._is_begun and text == _ASK and not self._asked:
            self._goals = {}

    def note_arrival(self, number: int) -> None:
        """Take that the printer has a line, and with it all before."""
        self._confirmed = number

    def note_request(self, number: int) -> None:
        """Take that the printer wants a line again: it has neither that nor one behind it."""
        self._confirmed = min(self._confirmed, number - 1)

    def note_heat(self, heat: Iterable[tuple[str, float, float]]) -> None:
        """Take what the printer reports of its heaters: letter, temperature and goal of each, degrees C."""
        highest: dict[str, float] = {}
        for letter, _, goal in heat:
            highest[letter] = max(goal, highest.get(letter, 0.0))
        if self._is_begun:
            self._goals |= highest

    def lines_after(self, text: str) -> tuple[str, ...]:
        """Return what is to be sent next because a line was answered."""
        if not self._is_begun or text != _ASK:
            return ()
        self._asked += 1
        if not self._goals:
            return (_ASK,) if self._asked < _MAX_ASKS else ()
        if not self.hot or self._is_repeated:
            return ()
        again = self.begin()
        self._is_repeated = True
        return again
