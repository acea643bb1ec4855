"""A run in figures: the report.json object and the summary for people. Pure."""

import math
from dataclasses import asdict, dataclass, field
from typing import Final

from common.camera.base import CameraHealth, health_values
from phone_host.accounts import LinkAccount, LinkTally, rung_lines, rung_values
from phone_host.delays import DELAYS, STAGES, DelayStatistics, Spread
from phone_host.model import TimeOffset
from phone_host.pairqueue import PairCounts
from phone_host.regime import Judgement, RunFigures, judge
from phone_host.results import Unwritten
from phone_host.sync.clock import ClockEstimate
from phone_host.sync.fifo import FifoSettings, Overflow
from phone_host.sync.phase import Alignment, Phase
from phone_host.trust import Timing, concerns

_MS: Final = 1e6


@dataclass(frozen=True, slots=True)
class RunFacts:
    """Everything a report is made of.

    Attributes:
        ended: why the run ended.
        processed: pairs whose results were written.
        undecodable: pairs whose bytes were no images.
        seconds: from the first to the last result, s.
        delays: of the processed pairs.
        counts: of frames and pairs on the host.
        link: the link's account.
        estimate: the last clock estimate, if there was one.
        tolerance_ns: greatest time skew of a pair.
        fifo: depth and policy.
        unwritten: what the disk did not take.
        spoiled: own frames that were no whole images.
        skipped: own frames that a newer one had replaced before they were looked at.
        time_offset: between the two cameras' stamps, as it was applied.
        phase: of the two cameras at the end; None: not known, or there is none.
        alignment: how the steering of a camera came out; None: not asked for.
        camera: how the own camera has fared.
        period_ns: of the slower camera, ns; 0 where images come on demand.
        motion_px_s: how fast the own camera's image moves, px/s; NaN where not measured.
        width_px: of that image; 0 where not measured.
        interpolated: whether the board's images were taken to the moment of the host's, so that their time skew did no harm.
    """

    ended: str
    processed: int
    undecodable: int
    seconds: float
    delays: DelayStatistics
    counts: PairCounts
    link: LinkAccount
    estimate: ClockEstimate | None
    tolerance_ns: int
    fifo: FifoSettings
    unwritten: Unwritten
    spoiled: int
    skipped: int
    camera: CameraHealth
    period_ns: int
    motion_px_s: float
    width_px: int
    interpolated: bool = False
    time_offset: TimeOffset = field(default_factory=TimeOffset)
    phase: Phase | None = None
    alignment: Alignment | None = None

    @property
    def stopped(self) -> int:
        """Pairs that still waited when the run was ended."""
        return self.counts.paired - self.processed - self.undecodable - self.counts.dropped

    @property
    def pairs_per_second(self) -> float:
        """Rate of results, 1/s; NaN with fewer than two."""
        return (self.processed - 1) / self.seconds if self.processed > 1 and self.seconds > 0 else float("nan")


def build(facts: RunFacts) -> dict[str, object]:
    """Make the report.json object; times in ms, None where nothing was measured.

    Args:
        facts: the run.
    """
    return {
        "ended": facts.ended,
        "pairs": facts.processed,
        "pairs_per_second": _number(facts.pairs_per_second),
        "delays_ms": {name: spread_ms(facts.delays.spread(name)) for name in DELAYS},
        "stages_ms": {name: spread_ms(facts.delays.spread(name)) for name in STAGES},
        "time_skew_ms": spread_ms(facts.delays.spread("time_skew")),
        "clock": _clock(facts),
        "phase": _phase(facts),
        "time_offset_ms": {
            "applied": facts.time_offset.offset_ns / _MS,
            "uncertainty": facts.time_offset.uncertainty_ns / _MS,
            "measured": facts.time_offset != TimeOffset(),
        },
        "fifo": {"depth": facts.fifo.depth, "overflow": facts.fifo.overflow.value, "age_bound": age_bound(facts)},
        "tolerance_ms": facts.tolerance_ns / _MS,
        "sessions": [_session(facts, index) for index in range(len(facts.link.sessions))],
        "links": [_link(tally) for tally in facts.link.links],
        "switches": facts.link.switches,
        "connects": facts.link.connects,
        "garbage": facts.link.garbage,
        "frames": {
            "received": facts.counts.received,
            "paired": facts.counts.paired,
            "held": facts.counts.held_board,
            "orphaned": dict(facts.counts.board_orphans),
            "before_clock": facts.link.no_clock,
        },
        "host_frames": {
            "grabbed": facts.counts.host_frames + facts.spoiled + facts.skipped,
            "spoiled": facts.spoiled,
            "skipped": facts.skipped,
            "paired": facts.counts.paired,
            "held": facts.counts.held_host,
            "orphaned": dict(facts.counts.host_orphans),
            "camera": _camera(facts.camera),
        },
        "regime": _regime(judge(figures(facts))),
        "image_motion_px_per_s": _number(facts.motion_px_s),
        "warnings": [
            {"doubt": item.doubt.value, "sentence": item.sentence, "remedy": item.remedy}
            for item in concerns(time_and_motion(facts))
        ],
        "pairs_account": {
            "paired": facts.counts.paired,
            "processed": facts.processed,
            "undecodable": facts.undecodable,
            "dropped_fifo": facts.counts.dropped,
            "stopped": facts.stopped,
        },
        "unwritten": asdict(facts.unwritten),
    }


