"""Lengths on the command line: one way to write them, in all verbs. Light."""

import math
import re
from typing import Final

from common.errors import SettingsError

_MM: Final = {"": 1.0, "mm": 1.0, "cm": 10.0, "m": 1000.0}
_LENGTH: Final = re.compile(
    r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d{1,2})?)\s*(mm|cm|m)?\s*", re.ASCII | re.IGNORECASE
)


def length_mm(text: str, option: str, example: str) -> float:
    """Read a length: 25mm, 2.5cm or 0.025m; a number alone means mm.

    Args:
        text: what the user wrote.
        option: the option, for errors.
        example: a value that would be right, for errors.

    Returns:
        mm, above 0.

    Raises:
        SettingsError: it is no length, or not above 0.
    """
    found = _LENGTH.fullmatch(text)
    value = float(found[1]) * _MM[(found[2] or "").lower()] if found else math.nan
    if not (math.isfinite(value) and value > 0):
        raise SettingsError(
            f"{option} is {text!r}",
            f"give a length above 0 in mm, cm or m, with a point for decimals, for example {example}",
        )
    return value


def bounded_mm(text: str, option: str, example: str, bounds_mm: tuple[float, float]) -> float:
    """Read a length like `length_mm`, of something that has a least and a greatest size.

    Args:
        text: what the user wrote.
        option: the option, for errors.
        example: a value that would be right, for errors.
        bounds_mm: the least and the greatest, mm.

    Returns:
        mm.

    Raises:
        SettingsError: it is no length, or beyond the bounds.
    """
    value = length_mm(text, option, example)
    least, most = bounds_mm
    if not least <= value <= most:
        raise SettingsError(f"{option} is {value:g} mm", f"give {least:g} to {most:g} mm, for example {example}")
    return value


_LEAST_BARE_SQUARE_MM: Final = 0.5
_LEAST_BARE_BASELINE_MM: Final = 5.0
_LEAST_BASELINE_MM: Final = 1.0
_LEAST_BARE_LIMIT_MM: Final = 10.0
"""No chessboard has smaller squares, two webcams are never nearer to each other, no stereo camera sees what is nearer. A
smaller number without a unit is a length in metres."""

_MOST_BASELINE_MM: Final = 10_000.0
"""As in rig.yaml and calib.txt. A longer one is given in micrometres."""

_MOST_LIMIT_MM: Final = 1e8
"""100 km: no stereo camera sees so far."""


_PIXELS: Final = re.compile(r"\s*(\d{1,5})\s*px\s*\*\s*(.+)", re.ASCII | re.IGNORECASE)
"""A square on a screen: its pixels, times the width of one."""


def square_mm(text: str) -> float:
    """Read --square, the side of a chessboard's square, like `length_mm`; or pixels times their pitch, such as 120px*0.1794mm.

    Args:
        text: what the user wrote.

    Returns:
        mm, above 0.

    Raises:
        SettingsError: it is no length, or a number without a unit that can only mean metres.
    """
    on_screen = _PIXELS.fullmatch(text)
    if on_screen is not None:
        return int(on_screen[1]) * length_mm(on_screen[2], "--square, the width of a pixel,", "120px*0.1794mm")
    return _not_metres(text, "--square", "25mm", _LEAST_BARE_SQUARE_MM)


def baseline_mm(text: str) -> float:
    """Read --baseline, the distance of two cameras, like `length_mm`.

    Args:
        text: what the user wrote.

    Returns:
        mm, 1 mm to 10 m.

    Raises:
        SettingsError: it is no length, a number without a unit that can only mean metres, or shorter or longer than that.
    """
    value = _not_metres(text, "--baseline", "60mm", _LEAST_BARE_BASELINE_MM, _LEAST_BASELINE_MM)
    if value < _LEAST_BASELINE_MM:
        raise SettingsError(
            f"--baseline {text.strip()} is {value:g} mm",
            f"give the distance of the two cameras, at least {_LEAST_BASELINE_MM:g}mm",
        )
    if value > _MOST_BASELINE_MM:
        said = f"--baseline {text.strip()} is {value / 1000:g} m"
        raise SettingsError(said, f"give the distance of the two cameras, at most {_MOST_BASELINE_MM / 1000:g}m")
    return value


def limit_mm(text: str, option: str, example: str) -> float:
    """Read --near or --far, a limit of the depth, like `length_mm`.

    Args:
        text: what the user wrote.
        option: the option, for errors.
        example: a value that would be right, for errors.

    Returns:
        mm, above 0, up to 100 km.

    Raises:
        SettingsError: it is no length, a number without a unit that can only mean metres, or more than 100 km.
    """
    value = _not_metres(text, option, example, _LEAST_BARE_LIMIT_MM)
    if value > _MOST_LIMIT_MM:
        raise SettingsError(
            f"{option} {text.strip()} is {value / 1e6:g} km",
            f"give at most {_MOST_LIMIT_MM / 1e6:g} km, for example {example}",
        )
    return value


def _not_metres(text: str, option: str, example: str, least_mm: float, possible_mm: float = 0.0) -> float:
    """Read a length; refuse a number without a unit that is below `least_mm`: too small to mean millimetres."""
    value = length_mm(text, option, example)
    found = _LENGTH.fullmatch(text)
    if found is not None and not found[2] and value < least_mm:
        raise SettingsError(
            f"{option} {text.strip()} has no unit, and a number alone means mm",
            f"write {value * 1000:g}mm or {value:g}m"
            + (f"; {value:g}mm if you mean that" if value >= possible_mm else ""),
        )
    return value
