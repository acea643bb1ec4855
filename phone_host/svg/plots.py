"""Plots as inline SVG: distributions of delays, and their shares. Pure: values in, text out.

Every plot is drawn for a given width in CSS pixels and is not meant to be scaled much, so that its text stays legible.
Colours are the CSS variables --c0 to --c7 and a few of the page's own (see `plot_parts.STYLE`), so that one SVG serves
light and dark mode. What a mark means is in its <title>, which browsers show when the pointer rests on it.

All values are durations in ns, float64, NaN = no measurement.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from phone_host.svg.plot_parts import DARK_COLOURS, LETTER_PX, empty, hit, svg
from phone_host.svg.plot_scale import Linear, Values, duration_text, duration_unit, log_scale

_ROOM_FOR_MAX_PX = 440


@dataclass(frozen=True, slots=True)
class Percentiles:
    """What is known of a quantity's distribution over more pairs than its values are of, ns."""

    p50_ns: float
    p95_ns: float
    p99_ns: float
    max_ns: float


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Quantity:
    """One named delay of every pair.

    Attributes:
        label: its name.
        values_ns: (N,) float64, ns.
        colour: index into the palette, 0..7.
        meaning: one sentence for the tooltip.
        percentiles: over all pairs, if `values_ns` is a sample of them; None: those of the values are told.
    """

    label: str
    values_ns: Values
    colour: int
    meaning: str = ""
    percentiles: Percentiles | None = None


@dataclass(frozen=True, slots=True)
class Share:
    """A piece of a budget.

    Attributes:
        label: its name.
        value_ns: its length, ns.
        colour: index into the palette, 0..7.
    """

    label: str
    value_ns: float
    colour: int


def mean_share(quantity: Quantity) -> Share:
    """Return a quantity's mean as a share of a budget."""
    return Share(quantity.label, float(quantity.values_ns.mean()), quantity.colour)


@dataclass(frozen=True, slots=True)
class Budget:
    """One bar made of shares that add up."""

    label: str
    shares: tuple[Share, ...]


@dataclass(frozen=True, slots=True)
class Strips:
    """Distributions under one heading.

    Attributes:
        heading: for example an interface; empty for none.
        quantities: one strip each.
    """

    heading: str
    quantities: tuple[Quantity, ...]


def distributions(groups: Sequence[Strips], width_px: int) -> str:
    """Plot strips on one logarithmic axis, one for each quantity.

    A bar reaches from p5 to p95, with a line at p50 and a tick at p99. A thin line reaches from the least value to a
    dot at the greatest.
    """
    quantities = [quantity for group in groups for quantity in group.quantities]
    everything = [quantity.values_ns for quantity in quantities]
    everything += [np.array([one.percentiles.max_ns]) for one in quantities if one.percentiles is not None]
    x = log_scale(np.concatenate(everything) if everything else np.zeros(0), 8.0, width_px - 12.0)
    height = 4.0
    rows = []
    strips: list[float] = []
    for group in groups:
        if group.heading:
            rows.append(
                f'<text class="strong" x="0" y="{height + 15:.0f}" font-weight="600">{escape(group.heading)}</text>'
            )
            height += 24.0
        for quantity in group.quantities:
            strips.append(height)
            rows.append(_strip(quantity, x.px, height, width_px))
            height += 36.0
    marks = x.decades()
    # In a narrow picture only some of the decades are labelled.
    every = max(1, math.ceil(len(marks) * 52 / width_px))
    # Grid lines only cross the bars, never the numbers above them.
    lines = "".join(f"M{x.px(mark):.1f} {top + 16:.0f}v18" for top in strips for mark in marks)
    axis = f'<path class="grid" d="{lines}"/>' if lines else ""
    axis += "".join(
        f'<text x="{x.px(mark):.1f}" y="{height + 15:.0f}" text-anchor="{_anchor(index, len(marks))}">{_decade(mark)}</text>'
        for index, mark in enumerate(marks)
        if index % every == 0
    )
    return svg(width_px, height + 22.0, "distribution of each delay", [axis, *rows])


