"""Where a printer can print: its bed, where its coordinates begin, and where a nozzle extrudes, line by line, in its G-code. Pure.

Most printers have the origin in the front left corner. Deltas, and some others, have it in the bed's middle.

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

from common.errors import SettingsError

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
        is_marked: whether the slicer marks where the model begins.
    """

    def __init__(self) -> None:
        self.model, self.printer = Extent(), Extent()
        self.start_moves = 0
        self._nozzle = NozzlePath()
        self.is_marked = self._is_custom = False

    @property
    def is_somewhere(self) -> bool:
        """Whether the nozzle is at a place that has numbers."""
        return self._nozzle.is_somewhere

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
        if not self.is_marked:
            self.is_marked = True
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
        elif name == "G92" and "E" in words_of(text) and not self.is_marked and self._extruding <= _MAX_PRIME_MOVES:
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


_LENGTH: Final = r"(\d+(?:\.\d+)?)"
_COORDINATE: Final = r"(-?\d+(?:\.\d+)?(?:e-?\d+)?)"
_NAME: Final = re.compile(
    rf"(?:{_LENGTH},{_LENGTH},{_LENGTH}|round:{_LENGTH},{_LENGTH})(?:@(?:(centre|center)|{_COORDINATE},{_COORDINATE}))?"
)
_EXAMPLES: Final = "width, depth and height in mm, as in 220,220,250, with the origin elsewhere 200,200,300@centre or 250,210,210@0,-5, of a round bed round:200,300"

BED_HELP: Final = "what the printer holds: width, depth and height, mm; @centre or @X,Y behind them says where the coordinates begin, round:DIAMETER,HEIGHT a round one"

_MIN_CORNERS, _MAX_CORNERS = 3, 1000
_ROUND_CORNERS: Final = 16
"""A slicer writes a round bed as a polygon of 36 or more corners, others have 4 to 8."""

_MAX_MM: Final = 10_000.0
_DELTA: Final = 1
"""Simplify3D's number of the kind of machine whose bed is round, with the origin in its middle."""

_SLACK_MM: Final = 0.01
_ROUND_SLACK: Final = 0.01
"""Share of the radius by which a slicer's polygon may lie inside its circle."""


@dataclass(frozen=True, slots=True)
class Bed:
    """What a printer can reach.

    Attributes:
        size_mm: width, depth and height, mm, above 0.
        origin_mm: smallest X and Y on the bed (of a round one: of the square around it), mm.
        is_round: whether it is a disc.
    """

    size_mm: tuple[float, float, float]
    origin_mm: tuple[float, float] = (0.0, 0.0)
    is_round: bool = False

    @property
    def centre_mm(self) -> tuple[float, float]:
        """Its middle, mm."""
        return self.origin_mm[0] + self.size_mm[0] / 2, self.origin_mm[1] + self.size_mm[1] / 2

    @property
    def words(self) -> str:
        """What it reaches, in words."""
        (width, depth, height), (x, y) = self.size_mm, self.origin_mm
        middle_x, middle_y = (round(value, 3) + 0.0 for value in self.centre_mm)
        shape = f"is round, {width:g} mm wide around X {middle_x:g}, Y {middle_y:g}"
        area = shape if self.is_round else f"reaches from X {x:g} to {x + width:g}, Y {y:g} to {y + depth:g}"
        return f"{area}, Z 0 to {height:g}"

    def holds(self, x_mm: float, y_mm: float, z_mm: float) -> bool:
        """Return whether a place lies on or above it."""
        (width, depth, height), (x, y) = self.size_mm, self.origin_mm
        if not -_SLACK_MM <= z_mm <= height + _SLACK_MM:
            return False
        if self.is_round:
            middle = self.centre_mm
            return math.hypot(x_mm - middle[0], y_mm - middle[1]) <= width / 2 + _SLACK_MM
        return -_SLACK_MM <= x_mm - x <= width + _SLACK_MM and -_SLACK_MM <= y_mm - y <= depth + _SLACK_MM


USUAL_BED: Final = Bed((220.0, 220.0, 250.0))


