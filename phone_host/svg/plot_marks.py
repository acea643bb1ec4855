"""Named values in a frame of two axes: over views, with limits of their uncertainty, and over the distance, beside curves. Pure: values in, SVG out."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from phone_host.svg.plot_parts import BOTTOM_PX, axes, empty, frame, point, svg, tick, ticks_below, wider
from phone_host.svg.plot_scale import Linear, Values

_HEIGHT_PX: Final = 240
_MARGIN: Final = 0.08
_FAR_HEIGHT_PX: Final = 260
_FAR_MARGIN: Final = 0.06
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
    size = (width_px, _HEIGHT_PX)
    ends = [np.zeros(1), *(one.values + way * one.limits for one in courses for way in (-1, 1))]
    across, up = frame(size, (0, max(1, len(names) - 1)), wider(np.concatenate(ends), _MARGIN))
    inset = 0.5 * _APART_PX * len(courses) + 4
    across = replace(across, start_px=across.start_px + inset, end_px=across.end_px - inset)
    parts = [axes(size, up, unit, "view"), *_names(names, across)]
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
    return svg(*size, label, parts)


def _names(names: Sequence[str], across: Linear) -> list[str]:
    """Write the names of as many views as there is room for."""
    longest = max((len(name) for name in names), default=1)
    room = (across.end_px - across.start_px) / max(1, len(names) - 1)
    every = max(1, -(-int(longest * _NAME_PX + 8) // max(1, int(room))))
    return [tick(across.px(index), _HEIGHT_PX - BOTTOM_PX, names[index]) for index in range(0, len(names), every)]


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
    size = (width_px, _FAR_HEIGHT_PX)
    values = np.concatenate([[0.0], [mark.value for mark in shown], *(curve.values for curve in curves)])
    places_m = np.array([mark.distance_m for mark in shown])
    across, up = frame(size, wider(places_m, _FAR_MARGIN), wider(values, _FAR_MARGIN))
    parts = [axes(size, up, unit, "distance, m"), ticks_below(size, across)]
    for curve in curves:
        places = (f"{across.px(x):.1f} {up.px(y):.1f}" for x, y in zip(curve.distances_m, curve.values, strict=True))
        parts.append(f'<path style="stroke:var(--c1);stroke-width:2;fill:none" d="M{"L".join(places)}"/>')
    parts += [point(5, (across.px(mark.distance_m), up.px(mark.value)), 4.5, mark.title) for mark in shown]
    return svg(*size, label, parts)


def span_m(distances_m: Values) -> Values:
    """Return places for a curve beside measurements at these distances: 50, from a little before the first to a little behind the last."""
    return np.linspace(*wider(distances_m, _FAR_MARGIN), 50)
