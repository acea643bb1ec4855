"""A browser's clock as the host sees it, and what its stamps of images mean. Pure: clock echoes in, host times out; the estimator is the board's (`sync.clock`).

No standard says on which clock `VideoFrame.timestamp` counts, nor from when. So the epoch is classified from the first
images of a track, and every later image must fit it: an image cannot be stamped after it was handed over, nor is it kept
for a second before. Of several clocks that fit, the one on which the images are youngest is right: they differ by how long
the machine has slept.

Stamps that fit no clock have a free epoch: they tell intervals, and the image that was handed over fastest tells when.
What even that image took is unknown and stays in the stamps as a constant; `calibrate-time` measures it.

Here the browser begins the echoes, so it takes the place that the host has towards a board, and the estimate is that of
the browser's clock minus the host's. A browser blurs its clock; each reading is therefore taken as early, or as late, as
it may have been, so that the estimate's bound stays hard.
"""

from collections import OrderedDict, deque
from dataclasses import dataclass
from enum import Enum
from statistics import median
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


_FRAMES: Final = 6
"""A fifth of a second at 30 images a second. The first ones may be late, but they are never early."""

_OLDEST_NS: Final = 1_000_000_000
_SAME_NS: Final = 1_000_000
_MISFITS: Final = 4
"""So many images in a row that do not fit: the epoch is another one now."""

_WINDOW_NS: Final = 30_000_000_000
"""Two machines' clocks drift by 1.5 ms in this time; it holds hundreds of images, of which one was handed over fast."""

_SCATTER: Final = 0.05
"""The share of the fastest images that shows how exact the fastest of all is."""


class Epoch(Enum):
    """On which clock stamps count."""

    BROWSER = "the browser's own clock"
    MONOTONIC = "CLOCK_MONOTONIC"
    BOOTTIME = "CLOCK_BOOTTIME"
    FREE = "no clock of this machine"


@dataclass(frozen=True, slots=True, kw_only=True)
class Handed:
    """When an image was handed to the browser's program.

    Attributes:
        stamp_ns: its stamp, on an unknown clock.
        browser_ns: when it was handed over, browser's clock, ns.
        host: the same on the host's clock.
        captured_ns: when the browser says that it was captured, host's clock, ns; when it was handed over if it does not say.
        asleep_ns: how long the host has slept since it booted, ns.
    """

    stamp_ns: int
    browser_ns: int
    host: HostTime
    captured_ns: int
    asleep_ns: int

    def late_ns(self, epoch: Epoch) -> int:
        """Return how long after its stamp the image was handed over, if the stamp is on a clock, ns."""
        match epoch:
            case Epoch.BROWSER:
                return self.browser_ns - self.stamp_ns
            case Epoch.MONOTONIC:
                return self.host.ns - self.stamp_ns
            case _:
                return self.host.ns + self.asleep_ns - self.stamp_ns


_CLOCKS: Final = (Epoch.MONOTONIC, Epoch.BOOTTIME, Epoch.BROWSER)


class Stamps:
    """The stamps of one track.

    Args:
        is_same_machine: whether the browser may run on this machine, so that the host's clocks may be its stamps'.
    """

    def __init__(self, *, is_same_machine: bool) -> None:
        self._clocks = _CLOCKS if is_same_machine else (Epoch.BROWSER,)
        self._first: list[Handed] = []
        self._misfits = 0
        self._ages: deque[tuple[int, int]] = deque()
        self.epoch: Epoch | None = None
        self.changes = 0

    @property
    def scatter_ns(self) -> int:
        """With a free epoch: how exact the fastest image's age is, ns; else 0."""
        if self.epoch is not Epoch.FREE:
            return 0
        ages = sorted(age_ns for _, age_ns in self._ages)
        return ages[int(_SCATTER * len(ages))] - ages[0] if len(ages) > 1 else 0

    def exposed(self, seen: Handed) -> HostTime | None:
        """Return when an image was exposed, on the host's clock.

        Args:
            seen: the image.

        Returns:
            The time; None while the epoch is being found out, and for an image that does not fit it.
        """
        if self.epoch is None:
            self._first.append(seen)
            if len(self._first) < _FRAMES:
                return None
            self._classify()
        found = self._mapped(seen)
        late_ns = seen.host.ns - found.ns
        if -max(found.bound_ns, 1_000_000) <= late_ns < _OLDEST_NS:
            self._misfits = 0
            return found
        self._misfits += 1
        if self._misfits >= _MISFITS:
            self._restart()
        return None

    def _classify(self) -> None:
        first, self._first = self._first, []
        fitting = {}
        for epoch in self._clocks:
            lates_ns = [seen.late_ns(epoch) for seen in first]
            margin_ns = max(1_000_000, *(seen.host.bound_ns for seen in first))
            if min(lates_ns) >= -margin_ns and median(lates_ns) < _OLDEST_NS:
                fitting[epoch] = median(lates_ns)
        least_ns = min(fitting.values(), default=0)
        # Where the machine has not slept, two clocks are one; the first of them is as good.
        near = (epoch for epoch, late_ns in fitting.items() if late_ns <= least_ns + _SAME_NS)
        self.epoch = next(near, Epoch.FREE)
        if self.epoch is Epoch.FREE:
            for seen in first[:-1]:  # the last one is about to be mapped
                self._age(seen)

    def _restart(self) -> None:
        self.epoch, self._misfits = None, 0
        self._ages.clear()
        self.changes += 1

    def _mapped(self, seen: Handed) -> HostTime:
        match self.epoch:
            case Epoch.MONOTONIC:
                return HostTime(seen.stamp_ns, 0, 0)
            case Epoch.BOOTTIME:
                return HostTime(seen.stamp_ns - seen.asleep_ns, 0, 0)
            case Epoch.BROWSER:
                moved_ns = seen.stamp_ns - seen.browser_ns
                return HostTime(seen.host.ns + moved_ns, seen.host.uncertainty_ns, seen.host.bound_ns)
            case _:
                self._age(seen)
                least_ns = min(age_ns for _, age_ns in self._ages)
                unsure_ns = seen.host.uncertainty_ns + self.scatter_ns
                return HostTime(seen.stamp_ns + least_ns, unsure_ns, seen.host.bound_ns + self.scatter_ns)

    def _age(self, seen: Handed) -> None:
        self._ages.append((seen.host.ns, seen.captured_ns - seen.stamp_ns))
        while self._ages[0][0] < seen.host.ns - _WINDOW_NS:
            self._ages.popleft()
