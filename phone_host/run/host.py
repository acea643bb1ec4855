"""The host's composition root: receiver and host camera -> pair queue -> worker -> sinks, each in its own thread."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Final

from common import now
from common.camera.base import Camera
from common.diagnostic import Diagnostic, Severity
from common.ledger import PairLedger
from common.link.base import Link
from common.orientation import UPRIGHT, Orientation
from common.protocol.message import Pacing
from phone_host.accounts.delays import replay_facts
from phone_host.accounts.link_account import away_of
from phone_host.diagnostics.run_rules import concerns
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.model import Processed, Side
from phone_host.recording.clock_messages import boot_of
from phone_host.recording.playback import Playback
from phone_host.recording.switch import RecordingSwitch
from phone_host.run.course import Course
from phone_host.run.file_sink import FileSink
from phone_host.run.host_settings import EndReason, HostSettings
from phone_host.run.kept import keep_freed_memory
from phone_host.run.ledgerer import Ledgerer
from phone_host.run.pair_budget import PairBudget
from phone_host.run.pipeline import Pipeline, Worker
from phone_host.run.recording_sinks import RecordingSink
from phone_host.run.rig_cameras import PhaseSteering, RigCameras
from phone_host.run.sinks import MotionSink, Sink
from phone_host.run.sources import demand_of, paired_streams
from phone_host.run.trust_sink import PERIOD_NS, DoubtLog, DriftKeeper, TrustSink
from phone_host.stereo.core import StereoCore
from phone_host.stereo.interpolate import Interpolator
from phone_host.stream.refusals import refusal_text

_STOP_S: Final = 0.4
"""A stopped run gives its current pair this long: Ctrl-C ends within a second, and the goodbye takes 0.3 s of it."""

_RECENT: Final = 60
"""While it runs, the latest 60 pairs are judged: two seconds at 30 pairs per second."""


class Host:
    """One run of the host.

    Attributes:
        recording: sees every frame; None: nothing can be recorded.

    Args:
        settings: settings of the run.
        camera: the host camera, open; or a recording of both cameras.
        links: open links to the board, the preferred one first; none beside a recording.
        core: the stereo core; None to measure pairs and delays only.
        sinks: take the results, in addition to the sink that writes to disk.
        recording: see above; the host ends it.
    """

    def __init__(
        self,
        settings: HostSettings,
        camera: Camera | Playback,
        links: Sequence[Link],
        core: StereoCore | None,
        sinks: Sequence[Sink] = (),
        *,
        recording: RecordingSwitch | None = None,
    ) -> None:
        self._settings, self._own, self._core, self.recording = settings, camera.description, core, recording
        self.started_ns, self._ended_ns = now.monotonic_ns(), 0
        rig, side, demand = None if core is None else core.rig, settings.board_side, demand_of(camera)
        self._files = FileSink(  # first of all, because it may be refused
            settings.out,
            settings.save_every,
            waits=bool(settings.pairs) or demand.is_timeless,
            settings=settings.resolved,
            axes=settings.axes,
            command=settings.command,
        )

        # Frames of both cameras, or a recording of them, become pairs.
        self._queue, self._camera, self._receiver = paired_streams(settings, camera, links, demand, recording)

        # Pairs become depth.
        self._budget = None if core is None or settings.budget is None else PairBudget(settings.budget, core)
        pipeline = Pipeline(
            core,
            side,
            now.monotonic_ns,
            Interpolator() if settings.interpolate else None,
            settings.most_pixels,
            budget=self._budget,
            host_orientation=self._own.orientation,
        )
        self._ledgerer = Ledgerer(self._receiver.account.was_away, lambda: demand.is_timeless)

        # Every sink takes the results.
        self._keeper = None
        if core is not None and rig is not None:
            self._keeper = DriftKeeper(
                core,
                side,
                corrects=settings.corrects,
                start=settings.overlay,
                is_timeless=demand.is_timeless,
                interpolates=settings.interpolate,
            )
        self._trust = TrustSink(core, period_ns=0 if demand.is_timeless else PERIOD_NS, keeper=self._keeper)
        self._motion = MotionSink(side, demand)
        recorded = () if recording is None else (RecordingSink(recording),)
        self._sinks: tuple[Sink, ...] = (self._files, self._motion, self._trust, *recorded, *sinks)
        self._worker = Worker(
            self._queue, pipeline, self._ledgerer, self._sinks, most_pairs=settings.pairs, taken=self._receiver.wake
        )

        # Meanwhile the run's own thread looks after all of it, several times a second.
        self._cameras = RigCameras(rig, side, self._own, self._camera, self._receiver)
        self._steering = PhaseSteering(settings.steered, self._receiver, self._camera, self._queue)
        self._doubts, streams = DoubtLog(), (self._camera, self._receiver)
        self._course = Course(
            settings, self._own, streams, queue=self._queue, worker=self._worker, ledgerer=self._ledgerer
        )
        self._replay = None
        if isinstance(camera, Playback):
            pace = "demand" if demand.is_timeless else "clock"
            self._replay = replay_facts(str(camera.file), pace, camera.ledgers())

    def run(self, stop: Callable[[], bool], watch: Callable[[], None] | None = None) -> EndReason:
        """Run until the number of pairs is reached, a stream ends or `stop` returns True.

        Args:
            stop: called several times a second.
            watch: called as often, for a live view.

        Raises:
            UnavailableError: no board came in time, or it does not talk to this host.
            DataError: the streams' images or the cameras do not fit the rig.
        """
        keep_freed_memory()
        try:
            self._worker.start()
            self._receiver.start()
            self._camera.start()
            ended = self._course.follow(stop, watch, self._step, self._raise_failures)
        except BaseException:
            with suppress(Exception):  # report what ended the run, not its consequences
                self._end(_STOP_S)
            raise
        self._end(_STOP_S if ended is EndReason.STOPPED else None)
        return ended

    @property
    def has_given_up(self) -> bool:
        """Whether native code still computes a pair that nobody waits for. The process may have to end without it."""
        return self._worker.has_given_up

    def _end(self, patience_s: float | None) -> None:
        """Finish the current pair but not the waiting ones, and let the sinks finish. No failure skips a later step.

        Args:
            patience_s: give the current pair up after this time; None: wait for it.

        Raises:
            Exception: the failure; the last one if there are several.
        """
        self._ended_ns = now.monotonic_ns()
        self._worker.finished.set()
        with ExitStack() as ending:  # callbacks run in reverse order
            ending.callback(self._raise_failures)
            ending.callback(self._end_recording)
            for sink in reversed(self._sinks):
                ending.callback(sink.finish)
            ending.callback(self._receiver.stop)  # after the worker, because the worker wakes the receiver
            ending.callback(self._worker.stop, patience_s)
            ending.callback(self._queue.finish)
            ending.callback(self._camera.stop)

    def _end_recording(self) -> None:
        """Write the rest of the recording; what is known of the cameras is known now."""
        if self.recording is not None:
            self.recording.end(self._cameras.text())

    def abandon(self) -> None:
        """Release the results folder of a host that will not `run`."""
        self._files.abandon()
        if self.recording is not None:
            self.recording.end()

    def write_report(self, report: dict[str, object], page: str = "", *, replaces_earlier: bool = True) -> bool:
        """Write the report of the run into its results folder, if there is one. Call this after `run`.

        Args:
            report: content of report.json.
            page: content of index.html; empty: none.
            replaces_earlier: whether the run is whole, so that an earlier run's results may be replaced by it.

        Returns:
            Whether all results were written.
        """
        overlay = "" if self._keeper is None else self._keeper.overlay
        self._files.close(report, page, self._cameras.text(), overlay, replaces_earlier=replaces_earlier)
        return self._files.complete

    @property
    def results_place(self) -> Path | None:
        """The folder in which the files of the run lie until its report is written; None: nothing is written."""
        return self._files.place

    def cameras_text(self) -> str:
        """Return the content of cameras.json: which cameras these are; empty if no board has said hello."""
        return self._cameras.text()

    @property
    def missing_files(self) -> str:
        """The files that `write_report` could not write, and why, in words; empty: none."""
        return self._files.missing

    @property
    def last(self) -> Processed | None:
        """The newest pair's images and depth."""
        return self._ledgerer.last

    @property
    def first_done_ns(self) -> int:
        """When the first pair was done, CLOCK_MONOTONIC, ns; 0: none yet."""
        return self._ledgerer.first_done_ns

    @property
    def has_met_board(self) -> bool:
        """Whether a board has said hello."""
        return self._receiver.hello is not None

    @property
    def refused(self) -> Diagnostic | None:
        """Why the board refuses this host, now or at the end of the run; None: it does not, or is silent."""
        return (
            None
            if self._course.refusal is None
            else Diagnostic(*refusal_text(self._course.refusal), severity=Severity.FAIL)
        )

    def sample(self) -> Sequence[PairLedger]:
        """Return ledgers for plots, in order: those of all pairs, or an evenly spaced sample."""
        return self._ledgerer.sample()

    def snapshot(self, ended: str = "running", failure: Diagnostic | None = None) -> RunSnapshot:
        """Return everything that presenters show, as of now.

        Args:
            ended: why the run ended. While it is running, time and motion are judged over the newest pairs only.
            failure: the error that ended it; None: none did.
        """
        books, receiver = self._ledgerer.books(), self._receiver
        rig = None if self._core is None else self._core.rig
        return RunSnapshot(
            ended=ended,
            processed=books.processed,
            undecodable=books.undecodable,
            seconds=(books.last_done_ns - books.first_done_ns - books.gap_ns) / 1e9,
            delays=books.delays,
            counts=self._queue.counts,
            link=receiver.account.copy(),
            carrier=receiver.carrier,
            estimate=receiver.estimate,
            tolerance_ns=self._queue.tolerance_ns,
            fifo=self._settings.fifo,
            sinks=tuple(account for sink in self._sinks for account in sink.accounts),
            unwritten=self._files.unwritten,
            spoiled=self._camera.spoiled,
            skipped=self._camera.skipped,
            own_future=self._camera.from_the_future,
            time_offset=self._settings.time_offset,
            phase=self._queue.phase,
            alignment=self._steering.alignment,
            camera=self._camera.health,
            period_ns=self._period_ns,
            motion_px_s=float("nan") if self._queue.is_timeless else self._motion.meter.px_s,
            width_px=self._motion.meter.width_px,
            interpolated=self._settings.interpolate,
            spoiled_images=books.spoiled_images,
            failed_pairs=books.failed_pairs,
            failure=failure,
            refused=self.refused,
            stamps_exact=self._stamps_are_exact,
            judged_pairs=_RECENT if ended == "running" else None,
            missed_locks=self._cameras.missed,
            timeless=self._queue.is_timeless,
            replayed=self._queue.images,
            away=away_of(receiver.account.absences, self.started_ns, self._ended_ns or now.monotonic_ns()),
            gaps=books.gaps,
            gap_s=books.gap_ns / 1e9,
            after_gap_ns=books.after_gap_ns,
            images=self._trust.trust,
            depth=books.depth,
            rig_rejected=rig is not None and rig.is_rejected,
            asked_pairs=self._settings.pairs,
            save_every=0 if self._settings.out is None else self._settings.save_every,
            last_s=max(0, books.last_done_ns - self.started_ns) / 1e9,
            orientations=self._orientations,
            matcher_note=self._settings.matcher_note,
            matcher_is_fastest=self._core is not None and self._core.matcher_is_fastest,
            budget=None if self._budget is None else self._budget.account,
            drift=None if self._keeper is None else self._keeper.drift,
            recording=None if self.recording is None else self.recording.account,
            replay=self._replay,
        )

    @property
    def _stamps_are_exact(self) -> bool:
        """Whether both cameras' stamps are exact by definition. Those of an absent board are assumed to be."""
        hello = self._receiver.hello
        return self._own.has_exact_stamps and (hello is None or hello.camera.has_exact_stamps)

    @property
    def _orientations(self) -> tuple[Orientation, Orientation]:
        """Those of the left and the right camera, as their users stated them."""
        hello = self._receiver.hello
        board = UPRIGHT if hello is None else hello.camera.orientation
        own = self._own.orientation
        return (board, own) if self._settings.board_side is Side.LEFT else (own, board)

    @property
    def _period_ns(self) -> int:
        """The slower camera's period, ns; 0 if a camera gives images on demand or the board is not known yet."""
        hello = self._receiver.hello
        if hello is None or Pacing.DEMAND in {hello.camera.pacing, self._own.pacing}:
            return 0
        return max(hello.camera.period_ns, self._own.period_ns)

    def _step(self, now_ns: int) -> None:
        """Do what is done several times a second."""
        self._cameras.look()
        self._steering.update(now_ns)
        self._doubts.look(now_ns, lambda: concerns(self.snapshot()))
        if self.recording is not None:
            self.recording.clock(self._receiver.estimate, boot_of(self._receiver.hello), now_ns)

    def _raise_failures(self) -> None:
        of_sinks = (sink.failure for sink in self._sinks)
        for failure in (self._worker.failure, self._receiver.failure, self._camera.failure, *of_sinks):
            if failure is not None:
                raise failure
