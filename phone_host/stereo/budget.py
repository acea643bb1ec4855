"""Holds a time budget for each pair: picks a step of the ladder, from the times that pairs took. Pure; the time is an argument.

Down at once, up with patience. The median of the newest pairs decides, so a single slow pair changes nothing. A better step must be
expected to leave room. One that was measured too slow stays barred until the machine has become faster, because its own measured
cost is what is expected of it. Each climb that had to be undone doubles the patience.
"""

import statistics
from collections import deque
from collections.abc import Sequence
from typing import Final

from phone_host.model import BudgetReason
from phone_host.stereo.budget_cost import CostModel
from phone_host.stereo.budget_ladder import Step

_NEWEST: Final = 5
_ENOUGH: Final = 3
"""The median over 3 to 5 pairs: one outlier among them does not move it far."""

_UNCOUNTED: Final = 1
"""The first pair after a change pays for new buffers and maps."""

_FITS: Final = 0.9
"""A step is good enough in need if it is expected to take this share of the budget."""

_ROOMY: Final = 0.75
"""A better step must be expected to take no more than this share, so that what is between the two shares changes nothing."""

_GAIN: Final = 0.95
"""A step that is expected to take more than this share of the present time is no remedy."""

_AS_FAST: Final = 1.1
"""Where nothing holds the budget, the best step is taken that is slower than the fastest by no more than this: when decoding takes
most of the time, nothing is won by less depth."""

_PATIENCE_NS: Final = 2_000_000_000
_MOST_PATIENCE_NS: Final = 60_000_000_000
_UNDONE_NS: Final = 10_000_000_000
"""A climb is tried two seconds after the last change; twice as long after one that was undone within ten seconds."""


class BudgetController:
    """Chooses how the next pair is matched.

    Args:
        budget_ns: time for each pair, ns.
        steps: from which to choose, best first.
        now_ns: monotonic, ns.
    """

    def __init__(self, budget_ns: int, steps: Sequence[Step], now_ns: int) -> None:
        self._budget_ns, self._steps = budget_ns, tuple(steps)
        self._model = CostModel()
        self._newest: deque[tuple[int, int]] = deque(maxlen=_NEWEST)
        self._uncounted = _UNCOUNTED
        self._patience_ns = _PATIENCE_NS
        self._changed_ns = now_ns
        self._climbed_ns = now_ns - _UNDONE_NS
        self.processing_ns = self.match_ns = float("nan")
        """Median time of the newest pairs that were matched alike, and of matching alone, ns; NaN: not measured yet."""
        self.is_cheapest = False
        """Whether pairs are too slow and no step is expected to be faster."""
        self.step = self._first_within(_ROOMY * budget_ns, self._steps) or self._fastest()

    def add(self, total_ns: int, match_ns: int, now_ns: int) -> BudgetReason | None:
        """Take the times of a pair that was matched as `step` says; `step` may then be another.

        Args:
            total_ns: time of the whole pair, ns.
            match_ns: the part of it that matching took, ns.
            now_ns: monotonic, ns.

        Returns:
            Why `step` is another; None if it is the same.
        """
        if self._uncounted:
            self._uncounted -= 1
            return None
        self._newest.append((total_ns, max(1, match_ns)))
        if len(self._newest) < _ENOUGH:
            return None
        self.processing_ns = statistics.median(total for total, _ in self._newest)
        self.match_ns = statistics.median(match for _, match in self._newest)
        self._model.observe(self.step, self.match_ns)
        if self.processing_ns > self._budget_ns:
            return self._descend(now_ns)
        self.is_cheapest = False
        return self._climb(now_ns) if self._is_patient(now_ns) else None

    def _is_patient(self, now_ns: int) -> bool:
        return len(self._newest) == _NEWEST and now_ns - self._changed_ns >= self._patience_ns

    def _descend(self, now_ns: int) -> BudgetReason | None:
        here = self._steps.index(self.step)
        step = self._first_within(_FITS * self._budget_ns, self._steps[here + 1 :]) or self._fastest()
        self.is_cheapest = step == self.step or self._model.expected_ns(step) > _GAIN * self.match_ns
        if self.is_cheapest:
            if self._steps.index(step) >= here or not self._is_patient(now_ns):
                return None
            self._change(step, now_ns)
            return BudgetReason.AS_FAST
        is_undone = now_ns - self._climbed_ns < _UNDONE_NS
        self._patience_ns = min(2 * self._patience_ns, _MOST_PATIENCE_NS) if is_undone else _PATIENCE_NS
        self._change(step, now_ns)
        return BudgetReason.TOO_SLOW

    def _climb(self, now_ns: int) -> BudgetReason | None:
        better = self._steps[: self._steps.index(self.step)]
        step = self._first_within(_ROOMY * self._budget_ns, better)
        if step is None:
            return None
        self._climbed_ns = now_ns
        self._change(step, now_ns)
        return BudgetReason.ROOM

    def _change(self, step: Step, now_ns: int) -> None:
        self.step, self._changed_ns, self._uncounted = step, now_ns, _UNCOUNTED
        self._newest.clear()

    def _first_within(self, limit_ns: float, steps: Sequence[Step]) -> Step | None:
        rest_ns = self._rest_ns
        return next((step for step in steps if rest_ns + self._model.expected_ns(step) <= limit_ns), None)

    def _fastest(self) -> Step:
        least_ns = self._rest_ns + min(map(self._model.expected_ns, self._steps))
        step = self._first_within(_AS_FAST * least_ns, self._steps)
        assert step is not None
        return step

    @property
    def _rest_ns(self) -> float:
        """What the newest pairs took besides matching, ns."""
        return statistics.median(total - match for total, match in self._newest) if self._newest else 0.0
