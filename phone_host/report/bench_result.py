"""delay-bench.json: its keys are the fields of these classes. Pure.

Times are over the pairs after the warm-up, counts of the whole run.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from phone_host.report.json_result import ABSENT, D6, Absent

Number = D6 | None
"""Null: not measured, or infinite."""


@dataclass(frozen=True, slots=True)
class DelaySpread:
    """The distribution of a delay over the pairs of a run."""

    p50_ms: Number
    p95_ms: Number
    p99_ms: Number
    max_ms: Number
    mean_ms: Number


@dataclass(frozen=True, slots=True)
class UncertaintySpread:
    """The distribution of the clock's uncertainty over the pairs of a run."""

    p50_us: Number
    p95_us: Number
    p99_us: Number
    max_us: Number
    mean_us: Number


@dataclass(frozen=True, slots=True)
class RegimeTold:
    """Which queueing regime held, and what would help."""

    regime: str
    sentence: str
    remedies: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class RunCounts:
    """What became of every frame and pair of a run; some by reason."""

    grabbed_frames: int
    dropped_on_board_frames: Mapping[str, int]
    sent_frames: int
    lost_on_link_frames: int
    under_way_at_end_frames: int
    received_frames: int
    before_clock_frames: int
    disbelieved_frames: Mapping[str, int]
    orphaned_frames: Mapping[str, int]
    held_at_end_frames: int
    paired_pairs: int
    dropped_in_fifo_pairs: int
    undecodable_pairs: int
    processed_pairs: int
    not_processed_at_end_pairs: int


@dataclass(frozen=True, slots=True)
class RelayAccount:
    """What the process that emulated a line reports when it ends; bytes lost and stalls are of both directions."""

    to_host_bytes: int
    to_board_bytes: int
    lost_bytes: int
    stalls: int
    cpu_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class BenchRun:
    """One run; without a JPEG quality the camera's images are sent as they are."""

    link: str
    emulated: str | None
    width_px: int
    height_px: int
    jpeg_quality_percent: int | None
    camera_rate_hz: int
    pair_rate_hz: Number
    measured_s: float
    measured_pairs: int
    mean_frame_bytes: int
    least_frame_bytes: int
    delays: Mapping[str, DelaySpread]
    stages: Mapping[str, DelaySpread]
    time_skew: DelaySpread
    clock_uncertainty: UncertaintySpread
    clock_uncertainty_at_end_us: Number
    clock_bound_at_end_us: Number
    regime: RegimeTold
    whole_run: RunCounts
    line: RelayAccount | None


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedLink:
    """Latency and rate of a link with their 95 % intervals; JSON has no number for an infinite rate, the slope says what was found."""

    link: str
    fitted_frames: int
    latency_ms: Number
    latency_low_ms: Number
    latency_high_ms: Number
    slope_ns_per_byte: Number
    slope_low_ns_per_byte: Number
    slope_high_ns_per_byte: Number
    typical_error_ms: Number
    rate_bytes_per_s: Number
    rate_low_bytes_per_s: Number
    rate_high_bytes_per_s: Number


@dataclass(frozen=True, slots=True, kw_only=True)
class RunFigures:
    """The figures of a run that are compared with their prediction."""

    pair_rate_hz: Number
    lost_percent: Number
    propagation_p50_ms: Number
    queuing_p95_ms: Number
    starvation_p50_ms: Number
    end_to_end_p50_ms: Number
    end_to_end_p95_ms: Number


@dataclass(frozen=True, slots=True)
class Predicted:
    """A run beside its prediction from all others, and from its own link and processing; or why there is none."""

    link: str
    images: str
    measured: RunFigures
    queues_alone: RunFigures | None
    predicted: RunFigures | None
    reason: str | Absent = ABSENT


@dataclass(frozen=True, slots=True)
class NotRunSetting:
    """The prediction for a setting that was not run; or why there is none."""

    link: str
    setting: str
    predicted: RunFigures | None
    reason: str | Absent = ABSENT


@dataclass(frozen=True, slots=True, kw_only=True)
class PredictionErrors:
    """How far predictions were from measurements."""

    predicted_runs: int
    pair_rate_median_percent: Number
    pair_rate_worst_percent: Number
    end_to_end_p50_median_percent: Number
    end_to_end_p50_worst_percent: Number


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
