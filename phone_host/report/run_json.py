"""Makes the report.json object of a run. Pure; times in ms, None where nothing was measured."""

from dataclasses import asdict
from typing import Final

from common.camera.base import CameraHealth, health_values
from common.diagnostic import Diagnostic
from common.versions import REPORT_FORMAT
from phone_host.accounts.delays import DELAYS, FROM_EXPOSURE, STAGES, ReplayFacts, SinkAccount, Spread
from phone_host.accounts.link_account import LinkTally, rung_values
from phone_host.diagnostics.headline import headline
from phone_host.diagnostics.image_judge import Episode, saved_pairs, told_past
from phone_host.diagnostics.run_rules import concerns, history
from phone_host.diagnostics.run_snapshot import TIMELESS, RecordingAccount, RunSnapshot, disbelieved, unused
from phone_host.diagnostics.throughput import Judgement, figures, judge
from phone_host.model import DepthAccount, TimeOffset
from phone_host.output.json_text import json_number
from phone_host.report.budget_report import budget_values
from phone_host.report.drift_report import RunDrift
from phone_host.report.json_result import result_values
from phone_host.report.match_words import Corrected
from phone_host.report.stereo_trust import Doubt, ImagesResult
from phone_host.sync.fifo import Overflow

_MS: Final = 1e6


def build(run: RunSnapshot, command: str = "run") -> dict[str, object]:
    """Make the report.json object; times in ms, None where nothing was measured."""
    return {
        "format_version": REPORT_FORMAT,
        "command": command,
        "ended": run.ended,
        "error": problem_values(run.failure),
        "pairs": run.processed,
        "pairs_asked": run.asked_pairs or None,
        "pairs_per_second": json_number(run.pairs_per_second),
        "paired_by": run.replayed.paired_by.value,
        **_delays(run),
        "clock": _clock(run),
        "phase": _phase(run),
        "time_offset_ms": _time_offset(run.time_offset),
        "fifo": {
            "depth": run.fifo.depth,
            "overflow": None if run.timeless else run.fifo.overflow.value,
            "age_bound": age_bound(run),
        },
        "tolerance_ms": run.tolerance_ns / _MS,
        "sessions": [_session(run, index) for index in range(len(run.link.sessions))],
        "links": [_link(tally, timeless=run.timeless) for tally in run.link.links],
        "switches": run.link.switches,
        "connects": run.link.connects,
        "garbage": run.link.garbage,
        "frames": _frames(run),
        "host_frames": _host_frames(run),
        "depth": _depth(run.depth),
        "matcher_note": run.matcher_note or None,
        "budget": budget_values(run.budget),
        "drift": result_values(RunDrift, run.drift),
        "regime": _regime(judge(figures(run))),
        "image_motion_px_per_s": json_number(run.motion_px_s),
        "trust": _trust(run),
        "warnings": _warnings(run),
        "shortfall": run.shortfall or None,
        "pairs_account": _pairs_account(run),
        "unused": [{"place": item.place, "reason": item.reason, "count": item.count} for item in unused(run)],
        "sinks": {sink.name: _sink(sink) for sink in run.sinks},
        "unwritten": asdict(run.unwritten),
        "recording": None if run.recording is None else recording_values(run.recording),
        "replay": None if run.replay is None else _replay(run.replay),
    }


def _replay(replay: ReplayFacts) -> dict[str, object]:
    """Return what was played, and the delays of then."""
    return {
        "file": replay.file,
        "pace": replay.pace,
        "recorded_pairs": replay.pairs,
        "recorded_delays_ms": {name: spread_ms(replay.delays.spread(name)) for name in DELAYS},
        "recorded_time_skew_ms": spread_ms(replay.delays.spread("time_skew")),
    }


