"""What a printer's server says, read without belief: its types are checked, its words are bounded. Pure."""

import json
import math
from dataclasses import dataclass
from typing import Final

from common.errors import UnavailableError

_MOST_WORDS: Final = 200


@dataclass(frozen=True, slots=True)
class Answer:
    """An answer.

    Attributes:
        server: who gave it, for messages.
        status: of HTTP.
        body: its bytes.
        challenge: how it asks for a password; empty: it does not.
    """

    server: str
    status: int
    body: bytes
    challenge: str = ""

    @property
    def is_good(self) -> bool:
        """Whether what was asked for is done."""
        return 200 <= self.status < 300

    def json(self) -> "Value":
        """Return what it holds.

        Raises:
            UnavailableError: it holds no JSON object.
        """
        try:
            read = json.loads(self.body)
        except (ValueError, RecursionError):
            read = None
        if not isinstance(read, dict):
            raise UnavailableError(
                f"{self.server} gives an unexpected kind of answer",
                "check the address, and which server is there",
            )
        return Value(read)

    @property
    def words(self) -> str:
        """What it says went wrong; its number where it says nothing."""
        try:
            read = Value(json.loads(self.body))
        except (ValueError, RecursionError):
            return f"answer {self.status}"
        found = read["error"].text or read["error"]["message"].text or read["message"].text or read["text"].text
        return found or f"answer {self.status}"


class Value:
    """A part of what a server says. What is not there, or of another type, is empty, NaN or False."""

    def __init__(self, value: object) -> None:
        self._value = value

    def __getitem__(self, key: str) -> "Value":
        return Value(self._value.get(key) if isinstance(self._value, dict) else None)

    @property
    def text(self) -> str:
        """A text on one line, printable and short."""
        if not isinstance(self._value, str):
            return ""
        words = " ".join("".join(each if each.isprintable() else " " for each in self._value).split())
        return words[:_MOST_WORDS]

    @property
    def number(self) -> float:
        """A number; NaN: it is none, or none that is finite."""
        if type(self._value) not in {int, float}:
            return math.nan
        try:
            number = float(self._value)  # type: ignore[arg-type]  # int or float, as just checked
        except OverflowError:
            return math.nan
        return number if math.isfinite(number) else math.nan

    @property
    def is_true(self) -> bool:
        """Whether it is true."""
        return self._value is True

    @property
    def is_false(self) -> bool:
        """Whether it is false, and not merely missing."""
        return self._value is False

    @property
    def keys(self) -> tuple[str, ...]:
        """The first keys of an object."""
        return tuple(self._value)[:_MOST_PARTS] if isinstance(self._value, dict) else ()

    @property
    def texts(self) -> tuple[str, ...]:
        """The first texts of a list."""
        if not isinstance(self._value, list):
            return ()
        return tuple(each for each in self._value[:_MOST_PARTS] if isinstance(each, str) and len(each) <= _MOST_WORDS)

    @property
    def parts(self) -> tuple["Value", ...]:
        """The first parts of a list."""
        return tuple(Value(each) for each in self._value[:_MOST_PARTS]) if isinstance(self._value, list) else ()


_MOST_PARTS: Final = 32


def or_zero(number: float) -> float:
    """Return a number, or 0 in place of NaN."""
    return 0.0 if math.isnan(number) else number
