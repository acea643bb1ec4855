"""Figures to reach. A benchmark reports whether each was reached and exits with code 4 when one was missed, as the soak does."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

_MISSED: Final = 4


@dataclass(frozen=True, slots=True)
class Verdict:
    """One figure and the measured value.

    Attributes:
        what: the quantity measured.
        reached: whether the figure was reached.
        found: the measured value with its unit.
        limit: the figure to reach.
    """

    what: str
    reached: bool
    found: str = ""
    limit: str = ""

    def __str__(self) -> str:
        """One line."""
        return f"{self.what}: {self.found} (to reach: {self.limit}) {'reached' if self.reached else 'NOT reached'}"


def exit_code(verdicts: Sequence[Verdict]) -> int:
    """0 when all figures were reached."""
    return 0 if all(verdict.reached for verdict in verdicts) else _MISSED
