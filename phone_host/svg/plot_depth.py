"""Values over the distance, beside curves of what theory says. Pure: values in, SVG out.

It stays SVG: a few named measurements beside a curve with places of its own, nothing to zoom; uPlot's series share their places.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Final

import numpy as np

from phone_host.svg.plot_parts import BOTTOM_PX, LEFT_PX, RIGHT_PX, TOP_PX, empty, point, svg
from phone_host.svg.plot_scale import Linear, Values, number_text, span, ticks

_HEIGHT_PX: Final = 260
_MARGIN: Final = 0.06  # of the spread, so that no mark lies on the frame
_RADIUS_PX: Final = 4.5


@dataclass(frozen=True, slots=True)
class Mark:
    """One measurement.

    Attributes:
        distance_m: where, m.
        value: in the plot's unit.
        title: shown when the pointer rests on it.
    """

    distance_m: float
    value: float
    title: str


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """A line.

    Attributes:
        distances_m: (N,), ascending, m.
        values: (N,), in the plot's unit.
    """

    distances_m: Values
    values: Values


def over_distance(marks: Sequence[Mark], curves: Sequence[Curve], unit: str, label: str, width_px: int) -> str:
    """Draw measurements over the distance; 0 is always shown."""
    shown = [mark for mark in marks if np.isfinite([mark.distance_m, mark.value]).all()]
    if not shown:
        return empty(width_px, "nothing was measured")
    near, far = _wider(np.array([mark.distance_m for mark in shown]))
    values = np.concatenate([[0.0], [mark.value for mark in shown], *(curve.values for curve in curves)])
    low, high = _wider(values)
    across = Linear(low=near, high=far, start_px=LEFT_PX, end_px=width_px - RIGHT_PX)
    up = Linear(low=low, high=high, start_px=_HEIGHT_PX - BOTTOM_PX, end_px=TOP_PX)
    parts = [f'<text x="0" y="11">{escape(unit)}</text>']
    for value in ticks(low, high, 4):
        level = up.px(value)
        kind = "axis" if abs(value) < 1e-12 else "grid"
        parts.append(f'<path class="{kind}" d="M{LEFT_PX} {level:.1f}H{width_px - RIGHT_PX}"/>')
        parts.append(f'<text x="{LEFT_PX - 6}" y="{level + 4:.1f}" text-anchor="end">{number_text(value)}</text>')
    bottom = _HEIGHT_PX - BOTTOM_PX
    for value in ticks(near, far, max(2, width_px // 110)):
        at = across.px(value)
        parts.append(f'<path class="axis" d="M{at:.1f} {bottom}v4"/>')
        parts.append(f'<text x="{at:.1f}" y="{bottom + 16}" text-anchor="middle">{number_text(value)}</text>')
    parts.append(f'<text x="{width_px - RIGHT_PX}" y="{_HEIGHT_PX - 3}" text-anchor="end">distance, m</text>')
    for curve in curves:
        places = (f"{across.px(x):.1f} {up.px(y):.1f}" for x, y in zip(curve.distances_m, curve.values, strict=True))
        parts.append(f'<path style="stroke:var(--c1);stroke-width:2;fill:none" d="M{"L".join(places)}"/>')
    parts += [point(5, (across.px(mark.distance_m), up.px(mark.value)), _RADIUS_PX, mark.title) for mark in shown]
    return svg(width_px, _HEIGHT_PX, label, parts)


def span_m(distances_m: Values) -> Values:
    """Return places for a curve beside measurements at these distances: 50, from a little before the first to a little behind the last."""
    return np.linspace(*_wider(distances_m), 50)


def _wider(values: Values) -> tuple[float, float]:
    low, high = span(values)
    more = _MARGIN * (high - low)
    return low - more, high + more
