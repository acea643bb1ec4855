"""Summarises a run in a few lines of text. Pure."""

import math
from typing import Final

from common.camera.base import CameraHealth, origin_words
from common.words import counted, times
from phone_host.accounts.delays import DELAYS, side_by_side
from phone_host.accounts.link_account import LinkAccount, LinkTally, away_words, rung_lines
from phone_host.diagnostics.drift import drift_lines
from phone_host.diagnostics.headline import headline
from phone_host.diagnostics.image_judge import ImageTrust, history_lines
from phone_host.diagnostics.image_numbers import pairing_words
from phone_host.diagnostics.run_rules import concerns, history
from phone_host.diagnostics.run_snapshot import RunSnapshot, unused
from phone_host.diagnostics.throughput import budget_lines, figures, judge, missed_words
from phone_host.model import DepthAccount, TimeOffset
from phone_host.report.match_words import cut_sentence, run_corrected_words
from phone_host.sync.phase import Alignment, Phase

_MS: Final = 1e6
_LONGEST_BEAT_S: Final = 3600.0
"""A drift that takes longer for one turn changes nothing within a scan, and is hardly measured."""

_DELAY_TABLE: Final = 54
_LINK_TABLE: Final = 64
"""Widths of the tables, characters."""


def summary(run: RunSnapshot, width: int = 0) -> str:
    """Summarise the run in a few lines.

    Args:
        run: the run.
        width: of the terminal, in characters: tables leave columns out rather than exceed it; 0: no limit.
    """
    rate = "" if math.isnan(run.pairs_per_second) else f" in {run.seconds:.1f} s ({run.pairs_per_second:.1f} /s)"
    lines = [headline(run).sentence, f"{counted(run.processed, 'pair')}{rate}, ended: {run.ended.replace('_', ' ')}"]
    if run.processed:
        lines += _delay_table(run, width)
    if run.estimate is not None:
        lines.append(
            f"the board's clock is known to +-{run.estimate.uncertainty_ns / 1000:.0f} us"
            f" (+-{run.estimate.bound_ns / 1000:.0f} us at worst), skew {run.estimate.skew * 1e6:+.1f} ppm"
        )
    lines += _pairing_lines(run)
    lines += _agreement(run)
    lines += phase_lines(run.phase, run.alignment)
    lines += _arrivals(run.camera, run.time_offset)
    if run.camera.origin is not None:
        lines.append(f"this machine's camera: {origin_words(run.camera.origin)}")
    lines.append(judge(figures(run)).sentence)
    lines += [f"  {remedy}" for remedy in judge(figures(run)).remedies]
    lines += [f"warning: {run.shortfall}"] if run.shortfall else []
    lines += [f"warning: {missed}"] if (missed := missed_words(run.budget)) else []
    lines += [f"warning: {item.message}: {item.remedy}" for item in concerns(run)]
    lines += [f"warning: {line}" for line in past_lines(run)]
    lines += depth_lines(run.images)
    lines += cut_lines(run.depth)
    lines += corrected_lines(run.depth)
    lines += drift_lines(run.drift)
    lines += [f"note: {run.matcher_note}"] if run.matcher_note else []
    lines += budget_lines(run.budget)
    lines += [] if run.recording is None else [run.recording.words]
    lines += [] if run.replay is None else side_by_side(run.replay, run.delays, is_timeless=run.timeless)
    lines += camera_troubles(run.camera)
    lines += [*rung_lines(run.link), *_links(run.link, width), *_unused_lines(run)]
    return "\n".join(lines)


def _delay_table(run: RunSnapshot, width: int) -> list[str]:
    """List the delays; the 99th percentile is left out where it has no room."""
    columns = ("p50", "p95", "p99", "max") if not 0 < width < _DELAY_TABLE else ("p50", "p95", "max")
    lines = [f"{'delay, ms':14} " + " ".join(f"{name:>9}" for name in columns)]
    for name in DELAYS:
        spread = run.delays.spread(name)
        if not spread.count:
            continue  # stills: nothing is counted from an exposure
        if name == "starvation" and run.timeless and not spread.max_ns:
            continue  # they come when the processor asks for them
        values = (getattr(spread, f"{column}_ns") / _MS for column in columns)
        lines.append(f"{name.replace('_', '-'):14} " + " ".join(f"{value:9.3f}" for value in values))
    return lines


def _pairing_lines(run: RunSnapshot) -> list[str]:
    """Say what paired the images of two replays, and when the board was away."""
    return [line for line in (pairing_words(run.replayed), away_words(run.away)) if line]


def phase_lines(phase: Phase | None, alignment: Alignment | None) -> list[str]:
    """Say how the two cameras' exposures relate in time, and what steering them achieved."""
    lines = []
    if phase is not None:
        drift = (
            ""
            if not abs(phase.beat_s) <= _LONGEST_BEAT_S  # never true of NaN
            else f", drifts by {phase.drift * 1e6:+.1f} ppm, one full turn in {phase.beat_s:.0f} s"
        )
        side = "before" if phase.time_skew_ns < 0 else "after"
        lines.append(
            f"phase: the board exposes {abs(phase.time_skew_ns) / _MS:.1f} of {phase.period_ns / _MS:.1f} ms {side} the host{drift}"
        )
    if alignment is not None:
        lines.append(f"alignment: {alignment.state.value}: {alignment.words}")
    return lines


