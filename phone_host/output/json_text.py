"""Writes JSON as its standard requires (RFC 8259, sections 6 and 8.2), and reads that of others.

Python's own writer emits NaN, Infinity and halves of letters (names of files that are no UTF-8), which other readers refuse.
"""

import json
import math
from typing import Any

from common.plain_text import writable


def json_text(value: Any, indent: int | None = None) -> str:  # noqa: ANN401 - whatever JSON can hold
    r"""Write a value as JSON; NaN and infinite numbers become null, bytes that are no UTF-8 become \xff.

    Args:
        value: made of dicts with text keys, lists, tuples, strings, numbers, booleans and None.
        indent: spaces per level; None for one line.
    """
    return json.dumps(_finite(value), indent=indent, allow_nan=False)


def json_number(value: float, digits: int = 6) -> float | None:
    """Round a number for JSON, which has neither NaN nor infinity: they become None."""
    return round(value, digits) if math.isfinite(value) else None


def json_value(text: str | bytes) -> Any:  # noqa: ANN401
    """Read JSON of others.

    Raises:
        ValueError: it is none, or nested deeper than any of ours.
    """
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("nested too deep") from None


def _finite(value: Any) -> Any:  # noqa: ANN401
    match value:
        case dict():
            return {_finite(key): _finite(each) for key, each in value.items()}
        case list() | tuple():
            return [_finite(each) for each in value]
        case float() if not math.isfinite(value):
            return None
        case str():
            return writable(value)
        case _:
            return value
