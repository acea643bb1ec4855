"""Where the board's clock stands to the host's, from two-way echoes. Pure: samples in, estimate out.

An echo gives two hard facts: the board's t1 lies after the host's t0, and its t2 before the host's t3. With H(b) = b + offset(b) the host
time of board time b:    t0 - t1 <= offset(t1)    and    offset(t2) <= t3 - t2.
Averages are useless when frames fill the link (study of links, 3d); extremes are not. So the skew is fitted to the best echo of each wave,
and the offset is the middle of what the two families of one-way minima still allow.
"""

from collections import deque
from dataclasses import dataclass
from typing import Final

from common.protocol.session import Echo

WINDOW_NS: Final = 10_000_000_000
"""One-way minima are taken over this long: some 40 waves, in which even a full link shows a gap."""

SKEW_WINDOW_NS: Final = 120_000_000_000
"""The skew is fitted over this long; crystals change theirs over minutes."""

SKEW_SPAN_NS: Final = 5_000_000_000
"""Before this much time has passed the skew is taken as unknown, not fitted to noise."""

MAX_SKEW: Final = 200e-6
"""No two crystals differ by more than this (100 ppm each)."""


@dataclass(frozen=True, slots=True)
class ClockEstimate:
    """The relation of two clocks near a moment.

    Attributes:
        reference_ns: board time at which `offset_ns` holds.
        offset_ns: host clock minus board clock there, ns.
        skew: change of the offset per ns of board time.
        skew_uncertainty: of that skew.
        uncertainty_ns: half of the interval that the echoes leave for the offset at the reference.
        round_trip_ns: least round trip in the window.
    """

    reference_ns: int
    offset_ns: int
    skew: float
    skew_uncertainty: float
    uncertainty_ns: int
    round_trip_ns: int

    def offset_at(self, board_ns: int) -> int:
        """Host clock minus board clock at a board time, ns."""
        return self.offset_ns + round(self.skew * (board_ns - self.reference_ns))

    def uncertainty_at(self, board_ns: int) -> int:
        """Half-width of the interval that holds the true offset at a board time, ns; grows with the distance from the echoes."""
        return self.uncertainty_ns + round(self.skew_uncertainty * abs(board_ns - self.reference_ns))


@dataclass(slots=True)
class _Wave:
    """What one wave of echoes left: its tightest lower and upper fact and its best single echo."""

    number: int
    lower: tuple[int, int]
    upper: tuple[int, int]
    best: tuple[int, int, int]


class ClockEstimator:
    """Learns one board clock; a new boot of the board needs a new estimator."""

    def __init__(self) -> None:
        self._waves: deque[_Wave] = deque()
        self._estimate: ClockEstimate | None = None

    @property
    def estimate(self) -> ClockEstimate | None:
        """The present estimate; None before the first echo."""
        if self._estimate is None and self._waves:
            self._estimate = self._solve()
        return self._estimate

    def add(self, echo: Echo) -> None:
        """Learn from one echo; one whose times run backwards is no echo and is passed over.

        Args:
            echo: its four times.
        """
        round_trip_ns = (echo.t3_ns - echo.t0_ns) - (echo.t2_ns - echo.t1_ns)
        if round_trip_ns < 0 or echo.t2_ns < echo.t1_ns:
            return
        lower = (echo.t1_ns, echo.t0_ns - echo.t1_ns)
        upper = (echo.t2_ns, echo.t3_ns - echo.t2_ns)
        best = (round_trip_ns, (echo.t1_ns + echo.t2_ns) // 2, (lower[1] + upper[1]) // 2)
        self._estimate = None
        wave = self._waves[-1] if self._waves else None
        if wave is None or wave.number != echo.wave:
            self._waves.append(_Wave(echo.wave, lower, upper, best))
            self._forget(echo.t1_ns)
            return
        wave.lower = max(wave.lower, lower, key=lambda fact: fact[1])
        wave.upper = min(wave.upper, upper, key=lambda fact: fact[1])
        wave.best = min(wave.best, best)

    def _forget(self, newest_ns: int) -> None:
        while newest_ns - self._waves[0].lower[0] > SKEW_WINDOW_NS:
            self._waves.popleft()

    def _jumped(self) -> bool:
        """Whether no two crystals could have got from the wave before to the newest one: a phone slept, however long ago that wave is."""
        if len(self._waves) < 2:
            return False
        before, newest = self._waves[-2], self._waves[-1]
        low = _carried(before.lower, newest.upper[0], 0.0, -MAX_SKEW)
        high = _carried(before.upper, newest.lower[0], 0.0, MAX_SKEW)
        return low > newest.upper[1] or high < newest.lower[1]

    def _solve(self) -> ClockEstimate:
        newest = self._waves[-1]
        if self._jumped():
            self._waves = deque([newest])
        reference_ns = newest.upper[0]
        skew, skew_uncertainty = self._skew()
        recent = [wave for wave in self._waves if reference_ns - wave.lower[0] <= WINDOW_NS]
        low, high = (
            max(_carried(wave.lower, reference_ns, skew, -skew_uncertainty) for wave in recent),
            min(_carried(wave.upper, reference_ns, skew, skew_uncertainty) for wave in recent),
        )
        if low > high:
            # The facts contradict each other: a clock jumped (suspend, a debugger). Only the newest wave is of the present.
            self._waves = deque([newest])
            skew, skew_uncertainty = self._skew()
            low, high = newest.lower[1], newest.upper[1]
            recent = [newest]
        # Rounded up, so that the interval is never narrower than the facts.
        half = max(1, (high - low + 1) // 2)
        return ClockEstimate(
            reference_ns, (low + high) // 2, skew, skew_uncertainty, half, min(wave.best[0] for wave in recent)
        )

    def _skew(self) -> tuple[float, float]:
        """Fit a line through the best echo of each wave, weighted by how close each came to the least round trip."""
        first, last = self._waves[0].best[1], self._waves[-1].best[1]
        if last - first < SKEW_SPAN_NS:
            return 0.0, MAX_SKEW
        least = min(wave.best[0] for wave in self._waves)
        total = mean_x = mean_y = 0.0
        points = [
            (wave.best[1] - first, wave.best[2] - self._waves[0].best[2], 1.0 / (wave.best[0] - least / 2 + 1000) ** 2)
            for wave in self._waves
        ]
        for x, y, weight in points:
            total += weight
            mean_x += weight * x
            mean_y += weight * y
        mean_x, mean_y = mean_x / total, mean_y / total
        spread = sum(weight * (x - mean_x) ** 2 for x, _, weight in points)
        slope = sum(weight * (x - mean_x) * (y - mean_y) for x, y, weight in points) / spread
        residual = sum(weight * (y - mean_y - slope * (x - mean_x)) ** 2 for x, y, weight in points)
        # Three standard errors of the slope, plus 0.1 ppm for its own change over the window (crystal and temperature).
        error = 3 * (residual / max(1, len(points) - 2) / spread) ** 0.5 + 1e-7
        return max(-MAX_SKEW, min(MAX_SKEW, slope)), min(MAX_SKEW, error)


def _carried(fact: tuple[int, int], reference_ns: int, skew: float, margin: float) -> int:
    """Move a one-way fact to the reference time along the skew, widened by what the skew is not known by."""
    age_ns = reference_ns - fact[0]
    return fact[1] + round(skew * age_ns + margin * abs(age_ns))
