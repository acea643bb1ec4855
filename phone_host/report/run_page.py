"""A run's page: the last pair, every delay, who waits for whom, how the own camera fared. The demo's page uses parts of it."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from common import now
from common.camera.base import CameraHealth
from common.ledger import PairLedger
from common.words import counted, times
from phone_host.accounts.link_account import away_words, rung_lines
from phone_host.diagnostics.drift import drift_lines
from phone_host.diagnostics.headline import headline, pixels_text
from phone_host.diagnostics.image_judge import saved_pairs
from phone_host.diagnostics.image_numbers import pairing_words
from phone_host.diagnostics.run_rules import concerns, history
from phone_host.diagnostics.run_snapshot import TIMELESS, RunSnapshot, unused
from phone_host.diagnostics.throughput import Regime, budget_lines, figures, judge, missed_words
from phone_host.model import Processed, Side
from phone_host.report.budget_report import budget_tables
from phone_host.report.depth_data import density, photograph
from phone_host.report.depth_view import cloud_view, depth_view
from phone_host.report.drift_report import drift_table
from phone_host.report.match_words import cut_sentence
from phone_host.report.page_frame import section
from phone_host.report.page_links import FileLink
from phone_host.report.report_page import Figure, Headline, PageData, Picture, Table, delay_series, page
from phone_host.report.summary import corrected_lines, past_lines, phase_lines

_FINE: Final = frozenset({Regime.STARVED_BY_CAMERAS, Regime.UNKNOWN})
"""Regimes in which nothing has to be done."""

_MOST_LINKS: Final = 40
"""More links to saved pairs than this are no help; the folder lists them as well."""


def run_page(
    run: RunSnapshot,
    last: Processed | None,
    board_side: Side,
    ledgers: Sequence[PairLedger],
    saved: Sequence[str] = (),
) -> str:
    """Make the page.

    Args:
        run: the run.
        last: its last pair; None if there was none.
        board_side: which of its views is the board's.
        ledgers: of all pairs, or of evenly chosen ones, in order.
        saved: the run's saved files, relative to the page, in order, for example `pair-000010/cloud.ply`.

    Returns:
        One self-contained HTML document.
    """
    verdict, sentence = _verdict(run)
    return page(
        PageData(
            title="tandemscan run",
            subtitle=f"ended: {run.ended.replace('_', ' ')}; {now.wall_time()}",
            verdict=verdict,
            sentence=with_absences(sentence, run),
            figures=_figures(run) if run.processed else (),
            depth=depth_card(
                last, board_side, f"The last pair: number {run.processed - 1} of this run, counted from 0"
            ),
            pictures=pictures(last, board_side),
            delays=delay_series(ledgers, timeless=run.timeless, after_gap_ns=run.after_gap_ns, statistics=run.delays),
            tables=(
                *links_tables(run),
                *budget_tables(run.budget),
                *drift_table(run.drift),
                unused_table(run),
                camera_table(run.camera),
            ),
            steps=steps(run),
            notes=notes(run),
            files=files(saved, doubtful_pairs(run)),
        )
    )


def with_absences(sentence: str, run: RunSnapshot) -> str:
    """Return a headline that also says when the board was away."""
    away = away_words(run.away)
    return f"{sentence} {away[:1].upper()}{away[1:]}." if away else sentence


def notes(run: RunSnapshot) -> tuple[str, ...]:
    """Say who waits for whom, what makes depth wrong, and how the cameras' exposures relate in time."""
    judgement = judge(figures(run))
    return (
        *([_sentence(paired)] if (paired := pairing_words(run.replayed)) else []),
        f"Queue: {judgement.sentence}.",
        *([f"Not measured: when results were exposed: {TIMELESS}."] if run.timeless else []),
        *(_sentence(remark) for remark in judgement.remedies if judgement.regime in _FINE),
        *([f"Warning: {run.shortfall}."] if run.shortfall else []),
        *([f"Warning: {missed}."] if (missed := missed_words(run.budget)) else []),
        *(f"Warning: {item.message}." for item in concerns(run)),
        *(f"Warning: {line}." for line in past_lines(run)),
        *(_sentence(line) for line in (*corrected_lines(run.depth), *budget_lines(run.budget))),
        *(_sentence(line) for line in drift_lines(run.drift)),
        *(_sentence(line) for line in (*phase_lines(run.phase, run.alignment), *rung_lines(run.link))),
    )


