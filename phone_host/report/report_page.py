"""A run as one self-contained HTML page: pictures, delays of all pairs as plots, key figures. Pure: data in, text out.

The page says what was not measured. All text that comes from outside is escaped.
"""

import base64
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from enum import Enum
from html import escape
from typing import Final

import numpy as np
from numpy.typing import NDArray

from common.errors import DataError
from common.ledger import PairLedger, StageTimes
from common.words import counted
from phone_host.accounts.delays import IDLE_STAGE_NS, DelayStatistics
from phone_host.report.chart_view import dots_chart, stacked_chart
from phone_host.report.page_frame import document, section, table, two_widths
from phone_host.report.page_links import FileLink, NextCommand, files_section, list_section, next_section
from phone_host.report.page_script import Script
from phone_host.svg.plot_parts import legend
from phone_host.svg.plots import (
    Budget,
    Percentiles,
    Quantity,
    Strips,
    budgets,
    distributions,
    mean_share,
)

MEANINGS: Final = (
    ("capture", "from the middle of the exposure until the board's program has the frame"),
    ("outbox", "waiting on the board for the link"),
    ("propagation", "from the first byte written to the last byte received"),
    ("pairing", "waiting for the partner frame of the other camera"),
    ("queuing", "waiting in the FIFO for the processor"),
    ("processing", "decode, rectify, match, reproject and write"),
)
"""The delays that add up to end-to-end, in the order in which they occur (DESIGN, section 4)."""

_END_TO_END: Final = "from the middle of the exposure until the results are written: the sum of the delays above"
_FROM_MIDDLE: Final = (
    "From the middle of the board camera's exposure to the written result; the delays of a pair add up to its end-to-end"
    " delay."
)
_FROM_DEMAND: Final = "From the moment at which the board had read an image to the written result."
_CHART_WORDS: Final = "A pointer reads each pair's delays, dragging zooms, a double click shows all, a click on a name hides it; a triangle is a pair beyond the top."
_STARVATION: Final = "how long the processor had nothing to do before this pair; no part of end-to-end"


class Headline(Enum):
    """How a run went; the page shows it as a colour and a symbol."""

    GOOD = "good"
    WARNING = "warning"
    BAD = "bad"


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """One key number as text, and a short explanation below it; unit and explanation may be empty."""

    label: str
    value: str
    unit: str = ""
    note: str = ""


@dataclass(frozen=True, slots=True)
class Picture:
    """One picture.

    Attributes:
        label: its caption.
        data: a whole PNG or JPEG file.
    """

    label: str
    data: bytes


