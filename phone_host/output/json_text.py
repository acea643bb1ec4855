"""Writes JSON as its standard requires (RFC 8259, section 6): Python's own writer emits NaN and Infinity, which other readers refuse."""

import json
import math
from typing import Any


def json_text(value: Any, indent: int | None = None) -> str:  # noqa: ANN401 - whatever JSON can hold
    """Write a value as JSON; NaN and infinite numbers become null.

    Args:
        value: made of dicts with text keys, lists, tuples, strings, numbers, booleans and None.
        indent: spaces per level; None for one line.

    Returns:
        The text, without a final newline.
    """
    return json.dumps(_finite(value), indent=indent, allow_nan=False)


def _finite(value: Any) -> Any:  # noqa: ANN401
    match value:
        case dict():
            return {key: _finite(each) for key, each in value.items()}
        case list() | tuple():
            return [_finite(each) for each in value]
        case float() if not math.isfinite(value):
            return None
        case _:
            return value
