"""What an attack is and what it found. Every attack is one `Attack`: the tests run it once, `make attack` runs it for minutes."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from statistics import quantiles
from typing import Final

MOST_MEMORY: Final = 1.3
"""Peak memory of a process under attack, in multiples of its peak before."""

MOST_GAP_S: Final = (1.0, 2.0)
"""Time without pairs after the cause is gone: median and p95 of all rounds (DESIGN, section 7)."""


class Rounds:
    """How often an attack is repeated: at least once, then until its time is over.

    Args:
        seconds: its time; 0: once.
    """

    def __init__(self, seconds: float = 0.0) -> None:
        self._until = time.monotonic() + seconds

    def __iter__(self) -> Iterator[int]:
        """The numbers of the rounds."""
        number = 0
        yield number
        while time.monotonic() < self._until:
            number += 1
            yield number


@dataclass(slots=True)
class Outcome:
    """What an attack has found so far.

    Attributes:
        frames: of the board that arrived at the host.
        pairs: made by the host.
        wrong: pairs of frames that do not belong together.
        gaps_s: time from the end of each cause to the first of many pairs.
        memory: peak of the attacked process, in multiples of its normal peak; 0: not measured.
        faults: everything else that must not happen, in words.
        slow: limits of processor time that were missed, in words.
        figures: what else was measured, in words.
    """

    frames: int = 0
    pairs: int = 0
    wrong: int = 0
    gaps_s: list[float] = field(default_factory=list)
    memory: float = 0.0
    faults: list[str] = field(default_factory=list)
    slow: list[str] = field(default_factory=list)
    figures: list[str] = field(default_factory=list)

    @property
    def gap_s(self) -> tuple[float, float]:
        """Median and p95 of the gaps, s; NaN if there was none."""
        if len(self.gaps_s) < 2:
            only = self.gaps_s[0] if self.gaps_s else float("nan")
            return only, only
        cuts = quantiles(self.gaps_s, n=20, method="inclusive")
        return cuts[9], cuts[18]

    def expect(self, holds: bool, otherwise: str) -> None:  # noqa: FBT001 - reads like an assertion
        """Note a fault unless the condition holds."""
        if not holds and otherwise not in self.faults:
            self.faults.append(otherwise)

    def broken(self) -> list[str]:
        """The failed checks that do not depend on how busy the machine is: counts and content."""
        wrong = [f"{self.wrong} wrong pairs"] if self.wrong else []
        memory = [f"memory {self.memory:.2f} x normal"] if self.memory > MOST_MEMORY else []
        return wrong + memory + self.faults

    def missed(self) -> list[str]:
        """All failed checks, including the recovery times and processor time."""
        too_long = any(gap > limit for gap, limit in zip(self.gap_s, MOST_GAP_S, strict=True))
        return self.broken() + self.slow + (["back too late"] if too_long else [])


@dataclass(frozen=True, slots=True)
class Attack:
    """One attack.

    Attributes:
        name: one or a few words.
        load: what the attack does, in words.
        run: attacks, with its files in a folder; returns what it found.
    """

    name: str
    load: str
    run: Callable[[Path, Rounds], Outcome]
