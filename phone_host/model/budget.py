"""How a run holds a time budget for each pair: what it chose, and what it changed. No behaviour, no I/O."""

from dataclasses import dataclass
from enum import Enum


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetStep:
    """One way to match pairs.

    Attributes:
        matcher: its name.
        scale: size of the matched images, as a share of the rectified ones', in (0, 1].
        width_px: width of the matched images, px.
        height_px: their height, px.
        disparities: N, px of the rectified images: 0 <= d < N is searched.
        nearest_m: the nearest depth that this search can find, m; NaN without metres.
    """

    matcher: str
    scale: float
    width_px: int
    height_px: int
    disparities: int
    nearest_m: float


class BudgetReason(Enum):
    """Why a run matches in another way than before."""

    TOO_SLOW = "too_slow"
    ROOM = "room"
    AS_FAST = "as_fast"
    OTHER_SIZE = "other_size"


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetChange:
    """One change.

    Attributes:
        pair: the first pair that is matched in the new way; counts the pairs that were processed, from 0.
        at_s: when it was decided, counted from the first pair, s.
        reason: why.
        processing_ns: what pairs took before it, ns; NaN: not measured.
        step: the new way.
    """

    pair: int
    at_s: float
    reason: BudgetReason
    processing_ns: float
    step: BudgetStep


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetAccount:
    """How the budget was held so far.

    Attributes:
        budget_ns: time for each pair, ns.
        now: how pairs are matched now.
        best: how they would be matched if the budget allowed it.
        processing_ns: median over the newest pairs, ns; NaN: not measured yet.
        match_ns: the part of it that matching takes, ns; NaN: not measured yet.
        pairs: pairs processed.
        held: pairs that took no longer than the budget.
        narrowed: pairs whose search was narrower than the best one.
        changed: how often the way was changed.
        changes: the newest changes, in order.
        is_missed: whether pairs take too long, and no way is expected to hold the budget.
    """

    budget_ns: int
    now: BudgetStep
    best: BudgetStep
    processing_ns: float = float("nan")
    match_ns: float = float("nan")
    pairs: int = 0
    held: int = 0
    narrowed: int = 0
    changed: int = 0
    changes: tuple[BudgetChange, ...] = ()
    is_missed: bool = False

    @property
    def is_narrowed(self) -> bool:
        """Whether near objects are not searched for now."""
        return self.now.disparities < self.best.disparities