def spread_ms(spread: Spread) -> dict[str, float | int | None]:
    """Give a spread in ms, rounded to the ns."""
    values = {
        "p50": spread.p50_ns,
        "p95": spread.p95_ns,
        "p99": spread.p99_ns,
        "max": spread.max_ns,
        "mean": spread.mean_ns,
    }
    return {"count": spread.count} | {name: _number(value / _MS) for name, value in values.items()}


def age_bound(facts: RunFacts) -> str:
    """Say how old a pair can get in the FIFO, from its depth and policy and the rates of this run."""
    depth, processing = facts.fifo.depth, facts.delays.spread("processing")
    if facts.fifo.overflow is Overflow.DROP_OLDEST:
        return f"{depth} frame period(s): newer pairs push older ones out"
    how = (
        "pairs that are in stay in"
        if facts.fifo.overflow is Overflow.DROP_NEWEST
        else "a pair is fetched when a place is free"
    )
    measured = f", here {depth * processing.p95_ns / _MS:.1f} ms (p95)" if processing.count else ""
    return f"{depth} processing time(s): {how}{measured}"


def summary(facts: RunFacts) -> str:
    """Say in a few lines what the run was."""
    rate = "" if math.isnan(facts.pairs_per_second) else f" in {facts.seconds:.1f} s ({facts.pairs_per_second:.1f} /s)"
    lines = [f"{facts.processed} pairs{rate}, ended: {facts.ended.replace('_', ' ')}"]
    if facts.processed:
        lines.append(f"{'delay, ms':14} {'p50':>9} {'p95':>9} {'p99':>9} {'max':>9}")
        for name in DELAYS:
            spread = facts.delays.spread(name)
            values = (spread.p50_ns, spread.p95_ns, spread.p99_ns, spread.max_ns)
            lines.append(f"{name.replace('_', '-'):14} " + " ".join(f"{value / _MS:9.3f}" for value in values))
    if facts.estimate is not None:
        lines.append(
            f"clock known to +-{facts.estimate.uncertainty_ns / 1000:.0f} us"
            f" (+-{facts.estimate.bound_ns / 1000:.0f} us whatever the link does), skew {facts.estimate.skew * 1e6:+.1f} ppm"
        )
    lines.append(_offset_text(facts.time_offset))
    lines += phase_lines(facts.phase, facts.alignment)
    lines += _arrivals(facts.camera, facts.time_offset)
    lines.append(judge(figures(facts)).sentence)
    lines += [f"  {remedy}" for remedy in judge(figures(facts)).remedies]
    lines += [f"warning: {item.sentence}: {item.remedy}" for item in concerns(time_and_motion(facts))]
    lines += camera_troubles(facts.camera)
    lines += [*rung_lines(facts.link), *_links(facts.link), *_losses(facts)]
    return "\n".join(lines)


def phase_lines(phase: Phase | None, alignment: Alignment | None) -> list[str]:
    """Say how the two cameras' exposures stand to each other, and what came of steering them."""
    lines = []
    if phase is not None:
        drift = (
            ""
            if not math.isfinite(phase.beat_s)
            else f", drifts by {phase.drift * 1e6:+.1f} ppm, comes round in {phase.beat_s:.0f} s"
        )
        side = "before" if phase.time_skew_ns < 0 else "after"
        lines.append(
            f"phase: the board exposes {abs(phase.time_skew_ns) / _MS:.1f} of {phase.period_ns / _MS:.1f} ms {side} the host{drift}"
        )
    if alignment is not None:
        lines.append(f"alignment: {alignment.state.value}: {alignment.words}")
    return lines