@dataclass(frozen=True, slots=True)
class Table:
    """A small table, for example drops by reason."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True, eq=False)
class DelaySeries:
    """The delays of all pairs, in the order in which the pairs were done; `delay_series` makes it from ledgers.

    Attributes:
        time_s: (N,) float64, when each pair was done, counted from the first, s.
        delays: the delays that add up to end-to-end, N values each.
        end_to_end: their sum.
        starvation: how long the processor waited before each pair.
        stages: the parts of processing.
        time_skew: signed.
        uncertainty: of the clock offset.
        timeless: whether exposures have no time. Then `delays` has no capture delay, and end-to-end and time skew are
            not shown.
    """

    time_s: NDArray[np.float64]
    delays: tuple[Quantity, ...]
    end_to_end: Quantity
    starvation: Quantity
    stages: tuple[Quantity, ...]
    time_skew: Quantity
    uncertainty: Quantity
    timeless: bool = False

    @property
    def pairs(self) -> int:
        """The number of pairs, N."""
        return int(self.time_s.size)


@dataclass(frozen=True, slots=True)
class PageData:
    """Everything on a page.

    Attributes:
        subtitle: when, where, how long; may be empty.
        figures: key figures, most important first.
        pictures: left, right, disparity.
        delays: of all pairs.
        tables: drops by reason and similar.
        notes: what to know, one sentence each; `steps`: what to do next.
        depth: the last pair's card, HTML with parts of `depth_view`, shown before the pictures; may be empty.
    """

    title: str
    subtitle: str
    verdict: Headline
    sentence: str
    figures: tuple[Figure, ...]
    pictures: tuple[Picture, ...]
    delays: DelaySeries
    tables: tuple[Table, ...] = ()
    notes: tuple[str, ...] = ()
    steps: tuple[str, ...] = ()
    commands: tuple[NextCommand, ...] = ()
    depth: str = ""
    files: tuple[FileLink, ...] = ()


def delay_series(
    ledgers: Sequence[PairLedger],
    *,
    timeless: bool = False,
    after_gap_ns: frozenset[int] = frozenset(),
    statistics: DelayStatistics | None = None,
) -> DelaySeries:
    """Make the series of all delays from ledgers.

    Args:
        ledgers: one per pair, in the order in which the pairs were done; may be empty.
        timeless: whether their exposures are labels, because images were shown on demand.
        after_gap_ns: when the pairs were done before which the board was away: their wait is no starvation.
        statistics: of all pairs, if the ledgers are a sample of them: the percentiles that are told.
    """

    def column(value: Callable[[PairLedger], int]) -> NDArray[np.float64]:
        return np.array([value(ledger) for ledger in ledgers], dtype=np.float64)

    def attribute(name: str) -> NDArray[np.float64]:
        return column(lambda ledger: int(getattr(ledger, name)))

    def stage(name: str) -> NDArray[np.float64]:
        return column(lambda ledger: int(getattr(ledger.stages, name)))

    def percentiles(name: str) -> Percentiles | None:
        spread = None if statistics is None else statistics.spread(name)
        known = spread is not None and spread.count
        return Percentiles(spread.p50_ns, spread.p95_ns, spread.p99_ns, spread.max_ns) if spread and known else None

    waits = attribute("starvation_ns")
    waits[[ledger.done_ns in after_gap_ns for ledger in ledgers]] = np.nan
    first_ns = ledgers[0].done_ns if ledgers else 0
    return DelaySeries(
        time_s=column(lambda ledger: ledger.done_ns - first_ns) / 1e9,
        delays=tuple(
            Quantity(
                label=name,
                values_ns=attribute(f"{name}_ns"),
                colour=colour,
                meaning=meaning,
                percentiles=percentiles(name),
            )
            for colour, (name, meaning) in enumerate(MEANINGS)
            if not (timeless and name == "capture")
        ),
        end_to_end=Quantity(
            label="end-to-end",
            values_ns=attribute("end_to_end_ns"),
            colour=7,
            meaning=_END_TO_END,
            percentiles=percentiles("end_to_end"),
        ),
        starvation=Quantity(
            label="starvation",
            values_ns=waits,
            colour=6,
            meaning=_STARVATION,
            percentiles=percentiles("starvation"),
        ),
        stages=tuple(
            Quantity(label=field.name, values_ns=stage(field.name), colour=colour, percentiles=percentiles(field.name))
            for colour, field in enumerate(fields(StageTimes))
        ),
        time_skew=Quantity(label="time skew", values_ns=attribute("time_skew_ns"), colour=5),
        uncertainty=Quantity(label="clock uncertainty", values_ns=attribute("uncertainty_ns"), colour=2),
        timeless=timeless,
    )


def page(data: PageData) -> str:
    """Make the whole page: an HTML document.

    Raises:
        DataError: a picture is neither PNG nor JPEG.
    """
    parts = [
        heading(data.title, data.subtitle, data.verdict, data.sentence),
        figures_row(data.figures),
        data.depth,
        _pictures(data.pictures),
        *_delays(data.delays),
        *(section(one.title, "", table(one.columns, one.rows)) for one in data.tables if one.rows),
        next_section(data.steps, data.commands),
        list_section("Remarks", data.notes),
        files_section(data.files),
    ]
    return document(data.title, "".join(parts), *_scripts(data))


def _scripts(data: PageData) -> list[Script]:
    charts = [Script.CHARTS] if data.delays.pairs > 1 else []
    if data.depth:
        return [*charts, Script.DEPTH]
    return [*charts, Script.COPY] if data.commands else charts


def heading(title: str, subtitle: str, verdict: Headline, sentence: str) -> str:
    """Make the head of a page: title, subtitle and verdict.

    Args:
        title: plain text.
        subtitle: plain text, may be empty.
        verdict: gives colour and symbol.
        sentence: the verdict in words.
    """
    sign = {Headline.GOOD: "✓", Headline.WARNING: "!", Headline.BAD: "✕"}[verdict]
    below = f'<p class="sub">{escape(subtitle)}</p>' if subtitle else ""
    return (
        f"<header><h1>{escape(title)}</h1>{below}</header>"
        f'<p class="verdict {verdict.value}"><b aria-hidden="true">{sign}</b><span>{escape(sentence)}</span></p>'
    )


def figures_row(figures: tuple[Figure, ...]) -> str:
    """Make the row of key figures; empty if there are none."""
    if not figures:
        return ""
    cards = "".join(
        f"<div><dt>{escape(figure.label)}</dt><dd>{escape(figure.value)}"
        f"{f' <small>{escape(figure.unit)}</small>' if figure.unit else ''}</dd>"
        f"{f'<dd class=note>{escape(figure.note)}</dd>' if figure.note else ''}</div>"
        for figure in figures
    )
    return f'<dl class="figures">{cards}</dl>'


def _pictures(pictures: tuple[Picture, ...]) -> str:
    if not pictures:
        return ""
    items = "".join(
        f'<figure><img alt="{escape(picture.label)}" src="{picture_uri(picture)}"><figcaption>{escape(picture.label)}'
        "</figcaption></figure>"
        for picture in pictures
    )
    return f'<div class="pictures">{items}</div>'


def picture_uri(picture: Picture) -> str:
    """Return a picture as the address of an <img>.

    Raises:
        DataError: it is neither PNG nor JPEG.
    """
    if picture.data.startswith(b"\x89PNG\r\n\x1a\n"):
        kind = "png"
    elif picture.data.startswith(b"\xff\xd8\xff"):
        kind = "jpeg"
    else:
        raise DataError(f"the picture '{picture.label}' is neither PNG nor JPEG", "encode it as one of them")
    return f"data:image/{kind};base64,{base64.b64encode(picture.data).decode('ascii')}"


def _delays(series: DelaySeries) -> list[str]:
    """Make the cards with plots."""
    if not series.pairs:
        return [section("Delays", "No pair was processed, so there are no delays to show.", "")]
    names = [(quantity.label, quantity.colour) for quantity in series.delays]
    mean = Budget(
        f"mean of {counted(series.pairs, 'pair')}, end to end",
        tuple(mean_share(quantity) for quantity in series.delays),
    )
    stages = tuple(stage for stage in series.stages if stage.values_ns.max() > IDLE_STAGE_NS)
    work = Budget("mean processing delay", tuple(mean_share(quantity) for quantity in stages))
    ends = () if series.timeless else (series.end_to_end,)
    lasting = tuple(one for one in (*series.delays, *ends, series.starvation) if np.any(one.values_ns > 0))
    everything = Strips("", lasting)
    return [
        section(
            "Where the time goes",
            f"{_FROM_DEMAND if series.timeless else _FROM_MIDDLE} {_CHART_WORDS}",
            legend(names)
            + two_widths(lambda width: budgets([mean], width))
            + stacked_chart("delays of the pairs over time, stacked", series.time_s, series.delays)
            + "<noscript><p>delays.jsonl has all values.</p></noscript>",
        ),
        section(
            "Each delay by itself",
            "Bar: 5th to 95th percentile. Line across: median. Small tick: 99th percentile. Dot: the longest. Logarithmic axis.",
            two_widths(lambda width: distributions([everything], width)) + _glossary(everything.quantities),
        ),
        ""
        if not stages
        else section(
            "Stages of processing",
            "",
            legend([(quantity.label, quantity.colour) for quantity in stages])
            + two_widths(lambda width: budgets([work], width))
            + two_widths(lambda width: distributions([Strips("", stages)], width)),
        ),
        '<div class="pair">'
        + ("" if series.timeless else _time_skew(series))
        + section(
            "Clock uncertainty",
            "How well the host knows the board's clock, plus or minus.",
            dots_chart(series.time_s, series.uncertainty),
        )
        + "</div>",
    ]


def _time_skew(series: DelaySeries) -> str:
    return section(
        "Time skew of the pairs",
        "Exposure of the board's frame minus that of the host's; the band is the clocks' uncertainty.",
        dots_chart(series.time_s, series.time_skew, band_ns=series.uncertainty.values_ns),
    )


def _glossary(quantities: tuple[Quantity, ...]) -> str:
    """Make the list of what each delay means, collapsed; phones have no tooltips."""
    items = "".join(f"<dt>{escape(one.label)}</dt><dd>{escape(one.meaning)}</dd>" for one in quantities)
    return f'<details><summary>What each delay means</summary><dl class="words">{items}</dl></details>'
