"""The phase of two free-running cameras: how to measure it and its drift, and how to steer it to 0.

Pure, `now_ns` passed in.

Two cameras of equal rate keep whatever time skew they started with, up to half a period, and no clock estimate changes
that. The phase is measured from the stamps of all frames, paired or not, modulo the shorter period. If a camera can be
steered, the controller lets it expose later by the missing time and waits until newly exposed frames show the outcome.
It corrects again when the crystals have drifted apart. It never steers by frames that were exposed before its last
correction took effect.
"""

import math
from bisect import bisect_left
from collections import deque
from dataclasses import dataclass
from enum import Enum
from statistics import fmean, median
from typing import Final

import numpy as np

from common.protocol.message import Steering

_MS: Final = 1_000_000

_RECENT: Final = 15
"""The present phase is the median of this many frames: half a second at 30 fps. Single late stamps do not affect it."""

_DRIFT_SAMPLES: Final = 1800
_DRIFT_SPAN_NS: Final = 5_000 * _MS
"""Webcam stamps scatter by 1 ms. At 30 fps, 5 s give the drift to about 20 ppm, a minute to 1 ppm."""

_KEPT_HOST: Final = 256
"""A board frame may arrive seconds after the host frame of the same moment (Bluetooth)."""

_RATIO_OFF: Final = 0.01
"""Rates have no phase if their ratio differs from a whole number by more than this share of it.

24 and 30 fps run through all phases six times a second."""

_NEAR_NS: Final = 4 * _MS
_NEAR_PART: Final = 8
"""The phase is good enough up to 4 ms or an eighth of the period, whichever is less, plus the scatter of the stamps.

Beyond that, the controller corrects again. Restarts of webcams scatter by 1 to 3 ms. If two or more corrections have missed by more
than this on average, what is no worse than that average is good enough, up to an eighth of the period: another restart would cost
frames and most likely bring no better phase."""

_SETTLE_NS: Final = {Steering.GRID: 200 * _MS, Steering.RESTART: 1_000 * _MS}
"""Frames exposed after this time belong to the steered stream. A webcam's first frames may have odd stamps."""

_PATIENCE_NS: Final = 10_000 * _MS
"""A correction has failed if no new frames come for this long. One that does not hold for this long counts as a try."""

_TRIES: Final = 12
"""Most tries. On a loaded board starts scatter: by 20 ms, at 10 fps, six tries left one of nine simulated cameras out of step, twelve none of 60."""

