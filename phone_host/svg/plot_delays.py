"""Plots of the delay benchmark as inline SVG: delay against bytes with its line, and the lives of single pairs. Pure; see `plots` for the rules."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Final, Protocol

import numpy as np

from common.ledger import PairLedger, StageTimes
from phone_host.svg.plot_parts import (
    BOTTOM_PX,
    DARK_COLOURS,
    LEFT_PX,
    RIGHT_PX,
    TOP_PX,
    axes,
    empty,
    frame,
    point,
    svg,
    ticks_below,
    triangle,
)
from phone_host.svg.plot_scale import Linear, Log, Values, duration_text, duration_unit, number_text, span, ticks

_MOST_DOTS: Final = 700
_ROW_PX: Final = 26
_LETTER_PX: Final = 7


class FittedLine(Protocol):
    """A line fitted to the delays of frames of different sizes."""

    @property
    def ns_per_byte(self) -> float:
        """Its slope; NaN if there is no line."""

    def delay_ns(self, size_bytes: float) -> float:
        """Return its delay for a frame, ns."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Scatter:
    """Delays of frames of different sizes.

    Attributes:
        size_bytes: (N,).
        delay_ns: (N,).
        number: (N,) index, 0 and up, of the run to which each frame belongs.
        fit: the line through them.
    """

    size_bytes: Values
    delay_ns: Values
    number: tuple[int, ...]
    fit: FittedLine


