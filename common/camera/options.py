"""The syntax of camera URIs and the numbers in their options.

Numbers are bounded before any computation: as a fraction, `fps=1e999999999` has a billion digits.
"""

import re
from fractions import Fraction
from typing import Final

EXAMPLE: Final = "v4l2:/dev/video0[?size=640x480&fps=30&format=mjpeg] or replay:PATH[?fps=30&loop=1&pace=clock|demand]"
"""Example of a camera URI, for help and errors."""

TURNED: Final = "rotate=90|180|270 (clockwise) and flip=h|v for a camera that is mounted turned"
"""Options of every camera URI, for help."""

_NUMBER: Final = re.compile(
    r"[+-]?\d{1,12}(\.\d{0,12})?(e[+-]?\d{1,2})?|[+-]?\.\d{1,12}|\d{1,12}/\d{1,12}", re.ASCII | re.IGNORECASE
)


def exact(text: str) -> Fraction:
    """Parse a decimal number or a ratio, such as 29.97 or 30000/1001.

    Raises:
        ValueError: it is not a number, or longer than any sensible one.
        ZeroDivisionError: the ratio's denominator is 0.
    """
    if not _NUMBER.fullmatch(text):
        raise ValueError(text)
    return Fraction(text)


def milliseconds(text: str, most_ms: int = 1000) -> int:
    """Parse a time from 0 to `most_ms`; return it in ns.

    Raises:
        ValueError: it is not such a time.
        ZeroDivisionError: the ratio's denominator is 0.
    """
    value_ns = round(exact(text) * 1_000_000)
    if not 0 <= value_ns <= most_ms * 1_000_000:
        raise ValueError(text)
    return value_ns
