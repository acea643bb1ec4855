"""G-code as it is sent: what its lines ask for, how far the nozzle goes where it extrudes, and what a slicer tells of it. Pure.

Rules: lines go one by one, a file of any length takes no memory. Comments and blanks are left away; a line that no firmware takes is refused
with its number.
Source: the RepRap wiki, "G-code" (https://reprap.org/wiki/G-code); Marlin's G-code index (https://marlinfw.org/meta/gcode).
"""

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final

from common.errors import DataError

MOST_FOR_LINES: Final = 90
"""Marlin's lines hold 96 (MAX_CMD_SIZE), number and checksum included."""

MOST_FOR_SERVERS: Final = 4096
"""Klipper has commands as long as the outline of a thing (EXCLUDE_OBJECT_DEFINE)."""

_WORD: Final = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+)?)")
"""Firmware takes blanks between a letter and its number."""

_NUMBERED: Final = re.compile(r"[Nn]\s*\d+\s*(?=[A-Za-z])([^*]*)(?:\*\s*\d+)?")
"""A line that has its number already, and perhaps its checksum, as hosts send them."""

_NAME: Final = re.compile(r"([GMT]\d+)(?!\d)")
_TIME: Final = re.compile(r";\s*(?:estimated printing time(?: \(normal mode\))?\s*=|TIME:)\s*(.+)", re.IGNORECASE)
_TIME_PART: Final = re.compile(r"(\d+)\s*([dhms]?)")
_UNIT_S: Final = {"d": 86400, "h": 3600, "m": 60, "s": 1, "": 1}
_HEATING: Final = {
    "M104": "nozzle",
    "M109": "nozzle",
    "M140": "bed",
    "M190": "bed",
    "M141": "chamber",
    "M191": "chamber",
}
_INCH_MM: Final = 25.4
_AXES: Final = "XYZ"
_TURNS: Final = {"G2": -1, "G3": 1}
"""Of arcs: with the clock, and against it."""


@dataclass(frozen=True, slots=True)
class Line:
    """A line that goes to the printer.

    Attributes:
        number: in its file, from 1.
        text: without comment, number and checksum, and blanks around it.
    """

    number: int
    text: str


@dataclass(frozen=True, slots=True)
class GcodeFacts:
    """What a file asks of a printer.

    Attributes:
        lines: that are sent.
        extruding: of these, those that move and extrude.
        low_mm: lowest X, Y, Z of these moves, mm; NaN: there are none.
        high_mm: highest, likewise.
        seconds: time that the slicer tells, s; NaN: it tells none.
        heats: whether anything is heated.
        leaves_hot: whether a heater is still on at its end.
    """

    lines: int
    extruding: int
    low_mm: tuple[float, float, float]
    high_mm: tuple[float, float, float]
    seconds: float
    heats: bool
    leaves_hot: bool


def lines_of(file: Iterable[str], name: str, most_characters: int = MOST_FOR_LINES) -> Iterator[Line]:
    """Give the lines that go to the printer.

    Args:
        file: its lines.
        name: of the file, for messages.
        most_characters: that a line may have.

    Raises:
        DataError: a line is none of G-code, or too long.
    """
    for number, raw in enumerate(file, start=1):
        text = _without_comment(raw)
        if not text:
            continue
        if not text.isascii() or not text.isprintable() or not text[0].isalpha():
            raise DataError(f"{name}: line {number} is no G-code", "give the file that a slicer wrote")
        if len(text) > most_characters:
            raise DataError(
                f"{name}: line {number} has {len(text)} characters", f"give lines of at most {most_characters}"
            )
        yield Line(number, text)


def _without_comment(raw: str) -> str:
    text = raw.partition(";")[0]
    if "(" in text:
        text = re.sub(r"\([^)]*\)", "", text)
    text = text.strip().removesuffix("*").strip()
    numbered = _NUMBERED.fullmatch(text)
    return text if numbered is None else numbered[1].strip()


def name_of(text: str) -> str:
    """Return a line's command, such as G1 or M104; empty: it has none."""
    found = _NAME.match(text.upper().replace(" ", ""))
    return found[1] if found else ""


def examine(file: Iterable[str], name: str, most_characters: int = MOST_FOR_LINES) -> GcodeFacts:
    """Read a whole file.

    Args:
        file: its lines.
        name: of the file, for messages.
        most_characters: that a line may have.

    Raises:
        DataError: a line is none of G-code, or nothing is sent.
    """
    path, heaters, seconds, count = _Path(), _Heaters(), math.nan, 0

    def watched() -> Iterator[str]:
        nonlocal seconds
        for raw in file:
            if raw.startswith(";") and (found := _TIME.match(raw)):
                seconds = _seconds(found[1])
            yield raw

    for line in lines_of(watched(), name, most_characters):
        count += 1
        heaters.take(line.text)
        path.take(line.text)
        if not path.is_somewhere:
            raise DataError(f"{name}: line {line.number} moves to no place", "give the file that a slicer wrote")
    if not count:
        raise DataError(f"{name} has no line that a printer would do", "give the file that a slicer wrote")
    ends = _ends(path.low), _ends(path.high)
    return GcodeFacts(count, path.extruding, *ends, seconds, heaters.heats, heaters.are_on)


def _ends(values: list[float]) -> tuple[float, float, float]:
    x, y, z = (value if math.isfinite(value) else math.nan for value in values)
    return x, y, z


