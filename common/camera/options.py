"""The syntax of camera URIs and the numbers in their options.

Numbers are bounded before any computation: as a fraction, `fps=1e999999999` has a billion digits.
"""

import re
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import Final, TypeVar

from common.errors import SettingsError

T = TypeVar("T")

EXAMPLE: Final = "v4l2:/dev/video0[?size=640x480&fps=30&format=mjpeg] or replay:PATH[?fps=30&loop=1&pace=clock|demand]"
"""Example of a camera URI, for help and errors."""


def without_options(example: str) -> str:
    """Return example URIs without their options, for errors in which the kind or the address is what matters."""
    return re.sub(r"\[\?[^]]*\]", "", example)


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


TRUTHS: Final = {"0": False, "1": True}
"""How yes and no are written in a camera URI."""


def rate(text: str) -> Fraction:
    """Parse a rate from 0.01 to 1000 images per second.

    Raises:
        ValueError: it is not such a rate.
        ZeroDivisionError: the ratio's denominator is 0.
    """
    rate_hz = exact(text)
    if not Fraction(1, 100) <= rate_hz <= 1000:
        raise ValueError(text)
    return rate_hz


class OptionReader:
    """Reads the options of a camera URI one by one; every error names the option, its value and what it may be.

    Args:
        uri: the whole URI, for errors.
        given: the options after the question mark.
        meanings: what each known option may be, for errors.

    Raises:
        SettingsError: an option is unknown.
    """

    def __init__(self, uri: str, given: Mapping[str, str], meanings: Mapping[str, str]) -> None:
        self._uri, self._given, self._meanings = uri, given, meanings
        if unknown := set(given) - set(meanings):
            raise SettingsError(
                f"camera {uri!r} has an unknown option {min(unknown)!r}",
                f"the options are {', '.join(meanings)}, rotate, flip",
            )

    def read(self, name: str, parse: Callable[[str], T], default: T) -> T:
        """Return the parsed value of an option, or the default.

        Args:
            name: a known option.
            parse: raises ValueError, KeyError or ZeroDivisionError for a text that is no value.
            default: the value if the option is not given.

        Raises:
            SettingsError: the value makes no sense.
        """
        if name not in self._given:
            return default
        value = self._given[name]
        try:
            return parse(value)
        except (ValueError, KeyError, ZeroDivisionError):
            raise SettingsError(f"camera {self._uri!r} has {name}={value}", f"give {self._meanings[name]}") from None