def budgets(rows: Sequence[Budget], width_px: int) -> str:
    """Plot horizontal bars whose shares add up, all on one axis from zero."""
    totals = [math.fsum(share.value_ns for share in row.shares) for row in rows]
    if not totals or not max(totals) > 0.0:
        return empty(width_px, "nothing measured")
    x = Linear(low=0.0, high=max(totals), start_px=0.0, end_px=float(width_px))
    parts = []
    for index, (row, total) in enumerate(zip(rows, totals, strict=True)):
        top = index * 56
        parts.append(f'<text class="strong" x="0" y="{top + 13}">{escape(row.label)}</text>')
        parts.append(
            f'<text class="strong" x="{width_px}" y="{top + 13}" text-anchor="end">{duration_text(total)}</text>'
        )
        start = 0.0
        for share in row.shares:
            left, right = x.px(start), x.px(start + share.value_ns)
            start += share.value_ns
            label = f"{share.label}: {duration_text(share.value_ns)}, {100.0 * share.value_ns / total:.1f} %"
            parts.append(
                f'<rect x="{left:.1f}" y="{top + 20}" width="{max(0.0, right - left):.1f}" height="26" '
                f'style="fill:var(--c{share.colour})"><title>{escape(label)}</title></rect>'
            )
            words = f"{share.label} {duration_text(share.value_ns)}"
            if right - left > LETTER_PX * len(words):
                pale = " pale" if share.colour in DARK_COLOURS else ""
                parts.append(f'<text class="on{pale}" x="{left + 7:.1f}" y="{top + 37}">{escape(words)}</text>')
    return svg(width_px, 56.0 * len(rows) - 6.0, "shares of the delays", parts)


def _strip(quantity: Quantity, px: Callable[[float], float], top: float, width_px: int) -> str:
    """Draw one row of `distributions`."""
    values = quantity.values_ns[np.isfinite(quantity.values_ns)]
    name = f'<text class="strong" x="0" y="{top + 12:.0f}">{escape(quantity.label)}<title>{escape(quantity.meaning)}</title></text>'
    if not values.size:
        return name + f'<text x="{width_px}" y="{top + 12:.0f}" text-anchor="end">not measured</text>'
    p5, p50, p95, p99 = (float(p) for p in np.percentile(values, (5, 50, 95, 99)))
    greatest = float(values.max())
    if (known := quantity.percentiles) is not None:
        p50, p95, p99, greatest = known.p50_ns, known.p95_ns, known.p99_ns, known.max_ns
    numbers = f"p50 {duration_text(p50)} · p95 {duration_text(p95)} · p99 {duration_text(p99)}"
    title = f"{quantity.label}: p5 {duration_text(p5)}, {numbers.replace(' · ', ', ')}, max {duration_text(greatest)}"
    if width_px >= _ROOM_FOR_MAX_PX:
        numbers += f" · max {duration_text(greatest)}"
    middle = top + 24.0
    left, right = px(p5), px(p95)
    return (
        f'<g>{name}<text x="{width_px}" y="{top + 12:.0f}" text-anchor="end">{numbers}</text>'
        f'<path class="grid" d="M{px(float(values.min())):.1f} {middle:.1f}H{px(greatest):.1f}" style="stroke:var(--c{quantity.colour})"/>'
        f'<rect class="bar" x="{left:.1f}" y="{middle - 5:.1f}" width="{max(2.0, right - left):.1f}" height="10" rx="3" '
        f'style="fill:var(--c{quantity.colour})"/>'
        f'<path class="mark p50" d="M{px(p50):.1f} {middle - 7:.1f}v14"/>'
        f'<path class="mark p99" d="M{px(p99):.1f} {middle - 4:.1f}v8" style="stroke:var(--c{quantity.colour})"/>'
        f'<circle cx="{px(greatest):.1f}" cy="{middle:.1f}" r="2.5" style="fill:var(--c{quantity.colour})"/>'
        f"{hit(0.0, top, width_px, 34.0, title)}</g>"
    )


def _decade(ns: float) -> str:
    unit, name = duration_unit(ns)
    return f"{ns / unit:.0f}\u202f{name}"


def _anchor(index: int, count: int) -> str:
    return "start" if index == 0 else "end" if index == count - 1 else "middle"
