"""Where a printer can print: the size of its bed, where its coordinates begin, and whether it is round. Pure.

Most printers have the origin in the front left corner. Deltas, and some others, have it in the bed's middle.
"""

import math
import re
from dataclasses import dataclass
from typing import Final

from common.errors import SettingsError

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
