"""One-way facts about a clock's offset, reduced to those that can matter. Pure geometry.

A fact (x, y) states that the quantity q was at least y at the board's time x. q is the offset itself (from the way to
the board) or its negative (from the way back), so one class serves both families of facts.

Crystals change their rate with temperature, so q is not a straight line, but it never bends faster than SKEW_CHANGE:
around any moment r, |q(x) - q(r) - q'(r) (x - r)| <= SKEW_CHANGE (x - r)^2 / 2. So a fact limits the tangent at r: q(r)
+ q'(r) (x - r) >= y - SKEW_CHANGE (x - r)^2 / 2. Moving r changes all right-hand sides by one linear function of x,
which does not affect a convex hull: the hull of the points (x, y - SKEW_CHANGE x^2 / 2) is the same for every r. So old
facts fade by themselves, and the hull grows by one point at a time.

Invariants: x rises from point to point; the slopes between widened neighbours fall; there are at most MOST_POINTS
points; omitting points only loosens the limits. Sources: Moon, Skelly, Towsley, "Estimation and removal of clock skew
from network delay measurements", INFOCOM 1999 (lower hulls of one-way delays); Harrison, Newman, "TICSync: knowing when
things happened", ICRA 2011 (both ways, hulls, bounds). The widening is ours.
"""

from typing import Final

SKEW_CHANGE: Final = 1e-6 / 60e9
"""Greatest change of a skew, per ns: 1 ppm a minute.

Cheap crystals change by about 1 ppm per kelvin, and boards warm up by less than a kelvin a minute."""

FORGET_NS: Final = 600_000_000_000
"""Older facts are dropped: after ten minutes the widening is 3 ms, more than the uncertainty of any echo."""

MOST_POINTS: Final = 64
"""Beyond this, every other point of the older half is dropped: its neighbours state nearly the same."""


def widening_ns(age_ns: float) -> float:
    """Return how far the offset can have left its tangent after `age_ns`, ns."""
    return SKEW_CHANGE / 2 * age_ns * age_ns


class Hull:
    """The upper hull of one family of facts."""

    def __init__(self) -> None:
        self._points: list[tuple[int, int]] = []

    def __len__(self) -> int:
        return len(self._points)

    def add(self, x_ns: int, y_ns: int) -> None:
        """Take a fact.

        Args:
            x_ns: board's time, not before that of any earlier fact.
            y_ns: lower limit of q at that time.
        """
        points = self._points
        if points and points[-1][0] == x_ns:
            if points[-1][1] >= y_ns:
                return
            points.pop()
        while len(points) >= 2:
            (x1, y1), (x2, y2) = points[-2:]
            # Slopes of the widened points: the terms that depend on the origin of x cancel out.
            if (y2 - y1) / (x2 - x1) + SKEW_CHANGE / 2 * (x_ns - x1) > (y_ns - y2) / (x_ns - x2):
                break
            points.pop()
        points.append((x_ns, y_ns))
        while x_ns - points[0][0] > FORGET_NS:
            del points[0]
        if len(points) > MOST_POINTS:
            del points[1 : MOST_POINTS // 2 : 2]

    def seen_from(self, x_ns: int, y_ns: int) -> list[tuple[float, float]]:
        """Return the points relative to a moment and widened for it, oldest first.

        Args:
            x_ns: the moment, board's time.
            y_ns: origin of the values.
        """
        half = SKEW_CHANGE / 2
        return [(x - x_ns, y - y_ns - half * (x - x_ns) ** 2) for x, y in self._points]
