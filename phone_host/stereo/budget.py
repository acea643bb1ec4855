"""Holds a time budget for each pair: picks a step of the ladder, from the times that pairs took. Pure; the time is an argument.

Down at once, up with patience. The median of the newest pairs decides, so a single slow pair changes nothing. A better step must be
expected to leave room. One that was measured too slow stays barred until the machine has become faster, because its own measured
cost is what is expected of it. Each climb that had to be undone doubles the patience.

A step takes `level * cost`. Its cost is what it takes on a usual machine,

    cost = step_ns * pixels * disparities + pixel_ns * pixels (+ resizing),

and the level is how much slower this machine is now: a phone that throttles raises the level of all steps alike. Measured times
are products of the two. Of a step that was long in use the cost is known, and its times tell the level. When a step is new, the
machine is taken to be as fast as a moment before, under the step that was left, and its times tell its cost.

The ladder holds the ways in which pairs of one size can be matched, best first. First the working size shrinks, because all of the scene keeps a depth, only
a coarser one. Only at the smallest size the search becomes narrower, because near objects get lost. The next matcher comes last.
"""

import math
import statistics
from collections import Counter, deque
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Final

from phone_host.model import BudgetReason, Search, StereoGeometry
from phone_host.stereo.matcher_names import AnyMatcher, UsualCost, usual_cost

_SCALES: Final = (1.0, 0.75, 0.6, 0.5, 0.42, 0.35, 0.3, 0.25)
"""Shares of the usual working size. Each step saves about a third of the pixels; a quarter of 640x480 is what toys had."""

_LEAST_SIDE_PX: Final = 60
"""Images are not made smaller than this: at 80x60 px a window of the matchers covers a tenth of the scene."""

_RANGES: Final = (0.75, 0.5)
"""Shares of the search. Half of it moves the nearest depth to twice the distance."""

_RANGE_STEP: Final = 16  # px: what vectors of 8-bit costs take at once


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetWanted:
    """A time budget for each pair.

    Attributes:
        budget_ns: from the beginning of decoding to the cloud, ns.
        matchers: that may be used, best first.
        may_scale: whether the working size may change.
        may_narrow: whether the search may become narrower.
    """

    budget_ns: int
    matchers: tuple[AnyMatcher, ...]
    may_scale: bool = True
    may_narrow: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """How a pair is matched, in place of what the core was built with.

    Attributes:
        matcher: the algorithm.
        scale: size of the images that are matched, as a share of the rectified ones', in (0, 1].
        disparities: N, px of the rectified images.
    """

    matcher: AnyMatcher
    scale: float
    disparities: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Extent:
    """What a core matches of pairs of one size if nothing is chosen.

    Attributes:
        width_px: of the part that is matched, px of the rectified images.
        height_px: the same.
        search: scale and range.
        geometry: of the rectified images; None without metres.
    """

    width_px: int
    height_px: int
    search: Search
    geometry: StereoGeometry | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A choice, and how much work it is.

    Attributes:
        choice: the choice.
        width_px: of the images that are matched, px.
        height_px: the same.
        full_pixels: pixels before they are reduced.
    """

    choice: Choice
    width_px: int
    height_px: int
    full_pixels: int

    @property
    def pixels(self) -> int:
        """Pixels of each image that is matched."""
        return self.width_px * self.height_px

    @property
    def searched(self) -> int:
        """Disparities that are searched, px of the matched images."""
        return max(1, math.ceil(self.choice.disparities * self.choice.scale))


def ladder(extent: Extent, wanted: BudgetWanted) -> tuple[Step, ...]:
    """List the ways to match, best first.

    Args:
        extent: what is matched without a budget; its range is known.
        wanted: what may change.

    Returns:
        At least one step for each matcher.
    """
    scale, widest = extent.search.scale, extent.search.disparities
    smallest = _LEAST_SIDE_PX / min(extent.width_px, extent.height_px)
    smaller = [scale * share for share in _SCALES[1:] if scale * share >= smallest] if wanted.may_scale else []
    narrower = [_rounded(widest * share) for share in _RANGES] if wanted.may_narrow else []
    ways = [(each, widest) for each in (scale, *smaller)]
    ways += [((scale, *smaller)[-1], each) for each in dict.fromkeys(narrower) if each < widest]
    return tuple(
        Step(
            choice=Choice(matcher=matcher, scale=each, disparities=disparities),
            width_px=max(1, round(extent.width_px * each)),
            height_px=max(1, round(extent.height_px * each)),
            full_pixels=extent.width_px * extent.height_px,
        )
        for matcher in wanted.matchers
        for each, disparities in ways
    )


def _rounded(disparities: float) -> int:
    return max(1, math.ceil(disparities / _RANGE_STEP)) * _RANGE_STEP


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


_NEWEST: Final = 5
_ENOUGH: Final = 3  # of 3 to 5 pairs the median tells whether they are too slow: one outlier does not move it far

_STEADY: Final = 15
"""The median over so many tells whether there is room: on a busy machine times vary by a third and more."""

_UNCOUNTED: Final = 1  # the first pair after a change pays for new buffers and maps

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
