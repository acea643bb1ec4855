"""Reads the numbers among the options of the stereo core: pixels, a crop, a scale."""

import math

from common.errors import SettingsError
from common.program.quantities import decimal_number
from phone_host.model import Crop

_LEAST_SCALE = 0.1
"""At a tenth of the size a disparity is known ten times worse: the smallest scale that still shows something."""


def pixels(text: str, option: str) -> float:
    """Read a number of pixels: 994.978 or 994.978px.

    Raises:
        SettingsError: it is no number.
    """
    value = _number(text.strip().removesuffix("px"))
    if not math.isfinite(value):
        raise SettingsError(f"{option} is {text!r}", "give a number of pixels, for example 994.978")
    return value


def point_px(text: str, option: str, example: str = "CX,CY in px, for example 319.5,239.5") -> tuple[float, float]:
    """Read a place in an image: X,Y.

    Args:
        text: what the user wrote.
        option: the option, for errors.
        example: what would be right, for errors.

    Raises:
        SettingsError: it is not two numbers.
    """
    values = [_number(part) for part in text.split(",")]
    if len(values) != 2 or not all(math.isfinite(value) for value in values):
        raise SettingsError(f"{option} is {text!r}", f"give {example}")
    return values[0], values[1]


def crop_of(text: str, option: str = "--crop") -> Crop:
    """Read a rectangle: X,Y,W,H in whole pixels.

    Args:
        text: what the user wrote.
        option: the option, for errors.

    Raises:
        SettingsError: it is not four whole numbers, or it is empty.
    """
    values = [_number(part) for part in text.split(",")]
    whole = len(values) == 4 and all(math.isfinite(value) and value == int(value) for value in values)
    if not whole or min(values[:2]) < 0 or min(values[2:]) < 1:
        raise SettingsError(
            f"{option} is {text!r}", "give X,Y,W,H in whole px of the rectified left image, for example 200,100,640,480"
        )
    x_px, y_px, width_px, height_px = (int(value) for value in values)
    return Crop(x_px=x_px, y_px=y_px, width_px=width_px, height_px=height_px)


def scale_of(text: str) -> float:
    """Read a working size, 0.1 to 1.

    Raises:
        SettingsError: it is no such number.
    """
    value = _number(text)
    if not _LEAST_SCALE <= value <= 1:
        raise SettingsError(f"--scale is {text!r}", f"give a number from {_LEAST_SCALE:g} to 1")
    return value


def _number(text: str) -> float:
    """Return a number, or NaN if the text is none."""
    try:
        return decimal_number(text)
    except ValueError:
        return math.nan
