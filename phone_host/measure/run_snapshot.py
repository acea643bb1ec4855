"""A run at one moment, in one object of copied values. Terminal, page and JSON show this and nothing else. Pure."""

from collections import Counter
from dataclasses import dataclass, field, replace
from typing import Final

from common.camera.base import CameraHealth
from common.frame import NOT_AS_SAID
from common.orientation import UPRIGHT, Orientation
from common.protocol.message import DropReason
from common.words import counted
from phone_host.measure.absence import Away
from phone_host.measure.accounts import LinkAccount
from phone_host.measure.budget_words import with_budget
from phone_host.measure.camera_match import LockMiss, settings_concerns
from phone_host.measure.delays import DelayStatistics
from phone_host.measure.doubt_history import Episode
from phone_host.measure.drift_words import drift_concerns, told_as_a_turn
from phone_host.measure.gone import gone_concerns
from phone_host.measure.image_trust import ImageTrust
from phone_host.measure.no_depth import no_depth
from phone_host.measure.numbers import ImageEvidence, blamed, number_concerns, with_cause
from phone_host.measure.orient_words import with_final_options
from phone_host.measure.recording_account import RecordingAccount
from phone_host.measure.regime import RunFigures
from phone_host.measure.replay_facts import ReplayFacts
from phone_host.measure.sink_account import SinkAccount
from phone_host.measure.spoiled import SpoiledCounts, spoiled_concerns
from phone_host.measure.trouble import Trouble
from phone_host.measure.trust import (
    NO_DOUBT,
    REJECTED_RIG,
    Concern,
    Timing,
    Unbelieved,
    gravest_first,
    stamp_doubt,
    timing_concerns,
    unbelieved_concerns,
)
from phone_host.model import BudgetAccount, DepthAccount, Drift, PairCounts, TimeOffset, Unwritten
from phone_host.sync.clock import ClockEstimate
from phone_host.sync.fifo import FifoSettings, Overflow
from phone_host.sync.phase import Alignment, Phase
from phone_host.sync.quarantine import Disbelief


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSnapshot:
    """Everything that presenters show. Nothing in it changes afterwards.

    Attributes: ended: why the run ended, or `running`. processed: pairs whose results were handed to the sinks.
        undecodable: pairs that could not be processed. seconds: time from the first to the last result, s. delays:
        delays of the processed pairs, a copy. counts: counts of frames and pairs on the host. link: the links' account,
        a copy. carrier: name of the link that carries frames now; empty while there is none. estimate: the present
        clock estimate, if there is one. tolerance_ns: greatest time skew of a pair. fifo: depth and policy. sinks: the
        account of each sink. unwritten: what could not be written to disk. spoiled: host frames that were not whole
        images. skipped: host frames that a newer one replaced before they were read. own_future: host frames dropped
        because their stamps were in the future. time_offset: time offset between the two cameras' stamps, as applied.
        phase: phase of the two cameras now or at the end; None: unknown, or there is none. alignment: outcome of
        steering a camera; None: not asked for. camera: health of the host camera. period_ns: period of the slower
        camera, ns; 0 if images come on demand. motion_px_s: how fast the host camera's image moves, px/s; NaN if not
        measured. width_px: width of that image; 0 if not measured. interpolated: whether the board's images were
        interpolated to the moment of the host's. If so, their time skew does not matter.
        spoiled_images: pairs with a spoiled image, by reason; part of `undecodable`.
        stamps_exact: whether both cameras' stamps are the times of exposure by definition.
        failed_pairs: the rest of `undecodable`, by reason, the most frequent first.
        failure: the error that ended the run; None: none did. refused: why the board refuses this host, now or at the
        end; None: it does not, or is silent.
        timeless: whether images are shown on demand: nothing is counted from their exposure. replayed: what is known of
        the images if both sides replay files. away: when the board was away. gaps: how often it was away between two
        pairs. gap_s: the time between those pairs, s; no part of `seconds`. after_gap_ns: when the first pair after each
        such time was done, CLOCK_MONOTONIC.
        judged_pairs: number of newest pairs over which time and motion are judged; None: all.
        missed_locks: controls of the rig's cameras that could not be restored.
        images: what the images say about the depth.
        depth: what became of the pixels of all pairs.
        rig_rejected: whether the rig's own calibration rejected it.
        asked_pairs: number of pairs after which the run was to end; 0: no limit.
        save_every: every Nth pair was saved, beginning with the first; 0: none.
        last_s: when the last pair was done, counted from the start of the run, s.
        orientations: what the left and the right camera have been given to be upright.
        matcher_note: what is to be said of the choice of the matcher; empty: nothing.
        matcher_is_fastest: whether none of ours is faster than the one that runs.
        budget: how the time budget for each pair was held; None: there is none, or no pair yet.
        drift: how the rig departs from its calibration; None: there is no rig.
        recording: what became of the images that were to be recorded; None: nobody asked for it.
        replay: the recording that is played; None: the cameras are live.
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
    camera: CameraHealth
    period_ns: int
    carrier: str = ""
    sinks: tuple[SinkAccount, ...] = ()
    spoiled: int = 0
    skipped: int = 0
    own_future: int = 0
    motion_px_s: float = float("nan")
    width_px: int = 0
    interpolated: bool = False
    stamps_exact: bool = False
    spoiled_images: tuple[tuple[str, int], ...] = ()
    failed_pairs: tuple[tuple[Trouble, int], ...] = ()
    failure: Trouble | None = None
    refused: Trouble | None = None
    time_offset: TimeOffset = field(default_factory=TimeOffset)
    phase: Phase | None = None
    alignment: Alignment | None = None
    judged_pairs: int | None = None
    missed_locks: tuple[LockMiss, ...] = ()
    timeless: bool = False
    replayed: ImageEvidence = field(default_factory=ImageEvidence)
    away: tuple[Away, ...] = ()
    gaps: int = 0
    gap_s: float = 0.0
    after_gap_ns: frozenset[int] = frozenset()
    images: ImageTrust = field(default_factory=ImageTrust)
    depth: DepthAccount = field(default_factory=DepthAccount)
    rig_rejected: bool = False
    asked_pairs: int = 0
    save_every: int = 0
    last_s: float = 0.0
    orientations: tuple[Orientation, Orientation] = (UPRIGHT, UPRIGHT)
    matcher_note: str = ""
    matcher_is_fastest: bool = False
    budget: BudgetAccount | None = None
    drift: Drift | None = None
    recording: RecordingAccount | None = None
    replay: ReplayFacts | None = None

    @property
    def shortfall(self) -> str:
        """Says that fewer pairs came than were asked for; empty if all came, or a person ended the run."""
        if self.processed >= self.asked_pairs or self.ended not in _SHORT:
            return ""
        return f"only {self.processed} of {counted(self.asked_pairs, 'pair')} came before {_SHORT[self.ended]}"

    @property
    def stopped(self) -> int:
        """Pairs that were still waiting when the run ended."""
        return self.counts.paired - self.processed - self.undecodable - self.counts.dropped

    @property
    def pairs_per_second(self) -> float:
        """Rate of results, 1/s, while the board was there; NaN with fewer than two results."""
        steps = self.processed - 1 - self.gaps
        return steps / self.seconds if steps > 0 and self.seconds > 0 else float("nan")

    @property
    def spoiled_counts(self) -> SpoiledCounts:
        """Images that were not whole, by where that was found."""
        return SpoiledCounts(
            pairs=self.processed,
            on_board=spoiled_on_board(self.link)[0],
            own=self.spoiled,
            decoded=sum(count for _, count in self.spoiled_images),
        )


_SHORT: Final = {"stream_ended": "the stream ended", "seconds_over": "the time was over"}

TIMELESS: Final = "images shown on demand have no moment of exposure: their stamps only count them"
"""Why a run of stills has no figures that start at an exposure."""


def figures(run: RunSnapshot) -> RunFigures:
    """Return the figures that determine the regime, over the whole run."""
    processed, steps = run.processed, run.processed - 1 - run.gaps
    interval_ns = run.seconds * 1e9 / steps if steps > 0 else float("nan")
    known = figures_of(
        run.delays,
        run.counts,
        processed,
        interval_ns=interval_ns,
        period_ns=run.period_ns,
        overflow=run.fifo.overflow,
    )
    lost, grabbed = spoiled_on_board(run.link)
    spoiled = lost / grabbed if grabbed else 0.0
    return replace(known, spoiled=spoiled, gap_s=run.gap_s, matcher_is_fastest=run.matcher_is_fastest)


def spoiled_on_board(link: LinkAccount) -> tuple[int, int]:
    """Return how many frames the board's camera gave that were not whole, and how many it gave in all."""
    lost = grabbed = 0
    for account in link.sessions:
        before, after = dict(account.first.dropped), dict(account.latest.dropped)
        lost += after.get(DropReason.SPOILED, 0) - before.get(DropReason.SPOILED, 0)
        grabbed += account.latest.grabbed - account.first.grabbed
    return lost, grabbed


