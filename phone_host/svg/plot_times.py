"""Plots of durations over time, such as the time between two images of a camera. Pure; the largest of many values are always drawn."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from phone_host.svg.plot_parts import BOTTOM_PX, LEFT_PX, RIGHT_PX, TOP_PX, axes, empty, point, svg
from phone_host.svg.plot_scale import Linear, Values, duration_text, span

_HEIGHT_PX: Final = 220
_MARGIN: Final = 0.05
_MOST: Final = 600
"""Points of one series; more cannot be told apart."""


@dataclass(frozen=True, slots=True, eq=False)
class Durations:
    """A series.

    Attributes:
        label: its name.
        colour: number of its colour.
        at_s: (N,) float64, when, s.
        values_ns: (N,) float64, ns.
    """

    label: str
    colour: int
    at_s: Values
    values_ns: Values


def over_time(series: Sequence[Durations], label: str, width_px: int) -> str:
    """Draw durations over time; 0 is always shown."""
    drawn = [one for one in series if one.at_s.size]
    if not drawn:
        return empty(width_px, "nothing was measured")
    low, high = span(np.concatenate([np.zeros(1), *(one.values_ns for one in drawn)]))
    more = _MARGIN * (high - low)
    up = Linear(low=low - more, high=high + more, start_px=_HEIGHT_PX - BOTTOM_PX, end_px=TOP_PX)
    ends = span(np.concatenate([one.at_s for one in drawn]))
    across = Linear(low=ends[0], high=ends[1], start_px=LEFT_PX + 4, end_px=width_px - RIGHT_PX - 4)
    parts = [axes(across, up, (width_px, _HEIGHT_PX), "s")]
    for one in drawn:
        for index in _chosen(one.values_ns):
            at, value = float(one.at_s[index]), float(one.values_ns[index])
            title = f"{one.label}, at {at:.2f} s: {duration_text(value)}"
            parts.append(point(one.colour, (across.px(at), up.px(value)), 2.2, title, "0.75"))
    return svg(width_px, _HEIGHT_PX, label, parts)


def _chosen(values: Values) -> list[int]:
    """Return which values are drawn: of each group of neighbours the one farthest from the median."""
    count = values.size
    if count <= _MOST:
        return list(range(count))
    far = np.abs(values - np.median(values))
    edges = np.linspace(0, count, _MOST + 1).astype(int)
    return [int(start + np.argmax(far[start:end])) for start, end in pairwise(edges.tolist())]
