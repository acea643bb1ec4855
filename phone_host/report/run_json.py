"""report.json of a run: its keys are the fields of these classes. Pure; times in ms, null where nothing was measured."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from common.camera.base import CameraHealth, health_values
from common.diagnostic import Diagnostic
from common.versions import REPORT_FORMAT
from phone_host.accounts.delays import DELAYS, FROM_EXPOSURE, STAGES, ReplayFacts, SinkAccount
from phone_host.accounts.link_account import Away
from phone_host.diagnostics.headline import Grade, headline
from phone_host.diagnostics.image_judge import Episode, saved_pairs, told_past
from phone_host.diagnostics.run_rules import concerns, history
from phone_host.diagnostics.run_snapshot import TIMELESS, RecordingAccount, RunSnapshot, Unused, disbelieved, unused
from phone_host.diagnostics.throughput import Judgement, figures, judge
from phone_host.model import CutCounts, DepthAccount, DepthLimits, TimeOffset, Unwritten
from phone_host.report.budget_report import BudgetResult
from phone_host.report.drift_report import RunDrift
from phone_host.report.json_result import ABSENT, D3, D4, Absent, FieldOf, Number, json_values, made
from phone_host.report.link_json import (
    KnownClock,
    LinkResult,
    SessionResult,
    SpreadMs,
    Told,
    UnknownClock,
    clock_result,
    session_result,
)
from phone_host.report.match_words import Corrected
from phone_host.report.stereo_trust import Doubt, ImagesResult
from phone_host.sync.fifo import Overflow
from phone_host.sync.phase import Aligning, Alignment
from phone_host.sync.stills import PairedBy

_MS: Final = 1e6

_offset, _away, _alignment = FieldOf[TimeOffset](), FieldOf[Away](), FieldOf[Alignment]()
_run, _sink, _depth, _replay = (
    FieldOf[RunSnapshot](),
    FieldOf[SinkAccount](),
    FieldOf[DepthAccount](),
    FieldOf[ReplayFacts](),
)

Spreads = Mapping[str, SpreadMs | None]
"""By what took so long."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AwayResult:
    """An absence of the board."""

    at_s: D3
    seconds: D3
    came_back: bool = _away(lambda away: away.is_over)


@dataclass(frozen=True, slots=True, kw_only=True)
class AlignmentResult:
    """How a camera was steered towards the other one's phase."""

    state: Aligning
    words: str
    corrections: int
    before_ms: Number = _alignment(lambda alignment: alignment.before_ns / _MS)
    after_ms: Number = _alignment(lambda alignment: alignment.after_ns / _MS)


@dataclass(frozen=True, slots=True, kw_only=True)
class PhaseResult:
    """The phase of the two cameras."""

    known: bool
    time_skew_ms: Number | Absent = ABSENT
    period_ms: Number | Absent = ABSENT
    drift_ppm: Number | Absent = ABSENT
    beat_s: Number | Absent = ABSENT
    alignment: AlignmentResult | Absent = ABSENT


@dataclass(frozen=True, slots=True, kw_only=True)
class OffsetResult:
    """The time offset between the two cameras' stamps."""

    applied: float = _offset(lambda offset: offset.offset_ns / _MS)
    uncertainty: float = _offset(lambda offset: offset.uncertainty_ns / _MS)
    measured: bool = _offset(lambda offset: offset != TimeOffset())


@dataclass(frozen=True, slots=True, kw_only=True)
class FifoResult:
    """The queue of pairs, and how old one can get in it."""

    depth: int = _run(lambda run: run.fifo.depth)
    overflow: Overflow | None = _run(lambda run: None if run.timeless else run.fifo.overflow)
    age_bound: str


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardFrames:
    """What became of the board's frames."""

    received: int
    paired: int
    held: int = _run(lambda run: run.counts.held_board)
    orphaned: Mapping[str, int] = _run(lambda run: dict(run.counts.board_orphans))
    before_clock: int = _run(lambda run: run.link.no_clock)
    disbelieved: Mapping[str, int] = _run(disbelieved)


@dataclass(frozen=True, slots=True, kw_only=True)
class HostFrames:
    """What became of the frames of the host's camera, and of itself."""

    grabbed: int = _run(lambda run: run.counts.host_frames + run.spoiled + run.skipped + run.own_future)
    spoiled: int
    skipped: int
    from_the_future: int = _run(lambda run: run.own_future)
    paired: int
    held: int = _run(lambda run: run.counts.held_host)
    orphaned: Mapping[str, int] = _run(lambda run: dict(run.counts.host_orphans))
    camera: Told = _run(lambda run: _camera(run.camera))