def _warnings(run: RunSnapshot) -> list[dict[str, object]]:
    """Return what terminal and page warn of: what stands at the end, and what stood for a while."""
    told = [(item.code, item.message, item.remedy) for item in concerns(run)]
    gone = told_past(history(run), run.processed, run.save_every)
    told += [(item.code, line, item.remedy) for item, line in gone]
    return [{"doubt": doubt, "sentence": sentence, "remedy": remedy} for doubt, sentence, remedy in told]


def _delays(run: RunSnapshot) -> dict[str, object]:
    """Return what took how long, when the board was away, and what of it was not measured."""
    return {
        "not_measured": dict.fromkeys(FROM_EXPOSURE, TIMELESS) if run.timeless else {},
        "board_away": [
            {"at_s": round(item.at_s, 3), "seconds": round(item.seconds, 3), "came_back": item.is_over}
            for item in run.away
        ],
        "delays_ms": {name: None if _is_untold(run, name) else spread_ms(run.delays.spread(name)) for name in DELAYS},
        "stages_ms": {name: spread_ms(run.delays.spread(name)) for name in STAGES},
        "time_skew_ms": None if run.timeless else spread_ms(run.delays.spread("time_skew")),
    }


def _time_offset(offset: TimeOffset) -> dict[str, object]:
    return {
        "applied": offset.offset_ns / _MS,
        "uncertainty": offset.uncertainty_ns / _MS,
        "measured": offset != TimeOffset(),
    }


def _frames(run: RunSnapshot) -> dict[str, object]:
    """Account for the board's frames."""
    return {
        "received": run.counts.received,
        "paired": run.counts.paired,
        "held": run.counts.held_board,
        "orphaned": dict(run.counts.board_orphans),
        "before_clock": run.link.no_clock,
        "disbelieved": disbelieved(run),
    }


def _host_frames(run: RunSnapshot) -> dict[str, object]:
    """Account for the own camera's frames."""
    return {
        "grabbed": run.counts.host_frames + run.spoiled + run.skipped + run.own_future,
        "spoiled": run.spoiled,
        "skipped": run.skipped,
        "from_the_future": run.own_future,
        "paired": run.counts.paired,
        "held": run.counts.held_host,
        "orphaned": dict(run.counts.host_orphans),
        "camera": _camera(run.camera),
    }


def _pairs_account(run: RunSnapshot) -> dict[str, object]:
    """Account for the pairs."""
    return {
        "paired": run.counts.paired,
        "processed": run.processed,
        "undecodable": run.undecodable,
        "spoiled_images": dict(run.spoiled_images),
        "dropped_fifo": run.counts.dropped,
        "stopped": run.stopped,
    }


def _is_untold(run: RunSnapshot, name: str) -> bool:
    """Whether a delay is counted from an exposure that has no time."""
    return run.timeless and name in FROM_EXPOSURE


def _depth(depth: DepthAccount) -> dict[str, object] | None:
    """Return what became of the pixels of all pairs, and between which limits; None without a core."""
    if depth.cut is None:
        return None
    return {
        "scale": None if depth.search is None else round(depth.search.scale, 4),
        "disparities": None if depth.search is None else depth.search.disparities or None,
        "corrected": result_values(Corrected, depth.match_report),
        "corrected_median": result_values(Corrected, depth.median_report),
        "limits": None if depth.limits is None else asdict(depth.limits),
        "cut": asdict(depth.cut),
    }


def _trust(run: RunSnapshot) -> dict[str, object]:
    """Return the answer, every doubt, and how density, consistency and vertical error moved."""
    said, images = headline(run), run.images
    return {
        "grade": said.grade.value,
        "headline": said.sentence,
        "doubts": [result_values(Doubt, item) for item in concerns(run)],
        "wants_depth": images.wants_depth,
        "has_depth": images.has_depth,
        "judged_pairs": images.judged,
        "at_first": result_values(ImagesResult, images.start),
        "now": result_values(ImagesResult, images.now),
        "history": [_episode(item, run.save_every) for item in history(run)],
    }


