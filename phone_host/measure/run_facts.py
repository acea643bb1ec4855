"""What a run was, in one object, and what others judge it by. Pure."""

from collections import Counter
from dataclasses import dataclass, field

from common.camera.base import CameraHealth
from common.frame import NOT_AS_SAID
from phone_host.measure.accounts import LinkAccount
from phone_host.measure.delays import DelayStatistics
from phone_host.measure.regime import RunFigures
from phone_host.measure.trust import (
    NO_DOUBT,
    Concern,
    Timing,
    Unbelieved,
    stamp_doubt,
    timing_concerns,
    unbelieved_concerns,
)
from phone_host.model import PairCounts, TimeOffset, Unwritten
from phone_host.sync.clock import ClockEstimate
from phone_host.sync.fifo import FifoSettings, Overflow
from phone_host.sync.phase import Alignment, Phase
from phone_host.sync.quarantine import Disbelief


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
        own_future: own frames whose stamps lay in the future, dropped.
        time_offset: between the two cameras' stamps, as it was applied.
        phase: of the two cameras at the end; None: not known, or there is none.
        alignment: how the steering of a camera came out; None: not asked for.
        camera: how the own camera has fared.
        period_ns: of the slower camera, ns; 0 where images come on demand.
        motion_px_s: how fast the own camera's image moves, px/s; NaN where not measured.
        width_px: of that image; 0 where not measured.
        interpolated: whether the board's images were taken to the moment of the host's, so that their time skew did no harm.
        spoiled_images: pairs one of whose images was not the whole image that it claimed to be, by reason; part of `undecodable`.
        stamps_exact: whether both cameras' stamps say by definition when their images were exposed.
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
    own_future: int = 0
    interpolated: bool = False
    stamps_exact: bool = False
    spoiled_images: tuple[tuple[str, int], ...] = ()
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


def figures(facts: RunFacts) -> RunFigures:
    """What the queueing regime is judged by, over the whole run."""
    processed = facts.processed
    interval_ns = facts.seconds * 1e9 / (processed - 1) if processed > 1 else float("nan")
    return figures_of(
        facts.delays,
        facts.counts,
        processed,
        interval_ns=interval_ns,
        period_ns=facts.period_ns,
        overflow=facts.fifo.overflow,
    )


def figures_of(
    delays: DelayStatistics,
    counts: PairCounts,
    processed: int,
    *,
    interval_ns: float,
    period_ns: int,
    overflow: Overflow,
) -> RunFigures:
    """What the queueing regime is judged by.

    Args:
        delays: of the pairs that are looked at.
        counts: of frames and pairs over the whole run.
        processed: pairs over the whole run.
        interval_ns: between two results; NaN where there are not two.
        period_ns: of the slower camera; 0 where images come on demand.
        overflow: of the FIFO.
    """
    return RunFigures(
        pairs=delays.spread("processing").count,
        interval_ns=interval_ns,
        processing_ns=delays.spread("processing").mean_ns,
        match_ns=delays.spread("match").mean_ns,
        starvation_ns=delays.spread("starvation").mean_ns,
        period_ns=period_ns,
        received=counts.received / counts.paired if counts.paired else 1.0,
        offered=counts.paired / processed if processed else 1.0,
        frame_bytes=delays.frame_bytes,
        propagation_ns=delays.spread("propagation").mean_ns,
        overflow=overflow,
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
        stamps=NO_DOUBT if facts.stamps_exact else stamp_doubt(facts.time_offset, facts.camera),
    )


def concerns(facts: RunFacts, last: int | None = None) -> tuple[Concern, ...]:
    """What makes the depth of a run wrong or its figures doubtful, the gravest first.

    Args:
        facts: the run.
        last: how many of the newest pairs time and motion are judged by; None: all.
    """
    link = facts.link
    unbelieved = Unbelieved(
        clock_steps=link.clock_steps,
        suspect_frames=sum(suspects.frames for suspects in link.suspects),
        disbelieved=disbelieved(facts),
        received=sum(account.received + account.disbelieved[Disbelief.CREDIT] for account in link.sessions),
        spoiled_images=spoiled(facts),
    )
    return unbelieved_concerns(unbelieved) + timing_concerns(time_and_motion(facts, last))


def spoiled(facts: RunFacts) -> dict[str, int]:
    """Images of either camera that were not what their headers said, by what was wrong; those that a camera drops as cut short are told with it."""
    found = Counter(dict(facts.spoiled_images))
    found.update({fault.value: count for fault, count in facts.camera.faults if fault in NOT_AS_SAID})
    return {reason: count for reason, count in found.items() if count}


def disbelieved(facts: RunFacts) -> dict[str, int]:
    """Frames that came and were not believed, by reason, the own camera's last."""
    found = {reason.value: count for reason, count in facts.link.disbelieved.items()}
    return found | ({"own_from_the_future": facts.own_future} if facts.own_future else {})


def board_drops(link: LinkAccount) -> dict[str, int]:
    """Frames that the board dropped while this host was connected, by reason."""
    drops: dict[str, int] = {}
    for account in link.sessions:
        before = dict(account.first.dropped)
        for reason, count in account.latest.dropped:
            drops[reason.value] = drops.get(reason.value, 0) + count - before.get(reason, 0)
    return drops
