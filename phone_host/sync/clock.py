"""Estimates the offset between the board's and the host's clock from two-way echoes.

Pure: echoes in, estimate out; the present is the time of the newest echo.

An echo gives two hard facts: the board's t1 lies after the host's t0, and the board's t2 before the host's t3. Let
H(b) = b + offset(b) be the host time of board time b. Then t0 - t1 <= offset(t1) and offset(t2) <= t3 - t2.
Averages are useless when frames fill the link (study of links, 3d), but extremes are not. `hull` keeps the extremes.
`allowed_lines` finds and weighs the lines between them. This module feeds both, detects clock jumps, and provides two
figures, `bound` and `uncertainty`.

A fact that contradicts the others proves nothing yet: either a clock has jumped, or the echo lies. Until further waves
have decided, there is no estimate.

`bound` is hard. It contains the true offset whatever the delays, as long as the clocks' rates differ by at most
MAX_SKEW and that difference changes by at most SKEW_CHANGE. At best it is half of the least round trip. `uncertainty`
contains the true offset in 99.9 % of cases if the link is nearly symmetric: the least delays in the two directions
differ by at most twice ASYMMETRY of the least round trip, and the delays above them are independent from wave to wave.

Sources: Mills, RFC 5905 (four stamps, minimum filter); `hull` and `allowed_lines` name the others.
"""

import math
from collections import deque
from dataclasses import dataclass
from enum import Enum
from typing import Final

from common.protocol.session import Echo
from phone_host.sync.allowed_lines import MAX_SKEW, Allowed, Belief, Spacing, allowed_lines, believe
from phone_host.sync.hull import SKEW_CHANGE, Hull, widening_ns

__all__ = ["ASYMMETRY", "CONFIRMED_WAVES", "MAX_SKEW", "ClockEstimate", "ClockEstimator", "Heard", "HostTime"]

ASYMMETRY: Final = 0.04
"""Assumed greatest error from unequal least delays, as a share of the least round trip.

The error is half of the delays' difference (bench_clock, real processes)."""

WAVES: Final = 64
"""Waves whose scatter is evaluated: 32 s in steady state. At twice that, the widening equals a slow link's scatter."""

_SMALLEST: Final = 12
"""Number of smallest delays that give the spacing. With 8, 0.5 % of uncertainties on a serial line were too small
(bench_clock)."""

_LEAST_SPACING_NS: Final = 500.0
"""An interpreter cannot take a stamp more precisely than this."""

CONFIRMED_WAVES: Final = 3
"""After this many waves on the new side, a jump is real, not a lie or an accident. They follow at once
(`Waves.hasten`)."""

_HARMLESS_NS: Final = 4_000_000
"""A jump that cannot exceed this is harmless: half of the tolerance of cameras at 60 frames a second.

So a clock that is being steered (NTP slews by 500 ppm) interrupts nothing if a round trip is shorter than this.
Otherwise it causes an occasional doubt of three waves."""


class Heard(Enum):
    """The meaning of an echo.

    NOTHING: not a valid echo. AGREED: it fits what is known. DOUBTED: it does not fit; there is no estimate until that
    is decided. STEPPED: a jump of the clocks is confirmed; earlier knowledge is void.
    """

    NOTHING = 0
    AGREED = 1
    DOUBTED = 2
    STEPPED = 3