_NEWEST_MISSES: Final = 6
"""The average is that of so many corrections."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Phase:
    """The two cameras' phase now.

    Attributes:
        time_skew_ns: board's exposures minus the host's, modulo the period, in [-period/2, period/2); median of the
            newest frames.
        period_ns: the shorter of the two periods.
        drift: change of the time skew per ns; NaN until it is known.
        first_ns: exposure of the oldest frame used for the median, host's clock.
        scatter_ns: median absolute deviation of those frames' skews; shows how accurate the stamps are.
    """

    time_skew_ns: float
    period_ns: int
    drift: float
    first_ns: int
    scatter_ns: float = 0.0

    @property
    def beat_s(self) -> float:
        """Time until the phase is the same again, s; NaN until the drift is known, infinite without drift."""
        return self.period_ns / abs(self.drift) / 1e9 if self.drift else math.inf


class PhaseMeter:
    """Measures the phase from all stamps.

    Args:
        board_period_ns: time between two frames of the board's camera.
        host_period_ns: the same for the host's camera.
    """

    def __init__(self, board_period_ns: int, host_period_ns: int) -> None:
        self._period_ns = min(board_period_ns, host_period_ns)
        ratio = max(board_period_ns, host_period_ns) / self._period_ns
        self.has_phase = abs(ratio - round(ratio)) <= _RATIO_OFF * ratio
        self._host: deque[int] = deque(maxlen=_KEPT_HOST)
        self._samples: deque[tuple[int, float]] = deque(maxlen=_DRIFT_SAMPLES)
        # The same samples in rings. Their order does not matter for a line fit. Arrays, because each frame asks for the
        # drift.
        self._moments_ns = np.zeros(_DRIFT_SAMPLES, dtype=np.int64)
        self._skews_ns = np.zeros(_DRIFT_SAMPLES)
        self._taken = 0

    @property
    def phase(self) -> Phase | None:
        """The phase now; None before there are enough frames, or if the rates have no phase."""
        if not self.has_phase or len(self._samples) < _RECENT:
            return None
        recent = [self._samples[index] for index in range(len(self._samples) - _RECENT, len(self._samples))]
        middle = median(value for _, value in recent)
        scatter_ns = median(abs(value - middle) for _, value in recent)
        return Phase(
            time_skew_ns=self._wrapped(middle),
            period_ns=self._period_ns,
            drift=self._drift(),
            first_ns=recent[0][0],
            scatter_ns=scatter_ns,
        )

    def add_host(self, stamp_ns: int) -> None:
        """Take note of a host frame. Stamps that go backwards are ignored."""
        if not self._host or stamp_ns > self._host[-1]:
            self._host.append(stamp_ns)

    def add_board(self, stamp_ns: int) -> None:
        """Take note of a board frame with its stamp on the host's clock, ns."""
        if not self._host or (self._samples and stamp_ns <= self._samples[-1][0]):
            return
        after = bisect_left(self._host, stamp_ns)
        nearest = min(self._near(after), key=lambda t: abs(t - stamp_ns))
        skew = self._wrapped(stamp_ns - nearest)
        if self._samples:  # unwrap: no jump where it passes half a period
            skew = self._samples[-1][1] + self._wrapped(skew - self._samples[-1][1])
        self._samples.append((stamp_ns, skew))
        place = self._taken % _DRIFT_SAMPLES
        self._moments_ns[place], self._skews_ns[place] = stamp_ns, skew
        self._taken += 1

    def restart(self) -> None:
        """Forget the measurements, because a camera has been steered."""
        self._samples.clear()
        self._taken = 0

    def _near(self, after: int) -> list[int]:
        """Return the host stamps just before and at index `after`."""
        return [self._host[index] for index in (after - 1, after) if 0 <= index < len(self._host)]

    def _wrapped(self, skew_ns: float) -> float:
        half = self._period_ns / 2
        return (skew_ns + half) % self._period_ns - half

    def _drift(self) -> float:
        first_ns, last_ns = self._samples[0][0], self._samples[-1][0]
        if last_ns - first_ns < _DRIFT_SPAN_NS:
            return math.nan
        count = len(self._samples)
        times = (self._moments_ns[:count] - first_ns).astype(np.float64)
        times -= times.mean()
        return float(times @ self._skews_ns[:count] / (times @ times))  # least-squares slope


class Aligning(Enum):
    """The state of the steering."""

    MEASURING = "measuring"
    STEERING = "steering"
    ALIGNED = "aligned"
    GIVEN_UP = "given up"
    IMPOSSIBLE = "impossible"


class Whose(Enum):
    """The camera to steer."""

    BOARD = "board"
    HOST = "host"


@dataclass(frozen=True, slots=True)
class Correction:
    """Let this camera expose later by `later_ns`."""

    whose: Whose
    later_ns: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Alignment:
    """The outcome of the steering, for reports.

    Attributes:
        state: the state.
        words: the state in words, with a remedy if it failed.
        corrections: how often a camera was steered.
        before_ns: time skew before the first correction; NaN: no correction yet.
        after_ns: time skew when last measured; NaN: not measured yet.
    """

    state: Aligning
    words: str
    corrections: int
    before_ns: float
    after_ns: float


