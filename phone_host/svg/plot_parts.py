"""The parts of all plots: colours, marks, axes, the frame around them. Pure: values in, SVG out.

Everything that static pages plot is drawn here, but for series over time, which `report.chart_view` hands to the live page's chart (decision 0144).

There are eight colours. Where more things than that must differ, further ones take the same colours with another shape
of mark, so that the first 32 differ.
"""

from collections.abc import Sequence
from html import escape
from typing import Final

from phone_host.svg.plot_scale import Linear, Values, number_text, span, ticks

# Okabe and Ito's palette, safe for all common kinds of colour blindness ("Color Universal Design", 2008); the last
# colour is grey.
STYLE: Final = """
:root{--c0:#56b4e9;--c1:#e69f00;--c2:#009e73;--c3:#cc79a7;--c4:#d55e00;--c5:#0072b2;--c6:#e3d332;--c7:#9aa3ad}
@media (prefers-color-scheme:dark){:root{--c3:#d88cb6;--c5:#3d9be0;--c4:#e8702a;--c2:#1fb98d;--c7:#77818c}}
svg.plot{display:block;width:100%;height:auto;font:12px/1 system-ui,sans-serif;font-variant-numeric:tabular-nums}
svg.plot text{fill:var(--ink2)}svg.plot text.strong{fill:var(--ink)}
svg.plot .grid{stroke:var(--line);fill:none}svg.plot .axis{stroke:var(--ink2);fill:none}
svg.plot .hit{fill:transparent}svg.plot .hit:hover{fill:var(--ink);fill-opacity:.12}
svg.plot text.on{fill:#111;pointer-events:none}svg.plot text.on.pale{fill:#fff}
@media (prefers-color-scheme:dark){svg.plot text.on.pale{fill:#111}}
svg.plot .dots{stroke:#1ec8ff;stroke-width:4;stroke-linecap:round;fill:none}svg.plot .err{stroke:#ff4b1f;stroke-width:1.8;fill:none}
svg.plot .ground{fill:#000;fill-opacity:.72}svg.plot text.bright{fill:#fff}
svg.plot .mark{stroke:var(--ink);stroke-width:2;fill:none}
ul.legend{display:flex;flex-wrap:wrap;gap:.25rem 1rem;margin:.5rem 0;padding:0;list-style:none;color:var(--ink2);font-size:.85rem}
ul.legend svg{width:.85em;height:.85em;margin-right:.35em;vertical-align:-.08em}
ul.legend i{display:inline-block;width:.8em;height:.8em;border-radius:2px;margin-right:.4em;vertical-align:-.05em}
"""

LEFT_PX, RIGHT_PX, TOP_PX, BOTTOM_PX = 52, 10, 24, 34
"""Margins of a plot with axes."""

DARK_COLOURS: Final = (2, 4, 5)
"""The colours on which text is light in light mode."""

LETTER_PX: Final = 8
"""Space for a letter of 12 px text, generous."""

COLOURS: Final = 8
"""Number of the colours that series take in turn."""


def fill(number: int) -> str:
    """Return the attribute that gives something the colour of the thing with this number, 0 and up."""
    return f'style="fill:var(--c{number % COLOURS})"'


def point(number: int, at_px: tuple[float, float], radius: float, title: str, opacity: str = "1") -> str:
    """Draw a mark for one of many things: a dot, a square, a diamond or a ring, in its colour.

    Args:
        number: number of the thing, 0 and up.
        at_px: its centre.
        radius: radius of the dot, px; the other shapes have about its area.
        title: plain text, shown when the pointer rests on it.
        opacity: opacity of the fill.
    """
    x, y = at_px
    words, inside = f"<title>{escape(title)}</title>", f'fill-opacity="{opacity}" {fill(number)}'
    match number // COLOURS % 4:
        case 0:
            return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}" {inside}>{words}</circle>'
        case 1:
            half = 0.9 * radius
            return f'<path d="M{x - half:.1f} {y - half:.1f}h{2 * half:.1f}v{2 * half:.1f}h{-2 * half:.1f}z" {inside}>{words}</path>'
        case 2:
            half = 1.3 * radius
            return f'<path d="M{x - half:.1f} {y:.1f}l{half:.1f} {-half:.1f}l{half:.1f} {half:.1f}l{-half:.1f} {half:.1f}z" {inside}>{words}</path>'
        case _:
            colour = f"stroke:var(--c{number % COLOURS});stroke-width:{radius / 2:.1f};fill:none"
            return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}" style="{colour}">{words}</circle>'


def triangle(number: int, x: float, y: float, title: str) -> str:
    """Draw a small triangle that stands on `y` and points up: a value beyond the plot's edge."""
    return f'<path d="M{x - 4:.1f} {y:.1f}l4 -7l4 7z" {fill(number)}><title>{escape(title)}</title></path>'


def hit(x: float, y: float, width: float, height: float, title: str) -> str:
    """Make an invisible area that shows a text when the pointer rests on it."""
    return (
        f'<rect class="hit" x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}">'
        f"<title>{escape(title)}</title></rect>"
    )


def legend(labels: Sequence[tuple[str, int]]) -> str:
    """Make a legend as an HTML list, which wraps in a narrow window.

    Args:
        labels: names with their index into the palette, 0..7.
    """
    items = "".join(f'<li><i style="background:var(--c{colour})"></i>{escape(name)}</li>' for name, colour in labels)
    return f'<ul class="legend">{items}</ul>'


