"""Which lines fit between the two families of facts about a clock's offset, and which of them to believe. Pure arithmetic.

All lines are told by their skew and their value at one moment, the reference; times are relative to it. For each skew s the facts leave
an interval [low(s), high(s)] for the value; low is convex and high concave, both piecewise linear, bending at the hulls' slopes. `allowed_lines` walks
along all bends: exact linear programming in two variables, in the number of hull points.

`believe` weighs: one-way delays above their least behave near it like exponential ones, of which the mean spacing b of the smallest is
measured in each direction. If the least delays are the same in both directions, the likelihood of a lower line l and an upper line u
with common skew s is exp((u - U)/b_back + (L - l)/b_there) beyond the touching lines U(s), L(s), times a prior for s. With the skew fixed that is
an exponential each, so the rest is a sum over the straight pieces of an exponential of s: the posterior mean has a closed form and, being a
mean and no corner of a hull, moves less from wave to wave.
Source of the likelihood: Jeske, "On maximum-likelihood estimation of clock offset", IEEE Trans. Communications 53(1), 2005 (exponential
delays, two-way exchange: the middle of the two minima is the maximum).
"""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, NamedTuple

MAX_SKEW: Final = 500e-6
"""Linux steers no clock further than this (adjtimex); crystals left alone differ by less (100 ppm each)."""

SKEW_SCALE: Final = 20e-6
"""Mean of |skew - what it was| before anything is known: data sheets of ordinary crystals promise 20 to 50 ppm. Its tail (Laplace) admits 100 ppm."""

LIKELIHOOD_DROP: Final = 11.23
"""The region that holds three parameters at ends of exponential distributions in 99.9 %: P(Gamma(3) > 11.23) = 0.001. With a scale that is itself
the mean of n spacings the quantile is 3 F(6, 2 n); 11.23 (1 + 6 / n) is within 7 % of its values from n = 7 on (22.3, 17.3 at 11, 14.2 at 20)."""

_NEGLIGIBLE: Final = 20.0
"""A fraction of the posterior below exp(-20) of its maximum adds nothing."""

Points = list[tuple[float, float]]


class Allowed(NamedTuple):
    """What the facts leave for one skew: lowest and highest value at the reference, ns."""

    skew: float
    low_ns: float
    high_ns: float


@dataclass(frozen=True, slots=True)
class Spacing:
    """Mean distance of the smallest delays of each direction from one another, ns; > 0.

    Attributes:
        there_ns: on the way to the board.
        back_ns: on the way back.
        count: of how many distances it is the mean.
    """

    there_ns: float
    back_ns: float
    count: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Belief:
    """What is believed of the offset at the reference, ns, and of the skew.

    Attributes:
        offset_ns: posterior mean.
        skew: posterior mean.
        offset_error_ns: half-width that holds the truth in 99.9 %.
        skew_error: the same for the skew.
        best: the most likely line's row.
    """

    offset_ns: float
    skew: float
    offset_error_ns: float
    skew_error: float
    best: Allowed


def allowed_lines(lower: Points, upper: Points, prior_skew: float) -> list[Allowed]:
    """Find all lines that respect all facts.

    Args:
        lower: hull points (age <= 0, least value), oldest first.
        upper: the same of the negated other family.
        prior_skew: an additional skew to be looked at.

    Returns:
        Rows at every bend, rising in skew, the first and the last at the ends of what is possible; empty if the facts contradict each other.
    """
    falling = [(b[1] - a[1]) / (b[0] - a[0]) for a, b in pairwise(lower)]
    rising = [(a[1] - b[1]) / (b[0] - a[0]) for a, b in pairwise(upper)]
    bends = [s for s in (*falling, *rising, prior_skew) if -MAX_SKEW < s < MAX_SKEW]
    rows: list[Allowed] = []
    i, j, last = len(lower) - 1, 0, len(upper) - 1
    before: Allowed | None = None
    for skew in sorted([-MAX_SKEW, *bends, MAX_SKEW]):
        while i > 0 and falling[i - 1] <= skew:
            i -= 1
        while j < last and rising[j] <= skew:
            j += 1
        row = Allowed(skew, lower[i][1] - skew * lower[i][0], -upper[j][1] - skew * upper[j][0])
        possible = row.low_ns <= row.high_ns
        if before is not None and possible != (before.low_ns <= before.high_ns):
            rows.append(_crossing(before, row))
        if possible:
            rows.append(row)
        elif rows:
            break
        before = row
    return rows


