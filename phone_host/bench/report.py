"""The delay benchmark's measurements as a JSON object: its keys are the fields of these classes, each with its number's unit.

Times are over the pairs after the warm-up, counts of the whole run.
"""

import math
import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import zmq

from common import now
from common.words import counted
from phone_host.accounts.delays import DELAYS, STAGES, Spread
from phone_host.bench.analysis import Analysis, Checked, Errors, WhatIf, regime_of, statistics_of
from phone_host.bench.cases import BOARD_SETS, Interface
from phone_host.bench.delay_fit import DelayFit
from phone_host.bench.prediction import Figures, Unknown
from phone_host.bench.relay import RelayAccount
from phone_host.bench.runs import WARM_UP_S, CaseResult, RunSettings
from phone_host.diagnostics.throughput import Judgement
from phone_host.report.json_result import ABSENT, Absent, FieldOf, Number, json_values, made
from phone_host.sync.fifo import FifoSettings

PERCENTILES: Final = ("p50", "p95", "p99", "max")

ENOUGH_PAIRS: Final = 50
"""With fewer pairs, a run's 95th percentile rests on its slowest two, and its median on what the machine did in that moment."""

_spread, _result, _fit, _errors = FieldOf[Spread](), FieldOf[CaseResult](), FieldOf[DelayFit](), FieldOf[Errors]()
_figures, _checked, _what_if = FieldOf[Figures](), FieldOf[Checked](), FieldOf[WhatIf]()


@dataclass(frozen=True, slots=True)
class DelaySpread:
    """The distribution of a delay over the pairs of a run."""

    p50_ms: Number = _spread(lambda spread: spread.p50_ns / 1e6)
    p95_ms: Number = _spread(lambda spread: spread.p95_ns / 1e6)
    p99_ms: Number = _spread(lambda spread: spread.p99_ns / 1e6)
    max_ms: Number = _spread(lambda spread: spread.max_ns / 1e6)
    mean_ms: Number = _spread(lambda spread: spread.mean_ns / 1e6)


