"""A run at one moment, in one object of copied values, and what of it was not used. Terminal, page and JSON show this and nothing else. Pure."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

from common.camera.base import CameraHealth
from common.diagnostic import Diagnostic
from common.frame import NOT_AS_SAID
from common.orientation import UPRIGHT, Orientation
from common.protocol.message import DropReason
from common.words import counted
from phone_host.accounts.delays import DelayStatistics, ReplayFacts, SinkAccount
from phone_host.accounts.link_account import Away, LinkAccount
from phone_host.diagnostics.image_judge import ImageTrust
from phone_host.diagnostics.image_numbers import ImageEvidence
from phone_host.model import BudgetAccount, DepthAccount, Drift, PairCounts, Side, TimeOffset, Unwritten
from phone_host.sync.clock import ClockEstimate
from phone_host.sync.fifo import FifoSettings
from phone_host.sync.phase import Alignment, Phase


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingAccount:
    """The account of one recording.

    Attributes:
        file: its path.
        frames: images in it, of both cameras.
        dropped: images that came faster than the disk takes them.
        lost: images that came after it had ended early.
        size_bytes: how long the file is.
        seconds: how long it lasted.
        left_bytes: room on its disk; None: not known.
        is_over: whether it has ended.
        failure: what ended it early; None: nothing did.
    """

    file: str
    frames: int
    dropped: int
    lost: int
    size_bytes: int
    seconds: float = 0.0
    left_bytes: int | None = None
    is_over: bool = True
    failure: Diagnostic | None = None

    @property
    def is_whole(self) -> bool:
        """Whether every image that came is in it."""
        return self.failure is None and not self.dropped

    @property
    def words(self) -> str:
        """For people, one line: while it grows what there is and what room is left, then what became of it."""
        return self._ended() if self.is_over else self._growing()

    def _growing(self) -> str:
        minutes, seconds = divmod(int(self.seconds), 60)
        dropped = f", {self.dropped} dropped: the disk is too slow" if self.dropped else ""
        left = "" if self.left_bytes is None else f", {self.left_bytes / 1e9:.1f} GB left"
        told = f"{minutes}:{seconds:02d}, {counted(self.frames, 'image')}, {self.size_bytes / 1e6:.0f} MB"
        return f"recording: {told}{left}{dropped}"

    def _ended(self) -> str:
        missing = [
            f"{count} {why}"
            for count, why in ((self.dropped, "too fast for the disk"), (self.lost, "came after its end"))
            if count
        ]
        told = f"; not in it: {', '.join(missing)}" if missing else ""
        ended = "" if self.frames or self.failure else "; no image came: look at the cameras with phone-host doctor"
        if self.failure is not None:
            ended = f"; {self.failure.message}: {self.failure.remedy}"
        return f"recorded: {counted(self.frames, 'image')}, {self.size_bytes / 1e6:.1f} MB in {self.file}{told}{ended}"


@dataclass(frozen=True, slots=True, kw_only=True)
class LockMiss:
    """A control that could not be restored.

    Attributes:
        side: whose it is.
        control: its name.
        wanted: its value in the rig.
        present: its value now; None: the camera does not hold it.
    """

    side: Side
    control: str
    wanted: int
    present: int | None


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
    failed_pairs: tuple[tuple[Diagnostic, int], ...] = ()
    failure: Diagnostic | None = None
    refused: Diagnostic | None = None
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


_SHORT: Final = {"stream_ended": "the stream ended", "seconds_over": "the time was over"}

TIMELESS: Final = "images shown on demand have no moment of exposure: their stamps only count them"
"""Why a run of stills has no figures that start at an exposure."""


def spoiled_on_board(link: LinkAccount) -> tuple[int, int]:
    """Return how many frames the board's camera gave that were not whole, and how many it gave in all."""
    lost = grabbed = 0
    for account in link.sessions:
        before, after = dict(account.first.dropped), dict(account.latest.dropped)
        lost += after.get(DropReason.SPOILED, 0) - before.get(DropReason.SPOILED, 0)
        grabbed += account.latest.grabbed - account.first.grabbed
    return lost, grabbed


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