def _phase(facts: RunFacts) -> dict[str, object]:
    phase, alignment = facts.phase, facts.alignment
    said: dict[str, object] = {"known": phase is not None}
    if phase is not None:
        said |= {
            "time_skew_ms": _number(phase.time_skew_ns / _MS),
            "period_ms": _number(phase.period_ns / _MS),
            "drift_ppm": _number(phase.drift * 1e6),
            "beat_s": None if not math.isfinite(phase.beat_s) else _number(phase.beat_s),
        }
    if alignment is not None:
        said["alignment"] = {
            "state": alignment.state.value,
            "words": alignment.words,
            "corrections": alignment.corrections,
            "before_ms": _number(alignment.before_ns / _MS),
            "after_ms": _number(alignment.after_ns / _MS),
        }
    return said


def _offset_text(offset: TimeOffset) -> str:
    known = f"+-{offset.uncertainty_ns / _MS:.2f} ms"
    if offset == TimeOffset():
        return f"the cameras' stamps agree to {known}: not measured (phone-host calibrate-time)"
    return f"the cameras' stamps differ by {offset.offset_ns / _MS:+.2f} {known}, which is taken out"


def _arrivals(health: CameraHealth, offset: TimeOffset) -> list[str]:
    """What the stamps of an own camera mean that tells of arrivals only."""
    if health.jitter_ns is None:
        return []
    jitter = f"they arrive up to {health.jitter_ns / _MS:.1f} ms late (p95)"
    if health.latency_ns is not None:
        stated = health.latency_uncertainty_ns
        known = "" if stated is None else f", known to +-{(stated + health.jitter_ns) / _MS:.1f} ms"
        return [f"own camera: stamps are arrivals - {health.latency_ns / _MS:g} ms{known}; {jitter}"]
    if offset != TimeOffset():
        return [f"own camera: stamps are arrivals, its latency part of the measured difference; {jitter}"]
    return [
        f"own camera: its latency is not known, every time skew is off by it (calibrate-time, or ?latency_ms=); {jitter}"
    ]


def _links(link: LinkAccount) -> list[str]:
    """The links side by side, where there are several."""
    if len(link.links) < 2:
        return []
    lines = [f"{'link':14} {'frames':>9} {'carried':>9} {'lost':>9} {'age p50':>9} {'p95':>9}"]
    for tally in link.links:
        age = tally.age.spread()
        ages = f"{age.p50_ns / _MS:9.3f} {age.p95_ns / _MS:9.3f}" if age.count else f"{'-':>9} {'-':>9}"
        lines.append(f"{tally.name:14} {tally.frames:9} {tally.carried:9} {tally.lost:9} {ages}")
    return lines


def _losses(facts: RunFacts) -> list[str]:
    lost = sum(account.lost for account in facts.link.sessions)
    stale = sum(account.duplicate + account.late + account.old_session for account in facts.link.sessions)
    board = {reason: n for reason, n in board_drops(facts.link).items() if n}
    parts = [
        *(f"{n} {reason} on the board" for reason, n in board.items()),
        *([f"{lost} lost on the link"] if lost else []),
        *([f"{stale} stale"] if stale else []),
        *(f"{n} board frames {reason}" for reason, n in facts.counts.board_orphans),
        *(f"{n} host frames {reason}" for reason, n in facts.counts.host_orphans),
        *([f"{facts.counts.dropped} pairs in a full FIFO"] if facts.counts.dropped else []),
        *([f"{facts.stopped} pairs by the run's end"] if facts.stopped else []),
        *([f"{facts.undecodable} pairs undecodable"] if facts.undecodable else []),
    ]
    lines = ["dropped: " + (", ".join(parts).replace("_", " ") or "nothing")]
    if facts.unwritten.lines or facts.unwritten.pairs:
        lines.append(
            f"not written: {facts.unwritten.lines} lines, {facts.unwritten.pairs} pairs ({facts.unwritten.cause})"
        )
    return lines


def figures(facts: RunFacts) -> RunFigures:
    """What the queueing regime is judged by, over the whole run."""
    delays, counts, processed = facts.delays, facts.counts, facts.processed
    return RunFigures(
        pairs=processed,
        interval_ns=facts.seconds * 1e9 / (processed - 1) if processed > 1 else float("nan"),
        processing_ns=delays.spread("processing").mean_ns,
        match_ns=delays.spread("match").mean_ns,
        starvation_ns=delays.spread("starvation").mean_ns,
        period_ns=facts.period_ns,
        received=counts.received / counts.paired if counts.paired else 1.0,
        offered=counts.paired / processed if processed else 1.0,
        frame_bytes=delays.frame_bytes,
        propagation_ns=delays.spread("propagation").mean_ns,
        overflow=facts.fifo.overflow,
    )


