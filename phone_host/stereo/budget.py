"""Holds a time budget for each pair: picks a step of the ladder, from the times that pairs took. Pure; the time is an argument.

Down at once, up with patience. The median of the newest pairs decides, so a single slow pair changes nothing. A better step must be
expected to leave room. One that was measured too slow stays barred until the machine has become faster, because its own measured
cost is what is expected of it. Each climb that had to be undone doubles the patience.
"""

import statistics
from collections import deque
from collections.abc import Collection, Sequence
from typing import Final

from phone_host.model import BudgetReason
from phone_host.stereo.budget_cost import CostModel
from phone_host.stereo.budget_ladder import Step

_NEWEST: Final = 5
_ENOUGH: Final = 3
"""The median over 3 to 5 pairs tells whether they are too slow: one outlier among them does not move it far."""

_STEADY: Final = 15
"""The median over so many tells whether there is room: on a busy machine times vary by a third and more."""

_UNCOUNTED: Final = 1
"""The first pair after a change pays for new buffers and maps."""

_FITS: Final = 0.9
"""A step is good enough in need if it is expected to take this share of the budget."""

_ROOMY: Final = 0.75
"""A better step must be expected to take no more than this share, so that what is between the two shares changes nothing."""

_GAIN: Final = 0.8
"""Where nothing holds the budget, a step must be expected to take no more than this share of the present time to be worth a change."""

_AS_FAST: Final = 1.1
"""Where nothing holds the budget, the best step is taken that is slower than the fastest by no more than this: when decoding takes
most of the time, nothing is won by less depth."""

_UNSURE: Final = 1.5
"""A step that was never measured may take so much less than is expected of it: simulated machines have 0.6 to 1.5."""

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
        self._rest_ns = 0.0
        self._newest: deque[tuple[int, int]] = deque(maxlen=_STEADY)
        self._uncounted = _UNCOUNTED
        self._patience_ns = _PATIENCE_NS
        self._changed_ns = now_ns
        self._climbed_ns = now_ns - _UNDONE_NS
        self._gave_up_ns = now_ns - _MOST_PATIENCE_NS
        self.processing_ns = self.match_ns = float("nan")
        """Median time of the newest pairs that were matched alike, and of matching alone, ns; NaN: not measured yet."""
        self.is_missed = False
        """Whether pairs are too slow and no step is expected to hold the budget."""
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
        newest = tuple(self._newest)[-_NEWEST:]
        self.processing_ns = statistics.median(total for total, _ in newest)
        self.match_ns = statistics.median(match for _, match in newest)
        is_slow = self.processing_ns > self._budget_ns
        self._learn(newest if is_slow else self._newest)
        if is_slow:
            return self._descend(now_ns)
        self.is_missed = False
        return self._climb(now_ns) if self._is_patient(now_ns) else None

    def _is_patient(self, now_ns: int) -> bool:
        return len(self._newest) == _STEADY and now_ns - self._changed_ns >= self._patience_ns

    def _descend(self, now_ns: int) -> BudgetReason | None:
        worse = self._steps[self._steps.index(self.step) + 1 :]
        step = self._first_within(_FITS * self._budget_ns, worse)
        if step is None:
            return self._make_the_best_of_it(now_ns)
        self._set_patience(is_failure=now_ns - self._climbed_ns < _UNDONE_NS)
        self._change(step, now_ns)
        return BudgetReason.TOO_SLOW

    def _make_the_best_of_it(self, now_ns: int) -> BudgetReason | None:
        """Nothing is expected to hold the budget: go to a step that may all the same, else to the best of the fastest; at once, but afterwards only with patience."""
        untried = self._untried()
        step, present_ns = untried or self._fastest(), self._rest_ns + self.match_ns
        is_first, self.is_missed = now_ns - self._gave_up_ns >= _MOST_PATIENCE_NS, True
        is_better = self._steps.index(step) < self._steps.index(self.step)
        is_faster = untried is not None or self._rest_ns + self._model.expected_ns(step) <= _GAIN * present_ns
        if step == self.step or not (is_first or self._is_patient(now_ns)) or not (is_better or is_faster):
            return None
        self._set_patience(is_failure=not is_first)
        self._gave_up_ns = now_ns
        self._change(step, now_ns)
        return BudgetReason.TOO_SLOW if is_faster else BudgetReason.AS_FAST

    def _untried(self) -> Step | None:
        """Return the step that is expected to be the fastest of those never measured, if it may hold the budget; None: there is none.

        What is measured of other steps foretells it only roughly: to stay too slow beside it, or to go back to what was too slow, is worse than a try.
        """
        new = [step for step in self._steps if not self._model.is_measured(step)]
        step = min(new, key=self._model.expected_ns, default=None)
        if step is None:
            return None
        limit_ns = min(_UNSURE * self._budget_ns, _AS_FAST * (self._rest_ns + self.match_ns))
        return self._first_within(limit_ns, (step,))

    def _set_patience(self, *, is_failure: bool) -> None:
        """Wait longer before the next change for the better, if the last one was a failure; else shorter again."""
        patience_ns = 2 * self._patience_ns if is_failure else self._patience_ns // 2
        self._patience_ns = min(max(patience_ns, _PATIENCE_NS), _MOST_PATIENCE_NS)

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
        return next((step for step in steps if self._rest_ns + self._model.expected_ns(step) <= limit_ns), None)

    def _fastest(self) -> Step:
        least_ns = self._rest_ns + min(map(self._model.expected_ns, self._steps))
        step = self._first_within(_AS_FAST * least_ns, self._steps)
        assert step is not None
        return step

    def _learn(self, pairs: Collection[tuple[int, int]]) -> None:
        """Take the medians of some pairs for the machine's present speed."""
        self._rest_ns = statistics.median(total - match for total, match in pairs)
        self._model.observe(self.step, statistics.median(match for _, match in pairs))
