"""The delay benchmark's page: one self-contained HTML document, offline, light and dark, desktop and phone. Pure."""

import math
from collections.abc import Sequence
from html import escape
from typing import Final

from common.words import counted
from phone_host.accounts.delays import IDLE_STAGE_NS, STAGES
from phone_host.bench.analysis import Analysis, InterfaceFit, typical_and_slow
from phone_host.bench.prediction import Figures, values_of
from phone_host.bench.report import Conditions, few_pairs_words, grouped, most_compared
from phone_host.bench.runs import WARM_UP_S, CaseResult
from phone_host.bench.tables import (
    FIT_COLUMNS,
    PREDICTION_COLUMNS,
    checked_rows,
    error_lines,
    fit_rows,
    latency_text,
    rate_text,
    regime_lines,
    result_sentence,
    summary_line,
    what_if_rows,
)
from phone_host.report.page_frame import HALF_PX, document, section, table, two_widths
from phone_host.report.report_page import DelaySeries, Headline, delay_series, heading
from phone_host.svg.plot_delays import Compared, Life, Scatter, against_bytes, compared, lives
from phone_host.svg.plot_parts import legend, point_legend, standalone
from phone_host.svg.plots import Budget, Quantity, Strips, budgets, distributions, mean_share

_FIGURE_PX: Final = 760


_FIT_WORDS: Final = (
    "Propagation, from the first byte written to the last received, is a latency and the bytes over a rate: the line of least absolute deviations "
    "through all frames of an interface, with 95 % intervals by a block bootstrap. Colours are the camera's rates; triangles are cut off."
)
_MODEL_WORDS: Final = (
    "Median end-to-end delay of each run. Each run is predicted from all the other runs: arrivals as the camera's clock gives them, the link as fitted, processing drawn "
    "from what was measured elsewhere, then Lindley's recursion through outbox, link, FIFO and worker. Nothing of a run enters its own prediction "
    "but its settings and the sizes of its frames. Lost: replaced by a newer frame on the board, or dropped in the FIFO."
)
_WHAT_IF_WORDS: Final = (
    "The same model for settings that nobody ran: each interface's heaviest run with one thing changed, and in its place the profiles of --emulate, "
    "as their figures stand there. No more than a prediction: a processor that several things compete for is slower than one that they do not."
)


def page(results: Sequence[CaseResult], under: Conditions, analysis: Analysis) -> str:
    """Make a self-contained HTML page: the interfaces side by side, the model beside the measurement, then every run stage by stage."""
    sub = (
        f"{under.machine} · {under.date} · matcher {under.matcher}, FIFO {under.fifo.depth}:{under.fifo.overflow.value}"
    )
    first = most_compared(results)
    sentence = result_sentence(first)
    few = few_pairs_words(first)
    verdict = Headline.BAD if not sentence else Headline.WARNING if few else Headline.GOOD
    head = heading("Delays of every interface and stage", sub, verdict, sentence or "No pair was processed.")
    cards = [
        _card(group, under)
        for group in sorted(grouped(results), key=lambda group: group[0].case.images != first[0].case.images)
    ]
    cards += [_what_ifs(analysis), section("How this was measured", _method(results, under), "")]
    cards += [_model(analysis), _glance(results, under, analysis), _fits(analysis)]
    return document("delay-bench", head + "".join(cards))


def figure(results: Sequence[CaseResult], under: Conditions) -> str:
    """Make one picture for a README: where the time goes over each interface, for the images measured with the most interfaces.

    Args:
        results: what was measured; at least one with pairs.
        under: machine, date, settings.
    """
    chosen = [result for result in most_compared(results) if result.ledgers]
    measured = [(str(result.case.interface), delay_series(result.ledgers)) for result in chosen]
    bars = [Budget(name, tuple(mean_share(quantity) for quantity in series.delays)) for name, series in measured]
    day = under.date.partition("T")[0]
    emulated = ", emulated interfaces" if all(result.case.interface.profile for result in chosen) else ""
    title = f"Mean delays of a pair, {chosen[0].case.images}{emulated}, {day}"
    return standalone(title, [(one.label, one.colour) for one in measured[0][1].delays], budgets(bars, _FIGURE_PX))


def _method(results: Sequence[CaseResult], under: Conditions) -> str:
    shaped = any(result.case.interface.profile is not None for result in results)
    emulated = (
        " An interface with a link in brackets is emulated: that link, with its bytes passed on by a process between the two programs at the "
        "interface's rate, delay and losses."
        if shaped
        else ""
    )
    if under.recording:
        return (
            f"The run of the recording {escape(under.recording)}, {under.seconds:g} s of it after a first {WARM_UP_S:g} s that is left out. Delays are on the "
            "host's clock; propagation carries the clocks' uncertainty. A board frame whose number is missing counts as replaced by a newer one."
        )
    return (
        f"Two real programs over rendered films, {under.seconds:g} s for each run after a warm-up of {WARM_UP_S:g} s that is left out. Delays are on the "
        f"host's clock; propagation carries the clocks' uncertainty.{emulated}"
    )


def _glance(results: Sequence[CaseResult], under: Conditions, analysis: Analysis) -> str:
    missing = "".join(f"<li>{escape(str(one))} was not run: {escape(reason)}</li>" for one, reason in under.not_run)
    content = table(FIT_COLUMNS, fit_rows(analysis), tight=True) + (f"<ul>{missing}</ul>" if missing else "")
    words = f"{counted(len(results), 'run')}. Propagation = latency + bytes / rate; the clock's uncertainty and its hard bound are those at the end of the run that knew it worst."
    return section("The interfaces", words, content)


