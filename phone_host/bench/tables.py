"""The delay benchmark's measurements as table rows and lines of text, for the terminal and the page. Pure."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from common.words import counted
from phone_host.accounts.delays import DELAYS, IDLE_STAGE_NS, STAGES, DelayStatistics
from phone_host.bench.analysis import Analysis, regime_of, statistics_of
from phone_host.bench.delay_fit import DelayFit
from phone_host.bench.prediction import Figures, Unknown
from phone_host.bench.report import PERCENTILES, few_pairs_words, losses, percentiles
from phone_host.bench.runs import CaseResult
from phone_host.svg.plot_scale import duration_text
from phone_host.sync.fifo import FifoSettings

_RATES: Final = ((1e9, "GB/s"), (1e6, "MB/s"), (1e3, "kB/s"))

_HARDLY_SLOWER: Final = 1.05
"""Medians this close are not told apart: runs of one and the same interface differ by as much."""

_PARTS: Final = {
    "capture": "capturing on the board",
    "outbox": "waiting on the board for the link",
    "propagation": "the way over the link",
    "pairing": "waiting for the partner frame",
    "queuing": "waiting for the processor",
    "processing": "processing",
}
_WORK: Final = {
    "decode": "decoding the images",
    "interpolate": "interpolating",
    "rectify": "rectifying",
    "match": "matching",
    "reproject": "computing the cloud",
    "write": "handing over the result",
}

_LOSSES: Final = {
    "spoiled_on_board": ("frame", "damaged on the board"),
    "no_host_on_board": ("frame", "came before the host connected"),
    "replaced_on_board": ("frame", "replaced on the board by a newer one"),
    "link_full_on_board": ("frame", "dropped on the board because the link was full"),
    "stopped_on_board": ("frame", "left on the board when it stopped"),
    "lost_on_link": ("frame", "lost on the link"),
    "stale": ("frame", "came twice or from an earlier session"),
    "before_clock": ("frame", "came before the clock was known"),
    "dropped_in_fifo": ("pair", "dropped from the full FIFO"),
    "undecodable": ("pair", "could not be decoded"),
}
"""Says what happened to frames or pairs, by the reason that `losses` gives."""

FIT_COLUMNS: Final = (
    "interface",
    "latency",
    "95 %",
    "rate",
    "95 %",
    "left over",
    "frames",
    "clock",
    "hard bound",
    "lost there",
)

PREDICTION_COLUMNS: Final = (
    "interface",
    "setting",
    "pairs/s",
    "lost",
    "propagation p50",
    "queuing p95",
    "starvation p50",
    "end-to-end p50",
    "p95",
)


def rows(results: Sequence[CaseResult]) -> list[tuple[str, ...]]:
    """Make the terminal's table: stage, link, percentiles in ms; the stages of processing are indented below processing.

    Stages that did nothing in any of the runs are left out, and so is what is zero in all of them.
    """
    spreads = [(str(result.case.interface), statistics_of(result)) for result in results]
    table = []
    for name in (*DELAYS[:6], *STAGES, *DELAYS[6:], "time_skew"):
        least_ns = IDLE_STAGE_NS if name in STAGES else 0
        if all(statistics.spread(name).max_ns <= least_ns for _, statistics in spreads):
            continue
        for index, (link, statistics) in enumerate(spreads):
            values = percentiles(statistics.spread(name))
            label = "" if index else f"  {name}" if name in STAGES else name.replace("_", "-")
            table.append((label, link, *(_cell(values[key]) for key in PERCENTILES)))
    return table


def narrow_rows(result: CaseResult) -> list[tuple[str, ...]]:
    """Make the table of one run for a narrow terminal: stage, median, 95th percentile and maximum in ms."""
    return [(label, p50, p95, most) for label, _, p50, p95, _, most in rows([result])]


def result_sentence(results: Sequence[CaseResult]) -> str:
    """Say in one sentence which interface is the fastest, how long it takes from exposure to depth, what takes longest, and if a run is too short to say so.

    Returns:
        The sentence; empty if nothing was measured.
    """
    measured = [(statistics_of(result), result) for result in results if result.ledgers]
    if not measured:
        return ""
    measured.sort(key=lambda one: one[0].spread("end_to_end").p50_ns)
    statistics, fastest = measured[0]
    typical_ns = statistics.spread("end_to_end").p50_ns
    name, part = str(fastest.case.interface), _largest_part(statistics)
    takes = f"{duration_text(typical_ns)} from exposure to depth at the median, with {fastest.case.images}"
    few = few_pairs_words(results)
    part += f"; {few}" if few else ""
    if len(measured) == 1:
        return f"{name} takes {takes}; the largest part is {part}."
    equal = [
        str(result.case.interface)
        for one, result in measured[1:]
        if one.spread("end_to_end").p50_ns <= _HARDLY_SLOWER * typical_ns
    ]
    if equal:
        return f"{' and '.join([name, *equal])} are equally fast: {takes}; the largest part is {part}."
    return f"{name} is the fastest link: {takes}; the largest part is {part}."


def _largest_part(statistics: DelayStatistics) -> str:
    """Name the delay, or the stage of processing, that takes longest."""
    delay = max(_PARTS, key=lambda name: statistics.spread(name).p50_ns)
    if delay != "processing":
        return _PARTS[delay]
    return _WORK[max(STAGES, key=lambda name: statistics.spread(name).p50_ns)]


def _cell(value_ns: float) -> str:
    return "-" if value_ns != value_ns else f"{value_ns / 1e6:.3f}"  # noqa: PLR0124 - NaN is the only value unlike itself


def summary_line(result: CaseResult) -> str:
    """Summarise pairs, rate, losses and clock of one run in a line. The clock's uncertainty and bound are of the same moment, so the bound is wider."""
    lost = ", ".join(_loss_text(reason, count) for reason, count in losses(result).items()) or "nothing lost"
    if result.ledgers:
        worst_us = statistics_of(result).spread("uncertainty").p95_ns / 1e3
        pairs = f"{counted(len(result.ledgers), 'pair')}, {result.pairs_per_second:.1f}/s, clock of the pairs +-{worst_us:.0f} us (p95)"
    else:
        pairs = "no pairs"
    at_end = (
        "clock not known at the end"
        if math.isnan(result.bound_ns)
        else f"at the end +-{result.uncertainty_ns / 1e3:.0f} us (+-{result.bound_ns / 1e3:.0f} us whatever the link does)"
    )
    return f"{pairs}, {at_end}; whole run: {lost}"