def depth_lines(images: ImageTrust) -> list[str]:
    """Say how the depth fared from the first judgements to the latest ones; nothing if none was judged."""
    start, end = images.start, images.now
    if math.isnan(end.density):
        return []
    parts = [f"density {start.density:.0%} at first, {end.density:.0%} now"]
    if not math.isnan(start.consistency + end.consistency):
        parts.append(f"left-right consistency {start.consistency:.0%}, {end.consistency:.0%}")
    if not math.isnan(start.vertical_px + end.vertical_px):
        parts.append(f"vertical error {start.vertical_px:.2f}, {end.vertical_px:.2f} px")
    return [f"depth: {'; '.join(parts)}"]


def past_lines(run: RunSnapshot) -> list[str]:
    """Say which doubts stood for a while and have gone, and which pairs they concern."""
    return history_lines(history(run), run.processed, run.save_every)


def cut_lines(depth: DepthAccount) -> list[str]:
    """Say in one line what was cut from the clouds of all pairs; nothing if nothing was."""
    words = "" if depth.cut is None else cut_sentence(depth.cut, depth.limits)
    return [f"cut from the clouds: {words}"] if words else []


def corrected_lines(depth: DepthAccount) -> list[str]:
    """Say in one line what the matcher corrected; nothing if it does not tell."""
    words = run_corrected_words(depth.median_report, depth.epipolar)
    return [words] if words else []


def camera_troubles(health: CameraHealth) -> list[str]:
    """Say in one line what went wrong with a camera; nothing if nothing did."""
    missed = "missed by its driver" if health.origin is None else "dropped in the browser"
    parts = [
        *([f"unplugged {times(health.unplugged)}"] if health.unplugged else []),
        *([f"stalled {times(health.stalls)}"] if health.stalls else []),
        *([f"failed {times(health.failures)}"] if health.failures else []),
        *([f"back {times(health.returned)}"] if health.returned else []),
        *([f"{counted(health.missed, 'frame')} {missed}"] if health.missed else []),
        *(f"{counted(count, 'frame')} {fault.value}" for fault, count in health.faults),
        *([f"{counted(health.distrusted_stamps, 'stamp')} not believed"] if health.distrusted_stamps else []),
        *([f"{counted(health.refused_controls, 'control')} refused"] if health.refused_controls else []),
    ]
    return [f"this machine's camera: {', '.join(parts)}".replace("_", " ")] if parts else []


def _agreement(run: RunSnapshot) -> list[str]:
    """Say how well the two cameras' stamps agree; nothing if the stamps are exposure times by definition."""
    offset = run.time_offset
    known = f"+-{offset.uncertainty_ns / _MS:.2f} ms"
    if offset != TimeOffset():
        return [f"the cameras' stamps differ by {offset.offset_ns / _MS:+.2f} {known}, which is corrected"]
    if run.stamps_exact:
        return []
    return [f"the cameras' stamps agree to {known}: not measured; phone-host calibrate-time measures it"]


def _arrivals(health: CameraHealth, offset: TimeOffset) -> list[str]:
    """Say what the stamps of an own camera mean that only tells arrival times."""
    if health.jitter_ns is None:
        return []
    jitter = f"images arrive up to {health.jitter_ns / _MS:.1f} ms late (p95)"
    if health.latency_ns is not None:
        stated = health.latency_uncertainty_ns
        known = "" if stated is None else f", known to +-{(stated + health.jitter_ns) / _MS:.1f} ms"
        return [
            f"this machine's camera: stamps are arrival times minus {health.latency_ns / _MS:g} ms{known}; {jitter}"
        ]
    if offset != TimeOffset():
        return [
            f"this machine's camera: stamps are arrival times; the measured time offset includes its latency; {jitter}"
        ]
    return [
        f"this machine's camera: its latency is unknown, and every time skew is wrong by it; measure it with phone-host calibrate-time; {jitter}"
    ]


def _links(link: LinkAccount, width: int) -> list[str]:
    """List the links side by side, if there are several; below each other where a table has no room."""
    if len(link.links) < 2:
        return []
    if 0 < width < _LINK_TABLE:
        return [_link_line(tally) for tally in link.links]
    lines = [f"{'link':14} {'frames':>9} {'took over':>9} {'lost':>9} {'age p50':>9} {'p95':>9}"]
    for tally in link.links:
        age = tally.age.spread()
        ages = f"{age.p50_ns / _MS:9.3f} {age.p95_ns / _MS:9.3f}" if age.count else f"{'-':>9} {'-':>9}"
        lines.append(f"{tally.name:14} {tally.frames:9} {tally.carried:9} {tally.lost:9} {ages}")
    return lines


def _link_line(tally: LinkTally) -> str:
    age = tally.age.spread()
    ages = f", age p50 {age.p50_ns / _MS:.3f} ms, p95 {age.p95_ns / _MS:.3f} ms" if age.count else ""
    return f"link {tally.name}: {counted(tally.frames, 'frame')}, took over {times(tally.carried)}, lost {times(tally.lost)}{ages}"


def _unused_lines(run: RunSnapshot) -> list[str]:
    """Say what was not used, and what was not written."""
    parts = [item.told for item in unused(run)]
    lines = [f"not used: {', '.join(parts) or 'nothing'}"]
    if run.unwritten.lines or run.unwritten.pairs:
        counts = (
            (run.unwritten.lines, "line of delays.jsonl", "lines of delays.jsonl"),
            (run.unwritten.pairs, "pair", "pairs"),
        )
        parts = [f"{count} {one if count == 1 else many}" for count, one, many in counts if count]
        lines.append(f"not written: {', '.join(parts)} ({run.unwritten.cause})")
    return lines