def _fits(analysis: Analysis) -> str:
    if not analysis.fits:
        return ""
    rates = sorted({result.case.rate_hz for one in analysis.fits for result in one.results})
    numbers = {rate_hz: index for index, rate_hz in enumerate(rates)}
    plots = "".join(
        f"<div><h3>{escape(str(one.interface))}: {_line(one)}</h3>{_scatter(one, numbers)}</div>"
        for one in analysis.fits
    )
    names = point_legend([(f"{rate_hz} frames/s", number) for rate_hz, number in numbers.items()])
    return section("Delay against bytes", _FIT_WORDS, f"{names}<div class='pair'>{plots}</div>")


def _line(one: InterfaceFit) -> str:
    if math.isnan(one.fit.ns_per_byte):
        return "frames of one size only, no rate to be told"
    if one.fit.ns_per_byte == 0.0:
        return f"{latency_text(one.fit)}, larger frames are no slower"
    return f"{latency_text(one.fit)} + bytes / {rate_text(one.fit.bytes_per_s)}"


def _scatter(one: InterfaceFit, numbers: dict[int, int]) -> str:
    ledgers = [ledger for result in one.results for ledger in result.ledgers]
    size = values_of(ledgers, lambda ledger: ledger.bytes)
    delay = values_of(ledgers, lambda ledger: ledger.propagation_ns)
    runs = tuple(numbers[result.case.rate_hz] for result in one.results for _ in result.ledgers)
    scatter = Scatter(size_bytes=size, delay_ns=delay, number=runs, fit=one.fit)
    return two_widths(lambda width: against_bytes(scatter, width), HALF_PX)


def _model(analysis: Analysis) -> str:
    if len(analysis.checked) < 2:  # one run alone predicts nothing
        return ""
    names = list(dict.fromkeys(str(one.interface) for one in analysis.fits))
    numbers = {name: index for index, name in enumerate(names)}
    points = [
        Compared(
            name=f"{one.case.interface} {one.case.short}",
            measured_ns=one.measured.end_to_end_p50_ns,
            predicted_ns=one.predicted.end_to_end_p50_ns,
            number=numbers[str(one.case.interface)],
        )
        for one in analysis.checked
        if isinstance(one.predicted, Figures)
    ]
    plot = point_legend(list(numbers.items())) + two_widths(lambda width: compared(points, width)) if points else ""
    errors = "".join(f"<li>{escape(line[0].upper() + line[1:])}.</li>" for line in error_lines(analysis))
    content = f"<ul>{errors}</ul>{plot}<h3>Measured | predicted</h3>{table(PREDICTION_COLUMNS, checked_rows(analysis), tight=True)}"
    return section("The model beside the measurement", _MODEL_WORDS, content)


def _what_ifs(analysis: Analysis) -> str:
    if not analysis.what_ifs:
        return ""
    return section(
        "Settings that were not run", _WHAT_IF_WORDS, table(PREDICTION_COLUMNS, what_if_rows(analysis), tight=True)
    )


def _card(results: Sequence[CaseResult], under: Conditions) -> str:
    """Make the card of one kind of images: a bar for each interface, each delay and stage, the lives of single pairs."""
    title = results[0].case.images
    useful = [result for result in results if result.ledgers]
    if not useful:
        return section(title, "No pair was processed.", "")
    measured = [(str(result.case.interface), delay_series(result.ledgers)) for result in useful]
    delays = measured[0][1].delays
    idle = [
        all(series.stages[k].values_ns.max() <= IDLE_STAGE_NS for _, series in measured) for k in range(len(STAGES))
    ]
    stages = [stage for stage, nothing in zip(measured[0][1].stages, idle, strict=True) if not nothing]
    bars = [Budget(name, tuple(mean_share(quantity) for quantity in series.delays)) for name, series in measured]
    names = {stage.label for stage in stages}
    work = [
        Budget(name, tuple(mean_share(quantity) for quantity in series.stages if quantity.label in names))
        for name, series in measured
    ]
    strips = [
        Strips(name, tuple(one for one in _quantities(series) if one.values_ns.any())) for name, series in measured
    ]
    chosen = [life for result in useful for life in _lives(result)]
    summaries = "".join(_summary(result, under) for result in results)
    content = (
        legend([(quantity.label, quantity.colour) for quantity in delays])
        + two_widths(lambda width: budgets(bars, width))
        + f'<ul class="small">{summaries}</ul>'
        + "<h3>Single pairs: one at the median of end-to-end, one at its 99th percentile</h3>"
        + two_widths(lambda width: lives(chosen, width))
        + "<h3>Stages of processing, means</h3>"
        + legend([(quantity.label, quantity.colour) for quantity in stages])
        + two_widths(lambda width: budgets(work, width))
        + "<details><summary>The distribution of each delay and stage</summary>"
        + two_widths(lambda width: distributions(strips, width))
        + "</details>"
    )
    return section(title, "Means of all pairs, from the middle of the exposure to the written result.", content)


def _summary(result: CaseResult, under: Conditions) -> str:
    """List one run's counts, which regime held, and what would help."""
    sentence, *remedies = regime_lines(result, under.fifo)
    help_ = f"<ul>{''.join(f'<li>{escape(remedy)}</li>' for remedy in remedies)}</ul>" if remedies else ""
    return f"<li>{escape(str(result.case.interface))}: {escape(summary_line(result))}<br>{escape(sentence)}{help_}</li>"


def _lives(result: CaseResult) -> list[Life]:
    name = str(result.case.interface)
    typical, slow = typical_and_slow(result)
    return [
        Life(f"{name}, typical", result.ledgers[typical]),
        Life(f"{name}, slow", result.ledgers[slow]),
    ]


def _quantities(series: DelaySeries) -> tuple[Quantity, ...]:
    return (*series.delays, series.end_to_end, series.starvation, *series.stages)
