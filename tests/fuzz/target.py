"""Defines a fuzz target."""

from collections.abc import Callable
from dataclasses import dataclass

from common.errors import TandemError


@dataclass(frozen=True, slots=True)
class Target:
    """One reader.

    Attributes:
        what: for people.
        run: takes any bytes; raises if something is wrong.
        seeds: valid inputs to begin with.
        most_bytes: limit per input.
        share: of the requested bytes.
    """

    what: str
    run: Callable[[bytes], None]
    seeds: Callable[[], list[bytes]]
    most_bytes: int
    share: float


def is_one_line(error: TandemError) -> None:
    """Check that an error message is one line."""
    assert "\n" not in str(error), "an error of several lines"
