"""The page of one stereo result, and the page that leads to several: self-contained HTML documents. Pure.

The first thing on a page is whether the depth is right, in one sentence that the caller has judged.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Final

import numpy as np

from common.words import counted, distance_text
from phone_host.diagnostics.headline import depth_error_m, pixels_text
from phone_host.model import Processed
from phone_host.output.preview import colour_disparity, colour_range_px
from phone_host.report import depth_data
from phone_host.report.depth_view import THIN, cloud_view, depth_view
from phone_host.report.match_words import cut_rows, searched_from_m, share_text
from phone_host.report.page_frame import document, section, table
from phone_host.report.page_links import FileLink, NextCommand, address, files_section, list_section, next_section
from phone_host.report.page_script import Script
from phone_host.report.report_page import Figure, Headline, Picture, figures_row, heading, picture_uri
from phone_host.svg.plot_scale import duration_text

_THUMBNAIL_PX: Final = 320
_CUT_COLOURS: Final = ("var(--c2)", "var(--c7)", "var(--c6)", "var(--c1)", "var(--c4)", "var(--c3)")


@dataclass(frozen=True, slots=True, kw_only=True)
class StereoPageData:
    """Everything on the page of a stereo result.

    Attributes:
        captions: what the left and the right picture are.
        settings: matcher and settings, names and values.
        times: stages and how long each took, ns, in order.
        notes: warnings and advice, one sentence each.
        back: relative link to the page of all pairs; empty: none.
    """

    title: str
    subtitle: str
    verdict: Headline
    sentence: str
    processed: Processed
    captions: tuple[str, str] = ("left, rectified", "right, rectified")
    settings: tuple[tuple[str, str], ...] = ()
    times: tuple[tuple[str, int], ...] = ()
    files: tuple[FileLink, ...] = ()
    commands: tuple[NextCommand, ...] = ()
    notes: tuple[str, ...] = ()
    back: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class PairEntry:
    """One pair on the page of several.

    Attributes:
        folder: relative to that page, with the pair's own index.html; empty if the pair failed.
        name: the names of the two images.
        thumbnail: from `thumbnail`; None if there is none.
        density: share of the pixels with a depth; NaN = no result.
    """

    folder: str
    name: str
    thumbnail: Picture | None
    density: float
    verdict: Headline
    sentence: str


@dataclass(frozen=True, slots=True, kw_only=True)
class StereoIndexData:
    """Everything on the page of several pairs."""

    title: str
    subtitle: str
    verdict: Headline
    sentence: str
    pairs: tuple[PairEntry, ...]
    files: tuple[FileLink, ...] = ()
    commands: tuple[NextCommand, ...] = ()
    notes: tuple[str, ...] = ()


def stereo_page(data: StereoPageData) -> str:
    """Make the page of one result: an HTML document."""
    back = f'<p class="sub"><a href="{address(data.back)}">all pairs</a></p>' if data.back else ""
    cloud = cloud_view(data.processed)
    shown = "" if data.processed.disparity is None else depth_view(data.processed, data.captions)
    parts = [
        back,
        heading(data.title, data.subtitle, data.verdict, data.sentence),
        figures_row(_figures(data.processed, data.verdict)),
        section("What the cameras saw, and the depth", _uncertainty_words(data.processed), shown) if shown else "",
        section("The cloud", "", cloud) if cloud else "",
        _pixels(data.processed),
        list_section("Remarks", data.notes),
        next_section((), data.commands),
        files_section(data.files),
        _settings(data.settings, data.times),
    ]
    return document(data.title, "".join(parts), Script.DEPTH)


def stereo_index(data: StereoIndexData) -> str:
    """Make the page of several pairs; each picture leads to its pair's page: an HTML document."""
    cards = "".join(_entry(pair) for pair in data.pairs)
    parts = [
        heading(data.title, data.subtitle, data.verdict, data.sentence),
        section(counted(len(data.pairs), "pair"), "", f'<div class="pictures">{cards}</div>') if cards else "",
        list_section("Remarks", data.notes),
        next_section((), data.commands),
        files_section(data.files),
    ]
    return document(data.title, "".join(parts), Script.COPY)


def thumbnail(processed: Processed) -> Picture | None:
    """Make a small picture of a pair's depth for the page of several.

    Args:
        processed: a pair; None is returned if it has no disparity.
    """
    if processed.disparity is None:
        return None
    step = max(1, math.ceil(processed.disparity.shape[1] / _THUMBNAIL_PX))
    small = processed.disparity[::step, ::step]
    return Picture("disparity: bright is near", depth_data.drawing(colour_disparity(small, *colour_range_px(small))))