@dataclass(frozen=True, slots=True, kw_only=True)
class DepthResult:
    """What became of the pixels of all pairs, and between which limits."""

    scale: D4 | None = _depth(lambda depth: None if depth.search is None else depth.search.scale)
    disparities: int | None = _depth(lambda depth: None if depth.search is None else depth.search.disparities or None)
    corrected: Corrected | None = _depth(lambda depth: made(Corrected, depth.match_report))
    corrected_median: Corrected | None = _depth(lambda depth: made(Corrected, depth.median_report))
    limits: DepthLimits | None
    cut: CutCounts | None


@dataclass(frozen=True, slots=True, kw_only=True)
class EpisodeResult(Doubt):
    """A while during which a doubt stood, with the numbers of its pairs, counted from 0."""

    from_s: D3
    to_s: D3
    is_over: bool
    first_pair: int
    last_pair: int
    judged_pairs: int
    saved_pairs: tuple[int, ...]
    saved_pairs_between: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class RunTrust:
    """The answer, every doubt, and how density, consistency and vertical error moved."""

    grade: Grade = _run(lambda run: headline(run).grade)
    headline: str = _run(lambda run: headline(run).sentence)
    doubts: tuple[Doubt, ...] = _run(lambda run: made(Doubt, concerns(run)))
    wants_depth: bool
    has_depth: bool
    judged_pairs: int = _run(lambda run: run.images.judged)
    at_first: ImagesResult = _run(lambda run: made(ImagesResult, run.images.start))
    now: ImagesResult = _run(lambda run: made(ImagesResult, run.images.now))
    history: tuple[EpisodeResult, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Warned:
    """What terminal and page warn of."""

    doubt: str
    sentence: str
    remedy: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PairsAccount:
    """What became of the pairs."""

    paired: int
    processed: int
    undecodable: int
    spoiled_images: Mapping[str, int] = _run(lambda run: dict(run.spoiled_images))
    dropped_fifo: int = _run(lambda run: run.counts.dropped)
    stopped: int


@dataclass(frozen=True, slots=True, kw_only=True)
class SinkResult:
    """What became of the results that a sink was offered."""

    written: int
    dropped: int
    failed: int
    delay_ms: SpreadMs = _sink(lambda sink: made(SpreadMs, sink.delay))


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayResult:
    """What was played, and the delays of then."""

    file: str
    pace: str
    recorded_pairs: int = _replay(lambda replay: replay.pairs)
    recorded_delays_ms: Spreads = _replay(
        lambda replay: {name: made(SpreadMs, replay.delays.spread(name)) for name in DELAYS}
    )
    recorded_time_skew_ms: SpreadMs = _replay(lambda replay: made(SpreadMs, replay.delays.spread("time_skew")))


@dataclass(frozen=True, slots=True, kw_only=True)
class RunResult:
    """What came of a run."""

    format_version: int = REPORT_FORMAT
    command: str = "run"
    ended: str
    error: Diagnostic | None = _run(lambda run: run.failure)
    pairs: int = _run(lambda run: run.processed)
    pairs_asked: int | None = _run(lambda run: run.asked_pairs or None)
    pairs_per_second: Number
    paired_by: PairedBy = _run(lambda run: run.replayed.paired_by)
    not_measured: Mapping[str, str] = _run(lambda run: dict.fromkeys(FROM_EXPOSURE, TIMELESS) if run.timeless else {})
    board_away: tuple[AwayResult, ...] = _run(lambda run: made(AwayResult, run.away))
    delays_ms: Spreads = _run(lambda run: {name: _spread_ms(run, name) for name in DELAYS})
    stages_ms: Spreads = _run(lambda run: {name: made(SpreadMs, run.delays.spread(name)) for name in STAGES})
    time_skew_ms: SpreadMs | None = _run(lambda run: _spread_ms(run, "time_skew"))
    clock: UnknownClock | KnownClock
    phase: PhaseResult
    time_offset_ms: OffsetResult = _run(lambda run: made(OffsetResult, run.time_offset))
    fifo: FifoResult = _run(lambda run: made(FifoResult, run, age_bound=age_bound(run)))
    tolerance_ms: float = _run(lambda run: run.tolerance_ns / _MS)
    sessions: tuple[SessionResult, ...] = _run(lambda run: tuple(map(session_result, run.link.sessions)))
    links: tuple[LinkResult, ...] = _run(
        lambda run: tuple(
            made(LinkResult, tally, age_ms=None if run.timeless else made(SpreadMs, tally.age.spread()))
            for tally in run.link.links
        )
    )
    switches: int = _run(lambda run: run.link.switches)
    connects: int = _run(lambda run: run.link.connects)
    garbage: int = _run(lambda run: run.link.garbage)
    frames: BoardFrames = _run(lambda run: made(BoardFrames, run, run.counts))
    host_frames: HostFrames = _run(lambda run: made(HostFrames, run, run.counts))
    depth: DepthResult | None = _run(lambda run: None if run.depth.cut is None else made(DepthResult, run.depth))
    matcher_note: str | None = _run(lambda run: run.matcher_note or None)
    budget: BudgetResult | None = _run(lambda run: made(BudgetResult, run.budget))
    drift: RunDrift | None = _run(lambda run: made(RunDrift, run.drift))
    regime: Judgement = _run(lambda run: judge(figures(run)))
    image_motion_px_per_s: Number = _run(lambda run: run.motion_px_s)
    trust: RunTrust
    warnings: tuple[Warned, ...]
    shortfall: str | None = _run(lambda run: run.shortfall or None)
    pairs_account: PairsAccount = _run(lambda run: made(PairsAccount, run, run.counts))
    unused: tuple[Unused, ...] = _run(unused)
    sinks: Mapping[str, SinkResult] = _run(lambda run: {sink.name: made(SinkResult, sink) for sink in run.sinks})
    unwritten: Unwritten
    recording: RecordingAccount | None
    replay: ReplayResult | None = _run(lambda run: made(ReplayResult, run.replay))


def build(run: RunSnapshot, command: str = "run") -> dict[str, Any]:
    """Make the report.json object."""
    past = history(run)
    trust = made(RunTrust, run, run.images, history=tuple(_episode(each, run.save_every) for each in past))
    told = [Warned(doubt=each.code, sentence=each.message, remedy=each.remedy) for each in concerns(run)]
    gone = told_past(past, run.processed, run.save_every)
    told += [Warned(doubt=item.code, sentence=line, remedy=item.remedy) for item, line in gone]
    known = {"clock": clock_result(run), "phase": _phase(run), "trust": trust, "warnings": tuple(told)}
    return json_values(made(RunResult, run, command=command, **known))


def _spread_ms(run: RunSnapshot, name: str) -> SpreadMs | None:
    """Return the spread of a delay; None: it is counted from an exposure that has no time."""
    return None if run.timeless and name in FROM_EXPOSURE else made(SpreadMs, run.delays.spread(name))


def _episode(episode: Episode, save_every: int) -> EpisodeResult:
    saved = saved_pairs(episode, save_every)
    told: EpisodeResult = made(
        EpisodeResult,
        episode.concern,
        episode,
        judged_pairs=episode.judgements,
        saved_pairs=saved.judged,
        saved_pairs_between=saved.between,
    )
    return told


def age_bound(run: RunSnapshot) -> str:
    """Say how old a pair can get in the FIFO, given its depth and policy and this run's rates."""
    depth, processing = run.fifo.depth, run.delays.spread("processing")
    if run.timeless:
        return "none needed: images come on demand, when there is room, so that none is dropped and none has an age"
    if run.fifo.overflow is Overflow.DROP_OLDEST:
        return f"{depth} frame period(s): newer pairs push older ones out"
    how = (
        "pairs that are in stay in"
        if run.fifo.overflow is Overflow.DROP_NEWEST
        else "a pair is fetched when a place is free"
    )
    measured = f", here {depth * processing.p95_ns / _MS:.1f} ms (p95)" if processing.count else ""
    return f"{depth} processing time(s): {how}{measured}"


def _phase(run: RunSnapshot) -> PhaseResult:
    phase = run.phase
    alignment = ABSENT if run.alignment is None else made(AlignmentResult, run.alignment)
    if phase is None:
        return PhaseResult(known=False, alignment=alignment)
    return PhaseResult(
        known=True,
        time_skew_ms=phase.time_skew_ns / _MS,
        period_ms=phase.period_ns / _MS,
        drift_ppm=phase.drift * 1e6,
        beat_s=phase.beat_s,
        alignment=alignment,
    )


def _camera(health: CameraHealth) -> Told:
    """Return what is known of the own camera; figures of its stamps only if they are arrival times."""
    values = health_values(health)
    if health.jitter_ns is None:
        return values
    stated = health.latency_uncertainty_ns
    return values | {
        "latency_ms": _ms(health.latency_ns),
        "jitter_ms": _ms(health.jitter_ns),
        "stamp_uncertainty_ms": None if stated is None else _ms(stated + health.jitter_ns),
    }


def _ms(value_ns: int | None) -> float | None:
    return None if value_ns is None else round(value_ns / _MS, 3)
