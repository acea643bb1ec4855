"""phone-host scan with cameras, or with a recording of both: a run whose pairs become a model."""

import argparse
import sys
from contextlib import suppress
from pathlib import Path

from common.errors import SettingsError
from common.orientation import UPRIGHT
from common.program import logs
from common.program.commandline import CHECK_FAILED, INTERRUPTED
from common.program.request import read_request, usual_values
from common.program.settings import log_level
from common.program.signals import StopSignals
from common.program.terminal import say
from common.protocol.message import Pacing
from phone_host.declared_settings import PhoneHostSettings
from phone_host.jobs.output_folders import (
    announce_other_report,
    require_alone,
    require_writable,
    spare_inputs,
    writing,
)
from phone_host.jobs.run import Opened, PreparedRun, open_run
from phone_host.jobs.run_request import RunRequest, checked
from phone_host.live.scan import LiveScan
from phone_host.live.scan_view import ScanPicture
from phone_host.recording.playback import Playback
from phone_host.report.scan_report import ScanReport
from phone_host.run.host_settings import EndReason
from phone_host.run.kept import partial_words
from phone_host.run.scan_files import NAMES, FinishedScan, write_scan
from phone_host.scan.scan_wanted import ScanWanted
from phone_host.scan.scanned import Submap
from phone_host.verbs.scan.wanted import axes_of, resumed_of, scan_wanted
from phone_host.verbs.stereo_options import orientations


def scan_live(options: argparse.Namespace) -> tuple[ScanReport, int]:
    """Run until stopped, until the number of pairs is reached, or until a stream ends; write the model.

    Args:
        options: of `scan`, without pictures.

    Returns:
        The report, and the exit code if the model is sound: 0, 4 (fewer pairs than were asked for) or 130.

    Raises:
        SettingsError: options contradict each other, or give no depth in metres.
        UnavailableError: a camera, a link or the folder cannot be had.
        DataError: the rig cannot be used, or no pair has depth.
    """
    wanted, of_run = scan_wanted(options), _run_request(options)
    axes = axes_of(options, wanted)
    found = checked(of_run)
    _require(options, found.values)
    _require_place(options)
    resumed = resumed_of(options)
    logs.set_up(log_level(found.values.log_level))
    opened = open_run(of_run, found, _tell)
    if opened.core is None:
        raise _no_metres()
    live = live_scan(opened, wanted, options.out, resumed)
    signals = StopSignals()
    prepared = opened.prepared(sys.argv, (live.sink,))

    def tell_of_partial(place: Path) -> None:
        _tell(partial_words(place, options.out))

    def finished() -> FinishedScan:
        return live.finished(prepared.host.snapshot(), found.values.matcher, axes)

    try:
        ended = _followed(prepared, live, signals)
    except BaseException:
        if live.scan.fused:
            with suppress(Exception):  # tell what ended the run, not what followed
                write_scan(options.out, finished(), tell_of_partial)
        raise
    over = prepared.ended(ended)
    last = finished()
    with writing(options.out):
        live.work.write(last, tell_of_partial if prepared.is_cut_short(over.snapshot, ended) else None)
    too_few = options.pairs and ended is EndReason.STREAM_ENDED
    return last.report, INTERRUPTED if signals.interrupted else CHECK_FAILED if too_few else 0


def live_scan(opened: Opened, wanted: ScanWanted, out: Path, resumed: tuple[Submap, ...] = ()) -> LiveScan:
    """Return what takes the pairs of a run.

    Args:
        opened: the run.
        wanted: how the model is made.
        out: the results folder.
        resumed: submaps of a scan that was killed, to go on from.
    """
    camera = opened.camera
    pacing = camera.pacing if isinstance(camera, Playback) else camera.description.pacing
    is_stills = pacing is Pacing.DEMAND and not isinstance(camera, Playback)
    return LiveScan(wanted, opened.board_side, out, resumed, waits=pacing is Pacing.DEMAND, is_timeless=is_stills)


def _followed(prepared: PreparedRun, live: LiveScan, signals: StopSignals) -> EndReason:
    """Run, and tell whoever holds the cameras what helps: beside the surface on a terminal, else a line when it changes."""
    if sys.stderr.isatty():
        with ScanPicture(live) as picture:
            ended = prepared.host.run(lambda: signals.stop, picture.refresh)
            picture.end()
            return ended
    told = ""

    def tell() -> None:
        nonlocal told
        advice = live.words.partition(": ")[2]
        if advice != told:
            _tell(live.words)
        told = advice

    ended = prepared.host.run(lambda: signals.stop, tell)
    live.end()
    _tell(live.words)
    return ended


def _run_request(options: argparse.Namespace) -> RunRequest:
    """Return the request of the run beneath: it writes nothing itself."""
    own = vars(options)
    usual = {**usual_values(RunRequest), "json": False, "debug": False}
    given = {name: own.get(name, value) for name, value in usual.items()}
    return read_request(RunRequest, {**given, "out": None})


def _require(options: argparse.Namespace, settings: PhoneHostSettings) -> None:
    """Refuse options that give no depth in metres, and those that only files know.

    Raises:
        SettingsError: so it is.
    """
    if options.replay is None and not settings.camera:
        raise SettingsError(
            "neither pictures nor cameras are given",
            "give two folders, LEFT and RIGHT, or --camera and --link, or --replay FILE.mcap",
        )
    may_hold_rig = options.replay is not None and not options.rectified
    if not settings.calibration and not may_hold_rig and not (options.rectified and options.focal):
        raise _no_metres()
    if orientations(options) != (UPRIGHT, UPRIGHT):
        raise SettingsError(
            "--rotate-... and --flip-... turn pictures in files",
            "put rotate= and flip= into the camera's address",
        )


def _no_metres() -> SettingsError:
    return SettingsError(
        "no --calibration is given, so there are no metres",
        "give the rig.yaml of `phone-host calibrate`, or --rectified --focal PX --baseline MM",
    )


def _require_place(options: argparse.Namespace) -> None:
    """Refuse a results folder that cannot be written to, or would lose the inputs."""
    require_writable(options.out)
    inputs = {"--calibration": options.calibration, "--replay": options.replay, "--overlay": options.overlay}
    spare_inputs(options.out, NAMES, {name: path for name, path in inputs.items() if path})
    require_alone(options.out)
    announce_other_report(options.out, "scan")


def _tell(line: str) -> None:
    say(f"phone-host: {line}", sys.stderr)
