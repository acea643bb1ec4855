"""A live scan as its request describes it, whoever asks: `scan` itself, or the page. Opens it, and writes what came of it."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from common.errors import SettingsError
from common.orientation import UPRIGHT
from common.program import logs
from common.program.request import options_of, read_request
from common.program.settings import Resolved, log_level
from common.program.signals import StopSignals
from common.protocol.message import Pacing
from phone_host.camera.browser_feed import BrowserFeed
from phone_host.declared_settings import PhoneHostSettings
from phone_host.diagnostics.run_snapshot import RunSnapshot
from phone_host.jobs.output_folders import (
    announce_other_report,
    require_alone,
    require_writable,
    spare_inputs,
    writing,
)
from phone_host.jobs.run import Opened, PreparedRun, open_run
from phone_host.jobs.run_request import RunRequest, checked
from phone_host.jobs.scan_request import ScanRequest, axes_beside, model_wanted, resumed_of
from phone_host.output.axes import Axes
from phone_host.recording.playback import Playback
from phone_host.report.scan_report import ScanReport
from phone_host.run.host import Host
from phone_host.run.host_settings import EndReason
from phone_host.run.kept import partial_words
from phone_host.run.live_scan import LiveScan
from phone_host.run.scan_job import NAMES, FinishedScan, write_scan
from phone_host.run.sinks import Sink
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import Submap
from phone_host.stereo.core import StereoCore

SinksOf = Callable[[StereoCore | None], Sequence[Sink]]
"""Makes sinks for a run, once its core is known."""


@dataclass(frozen=True, slots=True, eq=False)
class PreparedScan:
    """A live scan that is ready to begin: its camera and links are open.

    Attributes:
        prepared: the run beneath; `host.run` closes camera and links.
        live: takes its pairs.
        out: folder for its files.
        matcher: its name.
        axes: of its files.
        tell: takes a line that the user should know.
    """

    prepared: PreparedRun
    live: LiveScan
    out: Path
    matcher: str
    axes: Axes
    tell: Callable[[str], None]

    @property
    def host(self) -> Host:
        """Runs it."""
        return self.prepared.host

    def ended(self, ended: EndReason) -> tuple[ScanReport, RunSnapshot]:
        """Make the surface of a scan that has ended, and write its files. Return its report, and the last snapshot of the run.

        Args:
            ended: why it did.

        Raises:
            DataError: no pair has depth.
            UnavailableError: the files cannot be written.
        """
        snapshot = self.prepared.ended(ended).snapshot
        finished = self._finished()
        with writing(self.out):
            self.live.work.write(
                finished, self._tell_of_partial if self.prepared.is_cut_short(snapshot, ended) else None
            )
        return finished.report, snapshot

    def failed(self) -> ScanReport | None:
        """Write what there is after an error, and return its report; None: there was nothing, or it cannot be written. Raises nothing."""
        if self.live.scan.fused:
            with suppress(Exception):  # tell what ended the run, not what followed
                finished = self._finished()
                write_scan(self.out, finished, self._tell_of_partial)
                return finished.report
        return None

    def _finished(self) -> FinishedScan:
        return self.live.finished(self.host.snapshot(), self.matcher, self.axes)

    def _tell_of_partial(self, place: Path) -> None:
        self.tell(partial_words(place, self.out))


def open_scan(
    request: ScanRequest, words: Sequence[str], tell: Callable[[str], None]
) -> tuple[PreparedScan, StopSignals]:
    """Open a scan of what two cameras give, or of a recording.

    Args:
        request: of the scan, without pictures.
        words: of the command line.
        tell: takes a line that the user should know.

    Returns:
        The scan, and what asks the process to stop from the moment on at which cameras and links are open.

    Raises:
        SettingsError: options contradict each other, or give no depth in metres.
        UnavailableError: a camera, a link or the folder cannot be had.
        DataError: the rig cannot be used.
    """
    wanted = model_wanted(request.model, request.out)
    # the run beneath writes nothing itself
    own = {name: request.given.get(name, made.usual) for name, made in options_of(RunRequest).items()}
    told = {name: request.given.get(name, False) for name in ("json", "debug")}
    run = read_request(RunRequest, {**own, **told, "out": None})
    axes = axes_beside(request.depth.axes, wanted)
    found = checked(run)
    _require(request, found.values, tell)
    resumed = resumed_of(request, tell)
    logs.set_up(log_level(found.values.log_level))
    opened, signals = open_metric_run(run, found, tell), StopSignals()
    return prepare_scan(opened, found, wanted, axes, request.out, tell=tell, words=words, resumed=resumed), signals


def open_metric_run(
    run: RunRequest,
    found: Resolved[PhoneHostSettings],
    tell: Callable[[str], None],
    feed: BrowserFeed | None = None,
) -> Opened:
    """Open the run beneath a scan, as `open_run` does.

    Raises:
        SettingsError: it would give no depth in metres.
    """
    opened = open_run(run, found, tell, feed)
    if opened.core is None:
        raise _no_metres()
    return opened


def prepare_scan(
    opened: Opened,
    found: Resolved[PhoneHostSettings],
    wanted: ScanWanted,
    axes: Axes,
    out: Path,
    *,
    tell: Callable[[str], None],
    words: Sequence[str] = (),
    resumed: tuple[Submap, ...] = (),
    sinks_of: SinksOf = lambda _: (),
) -> PreparedScan:
    """Put a scan together over a run that is open.

    Args:
        opened: the run, from `open_metric_run`.
        found: its settings, from `checked`.
        wanted: how the model is made.
        axes: of the files.
        out: folder for the results.
        tell: takes a line that the user should know.
        words: of the command line.
        resumed: submaps of a scan that was killed, to go on from.
        sinks_of: makes further sinks.

    Raises:
        SettingsError: options contradict each other.
        UnavailableError: a camera, a link or the folder cannot be had.
    """
    camera = opened.camera
    is_replay = isinstance(camera, Playback)
    is_demanded = (camera.pacing if isinstance(camera, Playback) else camera.description.pacing) is Pacing.DEMAND
    live = LiveScan(
        wanted, opened.board_side, out, resumed, waits=is_demanded, is_timeless=is_demanded and not is_replay
    )
    prepared = opened.prepared(words, (live.sink, *sinks_of(opened.core)))
    return PreparedScan(prepared, live, out, found.values.matcher, axes, tell)


def _require(request: ScanRequest, settings: PhoneHostSettings, tell: Callable[[str], None]) -> None:
    """Refuse options that give no depth in metres, those that only files know, and a folder that cannot be written to, or would lose the inputs."""
    if request.replay is None and not settings.camera:
        raise SettingsError(
            "neither pictures nor cameras are given",
            "give two folders, LEFT and RIGHT, or --camera and --link, or --replay FILE.mcap",
        )
    depth, out = request.depth, request.out
    may_hold_rig = request.replay is not None and not depth.rectified
    if not settings.calibration and not may_hold_rig and not (depth.rectified and depth.focal_px):
        raise _no_metres()
    if request.pictures.mounted != (UPRIGHT, UPRIGHT):
        raise SettingsError(
            "--rotate-... and --flip-... turn pictures in files",
            "put rotate= and flip= into the camera's address",
        )
    require_writable(out)
    inputs = {"--calibration": depth.calibration, "--replay": request.replay, "--overlay": depth.overlay}
    spare_inputs(out, NAMES, {name: Path(path) for name, path in inputs.items() if path})
    require_alone(out)
    announce_other_report(out, "scan", tell)


def _no_metres() -> SettingsError:
    return SettingsError(
        "no --calibration is given, so there are no metres",
        "give the rig.yaml of `phone-host calibrate`, or --rectified --focal PX --baseline MM",
    )
