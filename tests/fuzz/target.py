"""What a thing to fuzz is."""

from collections.abc import Callable
from dataclasses import dataclass

from common.errors import TandemError


@dataclass(frozen=True, slots=True)
class Target:
    """One reader.

    Attributes:
        what: for people.
        run: takes any bytes; raises where something is wrong.
        seeds: sound inputs to begin with.
        most_bytes: of one input.
        share: of the bytes that were asked for.
    """

    what: str
    run: Callable[[bytes], None]
    seeds: Callable[[], list[bytes]]
    most_bytes: int
    share: float


def is_one_line(error: TandemError) -> None:
    """Check what an error says."""
    assert "\n" not in str(error), "an error of several lines"
