"""The board's clock as seen over several links at once. Pure: echoes in, one estimate out.

All echoes are facts about the same two clocks, so the truth lies where the hard limits of all links meet: `bound` is that of the intersection. That
the ways there and back are alike holds for each link by itself and for none between two, so offset, skew and `uncertainty` are those of one
link: the one that knows best at the newest echo. An offset outside what the others' facts allow is moved to the nearest that they do
allow, which is never further from the truth.
"""

from collections.abc import Iterable
from dataclasses import replace

from common.protocol.session import Echo
from phone_host.sync.clock import ClockEstimate, ClockEstimator
from phone_host.sync.hull import SKEW_CHANGE


class LinkClocks:
    """Learns one board clock over some links; a new boot of the board needs a new one.

    Args:
        links: how many.
    """

    def __init__(self, links: int) -> None:
        self._estimators = tuple(ClockEstimator() for _ in range(links))
        self._estimate: ClockEstimate | None = None

    @property
    def estimate(self) -> ClockEstimate | None:
        """The present estimate; None before the first echo."""
        return self._estimate

    def round_trip_ns(self, link: int) -> int | None:
        """Least round trip of late over one link; None before its first echo."""
        own = self._estimators[link].estimate
        return None if own is None else own.round_trip_ns

    def add(self, echo: Echo) -> None:
        """Learn from one echo.

        Args:
            echo: its four times, and the link that it came over.
        """
        estimator = self._estimators[echo.link]
        estimator.add(echo)
        newest = estimator.estimate
        if newest is None:
            return
        moment_ns = newest.reference_ns
        known = [moved(other.estimate, moment_ns) for other in self._estimators if other.estimate is not None]
        best = min(known, key=lambda one: one.uncertainty_ns)
        met = _meet(best, [one for one in known if one is not best])
        # Links that contradict each other: a clock jumped, and the one that was heard last knows.
        self._estimate = newest if met is None else met


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
