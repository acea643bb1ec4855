"""Which lines fit between the two families of facts about a clock's offset, and which to believe. Pure arithmetic.

A line is given by its skew and its value at one moment, the reference. Times are relative to the reference. For each
skew s the facts leave an interval [low(s), high(s)] for the value. low is convex and high concave; both are piecewise
linear and bend at the hulls' slopes. `allowed_lines` visits all bends: exact linear programming in two variables,
linear in the number of hull points.

`believe` weighs the lines. Near their minimum, one-way delays are distributed about exponentially. The mean spacing b
of the smallest delays is measured in each direction. If the least delays of both directions are equal, the likelihood
of a lower line l and an upper line u with common skew s is exp((u - U)/b_back + (L - l)/b_there) beyond the touching
lines U(s), L(s), times a prior for s. For a fixed skew, each factor is an exponential. What remains is a sum over the
straight pieces of an exponential of s, so the posterior mean has a closed form. As a mean rather than a corner of a
hull, it moves less from wave to wave. Source of the likelihood: Jeske, "On maximum-likelihood estimation of clock
offset", IEEE Trans. Communications 53(1), 2005 (exponential delays, two-way exchange: the middle of the two minima is
the maximum).
"""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Final, NamedTuple

MAX_SKEW: Final = 500e-6
"""Linux slews no clock faster than this (adjtimex). Free-running crystals differ by less (100 ppm each)."""

SKEW_SCALE: Final = 20e-6
"""Prior mean of |skew - prior skew|. Data sheets of ordinary crystals promise 20 to 50 ppm.

The tail of this (Laplace) prior allows 100 ppm."""

LIKELIHOOD_DROP: Final = 11.23
"""Log-likelihood drop of the 99.9 % region of three parameters at the ends of exponential distributions.

P(Gamma(3) > 11.23) = 0.001. If the scale itself is the mean of n spacings, the quantile is 3 F(6, 2 n).
11.23 (1 + 6 / n) is within 7 % of it from n = 7 on (22.3, 17.3 at 11, 14.2 at 20)."""

_NEGLIGIBLE: Final = 20.0
"""Parts of the posterior below exp(-20) of its maximum are negligible."""

Points = list[tuple[float, float]]


class Allowed(NamedTuple):
    """What the facts allow for one skew: lowest and highest value at the reference, ns."""

    skew: float
    low_ns: float
    high_ns: float


@dataclass(frozen=True, slots=True)
class Spacing:
    """Mean distance between neighbours among the smallest delays of each direction, ns; > 0.

    Attributes:
        there_ns: on the way to the board.
        back_ns: on the way back.
        count: number of distances in the mean.
    """

    there_ns: float
    back_ns: float
    count: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Belief:
    """The estimate of the offset at the reference, ns, and of the skew.

    Attributes:
        offset_ns: posterior mean of the offset.
        skew: posterior mean of the skew.
        offset_error_ns: half-width that contains the true offset in 99.9 % of cases.
        skew_error: the same for the skew.
        best: the row of the most likely line.
    """

    offset_ns: float
    skew: float
    offset_error_ns: float
    skew_error: float
    best: Allowed


def allowed_lines(lower: Points, upper: Points, prior_skew: float) -> list[Allowed]:
    """Find all lines that agree with all facts.

    Args:
        lower: hull points (age <= 0, least value), oldest first.
        upper: the same for the other family, negated.
        prior_skew: an additional skew to include.

    Returns: A row at every bend, with rising skew. The first and last rows are at the ends of the possible range. Empty
        if the facts contradict each other.
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
        rows: result of `allowed_lines`, at least one row.
        spacing: spacing of the smallest delays.
        middle_ns: mean time of the facts relative to the reference (<= 0).
        prior_skew: the value that the skew is likely to be near.
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
    # On average, the lines lie one spacing beyond the facts that touch them.
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
    """Return the row between two rows where low and high meet."""
    gap = a.high_ns - a.low_ns
    fraction = gap / (gap - (b.high_ns - b.low_ns))
    return _between(a, b, fraction)


def _between(a: Allowed, b: Allowed, fraction: float) -> Allowed:
    return Allowed(*(p + fraction * (q - p) for p, q in zip(a, b, strict=True)))


def _mean(rows: list[Allowed], drops: list[float]) -> tuple[float, float]:
    """Return the posterior means of the interval's middle and of the skew.

    These are exact integrals of (linear) x exp(linear) over each piece.
    """
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
    """Return the rows whose log-likelihood drop is at most `most_drop`, and the points at the border of that region."""
    region: list[tuple[Allowed, float]] = []
    for index, (row, drop) in enumerate(zip(rows, drops, strict=True)):
        if index and (drop <= most_drop) != (drops[index - 1] <= most_drop):
            fraction = (most_drop - drops[index - 1]) / (drop - drops[index - 1])
            region.append((_between(rows[index - 1], row, fraction), most_drop))
        if drop <= most_drop:
            region.append((row, drop))
    return region
