"""What a camera URI looks like, and the numbers in its options. They are bounded before they are computed with: `fps=1e999999999` is a billion digits to a fraction."""

import re
from fractions import Fraction
from typing import Final

EXAMPLE: Final = "v4l2:/dev/video0[?size=640x480&fps=30&format=mjpeg] or replay:PATH[?fps=30&loop=1&pace=clock|demand]"
"""How the URI of a camera looks, for help and for errors."""

_NUMBER: Final = re.compile(
    r"[+-]?\d{1,12}(\.\d{0,12})?(e[+-]?\d{1,2})?|[+-]?\.\d{1,12}|\d{1,12}/\d{1,12}", re.ASCII | re.IGNORECASE
)


def exact(text: str) -> Fraction:
    """Read a decimal number or a ratio, such as 29.97 or 30000/1001.

    Raises:
        ValueError: it is none, or longer than any sensible one.
        ZeroDivisionError: a ratio to nothing.
    """
    if not _NUMBER.fullmatch(text):
        raise ValueError(text)
    return Fraction(text)


def milliseconds(text: str, most_ms: int = 1000) -> int:
    """Read a time from 0 to `most_ms`; gives ns.

    Raises:
        ValueError: it is none.
        ZeroDivisionError: a ratio to nothing.
    """
    value_ns = round(exact(text) * 1_000_000)
    if not 0 <= value_ns <= most_ms * 1_000_000:
        raise ValueError(text)
    return value_ns
