"""When the board was away during a run, and what that means for figures over time. Pure.

While the board is away nothing can be paired. That time tells nothing of the link, so it counts neither as starvation
nor against the rate of pairs.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from common.words import times

_MOST_TOLD = 5


@dataclass(frozen=True, slots=True)
class Absence:
    """One absence of the board.

    Attributes:
        gone_ns: when its goodbye came or its silence was noticed, CLOCK_MONOTONIC, ns.
        back_ns: when it sent frames again; None: it has not come back.
    """

    gone_ns: int
    back_ns: int | None = None

    def overlaps(self, since_ns: int, until_ns: int) -> bool:
        """Whether the board was away at some time between the two."""
        return self.gone_ns < until_ns and (self.back_ns is None or self.back_ns > since_ns)


@dataclass(frozen=True, slots=True)
class Away:
    """One absence as it is told.

    Attributes:
        at_s: when it began, counted from the start of the run, s.
        seconds: how long it lasted, or has lasted so far, s.
        is_over: whether the board came back.
    """

    at_s: float
    seconds: float
    is_over: bool


def away_of(absences: Sequence[Absence], started_ns: int, now_ns: int) -> tuple[Away, ...]:
    """Return absences as they are told.

    Args:
        absences: in order.
        started_ns: start of the run, CLOCK_MONOTONIC, ns.
        now_ns: now or the end of the run, ns.
    """
    return tuple(
        Away(
            (absence.gone_ns - started_ns) / 1e9,
            ((now_ns if absence.back_ns is None else absence.back_ns) - absence.gone_ns) / 1e9,
            absence.back_ns is not None,
        )
        for absence in absences
    )


def away_words(away: Sequence[Away]) -> str:
    """Say how often, when and how long the board was away; empty if it was always there."""
    if not away:
        return ""
    each = [f"for {item.seconds:.1f} s from {item.at_s:.0f} s on" for item in away[:_MOST_TOLD]]
    more = f" and {times(len(away) - _MOST_TOLD)} more" if len(away) > _MOST_TOLD else ""
    often = times(len(away))
    back = "and came back" if away[-1].is_over else "and has not come back"
    return f"the board went away {often} {back} ({', '.join(each)}{more}); rates leave this time out"
