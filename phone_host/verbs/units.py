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
        raise SettingsError(f"{option} is {text!r}", f"give a length above 0, for example {example}")
    return value


_LEAST_BARE_MM: Final = 0.5
"""No chessboard has smaller squares. A smaller number without a unit is a length in metres."""


def square_mm(text: str) -> float:
    """Read --square, the side of a chessboard's square, like `length_mm`.

    Args:
        text: what the user wrote.

    Returns:
        mm, above 0.

    Raises:
        SettingsError: it is no length, or a number without a unit that can only mean metres.
    """
    value = length_mm(text, "--square", "25mm")
    found = _LENGTH.fullmatch(text)
    if found is not None and not found[2] and value < _LEAST_BARE_MM:
        in_metres = f"{value * 1000:g}mm or {value:g}m"
        raise SettingsError(f"--square {text.strip()} has no unit, and a number alone means mm", f"write {in_metres}")
    return value