def _loss_text(reason: str, count: int) -> str:
    """Say what happened to so many frames or pairs: `7 frames came before the host connected`."""
    if reason in _LOSSES:
        noun, words = _LOSSES[reason]
        return f"{counted(count, noun)} {words}"
    why = reason.removesuffix("_board_frame").removeprefix("disbelieved_").replace("_", " ")
    return f"{counted(count, 'frame')} not used ({why})"


def regime_lines(result: CaseResult, fifo: FifoSettings) -> tuple[str, ...]:
    """Say which queueing regime held in a run, then what would help."""
    judgement = regime_of(result, fifo)
    return (judgement.sentence, *judgement.remedies)


def error_lines(analysis: Analysis) -> list[str]:
    """Say how far predictions were from measurements; nothing if nothing was predicted."""
    return [
        f"{what}, {counted(errors.runs, 'run')}: pairs/s off by {100 * errors.rate:.0f} % (median; {100 * errors.worst_rate:.0f} % at worst), "
        f"end-to-end p50 by {100 * errors.end_to_end:.0f} % ({100 * errors.worst_end_to_end:.0f} %)"
        for what, errors in (
            ("predicted from the other runs", analysis.held_out),
            ("the queues alone, each run's own link and processing given", analysis.queues),
        )
        if errors.runs
    ]


def rate_text(bytes_per_s: float) -> str:
    """Write a rate with three digits."""
    if bytes_per_s != bytes_per_s or bytes_per_s == float("inf"):  # noqa: PLR0124 - NaN is the only value unlike itself
        return "any" if bytes_per_s == float("inf") else "\u2013"
    unit, name = next(((unit, name) for unit, name in _RATES if bytes_per_s >= 0.9995 * unit), _RATES[-1])
    return f"{bytes_per_s / unit:.3g} {name}"


def latency_text(fit: DelayFit) -> str:
    """Write a fitted latency. 0 means only that it is too small to measure, given the clocks and the scatter."""
    return "too small to tell" if fit.latency_ns == 0.0 else duration_text(fit.latency_ns)