@dataclass(frozen=True, slots=True)
class Unused:
    """One place and reason.

    Attributes:
        place: what they are and where they ended, for example `frames dropped on the board`.
        reason: the reason in the words of its account; empty if the place says it.
        count: how many, at least 1.
    """

    place: str
    reason: str
    count: int

    @property
    def words(self) -> str:
        """Place and reason for people."""
        return f"{self.place}: {self._reason_words}" if self.reason else self.place

    @property
    def told(self) -> str:
        """Number, place and reason for people: `1 pair dropped from a full FIFO`."""
        noun, _, rest = self.place.partition(" ")
        if noun in {"board", "host"}:
            second, _, rest = rest.partition(" ")
            noun = f"{noun} {second}"
        if self.count == 1:
            noun, rest = noun.removesuffix("s"), rest.replace("that were not whole images", "that was no whole image")
        reason = f": {self._reason_words}" if self.reason else ""
        return f"{self.count} {noun} {rest}{reason}"

    @property
    def _reason_words(self) -> str:
        """The reason for people: a word of an account gets its spaces; a sentence may hold a name and stays as it is."""
        return self.reason if " " in self.reason else self.reason.replace("_", " ")


def unused(run: RunSnapshot) -> tuple[Unused, ...]:
    """Return what was not used, as far as known. Nothing is counted twice."""
    return tuple(item for item in (*_on_the_way(run), *_on_the_host(run)) if item.count)


def _on_the_way(run: RunSnapshot) -> Iterator[Unused]:
    sessions = run.link.sessions
    for reason, count in board_drops(run.link).items():
        yield Unused("frames dropped on the board", reason, count)
    lost, late = sum(account.lost for account in sessions), sum(account.late for account in sessions)
    yield Unused("frames lost on the link", "", lost - late)
    yield Unused("frames that came too late over another link", "", late)
    yield Unused("frames delivered again", "", sum(account.duplicate for account in sessions))
    yield Unused("frames of an earlier session", "", sum(account.old_session for account in sessions))
    yield Unused("packets of something else", "", run.link.garbage)
    yield Unused("frames that came before the clock was known", "", run.link.no_clock)
    for reason, count in disbelieved(run).items():
        yield Unused("frames with impossible values", reason, count)


def _on_the_host(run: RunSnapshot) -> Iterator[Unused]:
    counts = run.counts
    whole = "were not whole images" if run.camera.origin is None else "could not be used"
    yield Unused(f"host frames that {whole}", "", run.spoiled)
    yield Unused("host frames replaced by newer ones", "", run.skipped)
    for reason, count in counts.board_orphans:
        yield Unused("board frames without partner", reason, count)
    for reason, count in counts.host_orphans:
        yield Unused("host frames without partner", reason, count)
    yield Unused("pairs dropped from a full FIFO", "", counts.dropped)
    for reason, count in run.spoiled_images:
        yield Unused("pairs with a spoiled image", reason, count)
    for trouble, count in run.failed_pairs:
        yield Unused("pairs that could not be processed", trouble.message, count)
    if run.ended != "running":
        yield Unused("pairs still waiting at the end", "", run.stopped)
    for sink in run.sinks:
        yield Unused("results that came too fast for the sink", sink.name, sink.dropped)
        yield Unused("results that the sink could not write", sink.name, sink.failed)


def board_drops(link: LinkAccount) -> dict[str, int]:
    """Return the frames that the board dropped while this host was connected, by reason."""
    drops: dict[str, int] = {}
    for account in link.sessions:
        before = dict(account.first.dropped)
        for reason, count in account.latest.dropped:
            drops[reason.value] = drops.get(reason.value, 0) + count - before.get(reason, 0)
    return drops
