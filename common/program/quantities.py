"""Times, rates and image sizes on the command line, in settings files and in the environment: one way to write each. Pure, light.

A number alone is in the unit that the option's help names, so every script that gives bare numbers stays right. Units are read in upper and
lower case, with or without a space before them. Lengths: `phone_host/jobs/units.py`.
"""

import math
import re
from collections.abc import Callable, Mapping
from typing import Final

from common.errors import SettingsError

_NUMBER: Final = r"\s*((?:\d{1,12}\.?\d{0,12}|\.\d{1,12})(?:e[+-]?\d{1,2})?)\s*"
"""Bounded, so that no text takes long to read. No sign: none of these quantities is negative."""

_QUANTITY: Final = re.compile(rf"{_NUMBER}([a-z/]*)\s*", re.ASCII | re.IGNORECASE)
_SIZE: Final = re.compile(r"\s*(\d{1,5})\s*[x*]\s*(\d{1,5})\s*(?:px)?\s*", re.ASCII | re.IGNORECASE)

_WHOLE: Final = re.compile(r"\s*[+-]?[0-9]{1,18}\s*")
_DECIMAL: Final = re.compile(r"\s*[+-]?([0-9]{1,18}\.?[0-9]{0,18}|\.[0-9]{1,18})(e[+-]?[0-9]{1,3})?\s*", re.IGNORECASE)
"""Python itself also takes 1_000 and the digits of other scripts, which nobody means."""

_SECONDS: Final = {"us": 1e-6, "ms": 1e-3, "s": 1.0, "sec": 1.0, "min": 60.0, "h": 3600.0}
_BYTES: Final = {"b": 1.0, "kb": 1e3, "mb": 1e6, "gb": 1e9, "kib": 2.0**10, "mib": 2.0**20, "gib": 2.0**30}
_RATES: Final = {"": 1.0, "fps": 1.0, "hz": 1.0, "/s": 1.0}

Reader = Callable[[str], float]


def seconds(text: str, option: str) -> float:
    """Read a time in s: 3, 3s, 500ms or 2min; a number alone means s.

    Raises:
        SettingsError: it is no time.
    """
    return _read(text, {"": 1.0, **_SECONDS}, option, "give a time, for example 3, 3s, 500ms or 2min")


def milliseconds(text: str, option: str) -> float:
    """Read a time in ms: 5, 5ms or 0.005s; a number alone means ms.

    Raises:
        SettingsError: it is no time.
    """
    units = {unit: 1000 * value for unit, value in _SECONDS.items()}
    return _read(text, {"": 1.0, **units}, option, "give a time, for example 5, 5ms or 0.005s")


def frames_per_second(text: str, option: str) -> float:
    """Read a rate in 1/s: 30, 30fps or 30Hz.

    Raises:
        SettingsError: it is no rate.
    """
    return _read(text, _RATES, option, "give a rate in frames per second, for example 30 or 30fps")


def file_size(text: str, option: str) -> float:
    """Read a size in bytes: 500MB, 2GB or 1.5GiB; a number alone means MB.

    Raises:
        SettingsError: it is no size.
    """
    return _read(text, {"": 1e6, **_BYTES}, option, "give a size, for example 500MB or 2GB")


def image_size(text: str, option: str) -> tuple[int, int]:
    """Read a size: 640x480 or 640X480.

    Returns:
        Width and height, px, both above 0.

    Raises:
        SettingsError: it is no size.
    """
    found = _SIZE.fullmatch(text)
    size_px = (int(found[1]), int(found[2])) if found else (0, 0)
    if not all(size_px):
        raise SettingsError(f"{option} is {text!r}", "give WIDTHxHEIGHT in px, for example 640x480")
    return size_px


def whole_number(text: str) -> int:
    """Read a whole number, with or without sign.

    Raises:
        ValueError: it is none.
    """
    if not _WHOLE.fullmatch(text):
        raise ValueError(text)
    return int(text)


def decimal_number(text: str) -> float:
    """Read a number, such as 30, -1.5 or 2e3. There is no infinity, and NaN is none.

    Raises:
        ValueError: it is none, or too large.
    """
    if not _DECIMAL.fullmatch(text) or not math.isfinite(value := float(text)):
        raise ValueError(text)
    return value


def reading(read: Callable[[str, str], float], option: str) -> Reader:
    """Return a reader for one option: `type=reading(seconds, "--wait")` of argparse."""
    return lambda text: read(text, option)


def _read(text: str, units: Mapping[str, float], option: str, remedy: str) -> float:
    """Return the value in the unit that the factors lead to."""
    found = _QUANTITY.fullmatch(text)
    factor = units.get(found[2].lower(), math.nan) if found else math.nan
    value = float(found[1]) * factor if found else math.nan
    if math.isnan(value):
        raise SettingsError(f"{option} is {text!r}", remedy)
    return value
