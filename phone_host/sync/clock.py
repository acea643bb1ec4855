"""Where the board's clock stands to the host's, from two-way echoes. Pure: echoes in, estimate out; time is that of the newest echo.

An echo gives two hard facts: the board's t1 lies after the host's t0, and its t2 before the host's t3. With H(b) = b + offset(b) the host
time of board time b:    t0 - t1 <= offset(t1)    and    offset(t2) <= t3 - t2.
Averages are useless when frames fill the link (study of links, 3d); extremes are not. `hull` keeps the extremes, `strip` finds the lines between
them and weighs them; this module feeds both, notices clocks that jump, and states two figures.

A fact that contradicts the others is no knowledge yet: a clock has jumped, or the echo lies. Until further waves have decided, nothing is known.

`bound`: hard. It contains the truth whatever the delays, as long as the clocks' rates differ by at most MAX_SKEW and their difference changes by at
most SKEW_CHANGE. Half of the least round trip is the best it can be.
`uncertainty`: contains the truth in 99.9 % if the link is nearly symmetric: the least delays there and back differ by at most twice ASYMMETRY of the
least round trip, and the delays above them scatter without memory from wave to wave.

Sources: Mills, RFC 5905 (four stamps, minimum filter); `hull` and `strip` name the others.
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
"""Error per least round trip that an unequal pair of least delays may make: half of their difference (bench_clock, real processes)."""

WAVES: Final = 64
"""Waves whose scatter is looked at: 32 s when old; at twice that the widening is as large as the scatter of a slow link."""

_SMALLEST: Final = 12
"""The spacing is that of so many smallest delays: with 8 the uncertainty was too small in 0.5 % on a serial line (bench_clock)."""

_LEAST_SPACING_NS: Final = 500.0
"""Nobody takes a stamp more exactly than this in an interpreter."""

CONFIRMED_WAVES: Final = 3
"""After so many waves on the new side of a jump it was no lie and no accident; they follow each other at once (`Waves.hasten`)."""

_HARMLESS_NS: Final = 4_000_000
"""Two sides of a jump that cannot be further apart are as good as each other: half of the tolerance of cameras at 60 frames a second. So a clock that is
being steered (NTP slews by 500 ppm) interrupts nothing where a round trip takes less; elsewhere it is a doubt of three waves now and then."""


class Heard(Enum):
    """What an echo meant.

    NOTHING: it was no echo. AGREED: it fits what is known. DOUBTED: it does not; until that is decided there is no estimate.
    STEPPED: a jump of the clocks is confirmed; what was known before holds no more.
    """

    NOTHING = 0
    AGREED = 1
    DOUBTED = 2
    STEPPED = 3


@dataclass(frozen=True, slots=True)
class HostTime:
    """A moment of the board on the host's clock, ns, with the half-widths of what is not known."""

    ns: int
    uncertainty_ns: int
    bound_ns: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockEstimate:
    """The relation of two clocks near a moment.

    Attributes:
        reference_ns: board time at which `offset_ns` holds.
        offset_ns: host clock minus board clock there, ns.
        skew: change of the offset per ns of board time.
        skew_uncertainty: of that skew, 99.9 % under near-symmetry.
        uncertainty_ns: of the offset at the reference, 99.9 % under near-symmetry.
        round_trip_ns: least round trip of late.
        low_ns: least offset at the reference that the facts allow; hard.
        high_ns: greatest.
        skew_low: least skew that the facts allow; hard.
        skew_high: greatest.
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
        """Half-width at the reference that contains the true offset whatever the asymmetry, ns."""
        return self.bound_at(self.reference_ns)

    def offset_at(self, board_ns: int) -> int:
        """Host clock minus board clock at a board time, ns."""
        return self.offset_ns + round(self.skew * (board_ns - self.reference_ns))

    def limits_at(self, board_ns: int) -> tuple[int, int]:
        """Least and greatest offset at a board time that the facts allow, ns; hard."""
        age_ns = board_ns - self.reference_ns
        low, high = (self.skew_low, self.skew_high) if age_ns >= 0 else (self.skew_high, self.skew_low)
        wide = widening_ns(age_ns)
        return self.low_ns + math.floor(low * age_ns - wide), self.high_ns + math.ceil(high * age_ns + wide)

    def bound_at(self, board_ns: int) -> int:
        """Half-width of the interval around `offset_at` that contains the true offset whatever the asymmetry, ns."""
        offset_ns = self.offset_at(board_ns)
        low_ns, high_ns = self.limits_at(board_ns)
        return max(high_ns - offset_ns, offset_ns - low_ns)

    def uncertainty_at(self, board_ns: int) -> int:
        """Half-width that contains the true offset in 99.9 % on a nearly symmetric link, ns; grows with the distance from the echoes."""
        age_ns = board_ns - self.reference_ns
        grown = self.skew_uncertainty * abs(age_ns) + widening_ns(age_ns)
        return min(self.uncertainty_ns + math.ceil(grown), self.bound_at(board_ns))

    def to_host(self, board_ns: int) -> HostTime:
        """Give the host's time of a moment of the board's clock, ns."""
        return HostTime(board_ns + self.offset_at(board_ns), self.uncertainty_at(board_ns), self.bound_at(board_ns))


@dataclass(slots=True)
class _Wave:
    """What one wave of echoes left: its tightest lower and upper fact (board's time, ns) and its least round trip."""

    number: int
    lower: tuple[int, int]
    upper: tuple[int, int]
    round_trip_ns: int


class _Learned:
    """All that is known of one pair of clocks between two jumps.

    Args:
        echo: the first one.
        prior_skew: what the skew was before the jump; 0 when nothing is known.
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
        """Whether an echo can be of these clocks: its facts leave something of what the earlier ones left."""
        estimate = self.estimate
        return estimate is not None and (
            echo.t0_ns - echo.t1_ns <= estimate.limits_at(echo.t1_ns)[1]
            and echo.t3_ns - echo.t2_ns >= estimate.limits_at(echo.t2_ns)[0]
        )

    def add(self, echo: Echo) -> bool:
        """Learn from an echo; gives whether all facts still agree. One that is older than the newest has been overtaken and adds nothing."""
        if echo.t1_ns < self._newest.t2_ns:
            return True
        new_wave = self.waves[-1].number != echo.wave
        tight = self._is_tight(echo)
        self._store(echo)
        if new_wave or tight:
            self.estimate = self._solved()
        return self.estimate is not None

    def _store(self, echo: Echo) -> None:
        # Stamps are rounded, so that a fact may be 1 ns too strict.
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
        """Whether an echo came closer to the truth than all before; others become part of the estimate with the next wave."""
        estimate = self.estimate
        if estimate is None or self._spacing is None:
            return True
        delay_ns = estimate.round_trip_ns / 2
        there_ns = echo.t1_ns + estimate.offset_at(echo.t1_ns) - echo.t0_ns - delay_ns
        back_ns = echo.t3_ns - echo.t2_ns - estimate.offset_at(echo.t2_ns) - delay_ns
        return there_ns < 0 or back_ns < 0

    def _solved(self) -> ClockEstimate | None:
        """Make the estimate; None if the facts contradict each other."""
        # All values are taken relative to the newest fact: offsets may be hours, and floats must tell a ns.
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
        # Low rises with the skew and high does too (all facts are past): the extremes lie at the ends.
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
        """A guess for the first wave: the delay above the least is a quarter of the round trip."""
        guess = max(_LEAST_SPACING_NS, max(row.high_ns - row.low_ns for row in rows) / 4 / len(self.waves))
        return Spacing(guess, guess, 1)

    def _measured_spacing(self, line: Allowed, reference_ns: int, origin_ns: int) -> Spacing | None:
        """Measure how close the waves' best echoes came to the touching lines; None while there are too few."""
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
    """Whether two estimates may be so far apart that frames would be paired wrongly by one of them."""
    low_ns, high_ns = old.limits_at(new.reference_ns)
    return max(high_ns - new.low_ns, new.high_ns - low_ns) > _HARMLESS_NS


class ClockEstimator:
    """Learns one board clock; a new boot of the board needs a new estimator.

    An echo that contradicts what is known begins a rival: a second state that knows of this echo and its like only. While the two may be further
    apart than is harmless there is no estimate. The rival falls with the first echo that agrees with the old state alone. Else further waves speak for the
    one or the other: the rival takes the old state's place when it and those that follow make CONFIRMED_WAVES, and falls when as many waves speak against it.

    Args:
        prior_skew: what the skew was before, where it is known.
    """

    def __init__(self, prior_skew: float = 0.0) -> None:
        self._prior_skew = prior_skew
        self._learned: _Learned | None = None
        self._rival: _Learned | None = None
        self._rival_wave = 0
        self._votes: dict[int, tuple[int, bool]] = {}

    @property
    def estimate(self) -> ClockEstimate | None:
        """The present estimate; None before the first echo, and while what was heard contradicts itself."""
        if self._rival is not None:
            return None if self.in_doubt else self._rival.estimate
        return self._learned.estimate if self._learned is not None else None

    @property
    def began_ns(self) -> int | None:
        """Board's time of the oldest echo that counts; None before the first."""
        return None if self._learned is None else self._learned.began_ns

    @property
    def skew(self) -> float:
        """The rate as far as it is known well enough to survive a jump; a crystal does not change when a clock is set."""
        learned = self._learned
        if learned is None or learned.estimate is None or len(learned.waves) < CONFIRMED_WAVES:
            return self._prior_skew
        return learned.estimate.skew

    @property
    def is_confirmed(self) -> bool:
        """Whether enough waves agree to be believed against all that was known before."""
        return self._rival is None and self._learned is not None and len(self._learned.waves) >= CONFIRMED_WAVES

    @property
    def in_doubt(self) -> bool:
        """Whether echoes contradict each other by more than is harmless, and no later ones have decided yet."""
        if self._rival is None or self._learned is None:  # asked for each frame
            return False
        old, new = self._learned.estimate, self._rival.estimate
        return old is not None and new is not None and may_harm(old, new)

    def add(self, echo: Echo) -> Heard:
        """Learn from one echo; one whose times run backwards is no echo and is passed over.

        Args:
            echo: its four times.

        Returns:
            What it meant.
        """
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
            if not self._learned.add(echo):  # within the bound, but the premise of its drift is broken
                self._learned = _Learned(echo, self.skew)
            return Heard.AGREED
        self._rival, self._rival_wave, self._votes = _Learned(echo, self.skew), echo.wave, {}
        return Heard.DOUBTED if self.in_doubt else Heard.AGREED

    def _weigh(self, rival: _Learned, echo: Echo, *, fits_both: bool) -> Heard:
        """Take an echo that agrees with the rival: which of the two its wave speaks for, and whether that decides.

        One that fits both took long; the ways there and back are alike on the whole, so that it speaks for the side nearer to its middle.
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
