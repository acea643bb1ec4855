"""A run in figures: the report.json object. Pure; times in ms, None where nothing was measured."""

import math
from dataclasses import asdict
from typing import Final

from common.camera.base import CameraHealth, health_values
from phone_host.measure.accounts import LinkTally, rung_values
from phone_host.measure.delays import DELAYS, STAGES, Spread
from phone_host.measure.regime import Judgement, judge
from phone_host.measure.run_facts import RunFacts, concerns, disbelieved, figures
from phone_host.model import TimeOffset
from phone_host.sync.fifo import Overflow

_MS: Final = 1e6


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
            "disbelieved": disbelieved(facts),
        },
        "host_frames": {
            "grabbed": facts.counts.host_frames + facts.spoiled + facts.skipped + facts.own_future,
            "spoiled": facts.spoiled,
            "skipped": facts.skipped,
            "from_the_future": facts.own_future,
            "paired": facts.counts.paired,
            "held": facts.counts.held_host,
            "orphaned": dict(facts.counts.host_orphans),
            "camera": _camera(facts.camera),
        },
        "regime": _regime(judge(figures(facts))),
        "image_motion_px_per_s": _number(facts.motion_px_s),
        "warnings": [
            {"doubt": item.doubt.value, "sentence": item.sentence, "remedy": item.remedy} for item in concerns(facts)
        ],
        "pairs_account": {
            "paired": facts.counts.paired,
            "processed": facts.processed,
            "undecodable": facts.undecodable,
            "spoiled_images": dict(facts.spoiled_images),
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


def _regime(judgement: Judgement) -> dict[str, object]:
    return {
        "regime": judgement.regime.value,
        "sentence": judgement.sentence,
        "remedies": list(judgement.remedies),
    }


def _clock(facts: RunFacts) -> dict[str, object]:
    estimate, link = facts.estimate, facts.link
    told = {
        "doubts": link.clock_doubts,
        "steps": link.clock_steps,
        "suspects": [asdict(suspects) for suspects in link.suspects],
    }
    if estimate is None:
        return {"known": False} | told
    return told | {
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
        "lost_late": account.late,
        "camera": rung_values(account.rung),
        "stale": {"duplicate": account.duplicate, "old_session": account.old_session},
        "disbelieved": {reason.value: count for reason, count in account.disbelieved.items()},
        "ended": account.ended,
        "tail": "unknown" if account.vanished else "known",
    }


def _number(value: float) -> float | None:
    return None if value != value else round(value, 6)  # noqa: PLR0124 - NaN is the only value unlike itself; JSON has none
