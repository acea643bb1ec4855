"""G-code as it is sent: what its lines ask for, how far the nozzle goes where it extrudes, and what a slicer tells of it. Pure.

Rules: lines go one by one, a file of any length takes no memory. Comments and blanks are left away; a line that no firmware takes is refused
with its number.

Lines that begin with `@` are for the host, not for the printer. OctoPrint obeys `@pause`, `@resume`, `@cancel` and `@abort`; Repetier-Host, from which
they come, also has `@kill`, and `@info` and others for its own windows; plugins have more (`@PAUSE_POSITION`). Cura's "Pause at height" writes `@pause` for
both. A printer knows none of them.
Source: the RepRap wiki, "G-code" (https://reprap.org/wiki/G-code); Marlin's G-code index (https://marlinfw.org/meta/gcode);
OctoPrint's documentation, "@ Commands"; Cura's PauseAtHeight.py.
"""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from common.errors import DataError
from phone_host.printers.bed import USUAL_BED, Bed, Place, PrintPath, bed_of_settings, stated_bed, words_of
from phone_host.printers.cooling import MAX_TOOL
from phone_host.printers.marlin_reply import HostAction

_COMMAND: Final = re.compile(r"@([A-Za-z]\w*)(?:\s.*)?")
_ACTIONS: Final = {
    "pause": HostAction.PAUSE,
    "resume": HostAction.RESUME,
    "cancel": HostAction.CANCEL,
    "abort": HostAction.CANCEL,
    "kill": HostAction.CANCEL,
}


def host_command(text: str) -> str:
    """Return the name of a command for the host, in small letters; empty: the line is none.

    Args:
        text: a line of G-code, without comment and blanks around it.
    """
    found = _COMMAND.fullmatch(text)
    return found[1].lower() if found and text.isprintable() else ""


def action_of(name: str) -> HostAction:
    """Return what a command wants; NONE: it is for another host."""
    return _ACTIONS.get(name, HostAction.NONE)


def ignored_note(names: Sequence[str]) -> tuple[str, ...]:
    """Return a sentence on the commands that are not obeyed here; nothing if there are none."""
    others = [f"@{name}" for name in names if action_of(name) is HostAction.NONE]
    return (f"its G-code has commands for another host ({', '.join(others)}): they were ignored",) if others else ()


def passed_note(names: Sequence[str], whose: str) -> tuple[str, ...]:
    """Return a sentence on commands in a file that somebody else prints; nothing if there are none."""
    listed = ", ".join(f"@{name}" for name in names)
    return (f"its G-code has commands for a host ({listed}): {whose} obeys or ignores them",) if names else ()


MOST_FOR_LINES: Final = 90
"""Marlin's lines hold 96 (MAX_CMD_SIZE), number and checksum included."""

MOST_FOR_SERVERS: Final = 4096
"""Klipper has commands as long as the outline of a thing (EXCLUDE_OBJECT_DEFINE)."""

_NUMBERED: Final = re.compile(r"[Nn]\s*\d+\s*(?=[A-Za-z])([^*]*)(?:\*\s*\d+)?")
"""A line that has its number already, and perhaps its checksum, as hosts send them."""

_NAME: Final = re.compile(r"([GMT])0*(\d+)(?!\d)")
"""Zeros before a number mean nothing: G01 is G1."""
_WITH_WORDS: Final = frozenset({"", "M0", "M1", "M16", "M23", "M28", "M32", "M117", "M118", "M486"})
"""Commands behind which stands a message or a name, in any script; the empty name stands for macros."""

_TIME: Final = re.compile(r";\s*(?:estimated printing time(?: \(normal mode\))?\s*=|TIME:)\s*(.+)", re.IGNORECASE)
_AREA: Final = re.compile(r";\s*(?:bed_shape|printable_area)\s*=\s*(.+)")
_HEIGHT: Final = re.compile(r";\s*(?:max_print_height|printable_height)\s*=\s*(\d+(?:\.\d+)?)\s*$")
"""What PrusaSlicer and OrcaSlicer write at the end of a file."""

