"""The lines that make a printer cold, whatever ended the print. Pure.

Source: Marlin's G-code index (M104, M107, M108, M140, M141; https://marlinfw.org/meta/gcode).
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
    return "".join(f"{text}\n" for text in ("", _WAKE, *off, *chamber, "M107")).encode()


def wake() -> bytes:
    """Return the bytes that end a wait for a temperature, where the firmware hears them at once."""
    return f"{_WAKE}\n".encode()
