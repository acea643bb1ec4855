"""Figures to reach. A benchmark says of each whether it was reached, and ends with exit code 4 when one was not, as the soak does."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

_MISSED: Final = 4


@dataclass(frozen=True, slots=True)
class Verdict:
    """One figure beside what was found.

    Attributes:
        said: what was found, and what was to be reached.
        reached: whether it was.
    """

    said: str
    reached: bool

    def __str__(self) -> str:
        """One line."""
        return f"{self.said} {'reached' if self.reached else 'NOT reached'}"


def exit_code(verdicts: Sequence[Verdict]) -> int:
    """0 when all were reached."""
    return 0 if all(verdict.reached for verdict in verdicts) else _MISSED
