"""The board's clock as seen over several links at once. Pure: echoes in, one estimate out.

All echoes are facts about the same two clocks, so the true offset lies in the intersection of all links' hard limits;
`bound` is that of the intersection. Near-symmetry of the two directions holds for each link separately, but not across
links. So offset, skew and `uncertainty` come from one link: the one with the least uncertainty at the newest echo. If
its offset is outside what the other links' facts allow, it is moved to the nearest allowed value, which is never
further from the truth. While echoes of one link or of two links contradict each other, there is no estimate over any
link. A jump that one link has confirmed holds for all.
"""

from collections.abc import Iterable
from dataclasses import replace

from common.protocol.session import Echo
from phone_host.sync.clock import ClockEstimate, ClockEstimator, Heard, may_harm
from phone_host.sync.hull import SKEW_CHANGE


class LinkClocks:
    """Estimates one board clock over several links. A new boot of the board needs a new instance.

    Attributes:
        estimate: the present estimate; None before the first echo, and while echoes contradict each other.
        since_ns: board's time of the first echo after the last doubt. Earlier stamps may come from a clock that has
            stepped since. None: no doubt yet.
    """

    def __init__(self, links: int) -> None:
        self._estimators = [ClockEstimator() for _ in range(links)]
        self.estimate: ClockEstimate | None = None
        self._believed: ClockEstimate | None = None
        self._contested = self._void = False
        self.since_ns: int | None = None

    @property
    def in_doubt(self) -> bool:
        """Whether echoes contradict each other, or earlier knowledge is void, and later echoes have not decided yet."""
        return self._void or self._contested or any(estimator.in_doubt for estimator in self._estimators)

    def round_trip_ns(self, link: int) -> int | None:
        """Return the least recent round trip over one link, ns; None before its first echo."""
        own = self._estimators[link].estimate
        return None if own is None else own.round_trip_ns

    def add(self, echo: Echo) -> Heard:
        """Learn from one echo.

        Args:
            echo: the echo with its four stamps and its link.
        """
        estimator = self._estimators[echo.link]
        heard = estimator.add(echo)
        self._contested = heard is Heard.AGREED and self._contradicts_others(estimator)
        if self._contested:
            heard = Heard.STEPPED if estimator.is_confirmed else Heard.DOUBTED
        if heard is Heard.STEPPED:
            self._contested = False
            self._forget(keep=echo.link)
        if heard is Heard.STEPPED or (heard is Heard.AGREED and self._void):
            # Earlier knowledge may still hold: another link lied, or neither clock has stood still.
            heard = Heard.AGREED if self._fits_what_was_believed(estimator.estimate) else Heard.STEPPED
            self._void = False
            self.since_ns = estimator.began_ns
        self.estimate = None if self.in_doubt else self._solved(estimator.estimate)
        self._believed = self.estimate or self._believed
        return heard

    def void(self, *, stepped: bool = False) -> None:
        """Forget the offset, because one of the two clocks may have stood still. Keep what is known of their rates.

        Args:
            stepped: whether a clock certainly stood still. If False, the next echo tells.
        """
        if self._believed is None:
            return
        self._believed = None if stepped else self._believed
        self._forget(keep=None)
        self._void, self._contested = True, False
        self.estimate = None

    def down(self, link: int) -> None:
        """Take note that a link is gone.

        A doubt that only its echoes could have settled is left to any link's next echo.
        """
        if self._contested or self._estimators[link].in_doubt:
            self._estimators[link] = ClockEstimator(self._estimators[link].skew)
            self._void, self._contested = self._void or self._believed is not None, False

    def _forget(self, keep: int | None) -> None:
        self._estimators = [
            estimator if link == keep else ClockEstimator(estimator.skew)
            for link, estimator in enumerate(self._estimators)
        ]

    def _fits_what_was_believed(self, newest: ClockEstimate | None) -> bool:
        if newest is None or self._believed is None:
            return newest is not None
        return _meet(newest, [moved(self._believed, newest.reference_ns)]) is not None

    def _contradicts_others(self, estimator: ClockEstimator) -> bool:
        """Return whether one link's facts contradict those of the others by more than is harmless."""
        newest = estimator.estimate
        if newest is None:
            return False
        others = [one.estimate for one in self._estimators if one is not estimator and one.estimate is not None]
        found = [moved(other, newest.reference_ns) for other in others]
        return _meet(newest, found) is None and any(may_harm(other, newest) for other in found)

    def _solved(self, newest: ClockEstimate | None) -> ClockEstimate | None:
        if newest is None:
            return self.estimate
        moment_ns = newest.reference_ns
        known = [moved(own, moment_ns) for one in self._estimators if (own := one.estimate) is not None]
        best = min(known, key=lambda one: one.uncertainty_ns)
        met = _meet(best, [one for one in known if one is not best])
        # If links contradict each other only harmlessly, a clock is being steered, and the link heard last is right.
        return newest if met is None else met


def moved(estimate: ClockEstimate, board_ns: int) -> ClockEstimate:
    """Restate an estimate at another moment. Its limits at any third moment get no narrower.

    Args:
        estimate: the estimate.
        board_ns: the moment, board's time.
    """
    age_ns = board_ns - estimate.reference_ns
    if not age_ns:
        return estimate
    low_ns, high_ns = estimate.limits_at(board_ns)
    change = SKEW_CHANGE * abs(age_ns)
    return replace(
        estimate,
        reference_ns=board_ns,
        offset_ns=estimate.offset_at(board_ns),
        skew_uncertainty=estimate.skew_uncertainty + change,
        uncertainty_ns=estimate.uncertainty_at(board_ns),
        low_ns=low_ns,
        high_ns=high_ns,
        skew_low=estimate.skew_low - change,
        skew_high=estimate.skew_high + change,
    )


def _meet(best: ClockEstimate, others: Iterable[ClockEstimate]) -> ClockEstimate | None:
    """Narrow an estimate's hard limits by those of others at the same moment; None if they contradict it."""
    for other in others:
        low_ns, high_ns = max(other.low_ns, best.low_ns), min(other.high_ns, best.high_ns)
        skew_low, skew_high = max(best.skew_low, other.skew_low), min(best.skew_high, other.skew_high)
        if low_ns > high_ns or skew_low > skew_high:
            return None
        best = replace(
            best,
            offset_ns=min(max(best.offset_ns, low_ns), high_ns),
            skew=min(max(best.skew, skew_low), skew_high),
            low_ns=low_ns,
            high_ns=high_ns,
            skew_low=skew_low,
            skew_high=skew_high,
        )
    return best