def fit_rows(analysis: Analysis) -> list[tuple[str, ...]]:
    """List each interface's latency and rate with their 95 % intervals, and how well its clocks were known."""
    rows: list[tuple[str, ...]] = []
    for one in analysis.fits:
        fit = one.fit
        worst = max(one.results, key=lambda result: result.uncertainty_ns)
        lost = sum(account.lost for result in one.results for account in result.link.sessions)
        sent = sum(result.board.sent for result in one.results)
        rows.append(
            (
                str(one.interface),
                latency_text(fit),
                f"{duration_text(fit.latency_low_ns)} to {duration_text(fit.latency_high_ns)}",
                rate_text(fit.bytes_per_s),
                f"{rate_text(fit.least_bytes_per_s)} to {rate_text(fit.most_bytes_per_s)}",
                duration_text(fit.typical_error_ns),
                f"{fit.points}",
                f"\u00b1{duration_text(worst.uncertainty_ns)}",
                f"\u00b1{duration_text(worst.bound_ns)}",
                f"{lost} of {sent}",
            )
        )
    return rows


def fit_lines(analysis: Analysis) -> list[str]:
    """List each interface's latency and rate for the terminal, with their 95 % intervals."""
    lines = []
    for one in analysis.fits:
        if math.isnan(one.fit.ns_per_byte):
            lines.append(f"{one.interface}: frames of one size only, so latency and rate cannot be told apart")
            continue
        name, latency, latency_reach, rate, rate_reach, *_ = fit_rows(replace(analysis, fits=(one,)))[0]
        if one.fit.ns_per_byte == 0.0:
            lines.append(
                f"{name}: propagation = {latency} ({latency_reach}), larger frames are no slower ({rate_reach})"
            )
            continue
        lines.append(f"{name}: propagation = {latency} ({latency_reach}) + bytes / {rate} ({rate_reach})")
    return lines


def prediction_lines(analysis: Analysis, *, every: bool = False) -> list[str]:
    """List each run beside its prediction from the other runs, and settings that were not run, for the terminal.

    Args:
        analysis: conclusions from the runs.
        every: not only the settings that the user asked for; and how well the queues alone foretell a single run.
    """
    lines = []
    if len(analysis.checked) > 1:
        lines = ["", "end-to-end p50 and pairs/s, measured and predicted from the other runs:"]
    for one in analysis.checked if lines else ():
        seen, said = one.measured, one.predicted
        found = f"{one.case.interface} {one.case.short}: {duration_text(seen.end_to_end_p50_ns)}, {seen.pairs_per_s:.1f}/s; "
        if isinstance(said, Unknown):
            lines.append(f"{found}no prediction: {said.reason}")
        else:
            lines.append(f"{found}{duration_text(said.end_to_end_p50_ns)}, {said.pairs_per_s:.1f}/s")
    lines += error_lines(analysis) if lines or every else []
    asked = [one for one in analysis.what_ifs if one.asked_for or every]
    if asked:
        lines += ["", "predicted, not run:"]
    for what_if in asked:
        if isinstance(what_if.figures, Unknown):
            lines.append(f"{what_if.interface} {what_if.setting}: no prediction: {what_if.figures.reason}")
            continue
        texts = zip(PREDICTION_COLUMNS[2:-1], _figure_texts(what_if.figures), strict=False)
        lines.append(f"{what_if.interface} {what_if.setting}: {', '.join(f'{name} {text}' for name, text in texts)}")
    return lines


def checked_rows(analysis: Analysis) -> list[tuple[str, ...]]:
    """List each run as measured and as predicted from the others: `12.1 | 11.9`."""
    rows: list[tuple[str, ...]] = []
    for one in analysis.checked:
        name, images = str(one.case.interface), one.case.short
        if isinstance(one.predicted, Unknown):
            rows.append((name, images, f"no prediction: {one.predicted.reason}"))
            continue
        pairs = zip(_figure_texts(one.measured), _figure_texts(one.predicted), strict=True)
        rows.append((name, images, *(f"{seen} | {said}" for seen, said in pairs)))
    return rows


def what_if_rows(analysis: Analysis) -> list[tuple[str, ...]]:
    """List the prediction for each setting that was not run."""
    return [
        (one.interface, one.setting, *_figure_texts(one.figures))
        if isinstance(one.figures, Figures)
        else (one.interface, one.setting, f"no prediction: {one.figures.reason}")
        for one in analysis.what_ifs
    ]


def _figure_texts(figures: Figures) -> tuple[str, ...]:
    delays = (
        figures.propagation_p50_ns,
        figures.queuing_p95_ns,
        figures.starvation_p50_ns,
        figures.end_to_end_p50_ns,
        figures.end_to_end_p95_ns,
    )
    return (
        f"{figures.pairs_per_s:.1f}",
        f"{100.0 * figures.lost_share:.0f} %",
        *(duration_text(value) for value in delays),
    )