def _seconds(text: str) -> float:
    return float(sum(int(amount) * _UNIT_S[unit] for amount, unit in _TIME_PART.findall(text)))


class _Heaters:
    """Follows what is heated. A command of one firmware alone (a macro) may cool: after one, nothing is said to be on."""

    def __init__(self) -> None:
        self.heats = False
        self._tool = 0.0
        self._on: set[tuple[str, float]] = set()

    @property
    def are_on(self) -> bool:
        """Whether one is on."""
        return bool(self._on)

    def take(self, text: str) -> None:
        """Take a line."""
        name = name_of(text)
        if not name:
            self._on.clear()
        elif name[0] == "T":
            self._tool = float(name[1:])
        elif name in _HEATING:
            self.heats = True
            words = _words(text)
            goal = words.get("S", words.get("R"))
            heater = (_HEATING[name], words.get("T", self._tool) if _HEATING[name] == "nozzle" else 0.0)
            if goal is not None:
                (self._on.add if goal > 0 else self._on.discard)(heater)


def _words(text: str) -> dict[str, float]:
    return {letter: float(value) for letter, value in _WORD.findall(text.upper()) if value not in {"", "+", "-"}}


class _Path:
    """Follows the nozzle: absolute or relative, mm or inches; where it extrudes, it notes how far it goes."""

    def __init__(self) -> None:
        self.low, self.high = [math.inf] * 3, [-math.inf] * 3
        self.extruding = 0
        self._at = [0.0, 0.0, 0.0]
        self._shift = [0.0, 0.0, 0.0]
        self._is_homed = [False, False, False]
        self._e = 0.0
        self._is_relative = self._e_is_relative = False
        self._unit = 1.0

    @property
    def is_somewhere(self) -> bool:
        """Whether the nozzle is at a place that has numbers."""
        return all(map(math.isfinite, self._at))

    def take(self, text: str) -> None:
        """Take a line."""
        words = _words(text)
        match name_of(text):
            case "G0" | "G1" | "G2" | "G3" as name:
                self._move(words, _TURNS.get(name, 0))
            case "G28":
                self._home([axis for axis, letter in enumerate(_AXES) if letter in text.upper()[3:]])
            case "G90":
                self._is_relative = self._e_is_relative = False
            case "G91":
                self._is_relative = self._e_is_relative = True
            case "M82":
                self._e_is_relative = False
            case "M83":
                self._e_is_relative = True
            case "G92":
                self._set(words)
            case "G20":
                self._unit = _INCH_MM
            case "G21":
                self._unit = 1.0

    def _home(self, asked: list[int]) -> None:
        for axis in asked or range(3):
            self._at[axis] = self._shift[axis] = 0.0
            self._is_homed[axis] = True

    def _set(self, words: dict[str, float]) -> None:
        """Give the place where the nozzle is other numbers: it does not move. Before it was homed, they say where it is."""
        for axis, letter in enumerate(_AXES):
            if letter in words and self._is_homed[axis]:
                self._shift[axis] = self._at[axis] - words[letter] * self._unit
            elif letter in words:
                self._at[axis] = words[letter] * self._unit
        self._e = words.get("E", self._e)

    def _move(self, words: dict[str, float], turn: int) -> None:
        """Follow a line, or an arc: against the clock (1), or with it (-1)."""
        before = list(self._at)
        for axis, letter in enumerate(_AXES):
            if letter in words:
                value = words[letter] * self._unit
                self._at[axis] = value + (self._at[axis] if self._is_relative else self._shift[axis])
        amount = words.get("E", 0.0 if self._e_is_relative else self._e)
        fed = amount if self._e_is_relative else amount - self._e
        self._e = self._e + amount if self._e_is_relative else amount
        if fed <= 0 or not {"X", "Y", "I", "J"} & words.keys():
            return
        self.extruding += 1
        for place in (before, self._at, *(self._tips(before, words, turn) if turn else ())):
            for axis in range(3):
                self.low[axis] = min(self.low[axis], place[axis])
                self.high[axis] = max(self.high[axis], place[axis])

    def _tips(self, before: list[float], words: dict[str, float], turn: int) -> Iterator[tuple[float, float, float]]:
        """Yield where an arc in the plane of the bed reaches farthest along its axes, beside its ends."""
        along, across = self._at[0] - before[0], self._at[1] - before[1]
        if "R" in words:
            radius, chord = words["R"] * self._unit, math.hypot(along, across)
            if not chord:
                return
            # Left of the way for a short arc against the clock; a radius below 0 means the long one.
            off = math.sqrt(max(radius**2 - chord**2 / 4, 0.0)) * turn * math.copysign(1, radius) / chord
            x, y = along / 2 - across * off, across / 2 + along * off
        else:
            x, y = words.get("I", 0.0) * self._unit, words.get("J", 0.0) * self._unit
        radius = math.hypot(x, y)
        begin, end = math.atan2(-y, -x), math.atan2(across - y, along - x)
        swept = (turn * (end - begin)) % math.tau or math.tau
        for quarter in range(4):
            angle = quarter * math.pi / 2
            if (turn * (angle - begin)) % math.tau < swept:
                yield before[0] + x + radius * math.cos(angle), before[1] + y + radius * math.sin(angle), self._at[2]