def parse_bed(text: str, option: str = "--bed") -> Bed:
    """Read a bed.

    Args:
        text: "X,Y,Z" (width, depth, height, mm) or "round:D,Z"; behind it "@centre", or "@X0,Y0", the smallest
            coordinates on it. Without it a rectangle begins at 0,0 and a round bed has 0,0 in its middle.
        option: the option, for errors.

    Raises:
        SettingsError: it is none.
    """
    found = _NAME.fullmatch(text.strip().lower().replace(" ", "").replace("mm", ""))
    if found is None:
        raise SettingsError(f"{option} is {text!r}", f"give {_EXAMPLES}")
    is_round = found[4] is not None
    size = (found[4], found[4], found[5]) if is_round else (found[1], found[2], found[3])
    width, depth, height = map(float, size)
    if not _is_believable(width, depth, height):
        raise SettingsError(f"{option} is {text!r}", "give lengths above 0 and up to 10000 mm")
    if found[7] is not None:
        origin = float(found[7]), float(found[8])
    else:
        origin = (-width / 2, -depth / 2) if found[6] or is_round else (0.0, 0.0)
    return Bed((width, depth, height), origin, is_round)


def stated_bed(area: str, height_mm: float) -> Bed | None:
    """Read the bed that a slicer states in its G-code.

    Args:
        area: its corners, as in "0x0,250x0,250x210,0x210" (bed_shape of PrusaSlicer, printable_area of OrcaSlicer).
        height_mm: what it holds, mm.

    Returns:
        The bed; None: there are no such corners.
    """
    corners = [
        (float(found[1]), float(found[2]))
        for word in area.split(",")[:_MAX_CORNERS]
        if (found := re.fullmatch(rf"\s*{_COORDINATE}x{_COORDINATE}\s*", word))
    ]
    if len(corners) < _MIN_CORNERS:
        return None
    low, high = (tuple(f(each[axis] for each in corners) for axis in range(2)) for f in (min, max))
    width, depth = high[0] - low[0], high[1] - low[1]
    if not _is_believable(width, depth, height_mm):
        return None
    middle = tuple(sum(each[axis] for each in corners) / len(corners) for axis in range(2))
    radius = max(math.dist(each, middle) for each in corners)
    if len(corners) >= _ROUND_CORNERS and all(
        math.dist(each, middle) > (1 - _ROUND_SLACK) * radius for each in corners
    ):
        return Bed((2 * radius, 2 * radius, height_mm), (middle[0] - radius, middle[1] - radius), is_round=True)
    return Bed((width, depth, height_mm), (low[0], low[1]))


def bed_of_settings(settings: dict[str, float]) -> Bed | None:
    """Read the bed that a slicer states as single numbers in its G-code.

    Args:
        settings: by name: of KISSlicer and IceSL `bed_size_x_mm`, y and z, `bed_offset_x_mm` and y (from the corner to the origin) and `round_bed`; of
            Simplify3D `strokeXoverride`, Y and Z, `originOffsetXoverride` and Y, and `machineTypeOverride`.

    Returns:
        The bed; None: there is none among them, or one that no printer has.
    """

    def value(name: str, other: str, default: float) -> float:
        return settings.get(name, settings.get(other, default))

    width, depth = (value(f"bed_size_{axis}_mm", f"stroke{axis.upper()}override", 0) for axis in "xy")
    height = value("bed_size_z_mm", "strokeZoverride", USUAL_BED.size_mm[2])
    x, y = (value(f"bed_offset_{axis}_mm", f"originOffset{axis.upper()}override", 0) for axis in "xy")
    if not (_is_believable(width, depth, height) and 0 <= x <= width and 0 <= y <= depth):
        return None
    is_round = settings.get("round_bed") == 1 or settings.get("machineTypeOverride") == _DELTA
    if is_round and not (x or y):
        x, y = width / 2, depth / 2
    return Bed((width, depth, height), (-x, -y), is_round and width == depth)


def _is_believable(*lengths_mm: float) -> bool:
    return all(0 < length <= _MAX_MM for length in lengths_mm)
