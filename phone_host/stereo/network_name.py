"""Reads the name of a learned matcher, `onnx:PATH[?OPTION=VALUE[&OPTION=VALUE]]`, and states what the options mean. Light: no numpy.

A network's file says which shapes it takes and gives, but not what it makes of the numbers. So that stands in the name.
"""

from dataclasses import dataclass
from enum import Enum
from typing import Final, TypeVar

from common.errors import SettingsError

PREFIX: Final = "onnx:"


class Levels(Enum):
    """What a network takes for the grey levels 0 to 255.

    UNIT: 0 to 1. BYTES: 0 to 255. IMAGENET: 0 to 1, less the mean and divided by the deviation of ImageNet's channels
    (Krizhevsky et al., NIPS 2012; the constants are torchvision's).
    """

    UNIT = "unit"
    BYTES = "bytes"
    IMAGENET = "imagenet"


class Sign(Enum):
    """What a network gives: the disparity, or its opposite, the flow along x from the left image to the right one."""

    DISPARITY = "disparity"
    FLOW = "flow"


class Check(Enum):
    """Whether the network also matches the mirrored pair, and only what both agree on counts. It takes twice the time."""

    YES = "yes"
    NO = "no"


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkMatcher:
    """A learned matcher: a network in a file.

    Attributes:
        value: the name as a user types it.
        path: of the ONNX file.
        levels: `input=`.
        sign: `output=`.
        check: `check=`.
    """

    value: str
    path: str
    levels: Levels = Levels.UNIT
    sign: Sign = Sign.DISPARITY
    check: Check = Check.YES


_Choice = TypeVar("_Choice", Levels, Sign, Check)


def network_named(text: str) -> NetworkMatcher:
    """Read a name that begins with `onnx:`. Nothing is opened.

    Raises:
        SettingsError: there is no path, or an option is unknown or has a value that it cannot have.
    """
    path, mark, tail = text.removeprefix(PREFIX).partition("?")
    if not path:
        raise SettingsError(f"matcher {text!r} names no file", "give onnx:PATH, a network in ONNX format")
    given = dict.fromkeys(("input", "output", "check"), "")
    for part in tail.split("&") if mark else ():
        key, _, value = part.partition("=")
        if key not in given or given[key]:
            raise SettingsError(
                f"matcher {text!r} has the option {part!r}", "give input=, output= and check= at most once each"
            )
        given[key] = value or "nothing"
    return NetworkMatcher(
        value=text,
        path=path,
        levels=_choice(text, "input", given["input"], Levels.UNIT),
        sign=_choice(text, "output", given["output"], Sign.DISPARITY),
        check=_choice(text, "check", given["check"], Check.YES),
    )


def _choice(text: str, key: str, value: str, default: _Choice) -> _Choice:
    if not value:
        return default
    kind = type(default)
    try:
        return kind(value)
    except ValueError:
        known = ", ".join(f"{key}={one.value}" for one in kind)
        raise SettingsError(f"matcher {text!r} has the option {key}={value}", f"give one of {known}") from None
