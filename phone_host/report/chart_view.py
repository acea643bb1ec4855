"""Charts of static pages: the values that `page_charts.js` draws by uPlot, and a sentence that says the most of them. Pure.

The script takes the values from an attribute. Without it, and for who cannot see it, the sentence stands below.
"""

import itertools
import json
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from html import escape
from typing import Final

import numpy as np
from numpy.typing import NDArray

from phone_host.svg.plot_scale import Values, duration_text, duration_unit, number_text
from phone_host.svg.plots import Quantity

MOST_PAIRS: Final = 4000
"""More pairs than a wide screen has pixels add bytes, not information."""

_GAP, _GAP_S = 5.0, 1.0
"""A pause of so many usual intervals between pairs, and of so many s at least, is drawn as a gap."""

_USUAL_PERCENT: Final = 75.0
"""The unit is that of the usual values: a few pairs of seconds among milliseconds do not make all others 0.0 s."""

_DIGITS: Final = 4
_NO_SCRIPT: Final = "The chart itself needs JavaScript."


class _Mark(Enum):
    AREA = "area"
    DOTS = "dots"
    EDGE = "edge"


@dataclass(frozen=True, slots=True, eq=False)
class _Line:
    """One line of a chart: its name, colour in the palette and mark; (N,) values, ns."""

    label: str
    colour: int
    mark: _Mark
    values_ns: Values


def stacked_chart(label: str, time_s: Values, layers: Sequence[Quantity]) -> str:
    """Make a chart of durations that stack up to their sum.

    Args:
        label: what it shows, plain text.
        time_s: (N,) when each pair was done, ascending, s.
        layers: the quantities that add up, lowest first, N values each, at least one.

    Returns:
        HTML for a page that runs Script.CHARTS.
    """
    total = np.sum([layer.values_ns for layer in layers], axis=0)
    known = np.isfinite(total)
    if not known.any():
        return _nothing()
    slowest = int(np.nanargmax(total))
    p50, p99 = (duration_text(float(value)) for value in np.percentile(total[known], (50, 99)))
    words = (
        f"In sum: median {p50}, 99 % below {p99}, longest {duration_text(float(total[slowest]))}"
        f" after {number_text(round(float(time_s[slowest]), 1))} s."
    )
    lines = [_Line(one.label, one.colour, _Mark.AREA, one.values_ns) for one in layers]
    return _chart(label, words, lines, time_s, by=total)


def dots_chart(time_s: Values, *quantities: Quantity, band_ns: Values | None = None) -> str:
    """Make a chart of quantities as dots over time.

    Args:
        time_s: (N,) when each value was measured, ascending, s.
        quantities: N values each, at least one; of several, only one has a value at each time.
        band_ns: (N,) half-width of a band around zero, drawn behind the dots, ns.

    Returns:
        HTML for a page that runs Script.CHARTS.
    """
    known = [one for one in quantities if np.isfinite(one.values_ns).any()]
    if not known:
        return _nothing()
    first, *others = known
    by = first.values_ns
    for one in others:
        by = np.where(np.isnan(by), one.values_ns, by)
    names = [f"{one.label}: median" for one in known] if others else ["Median"]
    words = " ".join(f"{name} {_spread_words(one.values_ns)}." for name, one in zip(names, known, strict=True))
    edges = () if band_ns is None else (band_ns, -band_ns)
    lines = [
        *(_Line(one.label, one.colour, _Mark.DOTS, one.values_ns) for one in known),
        *(_Line("uncertainty", first.colour, _Mark.EDGE, edge) for edge in edges),
    ]
    return _chart(f"{', '.join(one.label for one in known)} over time", words, lines, time_s, by=by)


def _spread_words(values: Values) -> str:
    found = values[np.isfinite(values)]
    p50, least, most = (duration_text(float(value)) for value in (np.median(found), found.min(), found.max()))
    return f"{p50}, between {least} and {most}"


def _nothing() -> str:
    return "<p>Not measured.</p>"


def _chart(label: str, words: str, lines: Sequence[_Line], time_s: Values, *, by: Values) -> str:
    """Make the chart's element; `by` says which pairs are extremes."""
    caption = f"<figcaption>{escape(words)}</figcaption>"
    if time_s.size < 2:
        return f'<figure class="chart">{caption}</figure>'
    rows = _with_gaps(time_s, _envelope(by) if lines[0].mark is _Mark.AREA else _even(by))
    at_s = np.where(rows < 0, (time_s[np.roll(rows, 1)] + time_s[np.roll(rows, -1)]) / 2.0, time_s[rows])
    unit_ns, unit = duration_unit(float(np.nanpercentile(np.abs(by), _USUAL_PERCENT)))
    columns = [[_number(line.values_ns[row] / unit_ns, gap=row < 0) for row in rows] for line in lines]
    values = {
        "unit": unit,
        "stacked": lines[0].mark is _Mark.AREA,
        "lines": [{"label": line.label, "colour": f"--c{line.colour}", "mark": line.mark.value} for line in lines],
        "columns": [[round(float(at), 4) for at in at_s], *columns],
    }
    data = escape(json.dumps(values, separators=(",", ":")))
    name = f"{escape(label)}; arrow keys read values, plus and minus zoom, Escape shows all"
    return (
        f'<figure class="chart"><div role="group" aria-label="{name}" data-chart="{data}"><p>{_NO_SCRIPT}</p></div>'
        f"{caption}</figure>"
    )


def _envelope(by: Values) -> NDArray[np.intp]:
    """Return the pairs whose areas are drawn: all, or the least and the greatest of each slice."""
    if by.size <= MOST_PAIRS:
        return np.arange(by.size)
    edges = np.linspace(0, by.size, MOST_PAIRS // 2 + 1).astype(np.intp)
    slices = itertools.pairwise(edges.tolist())
    return np.unique([start + at for start, end in slices for at in _extremes(np.nan_to_num(by[start:end]))])


def _even(by: Values) -> NDArray[np.intp]:
    """Return the pairs that are drawn as dots: all, or every n-th, which shows how they lie, and the extremes."""
    every = -(-by.size // MOST_PAIRS)
    return np.unique(
        np.append(np.arange(0, by.size, every), _extremes(np.nan_to_num(by)) if every > 1 else ()).astype(np.intp)
    )


def _extremes(values: Values) -> tuple[int, int]:
    return int(values.argmin()), int(values.argmax())


def _with_gaps(time_s: Values, kept: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the pairs to draw with -1 where time passed without any."""
    steps = np.diff(time_s)
    piece = np.append(0, np.cumsum(steps > max(_GAP * float(np.median(steps)), _GAP_S)))
    return np.insert(kept, np.flatnonzero(np.diff(piece[kept])) + 1, -1)


def _number(value: float, *, gap: bool) -> float | None:
    return None if gap or not np.isfinite(value) else float(f"{value:.{_DIGITS}g}")
