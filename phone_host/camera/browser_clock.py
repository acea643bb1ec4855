"""A browser's clock as the host sees it. Pure: clock echoes in, host times out; the estimator is the board's (`sync/clock`).

Here the browser begins the echoes, so it takes the place that the host has towards a board, and the estimate is that of
the browser's clock minus the host's. A browser blurs its clock; each reading is therefore taken as early, or as late, as
it may have been, so that the estimate's bound stays hard.
"""

from collections import OrderedDict
from typing import Final

from common.protocol.session import Echo
from phone_host.camera.browser_wire import EchoAsked, EchoHeard
from phone_host.sync.clock import ClockEstimate, ClockEstimator, Heard, HostTime

ASYMMETRY: Final = 0.2
"""Assumed greatest error from unequal least delays, as a share of the least round trip, beyond what the estimator assumes.

On its way a message passes another process and another event loop in each direction."""

_MOST_OPEN: Final = 16
"""Echoes whose end has not come; more are under way on no link."""


class BrowserClock:
    """The clock of one browser.

    Args:
        resolution_ns: how far a reading may be off.
    """

    def __init__(self, resolution_ns: int) -> None:
        self._resolution_ns = resolution_ns
        self._estimator = ClockEstimator()
        self._open: OrderedDict[int, tuple[EchoAsked, int, int]] = OrderedDict()

    @property
    def estimate(self) -> ClockEstimate | None:
        """Browser's clock minus host's clock; None before the first echo, and while echoes contradict each other."""
        return self._estimator.estimate

    @property
    def round_trip_ns(self) -> int:
        """Least recent round trip, ns; 0 while it is unknown."""
        estimate = self.estimate
        return 0 if estimate is None else estimate.round_trip_ns

    def asked(self, echo: EchoAsked, t1_ns: int, t2_ns: int) -> None:
        """Note that an echo came at `t1_ns` and was answered at `t2_ns`, host's clock, ns."""
        self._open[echo.number] = (echo, t1_ns, t2_ns)
        if len(self._open) > _MOST_OPEN:
            self._open.popitem(last=False)

    def heard(self, echo: EchoHeard) -> Heard:
        """Learn from an echo that has ended. One that was never asked, or not so, teaches nothing."""
        asked, t1_ns, t2_ns = self._open.pop(echo.number, (None, 0, 0))
        if asked is None or asked.t0_us != echo.t0_us:
            return Heard.NOTHING
        t0_ns, t3_ns = round(echo.t0_us * 1000) - self._resolution_ns, round(echo.t3_us * 1000) + self._resolution_ns
        return self._estimator.add(Echo(wave=echo.number, t0_ns=t0_ns, t1_ns=t1_ns, t2_ns=t2_ns, t3_ns=t3_ns))

    def to_host(self, browser_ns: int) -> HostTime | None:
        """Convert a moment of the browser's clock, ns, to the host's; None while the relation is unknown."""
        estimate = self.estimate
        if estimate is None:
            return None
        near_ns = browser_ns - estimate.offset_ns
        host_ns = browser_ns - estimate.offset_at(near_ns)
        bound_ns = estimate.bound_at(host_ns)
        uncertainty_ns = estimate.uncertainty_at(host_ns) + round(ASYMMETRY * estimate.round_trip_ns)
        return HostTime(host_ns, min(uncertainty_ns, bound_ns), bound_ns)