def believe(rows: list[Allowed], spacing: Spacing, middle_ns: float, prior_skew: float) -> Belief:
    """Weigh the allowed lines.

    Args:
        rows: of `allowed_lines`, at least one.
        spacing: of the smallest delays.
        middle_ns: mean time of the facts relative to the reference (<= 0).
        prior_skew: what the skew is likely to be near to.
    """
    there, back = spacing.there_ns, spacing.back_ns
    logs = [
        (row.high_ns + row.skew * middle_ns) / back
        - (row.low_ns + row.skew * middle_ns) / there
        - abs(row.skew - prior_skew) / SKEW_SCALE
        for row in rows
    ]
    most = max(logs)
    best = rows[logs.index(most)]
    drops = [most - value for value in logs]
    middle, skew = _mean(rows, drops)
    # The lines lie one spacing beyond the facts that touch them, on the average.
    shift = (there - back) / 2
    offset = min(max(middle + shift, best.low_ns), best.high_ns)
    offset_error = skew_error = 0.0
    most_drop = LIKELIHOOD_DROP * (1 + 6 / spacing.count)
    for row, drop in _region(rows, drops, most_drop):
        rest = most_drop - drop
        centre = (row.low_ns + row.high_ns) / 2 + shift
        offset_error = max(offset_error, centre + rest * there / 2 - offset, offset - centre + rest * back / 2)
        skew_error = max(skew_error, abs(row.skew - skew))
    return Belief(offset_ns=offset, skew=skew, offset_error_ns=offset_error, skew_error=skew_error, best=best)


def _crossing(a: Allowed, b: Allowed) -> Allowed:
    """Where low and high meet between two rows."""
    gap = a.high_ns - a.low_ns
    fraction = gap / (gap - (b.high_ns - b.low_ns))
    return _between(a, b, fraction)


def _between(a: Allowed, b: Allowed, fraction: float) -> Allowed:
    return Allowed(*(p + fraction * (q - p) for p, q in zip(a, b, strict=True)))


def _mean(rows: list[Allowed], drops: list[float]) -> tuple[float, float]:
    """Posterior mean of the interval's middle and of the skew: exact integrals of (linear) x exp(linear) over each piece."""
    total = middle = skew = 0.0
    for index in range(1, len(rows)):
        a, b, da, db = rows[index - 1], rows[index], drops[index - 1], drops[index]
        if da > db:
            a, b, da, db = b, a, db, da
        if da > _NEGLIGIBLE:
            continue
        fall = db - da
        if fall < 1e-4:
            weight, moment = 1 - fall / 2, 0.5 - fall / 3
        else:
            tail = math.exp(-fall)
            weight, moment = (1 - tail) / fall, (1 - tail * (1 + fall)) / (fall * fall)
        factor = abs(b.skew - a.skew) * math.exp(-da)
        total += factor * weight
        centre = (a.low_ns + a.high_ns) / 2
        middle += factor * (weight * centre + moment * ((b.low_ns + b.high_ns) / 2 - centre))
        skew += factor * (weight * a.skew + moment * (b.skew - a.skew))
    if total <= 0:
        row = rows[drops.index(0.0)]
        return (row.low_ns + row.high_ns) / 2, row.skew
    return middle / total, skew / total


def _region(rows: list[Allowed], drops: list[float], most_drop: float) -> list[tuple[Allowed, float]]:
    """The rows whose log likelihood is no further below the greatest, and the points where it leaves that region."""
    region: list[tuple[Allowed, float]] = []
    for index, (row, drop) in enumerate(zip(rows, drops, strict=True)):
        if index and (drop <= most_drop) != (drops[index - 1] <= most_drop):
            fraction = (most_drop - drops[index - 1]) / (drop - drops[index - 1])
            region.append((_between(rows[index - 1], row, fraction), most_drop))
        if drop <= most_drop:
            region.append((row, drop))
    return region
