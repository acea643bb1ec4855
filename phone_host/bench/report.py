"""The delay benchmark's measurements as a JSON object. Every key names its number's unit."""

import math
import os
import platform
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import zmq

from common import now
from common.words import counted
from phone_host.accounts.delays import DELAYS, STAGES, Spread
from phone_host.bench.analysis import Analysis, Checked, Errors, InterfaceFit, regime_of, statistics_of
from phone_host.bench.cases import BOARD_SETS, Interface
from phone_host.bench.delay_fit import DelayFit
from phone_host.bench.prediction import Figures, Unknown
from phone_host.bench.runs import WARM_UP_S, CaseResult, RunSettings
from phone_host.report.bench_result import (
    BenchRun,
    BothErrors,
    DelayBenchResult,
    DelaySpread,
    FittedLink,
    NotRun,
    NotRunSetting,
    Predicted,
    PredictionErrors,
    RegimeTold,
    RunCounts,
    RunFigures,
    UncertaintySpread,
)
from phone_host.report.json_result import ABSENT, Absent, json_values
from phone_host.sync.fifo import FifoSettings

PERCENTILES: Final = ("p50", "p95", "p99", "max")

ENOUGH_PAIRS: Final = 50
"""With fewer pairs, a run's 95th percentile rests on its slowest two, and its median on what the machine did in that moment."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Conditions:
    """The conditions of the measurement.

    Attributes:
        machine: processor, system, versions.
        date: local wall time.
        matcher: of the stereo core.
        fifo: depth and policy of the queue before it.
        seconds: length of each run after its warm-up, s.
        not_run: interfaces that could not be measured, and why.
        recording: the recording whose run this is; empty: the runs were made for this.
    """

    machine: str
    date: str
    matcher: str
    fifo: FifoSettings
    seconds: float
    not_run: tuple[tuple[Interface, str], ...] = ()
    recording: str = ""


def conditions(settings: RunSettings, not_run: Sequence[tuple[Interface, str]]) -> Conditions:
    """Read the machine's data and the wall clock."""
    versions = f"Python {platform.python_version()}, pyzmq {zmq.pyzmq_version()}, libzmq {zmq.zmq_version()}"
    system = f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()} {platform.release()}"
    return Conditions(
        machine=f"{system}, {versions}",
        date=now.wall_time(),
        matcher=settings.matcher.value,
        fifo=settings.fifo,
        seconds=settings.seconds,
        not_run=tuple(not_run),
    )


def as_json(results: Sequence[CaseResult], under: Conditions, analysis: Analysis) -> dict[str, object]:
    """Make the object of delay-bench.json."""
    return json_values(
        DelayBenchResult(
            recording=under.recording or None,
            machine=under.machine,
            date=under.date,
            matcher=under.matcher,
            measured_per_run_s=under.seconds,
            left_out_warm_up_s=WARM_UP_S,
            fifo=f"{under.fifo.depth}:{under.fifo.overflow.value}",
            runs=tuple(_run(result, under.fifo) for result in results),
            interfaces=tuple(_interface(one) for one in analysis.fits),
            predictions=tuple(_checked(one) for one in analysis.checked),
            prediction_errors=BothErrors(_errors(analysis.held_out), _errors(analysis.queues)),
            not_run_settings=tuple(
                NotRunSetting(one.interface, one.setting, *_figures_or_reason(one.figures)) for one in analysis.what_ifs
            ),
            not_run=tuple(NotRun(str(interface), reason) for interface, reason in under.not_run),
        )
    )


def losses(result: CaseResult) -> dict[str, int]:
    """Count everything that did not become a result in the whole run, by what happened to it; reasons with a count of 0 are left out."""
    counts, link = result.counts, result.link
    lost = {f"{reason}_on_board": count for reason, count in result.board.dropped}
    lost["lost_on_link"] = sum(account.lost for account in link.sessions)
    lost["stale"] = sum(account.duplicate + account.old_session for account in link.sessions)
    lost["before_clock"] = link.no_clock
    lost |= {f"disbelieved_{reason.value}": count for reason, count in link.disbelieved.items()}
    lost |= {f"{reason}_board_frame": count for reason, count in counts.board_orphans}
    lost["dropped_in_fifo"] = counts.dropped
    lost["undecodable"] = result.undecodable
    return {reason: count for reason, count in lost.items() if count}


def grouped(results: Sequence[CaseResult]) -> list[list[CaseResult]]:
    """Group runs of the same images, in their order."""
    groups: dict[str, list[CaseResult]] = {}
    for result in results:
        groups.setdefault(result.case.images, []).append(result)
    return list(groups.values())


def most_compared(results: Sequence[CaseResult]) -> list[CaseResult]:
    """Return the runs of those images that were measured over the most interfaces; the first ones of several."""
    groups = grouped(results)
    return max(groups, key=lambda group: sum(bool(result.ledgers) for result in group)) if groups else []


def few_pairs_words(results: Sequence[CaseResult]) -> str:
    """Say that a run is too short to compare by; empty if each has enough pairs, or none at all."""
    measured = [result for result in results if result.ledgers]
    if not measured:
        return ""
    least = min(measured, key=lambda result: len(result.ledgers))
    pairs = len(least.ledgers)
    if pairs >= ENOUGH_PAIRS:
        return ""
    # Whole tens of seconds; a rate that was never reached is no use for telling the time.
    seconds = math.ceil(ENOUGH_PAIRS / least.pairs_per_second / 10) * 10 if least.pairs_per_second > 0 else 60
    return f"{least.case.interface} from only {counted(pairs, 'pair')}: run it longer (--seconds {seconds})"