def steps(run: RunSnapshot) -> tuple[str, ...]:
    """Say what to do next: what makes depth right comes before what makes it fast."""
    judgement = judge(figures(run))
    failure = () if run.failure is None else (run.failure.remedy,)
    remedies = (
        *failure,
        *(item.remedy for item in concerns(run)),
        *(() if judgement.regime in _FINE else judgement.remedies),
    )
    return tuple(_sentence(remedy) for remedy in dict.fromkeys(remedies))


def _sentence(words: str) -> str:
    return f"{words[:1].upper()}{words[1:]}."


def doubtful_pairs(run: RunSnapshot) -> dict[int, str]:
    """Return why saved pairs are wrong, doubtful or perhaps so, by their number: what stood while they were taken."""
    found: dict[int, str] = {}
    for item in sorted(history(run), key=lambda item: item.concern.is_failure):
        verdict, saved = ("wrong" if item.concern.is_failure else "doubtful"), saved_pairs(item, run.save_every)
        perhaps = f"not judged, between pairs that are {verdict}: {item.concern.message}"
        found = dict.fromkeys(saved.between, perhaps) | found
        found |= dict.fromkeys(saved.judged, f"{verdict}: {item.concern.message}")
    return found


def files(saved: Sequence[str], doubtful: Mapping[int, str] | None = None) -> tuple[FileLink, ...]:
    """List the files of a run that lie beside its page.

    Args:
        saved: of saved pairs, relative to the page, in order.
        doubtful: why some of them are wrong or doubtful, by the number of the pair.
    """
    known = doubtful or {}
    links = [
        FileLink(
            name, "; ".join(filter(None, ("" if number else _saved_words(name), known.get(_pair_number(name), ""))))
        )
        for number, name in enumerate(saved[:_MOST_LINKS])
    ]
    if len(saved) > _MOST_LINKS:
        first = saved[_MOST_LINKS].partition("/")[0]
        links.append(FileLink(f"{first}/", f"and {len(saved) - _MOST_LINKS} more, from this folder on"))
    return (
        *links,
        FileLink("report.json", "everything that this page says, for programs"),
        FileLink("delays.jsonl", "every delay of every pair, one line each, ns"),
    )


def _pair_number(name: str) -> int:
    """Return the number of a saved file's pair, such as 30 of `pair-000030/cloud.ply`; -1 if it has none."""
    digits = name.partition("/")[0].removeprefix("pair-")
    return int(digits) if digits.isdigit() else -1


def _saved_words(name: str) -> str:
    """Say what a saved file holds; the others hold the same."""
    kind = name.rpartition("/")[2]
    return {
        "cloud.ply": "point cloud, metres: X right, Y down, Z forward from the left camera",
        "disparity.pfm": "disparity, px",
    }.get(kind, "")


def depth_card(last: Processed | None, board_side: Side, title: str) -> str:
    """Make the card of a pair with its depth, over which a pointer reads metres; empty if it has none.

    Args:
        last: the pair; None if there was none.
        board_side: which of its views is the board's.
        title: which pair it is.
    """
    if last is None or last.disparity is None or not np.isfinite(last.disparity).any():
        return ""
    words = f"{100 * density(last):.0f} % {pixels_text(last.cut)} have a depth."
    if last.cut is not None and (cut := cut_sentence(last.cut, last.limits)):
        words += f" Cut: {cut}."
    return section(title, words, depth_view(last, _captions(last, board_side)) + cloud_view(last))


def links_tables(run: RunSnapshot) -> tuple[Table, ...]:
    """Make a table of the links side by side, if there were several."""
    if len(run.link.links) < 2:
        return ()
    rows = []
    for tally in run.link.links:
        age = tally.age.spread()
        known = age.count and not run.timeless
        ages = f"{age.p50_ns / 1e6:.1f} ms; {age.p95_ns / 1e6:.1f} ms" if known else "-"
        rows.append((tally.name, str(tally.frames), str(tally.carried), str(tally.lost), ages))
    title = f"Links: the stream changed links {times(run.link.switches)}"
    columns = ("link", "frames", "times it took over", "times it was lost", "age of frames on arrival: median; p95")
    return (Table(title, columns, tuple(rows)),)