def figures_of(
    delays: DelayStatistics,
    counts: PairCounts,
    processed: int,
    *,
    interval_ns: float,
    period_ns: int,
    overflow: Overflow,
) -> RunFigures:
    """Return the figures that determine the regime.

    Args:
        delays: delays of the pairs to use.
        counts: counts of frames and pairs over the whole run.
        processed: number of processed pairs over the whole run.
        interval_ns: time between two results; NaN with fewer than two.
        period_ns: period of the slower camera; 0 if images come on demand.
        overflow: the FIFO's overflow policy.
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
        propagation_ns=delays.spread("propagation").p50_ns,
        overflow=overflow,
    )


def time_and_motion(run: RunSnapshot) -> Timing:
    """Return time and motion over the pairs to be judged."""
    last = run.judged_pairs
    return Timing(
        time_skew_ns=float("nan") if run.interpolated else run.delays.spread("time_skew", last).p95_ns,
        uncertainty_ns=run.delays.spread("uncertainty", last).p50_ns,
        end_to_end_ns=run.delays.spread("end_to_end", last).p50_ns,
        motion_px_s=run.motion_px_s,
        width_px=run.width_px,
        stamps=NO_DOUBT if run.stamps_exact else stamp_doubt(run.time_offset, run.camera),
    )


def concerns(run: RunSnapshot) -> tuple[Concern, ...]:
    """Return what makes the depth of a run wrong or its figures doubtful, most serious first."""
    link = run.link
    unbelieved = Unbelieved(
        clock_steps=link.clock_steps,
        suspect_frames=sum(suspects.frames for suspects in link.suspects),
        disbelieved=disbelieved(run),
        received=sum(account.received + account.disbelieved[Disbelief.CREDIT] for account in link.sessions),
        spoiled_images=spoiled(run),
    )
    numbers, images = with_cause(number_concerns(run.replayed), image_concerns(run), run.replayed)
    rejected = (REJECTED_RIG,) if run.rig_rejected else ()
    gone = gone_concerns(run.ended, run.away, run.camera, run.last_s, run.refused) if run.processed else ()
    told = (*spoiled_concerns(run.spoiled_counts), *settings_concerns(run.missed_locks))
    moved = () if run.drift is None else drift_concerns(run.drift)
    images = told_as_a_turn(images, moved)
    timing = unbelieved_concerns(unbelieved) + timing_concerns(time_and_motion(run))
    return gravest_first((*rejected, *numbers, *images, *moved, *told, *gone, *timing))


def history(run: RunSnapshot) -> tuple[Episode, ...]:
    """Return which doubts about the images stood during a run, and when, in order of beginning."""
    numbers = number_concerns(run.replayed)
    return tuple(replace(item, concern=blamed(item.concern, numbers, run.replayed)) for item in run.images.history)


def image_concerns(run: RunSnapshot) -> tuple[Concern, ...]:
    """Return what the images of a run make doubtful, gravest first. While it runs, pairs without depth may yet get some."""
    found = tuple(
        with_budget(with_final_options(concern, run.orientations), run.budget) for concern in run.images.concerns
    )
    if run.ended == "running" or not lacks_depth(run) or not run.processed:
        return found  # without any pair there is another reason
    if any(concern.is_certain for concern in found):
        return found  # which says why there is none
    return (no_depth(run.depth.cut, run.depth.limits, found), *found)


def depth_is_wrong(run: RunSnapshot) -> bool:
    """Tell whether depth was wanted and cannot be right: a doubt stands that leaves no hope, or no pair has depth."""
    return run.images.wants_depth and (not run.images.has_depth or any(concern.is_certain for concern in concerns(run)))


def lacks_depth(run: RunSnapshot) -> bool:
    """Tell whether a rig or rectified images were given, and no pair has depth."""
    return run.images.wants_depth and not run.images.has_depth


def spoiled(run: RunSnapshot) -> dict[str, int]:
    """Count images of either camera that were not what their headers said, by what was wrong.

    Images that a camera drops as cut short are reported with the camera instead.
    """
    found = Counter(dict(run.spoiled_images))
    found.update({fault.value: count for fault, count in run.camera.faults if fault in NOT_AS_SAID})
    return {reason: count for reason, count in found.items() if count}


def disbelieved(run: RunSnapshot) -> dict[str, int]:
    """Count frames that came but were not believed, by reason, the host camera's last."""
    found = {reason.value: count for reason, count in run.link.disbelieved.items()}
    return found | ({"own_from_the_future": run.own_future} if run.own_future else {})