@dataclass(frozen=True, slots=True)
class HostTime:
    """A moment of the board on the host's clock, ns, with the half-widths of its error."""

    ns: int
    uncertainty_ns: int
    bound_ns: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockEstimate:
    """The relation between the two clocks near a moment.

    Attributes:
        reference_ns: board time at which `offset_ns` holds.
        offset_ns: host clock minus board clock there, ns.
        skew: change of the offset per ns of board time.
        skew_uncertainty: uncertainty of that skew, 99.9 % on a nearly symmetric link.
        uncertainty_ns: uncertainty of the offset at the reference, 99.9 % on a nearly symmetric link.
        round_trip_ns: least recent round trip.
        low_ns: least offset at the reference that the facts allow; hard.
        high_ns: greatest offset at the reference that the facts allow; hard.
        skew_low: least skew that the facts allow; hard.
        skew_high: greatest skew that the facts allow; hard.
    """

    reference_ns: int
    offset_ns: int
    skew: float
    skew_uncertainty: float
    uncertainty_ns: int
    round_trip_ns: int
    low_ns: int
    high_ns: int
    skew_low: float
    skew_high: float

    @property
    def bound_ns(self) -> int:
        """Half-width at the reference that contains the true offset whatever the link's asymmetry, ns."""
        return self.bound_at(self.reference_ns)

    def offset_at(self, board_ns: int) -> int:
        """Return host clock minus board clock at a board time, ns."""
        return self.offset_ns + round(self.skew * (board_ns - self.reference_ns))

    def limits_at(self, board_ns: int) -> tuple[int, int]:
        """Return the least and greatest offset at a board time that the facts allow, ns; hard."""
        age_ns = board_ns - self.reference_ns
        low, high = (self.skew_low, self.skew_high) if age_ns >= 0 else (self.skew_high, self.skew_low)
        wide = widening_ns(age_ns)
        return self.low_ns + math.floor(low * age_ns - wide), self.high_ns + math.ceil(high * age_ns + wide)

    def bound_at(self, board_ns: int) -> int:
        """Return the half-width around `offset_at` that contains the true offset whatever the link's asymmetry, ns."""
        offset_ns = self.offset_at(board_ns)
        low_ns, high_ns = self.limits_at(board_ns)
        return max(high_ns - offset_ns, offset_ns - low_ns)

    def uncertainty_at(self, board_ns: int) -> int:
        """Return the half-width that contains the true offset in 99.9 % on a nearly symmetric link, ns.

        It grows with the distance from the echoes.
        """
        age_ns = board_ns - self.reference_ns
        grown = self.skew_uncertainty * abs(age_ns) + SKEW_CHANGE / 2 * age_ns * age_ns  # widening_ns, once per frame
        total_ns = self.uncertainty_ns + math.ceil(grown)
        # The bound is at least half of the limits' distance, which never gets smaller. It takes longer to compute than all of this.
        return total_ns if 2 * total_ns <= self.high_ns - self.low_ns else min(total_ns, self.bound_at(board_ns))

    def to_host(self, board_ns: int) -> HostTime:
        """Convert a moment of the board's clock, ns, to the host's clock."""
        return HostTime(board_ns + self.offset_at(board_ns), self.uncertainty_at(board_ns), self.bound_at(board_ns))


@dataclass(slots=True)
class _Wave:
    """The result of a wave of echoes: its tightest lower and upper facts (board's time, ns) and least round trip."""

    number: int
    lower: tuple[int, int]
    upper: tuple[int, int]
    round_trip_ns: int


