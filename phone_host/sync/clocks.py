"""The board's clock as seen over several links at once. Pure: echoes in, one estimate out.

All echoes are facts about the same two clocks, so the truth lies where the hard limits of all links meet: `bound` is that of the intersection. That
the ways there and back are alike holds for each link by itself and for none between two, so offset, skew and `uncertainty` are those of one
link: the one that knows best at the newest echo. An offset outside what the others' facts allow is moved to the nearest that they do
allow, which is never further from the truth. While echoes contradict each other, those of one link or those of two, nothing is known over any; a jump
that one link has confirmed is one for all.
"""

from collections.abc import Iterable
from dataclasses import replace

from common.protocol.session import Echo
from phone_host.sync.clock import ClockEstimate, ClockEstimator, Heard, may_harm
from phone_host.sync.hull import SKEW_CHANGE


class LinkClocks:
    """Learns one board clock over some links; a new boot of the board needs a new one.

    Args:
        links: how many.

    Attributes:
        since_ns: board's time of the first echo after the last doubt: what was stamped before may be of a clock that has stepped since. None: no doubt yet.
    """

    def __init__(self, links: int) -> None:
        self._estimators = [ClockEstimator() for _ in range(links)]
        self._estimate: ClockEstimate | None = None
        self._believed: ClockEstimate | None = None
        self._contested = self._void = False
        self.since_ns: int | None = None

    @property
    def estimate(self) -> ClockEstimate | None:
        """The present estimate; None before the first echo, and while echoes contradict each other."""
        return self._estimate

    @property
    def in_doubt(self) -> bool:
        """Whether echoes contradict each other, or what was known is void, and no later ones have decided yet."""
        return self._void or self._contested or any(estimator.in_doubt for estimator in self._estimators)

    def round_trip_ns(self, link: int) -> int | None:
        """Least round trip of late over one link; None before its first echo."""
        own = self._estimators[link].estimate
        return None if own is None else own.round_trip_ns

    def add(self, echo: Echo) -> Heard:
        """Learn from one echo.

        Args:
            echo: its four times, and the link that it came over.

        Returns:
            What it meant.
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
            # What was known may hold still: it was another link that lied, or neither clock has stood still.
            heard = Heard.AGREED if self._fits_what_was_believed(estimator.estimate) else Heard.STEPPED
            self._void = False
            self.since_ns = estimator.began_ns
        self._estimate = None if self.in_doubt else self._solved(estimator.estimate)
        self._believed = self._estimate or self._believed
        return heard

    def void(self, *, stepped: bool = False) -> None:
        """Forget the offset: one of the two clocks may have stood still. What is known of their rates stays.

        Args:
            stepped: whether one certainly has; else the next echo tells.
        """
        if self._believed is None:
            return
        self._believed = None if stepped else self._believed
        self._forget(keep=None)
        self._void, self._contested = True, False
        self._estimate = None

    def down(self, link: int) -> None:
        """Take note that a link is gone: a doubt that only its echoes could have settled is left to the next echo of any."""
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
        """Whether what one link says can be true with what no other says."""
        newest = estimator.estimate
        if newest is None:
            return False
        others = [one.estimate for one in self._estimators if one is not estimator and one.estimate is not None]
        found = [moved(other, newest.reference_ns) for other in others]
        return _meet(newest, found) is None and any(may_harm(other, newest) for other in found)

    def _solved(self, newest: ClockEstimate | None) -> ClockEstimate | None:
        if newest is None:
            return self._estimate
        moment_ns = newest.reference_ns
        known = [moved(own, moment_ns) for one in self._estimators if (own := one.estimate) is not None]
        best = min(known, key=lambda one: one.uncertainty_ns)
        met = _meet(best, [one for one in known if one is not best])
        # Links that contradict each other by as little as is harmless: a clock is being steered, and the link that was heard last knows.
        return newest if met is None else met


def moved(estimate: ClockEstimate, board_ns: int) -> ClockEstimate:
    """Tell an estimate at another moment; what it says of any third moment gets no narrower by that.

    Args:
        estimate: what is known.
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
    """Narrow an estimate's hard limits by those of others at the same moment; None where they contradict it."""
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
