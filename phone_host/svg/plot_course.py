"""Values of views in their order, with limits of their uncertainty. Pure: values in, SVG out.

It stays SVG: a few views with names and error bars, nothing to zoom; uPlot has no error bars.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Final

import numpy as np

from phone_host.svg.plot_parts import BOTTOM_PX, LEFT_PX, RIGHT_PX, TOP_PX, point, svg
from phone_host.svg.plot_scale import Linear, Values, number_text, span, ticks

_HEIGHT_PX: Final = 240
_MARGIN: Final = 0.08
_APART_PX: Final = 7
"""Between two series' marks of one view."""

_NAME_PX: Final = 7.0
"""Width of a letter of the names below the axis."""


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """One quantity over the views.

    Attributes:
        label: what it is.
        colour: its index into the palette.
        values: (V,), in the plot's unit; NaN = none.
        limits: (V,) half the length of its bar, in that unit; 0: it has none.
    """

    label: str
    colour: int
    values: Values
    limits: Values


def over_views(names: Sequence[str], courses: Sequence[Course], unit: str, label: str, width_px: int) -> str:
    """Draw quantities over the views; 0 is always shown."""
    ends = [np.zeros(1), *(one.values + way * one.limits for one in courses for way in (-1, 1))]
    low, high = span(np.concatenate(ends))
    more = _MARGIN * (high - low)
    up = Linear(low=low - more, high=high + more, start_px=_HEIGHT_PX - BOTTOM_PX, end_px=TOP_PX)
    inset = 0.5 * _APART_PX * len(courses) + 4
    across = Linear(low=0, high=max(1, len(names) - 1), start_px=LEFT_PX + inset, end_px=width_px - RIGHT_PX - inset)
    parts = [f'<text x="0" y="11">{escape(unit)}</text>']
    for value in ticks(up.low, up.high, 4):
        level = up.px(value)
        kind = "axis" if abs(value) < 1e-12 else "grid"
        parts.append(f'<path class="{kind}" d="M{LEFT_PX} {level:.1f}H{width_px - RIGHT_PX}"/>')
        parts.append(f'<text x="{LEFT_PX - 6}" y="{level + 4:.1f}" text-anchor="end">{number_text(value)}</text>')
    parts += _names(names, across)
    parts.append(f'<text x="{width_px - RIGHT_PX}" y="{_HEIGHT_PX - 3}" text-anchor="end">view</text>')
    for number, one in enumerate(courses):
        aside = (number - (len(courses) - 1) / 2) * _APART_PX
        for index in np.flatnonzero(np.isfinite(one.values)).tolist():
            x, value, limit = across.px(float(index)) + aside, float(one.values[index]), float(one.limits[index])
            if limit > 0:
                parts.append(
                    f'<path style="stroke:var(--c{one.colour});stroke-width:1.5" d="M{x:.1f} {up.px(value - limit):.1f}V{up.px(value + limit):.1f}"/>'
                )
            spread = f" ± {limit:.2g}" if limit > 0 else ""
            title = f"{names[index]}: {one.label} {value:+.3g}{spread} {unit}"
            parts.append(point(one.colour, (x, up.px(value)), 3.6, title))
    return svg(width_px, _HEIGHT_PX, label, parts)


def _names(names: Sequence[str], across: Linear) -> list[str]:
    """Write the names of as many views as there is room for."""
    longest = max((len(name) for name in names), default=1)
    room = (across.end_px - across.start_px) / max(1, len(names) - 1)
    every = max(1, -(-int(longest * _NAME_PX + 8) // max(1, int(room))))
    bottom = _HEIGHT_PX - BOTTOM_PX
    return [
        f'<path class="axis" d="M{across.px(index):.1f} {bottom}v4"/>'
        f'<text x="{across.px(index):.1f}" y="{bottom + 16}" text-anchor="middle">{escape(names[index])}</text>'
        for index in range(0, len(names), every)
    ]