def time_and_motion(facts: RunFacts, last: int | None = None) -> Timing:
    """What time and motion are.

    Args:
        facts: the run.
        last: over how many of the newest pairs; None for all.
    """
    return Timing(
        time_skew_ns=float("nan") if facts.interpolated else facts.delays.spread("time_skew", last).p95_ns,
        uncertainty_ns=facts.delays.spread("uncertainty", last).p50_ns,
        end_to_end_ns=facts.delays.spread("end_to_end", last).p50_ns,
        motion_px_s=facts.motion_px_s,
        width_px=facts.width_px,
    )


def _regime(judgement: Judgement) -> dict[str, object]:
    return {
        "regime": judgement.regime.value,
        "sentence": judgement.sentence,
        "remedies": list(judgement.remedies),
    }


def camera_troubles(health: CameraHealth) -> list[str]:
    """Say what has befallen a camera, in one line; nothing where nothing has."""
    parts = [
        *([f"unplugged {health.unplugged} times"] if health.unplugged else []),
        *([f"stalled {health.stalls} times"] if health.stalls else []),
        *([f"failed {health.failures} times"] if health.failures else []),
        *([f"back {health.returned} times"] if health.returned else []),
        *([f"{health.missed} frames missed by its driver"] if health.missed else []),
        *(f"{count} frames {fault.value}" for fault, count in health.faults),
        *([f"{health.distrusted_stamps} stamps not believed"] if health.distrusted_stamps else []),
        *([f"{health.refused_controls} controls refused"] if health.refused_controls else []),
    ]
    return [f"own camera: {', '.join(parts)}".replace("_", " ")] if parts else []


def board_drops(link: LinkAccount) -> dict[str, int]:
    """Frames that the board dropped while this host was connected, by reason."""
    drops: dict[str, int] = {}
    for account in link.sessions:
        before = dict(account.first.dropped)
        for reason, count in account.latest.dropped:
            drops[reason.value] = drops.get(reason.value, 0) + count - before.get(reason, 0)
    return drops


def _clock(facts: RunFacts) -> dict[str, object]:
    estimate = facts.estimate
    if estimate is None:
        return {"known": False}
    return {
        "known": True,
        "offset_ns": estimate.offset_ns,
        "skew_ppm": estimate.skew * 1e6,
        "uncertainty_us": estimate.uncertainty_ns / 1e3,
        "bound_us": estimate.bound_ns / 1e3,
        "round_trip_us": estimate.round_trip_ns / 1e3,
        "uncertainty_at_pairs_us": {
            k: None if v is None else v * 1e3
            for k, v in spread_ms(facts.delays.spread("uncertainty")).items()
            if k != "count"
        },
    }


def _camera(health: CameraHealth) -> dict[str, object]:
    """What is known of the own camera; its stamps' figures only where they are arrivals."""
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


def _link(tally: LinkTally) -> dict[str, object]:
    return {
        "link": tally.name,
        "up": tally.is_up,
        "frames": tally.frames,
        "bytes": tally.bytes,
        "carried": tally.carried,
        "lost": tally.lost,
        "age_ms": spread_ms(tally.age.spread()),
    }


def _session(facts: RunFacts, index: int) -> dict[str, object]:
    account = facts.link.sessions[index]
    before = dict(account.first.dropped)
    dropped = {reason.value: count - before.get(reason, 0) for reason, count in account.latest.dropped}
    grabbed, sent = account.latest.grabbed - account.first.grabbed, account.latest.sent - account.first.sent
    return {
        "session": account.session,
        "grabbed": grabbed,
        "sent": sent,
        "dropped": dropped,
        "waiting": grabbed - sent - sum(dropped.values()),
        "received": account.received,
        "lost": account.lost,
        "camera": rung_values(account.rung),
        "stale": {"duplicate": account.duplicate, "late": account.late, "old_session": account.old_session},
        "ended": account.ended,
        "tail": "unknown" if account.vanished else "known",
    }


def _number(value: float) -> float | None:
    return None if value != value else round(value, 6)  # noqa: PLR0124 - NaN is the only value unlike itself; JSON has none
