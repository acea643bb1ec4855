"""A machine that takes as long for a pair as a formula says: for tests of what chooses by measured times."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from phone_host.model import BudgetReason
from phone_host.stereo.budget import BudgetController, Step
from phone_host.stereo.matcher_names import AnyMatcher, MatcherName, UsualCost

MS = 1_000_000
S = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Played:
    """One pair of a simulated run: when it was done, how it was matched, and what it took in all."""

    at_ns: int
    step: Step
    total_ns: int


@dataclass(slots=True)
class Machine:
    """The machine, and the run on it.

    Attributes:
        costs: what each matcher takes.
        slowness: factor on all times, by the time since the start, s.
        rest_ns: what a pair takes besides matching, at slowness 1.
        noise: relative standard deviation of each time.
        outliers: numbers of pairs that take ten times as long.
        period_ns: of the cameras.
    """

    costs: dict[AnyMatcher, UsualCost] = field(
        default_factory=lambda: {
            MatcherName.SGBM: UsualCost(step_ns=1.0, pixel_ns=150.0),
            MatcherName.BLOCK: UsualCost(step_ns=3.0, pixel_ns=0.0),
        }
    )
    slowness: Callable[[float], float] = lambda _at_s: 1.0
    rest_ns: float = 5e6
    noise: float = 0.05
    outliers: frozenset[int] = frozenset()
    period_ns: int = S // 30

    def match_ns(self, step: Step, slowness: float = 1.0) -> float:
        """What matching takes without noise."""
        cost = self.costs[step.choice.matcher]
        resizing = 8.0 * step.full_pixels if step.pixels < step.full_pixels else 0.0
        return slowness * (step.pixels * (cost.step_ns * step.searched + cost.pixel_ns) + resizing)

    def total_ns(self, step: Step, slowness: float = 1.0) -> float:
        """What a pair takes without noise."""
        return slowness * self.rest_ns + self.match_ns(step, slowness)

    def play(self, budget_ns: int, steps: Sequence[Step], seconds: float) -> tuple[list[Played], list[BudgetReason]]:
        """Run for some seconds; return the pairs and the reasons of the changes."""
        random = np.random.default_rng(7)
        controller = BudgetController(budget_ns, steps, 0)
        pairs: list[Played] = []
        reasons: list[BudgetReason] = []
        now_ns = 0
        while now_ns < seconds * S:
            step = controller.step
            factor = self.slowness(now_ns / S) * (1 + self.noise * abs(float(random.standard_normal())))
            factor *= 10 if len(pairs) in self.outliers else 1
            total_ns, match_ns = round(self.total_ns(step, factor)), round(self.match_ns(step, factor))
            now_ns += max(total_ns, self.period_ns)
            pairs.append(Played(now_ns, step, total_ns))
            if (reason := controller.add(total_ns, match_ns, now_ns)) is not None:
                reasons.append(reason)
        return pairs, reasons