def _figures(processed: Processed, verdict: Headline) -> tuple[Figure, ...]:
    """Return density, points, depth and how certain it is, as far as they are known. Nothing is certain about wrong depth."""
    share = depth_data.density(processed)
    figures = []
    if not math.isnan(share):
        what = "have a depth" if processed.cloud is not None else "have a disparity"
        figures.append(
            Figure(label="density", value=f"{100 * share:.0f}", unit="%", note=f"{pixels_text(processed.cut)} {what}")
        )
    if processed.cloud is None or processed.geometry is None:
        return tuple(figures)
    depth = processed.cloud[..., 2]
    values = depth[np.isfinite(depth)]
    if not values.size:
        return (*figures, Figure(label="points", value="0", note="no pixel has a depth"))
    near, middle, far = (float(value) for value in np.percentile(values, (1, 50, 99)))
    figures.append(Figure(label="points", value=f"{values.size:,}".replace(",", THIN), note="in the cloud"))
    figures.append(
        Figure(
            label="depth",
            value=f"{middle:.3g}",
            unit="m",
            note=f"median; nearly all from {distance_text(near)} to {distance_text(far)}",
        )
    )
    if verdict is not Headline.BAD and processed.limits is not None and processed.limits.disparity_error_px > 0:
        wrong = depth_error_m(processed.geometry, middle, processed.limits.disparity_error_px)
        at = f"at {distance_text(middle)}, if a disparity is wrong by {processed.limits.disparity_error_px:.2g} px"
        figures.append(Figure(label="uncertainty", value=f"± {distance_text(wrong)}", note=at))
    return tuple(figures)


def _uncertainty_words(processed: Processed) -> str:
    from_m = searched_from_m(processed.geometry, processed.search)
    words = "" if math.isnan(from_m) else f"Searched from {distance_text(from_m)}: nothing nearer can be found. "
    if processed.limits is None or processed.geometry is None:
        return words
    error_px = processed.limits.disparity_error_px
    return f"{words}Behind ± is what an error of {error_px:.2g} px of disparity changes in the depth."


def _pixels(processed: Processed) -> str:
    """Show what became of the left image's pixels."""
    if processed.cut is None:
        return ""
    rows = cut_rows(processed.cut, processed.limits)
    colours = _CUT_COLOURS if processed.cut.kept else _CUT_COLOURS[1:]
    total = sum(count for _, count in rows)
    if len(rows) < 2:
        return ""
    bar = "".join(
        f'<div style="flex:{count};background:{colour}"></div>'
        for (_, count), colour in zip(rows, colours, strict=False)
    )
    legend = "".join(
        f'<li><i style="background:{colour}"></i>{escape(f"{share_text(count, total)} {words}")}</li>'
        for (words, count), colour in zip(rows, colours, strict=False)
    )
    words = f"Of {total:,} pixels of the left image:".replace(",", THIN)
    return section(
        "Which pixels have a depth", words, f'<div class="share">{bar}</div><ul class="legend">{legend}</ul>'
    )


def _settings(settings: Sequence[tuple[str, str]], times: Sequence[tuple[str, int]]) -> str:
    cards = []
    if settings:
        cards.append(section("Settings", "", table(("what", "value"), settings)))
    if times:
        rows = [(stage, duration_text(float(ns))) for stage, ns in times]
        cards.append(section("Times", "", table(("stage", "time"), rows)))
    return f'<div class="pair">{"".join(cards)}</div>' if len(cards) == 2 else "".join(cards)


def _entry(pair: PairEntry) -> str:
    """Make one pair's picture with its words."""
    sign = {Headline.GOOD: "✓", Headline.WARNING: "!", Headline.BAD: "✕"}[pair.verdict]
    picture = (
        f'<img alt="{escape(pair.thumbnail.label)}" src="{picture_uri(pair.thumbnail)}">' if pair.thumbnail else ""
    )
    share = "" if math.isnan(pair.density) else f" · density {100 * pair.density:.0f}\u00a0%"
    inside = f"{picture}<b>{escape(pair.name)}</b>"
    link = f'<a href="{address(pair.folder)}/index.html">{inside}</a>' if pair.folder else inside
    return (
        f'<figure>{link}<figcaption><span class="{pair.verdict.value}" aria-hidden="true">{sign}</span> '
        f"{escape(pair.sentence)}{share}</figcaption></figure>"
    )