class _Learned:
    """Everything known about the two clocks between two jumps.

    Args:
        echo: the first echo.
        prior_skew: the skew before the jump; 0 if unknown.
    """

    def __init__(self, echo: Echo, prior_skew: float) -> None:
        self._lower, self._upper = Hull(), Hull()
        self._prior_skew = prior_skew
        self._spacing: Spacing | None = None
        self.waves: deque[_Wave] = deque(maxlen=WAVES)
        self.began_ns = echo.t1_ns
        self._store(echo)
        self.estimate = self._solved()
        assert self.estimate is not None

    def agrees_with(self, echo: Echo) -> bool:
        """Return whether an echo can belong to these clocks, i.e. its facts do not contradict the earlier ones."""
        estimate = self.estimate
        return estimate is not None and (
            echo.t0_ns - echo.t1_ns <= estimate.limits_at(echo.t1_ns)[1]
            and echo.t3_ns - echo.t2_ns >= estimate.limits_at(echo.t2_ns)[0]
        )

    def add(self, echo: Echo) -> bool:
        """Learn from an echo. Return whether all facts still agree.

        An echo older than the newest one was overtaken and adds nothing.
        """
        if echo.t1_ns < self._newest.t2_ns:
            return True
        new_wave = self.waves[-1].number != echo.wave
        tight = self._is_tight(echo)
        self._store(echo)
        if new_wave or tight:
            self.estimate = self._solved()
        return self.estimate is not None

    def _store(self, echo: Echo) -> None:
        # Stamps are rounded, so a fact may be 1 ns too strict.
        lower, upper = (echo.t1_ns, echo.t0_ns - echo.t1_ns - 1), (echo.t2_ns, echo.t3_ns - echo.t2_ns + 1)
        round_trip_ns = (echo.t3_ns - echo.t0_ns) - (echo.t2_ns - echo.t1_ns)
        self._lower.add(*lower)
        self._upper.add(upper[0], -upper[1])
        self._newest = echo
        if not self.waves or self.waves[-1].number != echo.wave:
            self.waves.append(_Wave(echo.wave, lower, upper, round_trip_ns))
            return
        wave = self.waves[-1]
        wave.lower = max(wave.lower, lower, key=lambda fact: fact[1])
        wave.upper = min(wave.upper, upper, key=lambda fact: fact[1])
        wave.round_trip_ns = min(wave.round_trip_ns, round_trip_ns)

    def _is_tight(self, echo: Echo) -> bool:
        """Return whether an echo is tighter than all before. Others enter the estimate with the next wave."""
        estimate = self.estimate
        if estimate is None or self._spacing is None:
            return True
        delay_ns = estimate.round_trip_ns / 2
        there_ns = echo.t1_ns + estimate.offset_at(echo.t1_ns) - echo.t0_ns - delay_ns
        back_ns = echo.t3_ns - echo.t2_ns - estimate.offset_at(echo.t2_ns) - delay_ns
        return there_ns < 0 or back_ns < 0

    def _solved(self) -> ClockEstimate | None:
        """Compute the estimate; None if the facts contradict each other."""
        # All values are relative to the newest fact: offsets may be hours, and floats must resolve a ns.
        reference_ns, origin_ns = self._newest.t2_ns, self._newest.t3_ns - self._newest.t2_ns
        lower = self._lower.seen_from(reference_ns, origin_ns)
        upper = self._upper.seen_from(reference_ns, -origin_ns)
        rows = allowed_lines(lower, upper, self._prior_skew)
        if not rows:
            return None
        spacing = self._spacing or self._first_spacing(rows)
        middle_ns = sum(wave.upper[0] - reference_ns for wave in self.waves) / len(self.waves)
        belief = believe(rows, spacing, middle_ns, self._prior_skew)
        self._spacing = self._measured_spacing(belief.best, reference_ns, origin_ns)
        return self._told(rows, belief, reference_ns, origin_ns)

    def _told(self, rows: list[Allowed], belief: Belief, reference_ns: int, origin_ns: int) -> ClockEstimate:
        error = math.ceil(belief.offset_error_ns + ASYMMETRY * (belief.best.high_ns - belief.best.low_ns)) + 1
        offset_ns = round(belief.offset_ns)
        # Both low and high rise with the skew, because all facts are in the past: the extremes lie at the ends.
        low_ns, high_ns = math.floor(rows[0].low_ns), math.ceil(rows[-1].high_ns)
        return ClockEstimate(
            reference_ns=reference_ns,
            offset_ns=origin_ns + offset_ns,
            skew=belief.skew,
            skew_uncertainty=belief.skew_error,
            uncertainty_ns=min(error, max(high_ns - offset_ns, offset_ns - low_ns)),
            round_trip_ns=min(wave.round_trip_ns for wave in self.waves),
            low_ns=origin_ns + low_ns,
            high_ns=origin_ns + high_ns,
            skew_low=rows[0].skew,
            skew_high=rows[-1].skew,
        )

    def _first_spacing(self, rows: list[Allowed]) -> Spacing:
        """Guess the spacing for the first wave: the delay above the least is a quarter of the round trip."""
        guess = max(_LEAST_SPACING_NS, max(row.high_ns - row.low_ns for row in rows) / 4 / len(self.waves))
        return Spacing(guess, guess, 1)

    def _measured_spacing(self, line: Allowed, reference_ns: int, origin_ns: int) -> Spacing | None:
        """Measure how close the waves' best echoes came to the touching lines; None if there are too few waves."""
        count = min(_SMALLEST, len(self.waves) // 2)
        if count < 2:
            return None
        skew, half = line.skew, SKEW_CHANGE / 2
        from_low, from_high = line.low_ns + origin_ns, line.high_ns + origin_ns
        there = [
            from_low + (skew + half * (x - reference_ns)) * (x - reference_ns) - y
            for x, y in [wave.lower for wave in self.waves]
        ]
        back = [
            y - from_high - (skew - half * (x - reference_ns)) * (x - reference_ns)
            for x, y in [wave.upper for wave in self.waves]
        ]
        there_ns, back_ns = (max(_LEAST_SPACING_NS, sorted(side)[count] / (count - 1)) for side in (there, back))
        return Spacing(there_ns, back_ns, count - 1)


def may_harm(old: ClockEstimate, new: ClockEstimate) -> bool:
    """Return whether two estimates may be so far apart that one of them would pair frames wrongly."""
    low_ns, high_ns = old.limits_at(new.reference_ns)
    return max(high_ns - new.low_ns, new.high_ns - low_ns) > _HARMLESS_NS


class ClockEstimator:
    """Estimates one board clock. A new boot of the board needs a new estimator.

    An echo that contradicts what is known starts a rival: a second state that learns only from this echo and those that
    agree with it. While the two states may be further apart than is harmless, there is no estimate. The first echo that
    agrees only with the old state discards the rival. Otherwise each further wave votes for one state: the rival
    replaces the old state when its first wave and the votes for it make CONFIRMED_WAVES, and is discarded after
    CONFIRMED_WAVES - 1 votes against it.

    Args:
        prior_skew: the earlier skew, if known.
    """

    def __init__(self, prior_skew: float = 0.0) -> None:
        self._prior_skew = prior_skew
        self._learned: _Learned | None = None
        self._rival: _Learned | None = None
        self._rival_wave = 0
        self._votes: dict[int, tuple[int, bool]] = {}

    @property
    def estimate(self) -> ClockEstimate | None:
        """The present estimate; None before the first echo, and while echoes contradict each other."""
        if self._rival is not None:
            return None if self.in_doubt else self._rival.estimate
        return self._learned.estimate if self._learned is not None else None

    @property
    def began_ns(self) -> int | None:
        """Board's time of the oldest echo in use; None before the first."""
        return None if self._learned is None else self._learned.began_ns

    @property
    def skew(self) -> float:
        """The skew, once known well enough to outlast a jump: setting a clock does not change its crystal."""
        learned = self._learned
        if learned is None or learned.estimate is None or len(learned.waves) < CONFIRMED_WAVES:
            return self._prior_skew
        return learned.estimate.skew

    @property
    def is_confirmed(self) -> bool:
        """Whether enough waves agree to be believed over everything known before."""
        return self._rival is None and self._learned is not None and len(self._learned.waves) >= CONFIRMED_WAVES

    @property
    def in_doubt(self) -> bool:
        """Whether echoes contradict each other by more than is harmless and later ones have not decided yet."""
        if self._rival is None or self._learned is None:  # short cut: this is asked for each frame
            return False
        old, new = self._learned.estimate, self._rival.estimate
        return old is not None and new is not None and may_harm(old, new)

    def add(self, echo: Echo) -> Heard:
        """Learn from one echo. An echo whose stamps run backwards is invalid and ignored."""
        if echo.t3_ns - echo.t0_ns < echo.t2_ns - echo.t1_ns or echo.t2_ns < echo.t1_ns:
            return Heard.NOTHING
        if self._learned is None:
            self._learned = _Learned(echo, self._prior_skew)
            return Heard.AGREED
        fits = self._learned.agrees_with(echo)
        if self._rival is not None and self._rival.agrees_with(echo) and self._rival.add(echo):
            return self._weigh(self._rival, echo, fits_both=fits)
        if fits:
            self._rival = None
            if not self._learned.add(echo):  # within the bound, but SKEW_CHANGE was exceeded
                self._learned = _Learned(echo, self.skew)
            return Heard.AGREED
        self._rival, self._rival_wave, self._votes = _Learned(echo, self.skew), echo.wave, {}
        return Heard.DOUBTED if self.in_doubt else Heard.AGREED

    def _weigh(self, rival: _Learned, echo: Echo, *, fits_both: bool) -> Heard:
        """Take an echo that agrees with the rival: determine its wave's vote and whether that decides.

        An echo that fits both states was slow. The delays of both directions are similar on the whole, so it votes for
        the state nearer to its middle.
        """
        known, new = (self._learned.estimate if self._learned is not None else None), rival.estimate
        assert known is not None
        assert new is not None
        middle_ns = ((echo.t0_ns - echo.t1_ns) + (echo.t3_ns - echo.t2_ns)) / 2
        nearer = abs(middle_ns - new.offset_at(echo.t1_ns)) < abs(middle_ns - known.offset_at(echo.t1_ns))
        round_trip_ns = (echo.t3_ns - echo.t0_ns) - (echo.t2_ns - echo.t1_ns)
        if echo.wave != self._rival_wave:
            self._votes[echo.wave] = min(
                self._votes.get(echo.wave, (round_trip_ns, True)), (round_trip_ns, nearer or not fits_both)
            )
        votes = [for_rival for _, for_rival in self._votes.values()]
        enough = CONFIRMED_WAVES - 1
        if votes.count(False) >= enough:
            self._rival = None
            return Heard.AGREED
        if votes.count(True) < enough:
            return Heard.DOUBTED if self.in_doubt else Heard.AGREED
        was_harmless = not self.in_doubt
        self._learned, self._rival = rival, None
        return Heard.AGREED if was_harmless else Heard.STEPPED
