"""What kept pairs from being processed, in words: an error that ended a run, a board's refusal, a pair's fault. Pure."""

from collections import Counter
from dataclasses import dataclass
from typing import Final

from common.errors import TandemError
from common.plain_text import printable

_MOST_KINDS: Final = 16
"""Reasons may name figures of a single image; beyond this many different ones they are counted together."""

_OTHERS: Final = "other reasons"


@dataclass(frozen=True, slots=True)
class Trouble:
    """One reason.

    Attributes:
        problem: what is wrong, in words.
        remedy: what to do about it.
    """

    problem: str
    remedy: str

    @property
    def sentences(self) -> str:
        """Problem and remedy as they follow a colon."""
        return f"{self.problem}. Remedy: {self.remedy}."


def trouble_of(error: BaseException) -> Trouble:
    """Return an error in words. One that is none of ours is a mistake of the program, and named by its kind.

    Args:
        error: what ended the run, or a pair.
    """
    if isinstance(error, TandemError):
        return Trouble(printable(error.problem), printable(error.remedy))
    told = printable(f"{type(error).__name__}: {error}")
    return Trouble(f"the program itself failed ({told})", "run it again with --debug and report what it prints")


class Troubles:
    """Counts reasons in bounded memory."""

    def __init__(self) -> None:
        self._counts: Counter[Trouble] = Counter()

    def add(self, error: Exception) -> None:
        """Count one more."""
        trouble = trouble_of(error)
        if trouble not in self._counts and len(self._counts) >= _MOST_KINDS:
            trouble = Trouble(_OTHERS, "see the log")
        self._counts[trouble] += 1

    def counts(self) -> tuple[tuple[Trouble, int], ...]:
        """Return each reason with its number, the most frequent first."""
        return tuple(self._counts.most_common())
