"""Where the nozzle extrudes, line by line, and which of it is the model and which the printer's own code. Pure.

A printer's start code draws a prime line, often in front of the bed or left of it; purges and wipes lie outside, too. That
is the business of its profile. Slicers mark where the model begins (`;LAYER_CHANGE`, `;LAYER:0`, `; CHANGE_LAYER`) and what is
the printer's own (`;TYPE:Custom`, `; FEATURE: Custom`). In G-code without such marks start code ends at a `G92 E0` behind the first
few moves that extrude, if these stay near the bed.
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

Place = tuple[float, float, float]

_INCH_MM: Final = 25.4
AXES: Final = "XYZ"
_TURNS: Final = {"G2": -1, "G3": 1}
"""Of arcs: with the clock, and against it."""

_SPLINE: Final = "G5"

_LAYER: Final = re.compile(
    r";+\s*(?:-+\s*|<)?(?:LAYER_CHANGE|CHANGE_LAYER|BEGIN_LAYER_\w+|LAYER:\s*-?\d+|layer \d+)\b", re.IGNORECASE
)
"""Of PrusaSlicer, OrcaSlicer, KISSlicer, Cura and ideaMaker, Simplify3D, Kiri:Moto and IceSL."""

_TYPE: Final = re.compile(r";\s*(?:TYPE|FEATURE):\s*(.+)", re.IGNORECASE)
_CUSTOM: Final = "custom"
_MAX_PRIME_MOVES: Final = 20
"""Extruding moves of start code without marks: two lines beside each other have two to six."""

_WORD: Final = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+)?)")
"""Firmware takes blanks between a letter and its number."""


def words_of(text: str) -> dict[str, float]:
    """Return the numbers of a line by their letters."""
    return {letter: float(value) for letter, value in _WORD.findall(text.upper()) if value not in {"", "+", "-"}}


@dataclass(slots=True)
class Extent:
    """How far some moves go, mm; infinite where there are none."""

    low: list[float] = field(default_factory=lambda: [math.inf] * 3)
    high: list[float] = field(default_factory=lambda: [-math.inf] * 3)
    moves: int = 0

    def add(self, places: tuple[Place, ...]) -> None:
        """Include an extruding move with these ends, and what it reaches between them."""
        self.moves += 1
        for place in places:
            for axis in range(3):
                self.low[axis] = min(self.low[axis], place[axis])
                self.high[axis] = max(self.high[axis], place[axis])

    def take_over(self, other: "Extent") -> None:
        """Include all moves of another one, which is empty afterwards."""
        if not other.moves:
            return
        self.add((_place(other.low), _place(other.high)))
        self.moves += other.moves - 1
        other.low, other.high, other.moves = [math.inf] * 3, [-math.inf] * 3, 0


def _place(values: list[float]) -> Place:
    x, y, z = values
    return x, y, z


class PrintPath:
    """Follows a print, line by line.

    Attributes:
        model: how far the model goes.
        printer: how far the printer's own code goes: prime lines, purges.
        start_moves: how many of the first moves that extrude are start code.
    """

    def __init__(self) -> None:
        self.model, self.printer = Extent(), Extent()
        self.start_moves = 0
        self._nozzle = NozzlePath()
        self._is_marked = self._is_custom = False

    @property
    def is_somewhere(self) -> bool:
        """Whether the nozzle is at a place that has numbers."""
        return self._nozzle.is_somewhere

    @property
    def is_marked(self) -> bool:
        """Whether the slicer marks where the model begins."""
        return self._is_marked

    @property
    def _extruding(self) -> int:
        return self.model.moves + self.printer.moves

    def take_comment(self, raw: str) -> None:
        """Take a line that begins with a semicolon."""
        if found := _TYPE.match(raw):
            self._is_custom = found[1].strip().lower() == _CUSTOM
            if not self._is_custom:
                self._begin_model()
        elif _LAYER.match(raw):
            self._is_custom = False
            self._begin_model()

    def _begin_model(self) -> None:
        if not self._is_marked:
            self._is_marked = True
            self._end_start_code()

    def _end_start_code(self) -> None:
        self.printer.take_over(self.model)
        self.start_moves = self.printer.moves

    def take(self, name: str, text: str) -> tuple[Place, ...]:
        """Take a line.

        Args:
            name: its command, such as G1.
            text: the whole line.

        Returns:
            Places that it reaches while it extrudes, its ends included; none: it extrudes nothing.
        """
        places = self._nozzle.take(name, text)
        if places:
            (self.printer if self._is_custom else self.model).add(places)
        elif name == "G92" and "E" in words_of(text) and not self._is_marked and self._extruding <= _MAX_PRIME_MOVES:
            self._end_start_code()
        return places


class NozzlePath:
    """Follows the nozzle: absolute or relative, mm or inches."""

    def __init__(self) -> None:
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

    def take(self, name: str, text: str) -> tuple[Place, ...]:
        """Take a line; return what it reaches while it extrudes, as `PrintPath.take`."""
        words = words_of(text)
        match name:
            case "G0" | "G1" | "G2" | "G3" | "G5":
                return self._move(words, name)
            case "G28":
                self._home([axis for axis, letter in enumerate(AXES) if letter in text.upper()[3:]])
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
        return ()

    def _home(self, asked: list[int]) -> None:
        for axis in asked or range(3):
            self._at[axis] = self._shift[axis] = 0.0
            self._is_homed[axis] = True

    def _set(self, words: dict[str, float]) -> None:
        """Give the place where the nozzle is other numbers: it does not move. Before it was homed, they say where it is."""
        for axis, letter in enumerate(AXES):
            if letter in words and self._is_homed[axis]:
                self._shift[axis] = self._at[axis] - words[letter] * self._unit
            elif letter in words:
                self._at[axis] = words[letter] * self._unit
        self._e = words.get("E", self._e)

    def _move(self, words: dict[str, float], name: str) -> tuple[Place, ...]:
        """Follow a line, an arc or a spline."""
        before = list(self._at)
        for axis, letter in enumerate(AXES):
            if letter in words:
                value = words[letter] * self._unit
                self._at[axis] = value + (self._at[axis] if self._is_relative else self._shift[axis])
        amount = words.get("E", 0.0 if self._e_is_relative else self._e)
        fed = amount if self._e_is_relative else amount - self._e
        self._e = self._e + amount if self._e_is_relative else amount
        if fed <= 0 or not {"X", "Y", "I", "J"} & words.keys():
            return ()
        if turn := _TURNS.get(name):
            return _place(before), _place(self._at), *self._tips(before, words, turn)
        return _place(before), _place(self._at), *(self._controls(before, words) if name == _SPLINE else ())

    def _controls(self, before: list[float], words: dict[str, float]) -> Iterator[Place]:
        """Yield the two points between which and its ends a cubic spline stays."""
        i, j, p, q = (words.get(letter, 0.0) * self._unit for letter in "IJPQ")
        yield before[0] + i, before[1] + j, before[2]
        yield self._at[0] + p, self._at[1] + q, self._at[2]

    def _tips(self, before: list[float], words: dict[str, float], turn: int) -> Iterator[Place]:
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