def _run(result: CaseResult, fifo: FifoSettings) -> BenchRun:
    case, statistics, regime = result.case, statistics_of(result), regime_of(result, fifo)
    spread = statistics.spread
    return BenchRun(
        link=case.interface.link,
        emulated=case.interface.profile.name if case.interface.profile is not None else None,
        width_px=case.size.width_px,
        height_px=case.size.height_px,
        jpeg_quality_percent=None if case.quality_percent == BOARD_SETS else case.quality_percent,
        camera_rate_hz=case.rate_hz,
        pair_rate_hz=result.pairs_per_second,
        measured_s=result.measured_s,
        measured_pairs=len(result.ledgers),
        mean_frame_bytes=round(sum(ledger.bytes for ledger in result.ledgers) / max(1, len(result.ledgers))),
        least_frame_bytes=min((ledger.bytes for ledger in result.ledgers), default=0),
        delays={name: DelaySpread(*_in(1e6, spread(name))) for name in DELAYS},
        stages={name: DelaySpread(*_in(1e6, spread(name))) for name in STAGES},
        time_skew=DelaySpread(*_in(1e6, spread("time_skew"))),
        clock_uncertainty=UncertaintySpread(*_in(1e3, spread("uncertainty"))),
        clock_uncertainty_at_end_us=result.uncertainty_ns / 1e3,
        clock_bound_at_end_us=result.bound_ns / 1e3,
        regime=RegimeTold(regime.regime.value, regime.sentence, regime.remedies),
        whole_run=_counts(result),
        line=result.relay,
    )


def _counts(result: CaseResult) -> RunCounts:
    board, counts, link = result.board, result.counts, result.link
    received = sum(account.received for account in link.sessions)
    lost = sum(account.lost for account in link.sessions)
    return RunCounts(
        grabbed_frames=board.grabbed,
        dropped_on_board_frames=dict(board.dropped),
        sent_frames=board.sent,
        lost_on_link_frames=lost,
        under_way_at_end_frames=board.sent - received - lost,
        received_frames=received,
        before_clock_frames=link.no_clock,
        disbelieved_frames={reason.value: count for reason, count in link.disbelieved.items()},
        orphaned_frames=dict(counts.board_orphans),
        held_at_end_frames=counts.held_board,
        paired_pairs=counts.paired,
        dropped_in_fifo_pairs=counts.dropped,
        undecodable_pairs=result.undecodable,
        processed_pairs=result.processed,
        not_processed_at_end_pairs=counts.paired - counts.dropped - result.undecodable - result.processed,
    )


def percentiles(spread: Spread) -> dict[str, float]:
    """Return the percentiles that are reported, by name, and the mean, ns."""
    return {
        "p50": spread.p50_ns,
        "p95": spread.p95_ns,
        "p99": spread.p99_ns,
        "max": spread.max_ns,
        "mean": spread.mean_ns,
    }


def _in(unit_ns: float, spread: Spread) -> Iterator[float]:
    return (value / unit_ns for value in percentiles(spread).values())


def _interface(one: InterfaceFit) -> FittedLink:
    fit: DelayFit = one.fit
    return FittedLink(
        link=str(one.interface),
        fitted_frames=fit.points,
        latency_ms=fit.latency_ns / 1e6,
        latency_low_ms=fit.latency_low_ns / 1e6,
        latency_high_ms=fit.latency_high_ns / 1e6,
        slope_ns_per_byte=fit.ns_per_byte,
        slope_low_ns_per_byte=fit.slope_low,
        slope_high_ns_per_byte=fit.slope_high,
        typical_error_ms=fit.typical_error_ns / 1e6,
        rate_bytes_per_s=fit.bytes_per_s,
        rate_low_bytes_per_s=fit.least_bytes_per_s,
        rate_high_bytes_per_s=fit.most_bytes_per_s,
    )


def _errors(errors: Errors) -> PredictionErrors:
    return PredictionErrors(
        predicted_runs=errors.runs,
        pair_rate_median_percent=100.0 * errors.rate,
        pair_rate_worst_percent=100.0 * errors.worst_rate,
        end_to_end_p50_median_percent=100.0 * errors.end_to_end,
        end_to_end_p50_worst_percent=100.0 * errors.worst_end_to_end,
    )


def _checked(one: Checked) -> Predicted:
    queues, _ = _figures_or_reason(one.queues)
    return Predicted(
        str(one.case.interface), one.case.images, _figures(one.measured), queues, *_figures_or_reason(one.predicted)
    )


def _figures_or_reason(predicted: Figures | Unknown) -> tuple[RunFigures | None, str | Absent]:
    return (None, predicted.reason) if isinstance(predicted, Unknown) else (_figures(predicted), ABSENT)


def _figures(figures: Figures) -> RunFigures:
    return RunFigures(
        pair_rate_hz=figures.pairs_per_s,
        lost_percent=100.0 * figures.lost_share,
        propagation_p50_ms=figures.propagation_p50_ns / 1e6,
        queuing_p95_ms=figures.queuing_p95_ns / 1e6,
        starvation_p50_ms=figures.starvation_p50_ns / 1e6,
        end_to_end_p50_ms=figures.end_to_end_p50_ns / 1e6,
        end_to_end_p95_ms=figures.end_to_end_p95_ns / 1e6,
    )