def _episode(item: Episode, save_every: int) -> dict[str, object]:
    """Return one while during which a doubt stood, with the numbers of its pairs, counted from 0."""
    saved = saved_pairs(item, save_every)
    return {
        **result_values(Doubt, item.concern),
        "from_s": round(item.from_s, 3),
        "to_s": round(item.to_s, 3),
        "is_over": item.is_over,
        "first_pair": item.first_pair,
        "last_pair": item.last_pair,
        "judged_pairs": item.judgements,
        "saved_pairs": list(saved.judged),
        "saved_pairs_between": list(saved.between),
    }


def problem_values(found: Diagnostic | None) -> dict[str, object] | None:
    """Return what is wrong and what helps; None: nothing is."""
    return None if found is None else {"problem": found.message, "remedy": found.remedy}


def recording_values(account: RecordingAccount) -> dict[str, object]:
    """Return what became of a recording."""
    return {**asdict(account), "failure": problem_values(account.failure)}


def _sink(sink: SinkAccount) -> dict[str, object]:
    return {"written": sink.written, "dropped": sink.dropped, "failed": sink.failed, "delay_ms": spread_ms(sink.delay)}


def spread_ms(spread: Spread) -> dict[str, float | int | None]:
    """Convert a spread to ms, rounded to the ns."""
    values = {
        "p50": spread.p50_ns,
        "p95": spread.p95_ns,
        "p99": spread.p99_ns,
        "max": spread.max_ns,
        "mean": spread.mean_ns,
    }
    return {"count": spread.count} | {name: json_number(value / _MS) for name, value in values.items()}


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


def _phase(run: RunSnapshot) -> dict[str, object]:
    phase, alignment = run.phase, run.alignment
    said: dict[str, object] = {"known": phase is not None}
    if phase is not None:
        said |= {
            "time_skew_ms": json_number(phase.time_skew_ns / _MS),
            "period_ms": json_number(phase.period_ns / _MS),
            "drift_ppm": json_number(phase.drift * 1e6),
            "beat_s": json_number(phase.beat_s),
        }
    if alignment is not None:
        said["alignment"] = {
            "state": alignment.state.value,
            "words": alignment.words,
            "corrections": alignment.corrections,
            "before_ms": json_number(alignment.before_ns / _MS),
            "after_ms": json_number(alignment.after_ns / _MS),
        }
    return said


def _regime(judgement: Judgement) -> dict[str, object]:
    return {
        "regime": judgement.regime.value,
        "sentence": judgement.sentence,
        "remedies": list(judgement.remedies),
    }


def _clock(run: RunSnapshot) -> dict[str, object]:
    estimate, link = run.estimate, run.link
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
            for k, v in spread_ms(run.delays.spread("uncertainty")).items()
            if k != "count"
        },
    }


def _camera(health: CameraHealth) -> dict[str, object]:
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


def _link(tally: LinkTally, *, timeless: bool) -> dict[str, object]:
    return {
        "link": tally.name,
        "up": tally.is_up,
        "frames": tally.frames,
        "bytes": tally.bytes,
        "took_over": tally.carried,
        "lost": tally.lost,
        "age_ms": None if timeless else spread_ms(tally.age.spread()),
    }


def _session(run: RunSnapshot, index: int) -> dict[str, object]:
    account = run.link.sessions[index]
    before = dict(account.first.dropped)
    dropped = {reason.value: count - before.get(reason, 0) for reason, count in account.latest.dropped}
    # Frames overtake accounts, and the board's last one may not have come: what is here was sent.
    sent = max(account.latest.sent - account.first.sent, account.received + account.lost)
    # A frame that waited when this host came was grabbed before and sent, or dropped, since. It belongs to this account.
    grabbed = account.latest.grabbed - account.first.sent - sum(before.values())
    grabbed = max(grabbed, sent + sum(dropped.values()))
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