def point_legend(labels: Sequence[tuple[str, int]]) -> str:
    """Make a legend for points: each name beside its mark.

    Args:
        labels: names with their numbers, 0 and up.
    """
    items = "".join(
        f'<li><svg viewBox="0 0 10 10" aria-hidden="true">{point(number, (5.0, 5.0), 3.6, name)}</svg>{escape(name)}</li>'
        for name, number in labels
    )
    return f'<ul class="legend">{items}</ul>'


def frame(size_px: tuple[int, int], ends_x: tuple[float, float], ends_y: tuple[float, float]) -> tuple[Linear, Linear]:
    """Return the scales of a plot's two axes, which leave room for its margins."""
    width_px, height_px = size_px
    x = Linear(low=ends_x[0], high=ends_x[1], start_px=LEFT_PX, end_px=width_px - RIGHT_PX)
    return x, Linear(low=ends_y[0], high=ends_y[1], start_px=height_px - BOTTOM_PX, end_px=TOP_PX)


def wider(values: Values, share: float) -> tuple[float, float]:
    """Return the least and the greatest value, moved apart by a share of their distance, so that no mark lies on the frame."""
    low, high = span(values)
    more = share * (high - low)
    return low - more, high + more


def axes(size_px: tuple[int, int], y: Linear, unit: str, name: str, *, per: float = 1.0) -> str:
    """Draw the grid, tick labels and names of both axes; the ticks of the horizontal one are `ticks_below`.

    Args:
        size_px: width and height of the picture.
        y: scale of the vertical axis.
        unit: symbol of its unit, plain text.
        name: name of the horizontal axis, plain text.
        per: the unit of the vertical axis' labels, in the unit of `y`.
    """
    width_px, height_px = size_px
    parts = [f'<text x="0" y="11">{escape(unit)}</text>']
    for value in ticks(y.low / per, y.high / per, 4):
        level = y.px(value * per)
        kind = "axis" if abs(value) < 1e-12 else "grid"
        parts.append(f'<path class="{kind}" d="M{LEFT_PX} {level:.1f}H{width_px - RIGHT_PX}"/>')
        parts.append(f'<text x="{LEFT_PX - 6}" y="{level + 4:.1f}" text-anchor="end">{number_text(value)}</text>')
    parts.append(f'<text x="{width_px - RIGHT_PX}" y="{height_px - 3}" text-anchor="end">{escape(name)}</text>')
    return "".join(parts)


def ticks_below(size_px: tuple[int, int], x: Linear, per: float = 1.0) -> str:
    """Draw the ticks of the horizontal axis and their numbers, in a unit of so much."""
    bottom = size_px[1] - BOTTOM_PX
    values = ticks(x.low / per, x.high / per, max(2, size_px[0] // 110))
    return "".join(tick(x.px(value * per), bottom, number_text(value)) for value in values)


def tick(at_px: float, bottom_px: float, label: str) -> str:
    """Draw a tick of the horizontal axis with its label, plain text."""
    return (
        f'<path class="axis" d="M{at_px:.1f} {bottom_px}v4"/>'
        f'<text x="{at_px:.1f}" y="{bottom_px + 16}" text-anchor="middle">{escape(label)}</text>'
    )


def svg(width_px: int, height_px: float, label: str, parts: Sequence[str]) -> str:
    """Make the picture: an <svg> element around its parts."""
    return (
        f'<svg class="plot" role="img" aria-label="{escape(label)}" viewBox="0 0 {width_px} {height_px:.0f}">'
        f"{''.join(parts)}</svg>"
    )


def standalone(title: str, labels: Sequence[tuple[str, int]], plot: str) -> str:
    """Make a plot into an SVG file of its own, with a title and a legend above it."""
    width_px, height_px = (int(part) for part in plot.partition('viewBox="0 0 ')[2].partition('"')[0].split())
    x, names = 0, ""
    for name, colour in labels:
        names += f'<rect x="{x}" y="32" width="11" height="11" rx="2" style="fill:var(--c{colour})"/>'
        names += f'<text x="{x + 16}" y="42">{escape(name)}</text>'
        x += 30 + LETTER_PX * len(name)
    colours = (
        ":root{--ground:#fff;--ink:#1a1e24;--ink2:#5c6570;--line:#e2e6ea}"
        "@media (prefers-color-scheme:dark){:root{--ground:#101318;--ink:#e9ecf0;--ink2:#9ba5b1;--line:#2b323b}}"
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" class="plot" viewBox="0 0 {width_px} {height_px + 60}"><title>{escape(title)}</title>'
        f'<style>{colours}{STYLE}</style><rect width="100%" height="100%" style="fill:var(--ground)"/><text class="strong" x="0" y="16" font-size="15" font-weight="600">{escape(title)}</text>{names}'
        f'<svg y="60" width="{width_px}" height="{height_px}"{plot.removeprefix("<svg")}</svg>\n'
    )


def empty(width_px: int, reason: str) -> str:
    """Make a picture that says why there is nothing to see."""
    words = f'<text x="{width_px / 2:.0f}" y="34" text-anchor="middle">{escape(reason)}</text>'
    return svg(width_px, 60.0, reason, [words])
