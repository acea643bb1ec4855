"""phone-host record: keep what both cameras give, without computing anything."""

import math
import sys
from collections.abc import Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from common import now
from common.camera.base import Camera
from common.errors import SettingsError, TandemError
from common.link.base import Link
from common.program import logs
from common.program.commandline import CHECK_FAILED, INTERRUPTED
from common.program.quantities import seconds
from common.program.request import Request, option, part
from common.program.settings import log_level, with_origins
from common.program.signals import StopSignals
from common.program.terminal import fitted
from common.recording.recording_file import require_new
from common.stamp import HOST_CLOCK
from common.versions import REPORT_FORMAT
from phone_host.camera.factory import open_camera
from phone_host.camera.uris import EXAMPLE
from phone_host.diagnostics.run_snapshot import RecordingAccount
from phone_host.discovery.opened import open_named
from phone_host.jobs.options import CameraOptions
from phone_host.jobs.output_folders import require_alone
from phone_host.model import Rig, Side
from phone_host.output.json_text import json_text
from phone_host.output.rig_files.imported import read_own_rig
from phone_host.recording.footage import take_alone, take_frames
from phone_host.recording.recorder import UnpairedFrames, begin_recording
from phone_host.report.json_result import json_values
from phone_host.run.progress_bar import step_bar
from phone_host.settings import check, key_folder, resolve_settings

EXAMPLES = """  phone-host record --link tcp://192.168.7.2:5555 --camera v4l2:/dev/video0 --out session.mcap
  phone-host record --link tcp://192.168.7.2:5555 --camera v4l2:/dev/video0 --calibration rig.yaml --seconds 60 --out session.mcap    # run --replay with the same rig computes depth from it
  phone-host record --alone --camera v4l2:/dev/video0 --out host.mcap    # the board runs board-agent record; then sessions join
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordRequest(Request):
    """What record can be told."""

    config: Path | None = option("--config", type=Path, metavar="FILE", help="settings file (TOML)")
    cameras: CameraOptions = part(CameraOptions)
    alone: bool = option(
        "--alone",
        action="store_true",
        help="record this machine's camera only, while the board records its own; sessions join puts both together",
    )
    out: Path = option("--out", type=Path, required=True, metavar="FILE.mcap", help="the recording; it must not exist")
    duration_s: float = option(
        "--seconds",
        number=seconds,
        default=0.0,
        metavar="S",
        help="end after S seconds, counted from the board's first frame (default: when it is stopped)",
    )
    calibration: str | None = option(
        "--calibration",
        metavar="rig.yaml",
        help="calibration to keep in the recording; other programs read it as camera_info",
    )
    board_side: Side | None = option(
        "--board-side",
        read=lambda text, _: Side(text),
        choices=("left", "right"),
        help="which view the board's camera gives (default: as in the calibration, else left)",
    )


def run(request: RecordRequest) -> int:
    """Record until stopped, until the time is over, or until a stream ends."""
    found = resolve_settings(request.given)
    settings = found.values
    check(settings)
    if not settings.camera:
        raise SettingsError("no camera of this machine is given", f"use --camera {EXAMPLE}")
    require_alone(
        request.out.parent, request.out.name
    )  # before the file that another program just writes is in the way
    require_new(request.out, "--out")
    if request.alone and request.cameras.link:
        raise SettingsError("--alone records without a board, and --link names one", "leave one of both out")
    logs.set_up(log_level(settings.log_level))
    attached = {"settings.json": json_text(with_origins(found, request.given, sys.argv), indent=1).encode()}
    rig: Rig | None = None
    if settings.calibration:
        rig = read_own_rig(Path(settings.calibration))
        attached["rig.yaml"] = Path(settings.calibration).read_bytes()
    side = request.board_side or (rig.board_side if rig is not None else Side.LEFT)
    signals = StopSignals()
    with ExitStack() as opened:
        camera = open_camera(settings.camera, HOST_CLOCK, now.monotonic_ns(), settings.most_pixels)
        opened.enter_context(closing(camera))
        keys = key_folder(settings.keys)
        links = () if request.alone else open_named(settings.link, keys, request.cameras.wait_s)[1]
        for link in links:
            opened.enter_context(closing(link))
        recorder = begin_recording(request.out, camera.description, side, rig, attached)
        opened.pop_all()
    frames, is_vain = UnpairedFrames(recorder), False
    try:
        _film(request, camera, links, frames, signals)
    except TandemError:
        is_vain = frames.begun_ns is None and not request.alone
        raise
    finally:
        account = recorder.finish()
        if is_vain:
            request.out.unlink(missing_ok=True)  # the board gave nothing: the next try may use the name again
    return _tell(account, as_json=request.as_json, is_interrupted=signals.interrupted)


def _film(
    request: RecordRequest,
    camera: Camera,
    links: Sequence[Link],
    frames: UnpairedFrames,
    signals: StopSignals,
) -> None:
    """Take frames, and show how many there are, until it is over."""
    wait_ns = None if request.cameras.wait_s is None else round(request.cameras.wait_s * 1e9)
    seconds = request.duration_s or math.inf
    with step_bar("recording" if request.alone else "waiting for the board", None, Console(stderr=True)) as bar:

        def advance(_: float) -> None:
            bar.say(frames.account.words)

        if request.alone:
            take_alone(camera, frames, seconds, stop=lambda: signals.stop, advance=advance)
        else:
            take_frames(links, camera, frames, seconds, wait_ns, stop=lambda: signals.stop, advance=advance)


def _tell(account: RecordingAccount, *, as_json: bool, is_interrupted: bool) -> int:
    if as_json:
        print(json_text({"format_version": REPORT_FORMAT, "command": "record", **json_values(account)}))
    else:
        print(fitted(account.words))
    if is_interrupted:
        return INTERRUPTED
    return 0 if account.is_whole and account.frames else CHECK_FAILED