_BED_SETTING: Final = re.compile(
    r";\s*(bed_size_[xyz]_mm|bed_offset_[xy]_mm|round_bed|stroke[XYZ]override|originOffset[XY]override|machineTypeOverride)\s*[=:,]\s*(-?\d+(?:\.\d+)?)\s*$"
)
"""What KISSlicer, IceSL and Simplify3D write among their settings."""

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
        low_mm: lowest X, Y, Z of those that print the model, mm; NaN: there are none.
        high_mm: highest, likewise.
        prime_low_mm: lowest X, Y, Z of those of the printer's own code (prime lines, purges), mm; NaN: there are none.
        prime_high_mm: highest, likewise.
        start_moves: how many of the first moves that extrude are start code.
        is_marked: whether the slicer marks where the model begins.
        bed: the printer's, as the slicer states it; None: it does not.
        seconds: time that the slicer tells, s; NaN: it tells none.
        heats: whether anything is heated.
        leaves_hot: whether a heater is still on at its end.
        tools: numbers of the tools whose nozzles are heated.
        has_chamber: whether a chamber is heated.
        has_model: whether anything that extrudes is the model, and not all the printer's own code.
        host_commands: names of the commands in it that are for the host, such as pause; each once.
    """

    lines: int
    extruding: int
    low_mm: tuple[float, float, float]
    high_mm: tuple[float, float, float]
    prime_low_mm: tuple[float, float, float]
    prime_high_mm: tuple[float, float, float]
    start_moves: int
    is_marked: bool
    bed: Bed | None
    seconds: float
    heats: bool
    leaves_hot: bool
    tools: tuple[int, ...] = ()
    has_chamber: bool = False
    has_model: bool = True
    host_commands: tuple[str, ...] = ()


def lines_of(
    file: Iterable[str],
    name: str,
    most_characters: int = MOST_FOR_LINES,
    obey: Callable[[str], None] = lambda _: None,
) -> Iterator[Line]:
    """Give the lines that go to the printer.

    Args:
        file: its lines.
        name: of the file, for messages.
        most_characters: that a line may have, as bytes of UTF-8.
        obey: is told the name of each command for the host, before the line behind it is given.

    Raises:
        DataError: a line is none of G-code, or too long.
    """
    for number, raw in enumerate(file, start=1):
        text = _without_comment(raw)
        if not text:
            continue
        if command := host_command(text):
            obey(command)
            continue
        if not _is_line(text):
            raise DataError(f"{name}: line {number} is no G-code", "give the file that a slicer wrote")
        encoded = text.encode()
        if len(encoded) > most_characters:
            raise DataError(
                f"{name}: line {number} has {len(encoded)} characters", f"give lines of at most {most_characters}"
            )
        yield Line(number, text)


def _is_line(text: str) -> bool:
    """Return whether a line may be G-code: letters beyond ASCII only where people and macros write words."""
    if not text.isprintable() or not (text[0].isascii() and text[0].isalpha()):
        return False
    return text.isascii() or name_of(text) in _WITH_WORDS


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
    return found[1] + found[2] if found else ""


def examine(file: Iterable[str], name: str, most_characters: int = MOST_FOR_LINES) -> GcodeFacts:
    """Read a whole file.

    Raises:
        DataError: a line is none of G-code, or nothing is sent.
    """
    path, heaters, comments, count = PrintPath(), _Heaters(), _Comments(), 0
    commands = dict[str, None]()

    def watched() -> Iterator[str]:
        for raw in file:
            if raw.startswith(";"):
                comments.take(raw)
                path.take_comment(raw)
            yield raw

    for line in lines_of(watched(), name, most_characters, commands.setdefault):
        count += 1
        heaters.take(line.text)
        path.take(name_of(line.text), line.text)
        if not path.is_somewhere:
            raise DataError(f"{name}: line {line.number} moves to no place", "give the file that a slicer wrote")
    if not count:
        raise DataError(f"{name} has no line that a printer would execute", "give the file that a slicer wrote")
    has_model = path.model.moves > 0
    whole = path.model if has_model else path.printer  # nothing but start code is what is printed
    return GcodeFacts(
        lines=count,
        extruding=path.model.moves + path.printer.moves,
        low_mm=_ends(whole.low),
        high_mm=_ends(whole.high),
        prime_low_mm=_ends(path.printer.low),
        prime_high_mm=_ends(path.printer.high),
        start_moves=path.start_moves if has_model else 0,
        is_marked=path.is_marked,
        bed=comments.bed,
        seconds=comments.seconds,
        heats=heaters.heats,
        leaves_hot=heaters.are_on,
        tools=heaters.tools,
        has_chamber=heaters.has_chamber,
        has_model=has_model,
        host_commands=tuple(commands),
    )


def first_outside(file: Iterable[str], name: str, facts: GcodeFacts, bed: Bed) -> tuple[Line, Place] | None:
    """Find the first line that extrudes the model beyond a bed; without any model all that extrudes counts.

    Args:
        file: lines of G-code.
        name: of the file, for messages.
        facts: of the same file.
        bed: that must hold it.

    Returns:
        The line, and a place that it reaches there, mm; None: there is none.
    """
    path, moves = PrintPath(), 0

    def watched() -> Iterator[str]:
        for raw in file:
            if raw.startswith(";"):
                path.take_comment(raw)
            yield raw

    for line in lines_of(watched(), name, MOST_FOR_SERVERS):
        printers = path.printer.moves
        places = path.take(name_of(line.text), line.text)
        moves += bool(places)
        is_model = not facts.has_model or (moves > facts.start_moves and path.printer.moves == printers)
        outside = next((place for place in places if not bed.holds(*place)), None)
        if is_model and outside is not None:
            return line, outside
    return None


class _Comments:
    """Reads what a slicer tells beside the lines: how long it takes, and the printer's bed."""

    def __init__(self) -> None:
        self.seconds = math.nan
        self._area, self._height_mm = "", USUAL_BED.size_mm[2]
        self._settings = dict[str, float]()

    @property
    def bed(self) -> Bed | None:
        """The bed, if its area is stated; a height that is not stated is the usual one."""
        return stated_bed(self._area, self._height_mm) if self._area else bed_of_settings(self._settings)

    def take(self, raw: str) -> None:
        """Take a line that begins with a semicolon."""
        if found := _TIME.match(raw):
            self.seconds = _seconds(found[1])
        elif found := _AREA.match(raw):
            self._area = found[1]
        elif found := _HEIGHT.match(raw):
            self._height_mm = float(found[1])
        elif found := _BED_SETTING.match(raw):
            self._settings[found[1]] = float(found[2])


def _ends(values: list[float]) -> tuple[float, float, float]:
    x, y, z = (value if math.isfinite(value) else math.nan for value in values)
    return x, y, z


def _seconds(text: str) -> float:
    return float(sum(int(amount) * _UNIT_S[unit] for amount, unit in _TIME_PART.findall(text)))


class _Heaters:
    """Follows what is heated. A command of one firmware alone (a macro) may cool: after one, nothing is said to be on."""

    def __init__(self) -> None:
        self.heats = self.has_chamber = False
        self._tool = 0.0
        self._on: set[tuple[str, float]] = set()
        self._tools: set[int] = set()

    @property
    def tools(self) -> tuple[int, ...]:
        """Numbers of the tools whose nozzles are heated."""
        return tuple(sorted(self._tools))

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
            words = words_of(text)
            goal = words.get("S", words.get("R"))
            heater = (_HEATING[name], words.get("T", self._tool) if _HEATING[name] == "nozzle" else 0.0)
            if heater[0] == "nozzle" and 0 <= heater[1] <= MAX_TOOL:
                self._tools.add(int(heater[1]))
            self.has_chamber = self.has_chamber or heater[0] == "chamber"
            if goal is not None:
                (self._on.add if goal > 0 else self._on.discard)(heater)
