"""Reads JSON that anybody may have written: whatever the bytes are, they become values or one ValueError. Pure."""

import json
import math
from typing import Any, Final, NoReturn

_LARGEST: Final = 2**62
"""Times of our files stay below it, so that two of them can be added in 64 bits."""


def strict_json(text: str | bytes) -> Any:  # noqa: ANN401 - whatever JSON can hold
    """Read JSON as its standard has it (RFC 8259): without NaN and infinite numbers.

    Raises:
        ValueError: it is none, holds a number that no computer can, or is nested too deep.
    """
    try:
        return json.loads(text, parse_constant=_refuse, parse_float=_finite)
    except RecursionError:
        raise ValueError("nested too deep") from None


def whole_number(value: object) -> int:
    """Return a value that must be a whole number of 62 bits, such as a time in ns.

    Raises:
        ValueError: it is none.
    """
    if isinstance(value, bool) or not isinstance(value, int) or abs(value) >= _LARGEST:
        raise ValueError(f"{str(value)[:40]} is no whole number of 62 bits")
    return value


def _refuse(name: str) -> NoReturn:
    raise ValueError(f"{name} is no number")


def _finite(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text[:40]} is too large")
    return number
