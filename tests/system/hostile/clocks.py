"""Clocks that step while the programs run: the board's or the host's, forward, or standing still as in a suspend or a stopped machine."""

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from enum import Enum
from functools import partial
from pathlib import Path
from typing import Final

from tests.support.programs import Program
from tests.system.hostile.attack import Attack, Outcome, Rounds
from tests.system.hostile.scene import PERIOD_NS, Scene, board_and_host
from tests.system.hostile.shim import ShiftedClock, stopped

S: Final = 1_000_000_000
MS: Final = 1_000_000


class Whose(Enum):
    """Whose clocks step."""

    BOARD = "board"
    HOST = "host"


class How(Enum):
    """What else happens at the same time."""

    PLAIN = "plain"
    ASLEEP = "asleep"
    """It loses time, and CLOCK_BOOTTIME does not."""
    SILENT = "silent"
    """The other side is stopped for a second around the step."""
    GIVEN_UP = "given up"
    """The other side is stopped for longer than the silence timeout."""


@dataclass(frozen=True, slots=True)
class Step:
    """One step.

    Attributes:
        by_ns: how far; negative: the machine stands still for this long.
        how: what else is so.
    """

    by_ns: int
    how: How = How.PLAIN

    @property
    def words(self) -> str:
        """A description for people."""
        how = "" if self.how is How.PLAIN else f" ({self.how.value})"
        return f"{self.by_ns / S:+g} s{how}" if abs(self.by_ns) >= S else f"{self.by_ns / MS:+g} ms{how}"


_SILENT_S: Final = {How.SILENT: 0.5, How.GIVEN_UP: 1.8}
"""Before and after the step."""

LARGE: Final = (Step(7 * S), Step(-2 * S), Step(-2 * S, How.ASLEEP), Step(13 * S, How.SILENT))
AT_THE_LIMIT: Final = (Step(2 * PERIOD_NS + 33_333), Step(-2 * PERIOD_NS - 33_333))
SMALL: Final = (Step(10 * MS), Step(-10 * MS), Step(-10 * MS, How.ASLEEP))
LONG: Final = (Step(-7 * S), Step(-4 * S, How.ASLEEP), Step(7 * S, How.GIVEN_UP), Step(-2 * S, How.GIVEN_UP))


def step(clock: ShiftedClock, mine: Program, other: Program, this: Step, watched: Scene) -> None:
    """Step a clock.

    Args:
        clock: the clock to step.
        mine: the process of that clock.
        other: the process at the other end.
        this: the step.
        watched: told of steps that cannot be noticed at once.
    """
    with ExitStack() as held:
        if this.how in _SILENT_S:
            held.enter_context(stopped(other))
            time.sleep(_SILENT_S[this.how])
        before_ns = time.monotonic_ns()
        if this.by_ns < 0:
            clock.stand_still(mine, -this.by_ns, asleep=this.how is How.ASLEEP, meanwhile=lambda: None)
        else:
            clock.jump(this.by_ns)
        if this.how in _SILENT_S:
            time.sleep(_SILENT_S[this.how])
    if abs(this.by_ns) < 2 * PERIOD_NS:
        watched.small_step(before_ns)


def _run(whose: Whose, steps: Sequence[Step], folder: Path, rounds: Rounds) -> Outcome:
    outcome = Outcome()
    clock = ShiftedClock(folder / "clock")
    clocks = (clock, None) if whose is Whose.BOARD else (None, clock)
    with board_and_host(folder, clocks=clocks) as (agent, watched):
        mine, other = (agent, watched.receiver) if whose is Whose.BOARD else (watched.receiver, agent)
        goes_on = True
        for _ in rounds:
            for this in steps:
                if goes_on:
                    step(clock, mine, other, this, watched)
                    goes_on = watched.cause_gone(outcome, f"{this.words} on the {whose.value}")
        watched.stop(outcome)
        outcome.expect(agent.stop() == 0, "the board did not end with 0")
    return outcome


def attack(whose: Whose, name: str, steps: Sequence[Step]) -> Attack:
    """An attack of several steps, one after the other."""
    load = f"the {whose.value}'s clocks: " + ", ".join(this.words for this in steps)
    run: Callable[[Path, Rounds], Outcome] = partial(_run, whose, steps)
    return Attack(f"clock: {whose.value}, {name}", load, run)


SHORT: Final = tuple(
    attack(whose, name, steps)
    for whose in Whose
    for name, steps in (("large", LARGE), ("two periods", AT_THE_LIMIT), ("small", SMALL))
)
"""These run in CI, too."""

LONG_ONLY: Final = tuple(attack(whose, "long", LONG) for whose in Whose)
