"""Figures to reach. A benchmark says of each whether it was reached, and ends with exit code 4 when one was not, as the soak does."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

_MISSED: Final = 4


@dataclass(frozen=True, slots=True)
class Verdict:
    """One figure beside what was found.

    Attributes:
        what: was measured.
        reached: whether the figure was reached.
        found: with its unit.
        limit: what was to be reached.
    """

    what: str
    reached: bool
    found: str = ""
    limit: str = ""

    def __str__(self) -> str:
        """One line."""
        return f"{self.what}: {self.found} (to reach: {self.limit}) {'reached' if self.reached else 'NOT reached'}"


def exit_code(verdicts: Sequence[Verdict]) -> int:
    """0 when all were reached."""
    return 0 if all(verdict.reached for verdict in verdicts) else _MISSED