def against_bytes(scatter: Scatter, width_px: int, height_px: int = 240) -> str:
    """Plot delay against bytes as dots, with the fitted line.

    A delay far beyond the rest is cut off and marked by a triangle at the top, so that the region of the line stays
    legible.

    Returns:
        An <svg> element.
    """
    size, delay, fit = scatter.size_bytes, scatter.delay_ns, scatter.fit
    most = 1.05 * span(size)[1]
    wanted = max(2.5 * float(np.percentile(delay, 75)), 1.25 * fit.delay_ns(most) if fit.ns_per_byte > 0 else 0.0)
    top = min(1.06 * float(delay.max()), wanted)
    x, y = frame((width_px, height_px), (0.0, most), (0.0, max(1.0, top)))
    unit_ns, unit = duration_unit(y.high)
    dots = []
    every = max(1, -(-size.size // _MOST_DOTS))
    late = set(np.flatnonzero(delay > y.high).tolist())
    for index in sorted({*range(0, size.size, every), *late}):
        title = f"{size[index] / 1e3:.1f} kB: {duration_text(float(delay[index]))}"
        number, across = scatter.number[index], x.px(float(size[index]))
        if index in late:
            dots.append(triangle(number, across, TOP_PX - 1.0, title))
        else:
            dots.append(point(number, (across, y.px(float(delay[index]))), 1.8, title, ".65"))
    line = ""
    if not np.isnan(fit.ns_per_byte):
        ends = ((at, fit.delay_ns(at)) for at in (0.0, x.high))
        (x0, y0), (x1, y1) = ((x.px(at), y.px(max(0.0, value))) for at, value in ends)
        line = f'<path class="mark fit" d="M{x0:.1f} {y0:.1f}L{x1:.1f} {y1:.1f}"/>'
    around = axes((width_px, height_px), y, unit, "size of the frame, kB", per=unit_ns)
    below = ticks_below((width_px, height_px), x, 1e3)
    return svg(width_px, height_px, "propagation against bytes", [around, below, *dots, line])


@dataclass(frozen=True, slots=True, kw_only=True)
class Compared:
    """One figure, measured and predicted.

    Attributes:
        name: name of the run.
        measured_ns: the measured value.
        predicted_ns: the value that the model predicted.
        number: index, 0 and up, of what it belongs to.
    """

    name: str
    measured_ns: float
    predicted_ns: float
    number: int


def compared(points: Sequence[Compared], width_px: int, height_px: int = 300) -> str:
    """Plot predicted against measured of at least one point, both logarithmic; on the line they are equal.

    Returns:
        An <svg> element.
    """
    values = np.array([value for one in points for value in (one.measured_ns, one.predicted_ns)])
    low, high = 0.8 * float(values.min()), 1.25 * float(values.max())
    x = Log(low=low, high=high, start_px=LEFT_PX, end_px=width_px - RIGHT_PX)
    y = Log(low=low, high=high, start_px=height_px - BOTTOM_PX, end_px=TOP_PX)
    parts = ['<text x="0" y="11">predicted</text>']
    for value in _steps(low, high):
        across, up = x.px(value), y.px(value)
        name = duration_text(value).replace(".00", "").replace(".0\u202f", "\u202f")
        parts.append(
            f'<path class="grid" d="M{LEFT_PX} {up:.1f}H{width_px - RIGHT_PX}M{across:.1f} {TOP_PX}V{height_px - BOTTOM_PX}"/>'
        )
        parts.append(f'<text x="{LEFT_PX - 6}" y="{up + 4:.1f}" text-anchor="end">{name}</text>')
        parts.append(f'<text x="{across:.1f}" y="{height_px - BOTTOM_PX + 16}" text-anchor="middle">{name}</text>')
    parts.append(f'<text x="{width_px - RIGHT_PX}" y="{height_px - 3}" text-anchor="end">measured</text>')
    parts.append(f'<path class="axis" d="M{x.px(low):.1f} {y.px(low):.1f}L{x.px(high):.1f} {y.px(high):.1f}"/>')
    parts.extend(
        point(
            one.number,
            (x.px(one.measured_ns), y.px(one.predicted_ns)),
            4.0,
            f"{one.name}: measured {duration_text(one.measured_ns)}, predicted {duration_text(one.predicted_ns)}",
        )
        for one in points
    )
    return svg(width_px, height_px, "predicted against measured", parts)


def _steps(low: float, high: float) -> list[float]:
    """Return 1, 2 and 5 of each decade between two values."""
    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    return [step * 10.0**decade for decade in decades for step in (1, 2, 5) if low <= step * 10.0**decade <= high]


@dataclass(frozen=True, slots=True)
class Life:
    """One pair whose life is drawn."""

    heading: str
    ledger: PairLedger


def lives(pairs: Sequence[Life], width_px: int) -> str:
    """Draw the lives of single pairs as bars on three lanes each, board, link and host, on one time axis from the exposure.

    The stages of processing are drawn below its bar. A bar too short to see is drawn two pixels wide.
    """
    longest = max((pair.ledger.end_to_end_ns for pair in pairs), default=0)
    if longest <= 0:
        return empty(width_px, "no pairs")
    x = Linear(low=0.0, high=1.02 * longest, start_px=LEFT_PX, end_px=width_px - RIGHT_PX)
    height = 4.0
    rows = []
    for pair in pairs:
        rows.append(
            f'<text class="strong" x="0" y="{height + 13:.0f}" font-weight="600">{escape(pair.heading)}</text>'
            f'<text x="{width_px}" y="{height + 13:.0f}" text-anchor="end">{duration_text(pair.ledger.end_to_end_ns)}</text>'
        )
        height += 22.0
        rows.append(_life(pair.ledger, x, height))
        height += 3.0 * _ROW_PX + 18.0
    unit, name = duration_unit(longest)
    grid = []
    for value in ticks(0.0, x.high / unit, max(2, width_px // 110)):
        at = x.px(value * unit)
        grid.append(f'<path class="grid" d="M{at:.1f} 22V{height - 4:.0f}"/>')
        grid.append(f'<text x="{at:.1f}" y="{height + 10:.0f}" text-anchor="middle">{number_text(value)}</text>')
    grid.append(
        f'<text x="{width_px - RIGHT_PX}" y="{height + 26:.0f}" text-anchor="end">since the exposure, {name}</text>'
    )
    return svg(width_px, height + 32.0, "lives of single pairs", [*grid, *rows])


def _life(ledger: PairLedger, x: Linear, top: float) -> str:
    """Draw the three lanes of one pair."""
    board, zero_ns = ledger.board, ledger.board.exposed_ns
    # Lane, name, from, to, colour as on all pages (report_page.MEANINGS).
    bars = (
        (0, "capture", zero_ns, board.grabbed_ns, 0),
        (0, "outbox", board.grabbed_ns, board.sent_ns, 1),
        (1, "propagation", board.sent_ns, ledger.received_ns, 2),
        (2, "pairing", ledger.received_ns, ledger.queued_ns, 3),
        (2, "queuing", ledger.queued_ns, ledger.dequeued_ns, 4),
        (2, "processing", ledger.dequeued_ns, ledger.done_ns, 5),
    )
    parts = [
        f'<text x="{LEFT_PX - 8}" y="{top + lane * _ROW_PX + 15:.0f}" text-anchor="end">{name}</text>'
        for lane, name in enumerate(("board", "link", "host"))
    ]
    for lane, name, start_ns, end_ns, colour in bars:
        parts.append(_bar(name, x, (start_ns - zero_ns, end_ns - zero_ns), (top + lane * _ROW_PX, 20.0), colour))
    at_ns = ledger.dequeued_ns
    for index, stage in enumerate(StageTimes.__slots__):
        length_ns = getattr(ledger.stages, stage)
        begin_ns = ledger.done_ns - length_ns if stage == "write" else at_ns
        place = (top + 3 * _ROW_PX - 4.0, 7.0)
        parts.append(_bar(stage, x, (begin_ns - zero_ns, begin_ns + length_ns - zero_ns), place, index, words=False))
        at_ns += length_ns
    for lane, mark_ns in ((0, board.sent_ns), (1, ledger.received_ns)):
        at, below = x.px(mark_ns - zero_ns), top + lane * _ROW_PX + 20.0
        parts.append(f'<path class="axis" d="M{at:.1f} {below:.1f}v{_ROW_PX - 20}"/>')
    return "".join(parts)


def _bar(
    name: str, x: Linear, reach_ns: tuple[float, float], place: tuple[float, float], colour: int, *, words: bool = True
) -> str:
    """Draw one bar; `place` is its top and height, px. Its name is written in it if there is room."""
    left, right = (x.px(value) for value in reach_ns)
    top, height = place
    length = duration_text(reach_ns[1] - reach_ns[0])
    wide = max(2.0, right - left)
    bar = (
        f'<rect x="{left:.1f}" y="{top:.1f}" width="{wide:.1f}" height="{height:.0f}" rx="2" style="fill:var(--c{colour})">'
        f"<title>{escape(name)}: {length}</title></rect>"
    )
    text = f"{name} {length}"
    if not words or wide < _LETTER_PX * len(text):
        return bar
    pale = " pale" if colour in DARK_COLOURS else ""
    return bar + f'<text class="on{pale}" x="{left + 6:.1f}" y="{top + 14:.1f}">{escape(text)}</text>'