class PhaseController:
    """Steers one of the two cameras until the phase is nearly 0, and keeps it there.

    Args:
        board: how the board's camera can be steered.
        host: how the host's camera can be steered.
        has_phase: whether the two rates have a phase at all.
    """

    def __init__(self, board: Steering, host: Steering, *, has_phase: bool) -> None:
        ways = [(board, Whose.BOARD), (host, Whose.HOST)]
        # Prefer a grid: it moves exactly and without a gap. Then prefer the host camera, which needs no link.
        self._steering, self._whose = next(
            (way for kind in (Steering.GRID, Steering.RESTART) for way in reversed(ways) if way[0] is kind),
            (Steering.NONE, Whose.HOST),
        )
        self._state = Aligning.MEASURING
        self._words = "not measured yet"
        if not has_phase:
            self._state, self._words = (
                Aligning.IMPOSSIBLE,
                "the cameras' rates have no common phase: give both the same fps",
            )
        elif self._steering is Steering.NONE:
            self._state = Aligning.IMPOSSIBLE
            self._words = (
                "no camera that may be steered can be: --interpolate moves the board's image to the host's time instead"
            )
        self._settled_ns = -(2**63)
        self._deadline_ns = 2**63
        self._aligned_ns: int | None = None
        self._tries = self._corrections = 0
        self._misses_ns: deque[float] = deque(maxlen=_NEWEST_MISSES)
        self._before_ns = self._after_ns = math.nan

    @property
    def alignment(self) -> Alignment:
        """The outcome so far."""
        return Alignment(
            state=self._state,
            words=self._words,
            corrections=self._corrections,
            before_ns=self._before_ns,
            after_ns=self._after_ns,
        )

    def update(self, now_ns: int, phase: Phase | None) -> Correction | None:
        """Evaluate the phase. Call this a few times a second.

        Args:
            now_ns: host's clock, ns.
            phase: the phase measured now; None: unknown.

        Returns:
            The correction to apply now, or None. After a correction, restart the meter.
        """
        if self._state in {Aligning.GIVEN_UP, Aligning.IMPOSSIBLE}:
            return None
        if phase is None or phase.first_ns < self._settled_ns:
            if now_ns > self._deadline_ns:
                self._give_up("no frames came after a correction")
            return None
        skew_ns = self._after_ns = phase.time_skew_ns
        if self._deadline_ns < 2**63:  # the outcome of a correction
            self._misses_ns.append(abs(skew_ns))
            self._deadline_ns = 2**63
        if abs(skew_ns) <= self._near_ns(phase.period_ns) + phase.scatter_ns:
            if self._state is not Aligning.ALIGNED:
                self._state, self._aligned_ns = Aligning.ALIGNED, now_ns
            if self._aligned_ns is not None and now_ns - self._aligned_ns >= _PATIENCE_NS:
                self._tries = 0
            self._words = f"in step to {abs(skew_ns) / _MS:.1f} ms, corrections: {self._corrections}"
            return None
        if self._tries >= _TRIES:
            self._give_up(f"{_TRIES} corrections left {abs(skew_ns) / _MS:.1f} ms")
            return None
        return self._correct(now_ns, skew_ns, phase.period_ns)

    def _near_ns(self, period_ns: int) -> float:
        """Return up to which time skew the phase is good enough, ns."""
        reached_ns = fmean(self._misses_ns) if len(self._misses_ns) > 1 else 0.0
        return min(max(_NEAR_NS, reached_ns), period_ns / _NEAR_PART)

    def _correct(self, now_ns: int, skew_ns: float, period_ns: int) -> Correction:
        if not self._corrections:
            self._before_ns = skew_ns
        self._state = Aligning.STEERING
        self._words = f"steering the {self._whose.value}'s camera by {abs(skew_ns) / _MS:.1f} ms"
        self._tries += 1
        self._corrections += 1
        self._settled_ns = now_ns + _SETTLE_NS[self._steering]
        self._deadline_ns = self._settled_ns + _PATIENCE_NS
        later_ns = -skew_ns if self._whose is Whose.BOARD else skew_ns
        return Correction(self._whose, round(later_ns) % period_ns)

    def _give_up(self, why: str) -> None:
        self._state = Aligning.GIVEN_UP
        self._words = f"the {self._whose.value}'s camera does not follow ({why}): use --interpolate, or equal fps"
