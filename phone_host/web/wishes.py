"""Reads what viewers say, and what programs send: strangers' JSON as values. Pure."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from phone_host.output.json_text import json_value
from phone_host.web.frames import View, fitting_width
from phone_host.web.source import Command, Do

MOST_HZ: Final = 30.0
_LEAST_HZ: Final = 0.1
MOST_VALUES: Final = 64
MOST_TEXT: Final = 1000
MOST_POINTS: Final = 2
MOST_PX: Final = 100_000.0
MOST_NUMBER: Final = 2**53 - 1
"""Beyond, JSON's readers no longer tell whole numbers apart (RFC 8259, section 6)."""

_PLAIN: Final = re.compile(r"[ -~\u00a0-\ud7ff\ue000-\U0010ffff]*")
"""Without control characters, which would reach terminals and logs, and without halves of letters."""


@dataclass(frozen=True, slots=True)
class Ack:
    """A viewer has shown a pair.

    Attributes:
        number: of the result.
    """

    number: int


@dataclass(frozen=True, slots=True)
class Want:
    """What a viewer wants to be sent.

    Attributes:
        views: parts, each once, in the order of `View`; none: no pairs.
        width_px: greatest width, one of `frames.WIDTHS`; 0 before it has said anything.
        hz: greatest rate, 1/s; 0 likewise.
    """

    views: tuple[View, ...]
    width_px: int
    hz: float


@dataclass(frozen=True, slots=True)
class MeasureRequest:
    """Points to measure.

    Attributes:
        points_px: x, y of one or two points, px of the full rectified left image.
        number: of the result; None: the newest.
    """

    points_px: tuple[tuple[float, float], ...]
    number: int | None


def read_wish(text: str) -> Ack | Want | None:
    """Read a viewer's message.

    Returns:
        What it says; None: nothing that we know.
    """
    said = _object(text)
    match said.get("kind"):
        case "ack":
            number = _whole(said.get("number"))
            return None if number is None else Ack(number)
        case "want":
            return _want(said)
    return None


def read_command(text: str | bytes) -> Command | None:
    """Read a command.

    Args:
        text: JSON: do, and values by name.

    Returns:
        The command; None: it is none.
    """
    said = _object(text)
    values = said.get("values", {})
    if said.get("do") not in [each.value for each in Do] or not set(said) <= {"do", "values"}:
        return None
    if not isinstance(values, dict) or len(values) > MOST_VALUES:
        return None
    texts = (text for pair in values.items() for text in pair)
    if not all(isinstance(text, str) and len(text) <= MOST_TEXT and _PLAIN.fullmatch(text) for text in texts):
        return None
    return Command(do=Do(said["do"]), values=values)


def read_number(text: str) -> int | None:
    """Read a number of an address; None: it is none, or too large."""
    if not text.isascii() or not text.isdigit() or len(text) > len(str(MOST_NUMBER)):
        return None
    number = int(text)
    return number if number <= MOST_NUMBER else None


def token_in(text: str) -> str:
    """Return the token that a hello carries; empty: none."""
    said = _object(text)
    token = said.get("token")
    return token if said.get("kind") == "hello" and isinstance(token, str) else ""


def read_measure(text: str | bytes) -> MeasureRequest | None:
    """Read which points to measure.

    Args:
        text: JSON: points, and perhaps the number of the result.

    Returns:
        The request; None: it is none.
    """
    said = _object(text)
    points, number = said.get("points"), said.get("number")
    if not isinstance(points, list) or not 1 <= len(points) <= MOST_POINTS or not set(said) <= {"points", "number"}:
        return None
    if not all(isinstance(point, list) and len(point) == 2 and all(map(_is_place, point)) for point in points):
        return None
    whole = _whole(number)
    if number is not None and whole is None:
        return None
    return MeasureRequest(tuple((float(x), float(y)) for x, y in points), whole)


def _want(said: Mapping[str, Any]) -> Want | None:
    views, width, hz = said.get("views"), _whole(said.get("width", 640)), said.get("hz", 10)
    if not isinstance(views, list) or not {view.value for view in View}.issuperset(map(str, views)):
        return None
    if width is None or not _is_number(hz) or not hz > 0:
        return None
    return Want(
        tuple(view for view in View if view.value in views),
        fitting_width(width),
        min(MOST_HZ, max(_LEAST_HZ, float(hz))),
    )


def _object(text: str | bytes) -> dict[str, Any]:
    """Read a JSON object; an empty one stands for what is none."""
    try:
        value = json_value(text)
    except ValueError:
        return {}
    return value if isinstance(value, dict) else {}


def _whole(value: object) -> int | None:
    """Return a number that counts something. For JSON, 5.0 is whole, too."""
    return int(value) if _is_number(value) and value >= 0 and value == int(value) else None  # type: ignore[operator, call-overload]


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= MOST_NUMBER


def _is_place(value: object) -> bool:
    return _is_number(value) and abs(value) <= MOST_PX  # type: ignore[arg-type]