@dataclass(frozen=True, slots=True)
class UncertaintySpread:
    """The distribution of the clock's uncertainty over the pairs of a run."""

    p50_us: Number = _spread(lambda spread: spread.p50_ns / 1e3)
    p95_us: Number = _spread(lambda spread: spread.p95_ns / 1e3)
    p99_us: Number = _spread(lambda spread: spread.p99_ns / 1e3)
    max_us: Number = _spread(lambda spread: spread.max_ns / 1e3)
    mean_us: Number = _spread(lambda spread: spread.mean_ns / 1e3)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunCounts:
    """What became of every frame and pair of a run; some by reason."""

    grabbed_frames: int = _result(lambda result: result.board.grabbed)
    dropped_on_board_frames: Mapping[str, int] = _result(lambda result: dict(result.board.dropped))
    sent_frames: int = _result(lambda result: result.board.sent)
    lost_on_link_frames: int = _result(lambda result: sum(each.lost for each in result.link.sessions))
    under_way_at_end_frames: int = _result(
        lambda result: result.board.sent - sum(each.received + each.lost for each in result.link.sessions)
    )
    received_frames: int = _result(lambda result: sum(each.received for each in result.link.sessions))
    before_clock_frames: int = _result(lambda result: result.link.no_clock)
    disbelieved_frames: Mapping[str, int] = _result(
        lambda result: {reason.value: count for reason, count in result.link.disbelieved.items()}
    )
    orphaned_frames: Mapping[str, int] = _result(lambda result: dict(result.counts.board_orphans))
    held_at_end_frames: int = _result(lambda result: result.counts.held_board)
    paired_pairs: int = _result(lambda result: result.counts.paired)
    dropped_in_fifo_pairs: int = _result(lambda result: result.counts.dropped)
    undecodable_pairs: int = _result(lambda result: result.undecodable)
    processed_pairs: int = _result(lambda result: result.processed)
    not_processed_at_end_pairs: int = _result(
        lambda result: result.counts.paired - result.counts.dropped - result.undecodable - result.processed
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchRun:
    """One run; without a JPEG quality the camera's images are sent as they are."""

    link: str = _result(lambda result: result.case.interface.link)
    emulated: str | None
    width_px: int
    height_px: int
    jpeg_quality_percent: int | None
    camera_rate_hz: int = _result(lambda result: result.case.rate_hz)
    pair_rate_hz: Number = _result(lambda result: result.pairs_per_second)
    measured_s: float
    measured_pairs: int = _result(lambda result: len(result.ledgers))
    mean_frame_bytes: int = _result(
        lambda result: round(sum(ledger.bytes for ledger in result.ledgers) / max(1, len(result.ledgers)))
    )
    least_frame_bytes: int = _result(lambda result: min((ledger.bytes for ledger in result.ledgers), default=0))
    delays: Mapping[str, DelaySpread]
    stages: Mapping[str, DelaySpread]
    time_skew: DelaySpread
    clock_uncertainty: UncertaintySpread
    clock_uncertainty_at_end_us: Number = _result(lambda result: result.uncertainty_ns / 1e3)
    clock_bound_at_end_us: Number = _result(lambda result: result.bound_ns / 1e3)
    regime: Judgement
    whole_run: RunCounts = _result(lambda result: made(RunCounts, result))
    line: RelayAccount | None = _result(lambda result: result.relay)


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedLink:
    """Latency and rate of a link with their 95 % intervals; JSON has no number for an infinite rate, the slope says what was found."""

    link: str
    fitted_frames: int = _fit(lambda fit: fit.points)
    latency_ms: Number = _fit(lambda fit: fit.latency_ns / 1e6)
    latency_low_ms: Number = _fit(lambda fit: fit.latency_low_ns / 1e6)
    latency_high_ms: Number = _fit(lambda fit: fit.latency_high_ns / 1e6)
    slope_ns_per_byte: Number = _fit(lambda fit: fit.ns_per_byte)
    slope_low_ns_per_byte: Number = _fit(lambda fit: fit.slope_low)
    slope_high_ns_per_byte: Number = _fit(lambda fit: fit.slope_high)
    typical_error_ms: Number = _fit(lambda fit: fit.typical_error_ns / 1e6)
    rate_bytes_per_s: Number = _fit(lambda fit: fit.bytes_per_s)
    rate_low_bytes_per_s: Number = _fit(lambda fit: fit.least_bytes_per_s)
    rate_high_bytes_per_s: Number = _fit(lambda fit: fit.most_bytes_per_s)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunFigures:
    """The figures of a run that are compared with their prediction."""

    pair_rate_hz: Number = _figures(lambda figures: figures.pairs_per_s)
    lost_percent: Number = _figures(lambda figures: 100.0 * figures.lost_share)
    propagation_p50_ms: Number = _figures(lambda figures: figures.propagation_p50_ns / 1e6)
    queuing_p95_ms: Number = _figures(lambda figures: figures.queuing_p95_ns / 1e6)
    starvation_p50_ms: Number = _figures(lambda figures: figures.starvation_p50_ns / 1e6)
    end_to_end_p50_ms: Number = _figures(lambda figures: figures.end_to_end_p50_ns / 1e6)
    end_to_end_p95_ms: Number = _figures(lambda figures: figures.end_to_end_p95_ns / 1e6)


@dataclass(frozen=True, slots=True)
class Predicted:
    """A run beside its prediction from all others, and from its own link and processing; or why there is none."""

    link: str = _checked(lambda one: str(one.case.interface))
    images: str = _checked(lambda one: one.case.images)
    measured: RunFigures = _checked(lambda one: made(RunFigures, one.measured))
    queues_alone: RunFigures | None = _checked(lambda one: _predicted(one.queues))
    predicted: RunFigures | None = _checked(lambda one: _predicted(one.predicted))
    reason: str | Absent = _checked(lambda one: _reason(one.predicted))


@dataclass(frozen=True, slots=True, kw_only=True)
class NotRunSetting:
    """The prediction for a setting that was not run; or why there is none."""

    link: str = _what_if(lambda one: one.interface)
    setting: str
    predicted: RunFigures | None = _what_if(lambda one: _predicted(one.figures))
    reason: str | Absent = _what_if(lambda one: _reason(one.figures))


@dataclass(frozen=True, slots=True, kw_only=True)
class PredictionErrors:
    """How far predictions were from measurements."""

    predicted_runs: int = _errors(lambda errors: errors.runs)
    pair_rate_median_percent: Number = _errors(lambda errors: 100.0 * errors.rate)
    pair_rate_worst_percent: Number = _errors(lambda errors: 100.0 * errors.worst_rate)
    end_to_end_p50_median_percent: Number = _errors(lambda errors: 100.0 * errors.end_to_end)
    end_to_end_p50_worst_percent: Number = _errors(lambda errors: 100.0 * errors.worst_end_to_end)


@dataclass(frozen=True, slots=True)
class BothErrors:
    """Errors of the predictions from the other runs, and of the queues alone."""

    held_out: PredictionErrors
    queues_alone: PredictionErrors


@dataclass(frozen=True, slots=True)
class NotRun:
    """An interface that could not be measured, and why."""

    link: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class DelayBenchResult:
    """What delay-bench measured and predicts, and under which conditions."""

    command: str = "delay-bench"
    recording: str | None
    machine: str
    date: str
    matcher: str
    measured_per_run_s: float
    left_out_warm_up_s: float
    fifo: str
    runs: tuple[BenchRun, ...]
    interfaces: tuple[FittedLink, ...]
    predictions: tuple[Predicted, ...]
    prediction_errors: BothErrors
    not_run_settings: tuple[NotRunSetting, ...]
    not_run: tuple[NotRun, ...]


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
        made(
            DelayBenchResult,
            under,
            recording=under.recording or None,
            measured_per_run_s=under.seconds,
            left_out_warm_up_s=WARM_UP_S,
            fifo=f"{under.fifo.depth}:{under.fifo.overflow.value}",
            runs=tuple(_run(result, under.fifo) for result in results),
            interfaces=tuple(made(FittedLink, one.fit, link=str(one.interface)) for one in analysis.fits),
            predictions=made(Predicted, analysis.checked),
            prediction_errors=BothErrors(
                made(PredictionErrors, analysis.held_out), made(PredictionErrors, analysis.queues)
            ),
            not_run_settings=made(NotRunSetting, analysis.what_ifs),
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


def percentiles(spread: Spread) -> dict[str, float]:
    """Return the percentiles that are reported, by name, and the mean, ns."""
    return {
        "p50": spread.p50_ns,
        "p95": spread.p95_ns,
        "p99": spread.p99_ns,
        "max": spread.max_ns,
        "mean": spread.mean_ns,
    }


def _run(result: CaseResult, fifo: FifoSettings) -> BenchRun:
    case, spread = result.case, statistics_of(result).spread
    run: BenchRun = made(
        BenchRun,
        result,
        case.size,
        emulated=case.interface.profile.name if case.interface.profile is not None else None,
        jpeg_quality_percent=None if case.quality_percent == BOARD_SETS else case.quality_percent,
        delays={name: made(DelaySpread, spread(name)) for name in DELAYS},
        stages={name: made(DelaySpread, spread(name)) for name in STAGES},
        time_skew=made(DelaySpread, spread("time_skew")),
        clock_uncertainty=made(UncertaintySpread, spread("uncertainty")),
        regime=regime_of(result, fifo),
    )
    return run


def _predicted(figures: Figures | Unknown) -> RunFigures | None:
    return None if isinstance(figures, Unknown) else made(RunFigures, figures)


def _reason(figures: Figures | Unknown) -> str | Absent:
    return figures.reason if isinstance(figures, Unknown) else ABSENT
