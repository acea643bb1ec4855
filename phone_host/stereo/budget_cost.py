"""Learns what each way of matching costs on this machine, and how fast the machine is at the moment. Pure.

A step takes `level * cost`. Its cost is what it takes on a usual machine,

    cost = step_ns * pixels * disparities + pixel_ns * pixels (+ resizing),

and the level is how much slower this machine is now: a phone that throttles raises the level of all steps alike. Measured times
are products of the two. Of a step that was long in use the cost is known, and its times tell the level. When a step is new, the
machine is taken to be as fast as a moment before, under the step that was left, and its times tell its cost.
"""

import math
from collections import Counter
from typing import Final

from phone_host.stereo.budget_ladder import Step
from phone_host.stereo.matcher_names import AnyMatcher, UsualCost, usual_cost

_NEW: Final = 10
"""A step with so few measured pairs is new. At 30 pairs a second they pass before a machine warms up."""

_RESIZE_NS: Final = 10.0
"""For each pixel of the full size, if smaller images are matched: 3 ms at 640x480 on a usual machine."""

_RATIOS: Final = (0.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0, 512.0)
"""What a pixel may cost besides, in disparities: block matching has 5, `sgbm` 130."""

_FAITH: Final = 0.01
"""Weight of the usual ratio, against the squared relative errors of the measured steps: one step cannot tell a ratio, three can."""


class CostModel:
    """The learned costs of a ladder's steps. It begins with those of a usual machine."""

    def __init__(self) -> None:
        self._level = 1.0
        self._known: dict[Step, float] = {}
        self._pairs: Counter[Step] = Counter()
        self._here: Step | None = None
        self._here_ns = math.nan
        self._since = 0
        self._left: tuple[Step, float] | None = None
        self._fits: dict[AnyMatcher, UsualCost] = {}

    def expected_ns(self, step: Step) -> float:
        """Return how long matching would take now, ns."""
        return self._level * (self._known.get(step) or self._fitted(step))

    def is_measured(self, step: Step) -> bool:
        """Return whether a step was ever used, so that its cost is no guess."""
        return step in self._known

    def observe(self, step: Step, match_ns: float) -> None:
        """Take what matching took.

        Args:
            step: how the pair was matched.
            match_ns: a robust average over the newest pairs that were matched so, ns, > 0.
        """
        if step != self._here:
            self._left = None if self._here is None else (self._here, self._here_ns)
            self._here, self._since = step, 0
        self._here_ns = match_ns
        self._pairs[step] += 1
        self._since += 1
        if not self._known:
            self._learn(step, self._fitted(step))
        elif self._left is not None and self._since <= _NEW:
            self._compare(step, match_ns, *self._left)
        self._level = match_ns / self._known[step]

    def _compare(self, step: Step, match_ns: float, left: Step, left_ns: float) -> None:
        """Take the machine to be as fast now as before the change: the times of the less known step tell its cost."""
        if self._pairs[step] <= _NEW:
            self._learn(step, self._known[left] * match_ns / left_ns)
        elif self._pairs[left] <= _NEW:
            self._learn(left, self._known[step] * left_ns / match_ns)

    def _learn(self, step: Step, cost: float) -> None:
        self._known[step] = cost
        self._fits.pop(step.choice.matcher, None)

    def _fitted(self, step: Step) -> float:
        """Return the cost by the formula, ns on a usual machine."""
        matcher = step.choice.matcher
        if matcher not in self._fits:
            measured = [(known, cost) for known, cost in self._known.items() if known.choice.matcher == matcher]
            self._fits[matcher] = _fit(measured, usual_cost(matcher))
        fit = self._fits[matcher]
        return step.pixels * (fit.step_ns * step.searched + fit.pixel_ns) + _resizing(step)


def _resizing(step: Step) -> float:
    return _RESIZE_NS * step.full_pixels if step.pixels < step.full_pixels else 0.0


def _fit(measured: list[tuple[Step, float]], usual: UsualCost) -> UsualCost:
    """Fit the formula to the costs of some steps: of a few ratios of its two terms the one that leaves the least relative errors."""
    if not measured:
        return usual

    def rests(ratio: float) -> list[float]:
        return [
            math.log(max(cost - _resizing(step), 0.1 * cost) / (step.pixels * (step.searched + ratio)))
            for step, cost in measured
        ]

    def misfit(ratio: float) -> float:
        logs = rests(ratio)
        mean = sum(logs) / len(logs)
        return sum((each - mean) ** 2 for each in logs) + _FAITH * math.log((ratio + 1) / (of_usual + 1)) ** 2

    of_usual = usual.pixel_ns / usual.step_ns
    best = min((of_usual, *_RATIOS), key=misfit)
    logs = rests(best)
    step_ns = math.exp(sum(logs) / len(logs))
    return UsualCost(step_ns=step_ns, pixel_ns=best * step_ns)