def camera_table(health: CameraHealth) -> Table:
    """Make a table of how the own camera fared; what did not happen is left out."""
    troubles = (
        ("unplugged", health.unplugged),
        ("stalled", health.stalls),
        ("failed", health.failures),
        ("came back afterwards", health.returned),
        ("frames that its driver missed", health.missed),
        *((f"spoiled frames: {fault.value.replace('_', ' ')}", count) for fault, count in health.faults),
        ("stamps not believed", health.distrusted_stamps),
        ("controls that its driver refused", health.refused_controls),
    )
    rows = [
        *([] if health.period_ns is None else [("measured rate", f"{1e9 / health.period_ns:.2f} frames/s")]),
        *((what, str(count)) for what, count in troubles if count),
        *((f"held: {name.replace('_', ' ')}", str(value)) for name, value in health.held),
    ]
    return Table("This machine's camera", ("what", "value"), tuple(rows))


def _verdict(run: RunSnapshot) -> tuple[Headline, str]:
    said = headline(run)
    return Headline(said.grade.value), said.sentence


def _figures(run: RunSnapshot) -> tuple[Figure, ...]:
    if run.timeless:
        return (rate_figure(run), clock_figure(run))
    skew = run.delays.spread("time_skew")
    return (
        rate_figure(run),
        end_to_end_figure(run),
        Figure(
            label="time skew",
            value=f"{skew.p50_ns / 1e6:.1f}",
            unit="ms",
            note=f"median; 95 % below {skew.p95_ns / 1e6:.1f} ms",
        ),
        clock_figure(run),
        *(() if np.isnan(run.motion_px_s) else (_motion_figure(run),)),
    )


def _motion_figure(run: RunSnapshot) -> Figure:
    words = "the fastest tenth of the host camera's image"
    return _measured("image motion", run.motion_px_s, 0, "px/s", words)


def rate_figure(run: RunSnapshot) -> Figure:
    """How many pairs per second were processed."""
    pairs = f"{counted(run.processed, 'pair')} in {run.seconds:.1f} s"
    return _measured("pairs per second", run.pairs_per_second, 1, "/s", pairs)


def end_to_end_figure(run: RunSnapshot) -> Figure:
    """The age of the results."""
    spread = run.delays.spread("end_to_end")
    note = f"median; 99 % below {spread.p99_ns / 1e6:.0f} ms"
    return Figure(label="end-to-end", value=f"{spread.p50_ns / 1e6:.0f}", unit="ms", note=note)


def clock_figure(run: RunSnapshot) -> Figure:
    """How well the host knew the board's clock."""
    spread = run.delays.spread("uncertainty")
    return Figure(
        label="clock uncertainty", value=f"{spread.p50_ns / 1e3:.0f}", unit="\u00b5s", note="median over the pairs"
    )


def _measured(label: str, value: float, decimals: int, unit: str, note: str) -> Figure:
    """Make a figure that may be unknown (NaN)."""
    return (
        Figure(label=label, value="-", unit="", note=f"not measured; {note}")
        if np.isnan(value)
        else Figure(label=label, value=f"{value:.{decimals}f}", unit=unit, note=note)
    )


def pictures(last: Processed | None, board_side: Side = Side.LEFT) -> tuple[Picture, ...]:
    """Return the views of a pair that has no depth; a pair with depth has a card of its own (`depth_card`).

    Args:
        last: the pair; None if there was none.
        board_side: which of the views is the board's.
    """
    if last is None or (last.disparity is not None and np.isfinite(last.disparity).any()):
        return ()
    left, right = _captions(last, board_side)
    return (Picture(left, photograph(last.pair.left)), Picture(right, photograph(last.pair.right)))


def _captions(last: Processed, board_side: Side) -> tuple[str, str]:
    whose = ("the board's", "the host's") if board_side is Side.LEFT else ("the host's", "the board's")
    rectified = "" if last.disparity is None else ", rectified"
    return f"left: {whose[0]} camera{rectified}", f"right: {whose[1]} camera{rectified}"


def unused_table(run: RunSnapshot) -> Table:
    """Make a table of what was not used, by place and reason."""
    rows = tuple((item.words, str(item.count)) for item in unused(run))
    return Table("Frames and pairs that were not used", ("what", "count"), rows)
