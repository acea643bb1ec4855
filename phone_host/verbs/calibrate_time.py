"""phone-host calibrate-time: measure the time offset between the two cameras and store it in rig.yaml."""

import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from common import now
from common.errors import SettingsError
from common.frame import SpoiledImageError
from common.places import make_folder
from common.program import logs
from common.program.commandline import INTERRUPTED
from common.program.quantities import seconds
from common.program.request import Request, option, part
from common.program.settings import log_level
from common.program.signals import StopSignals
from common.program.terminal import fitted
from common.recording.opened import is_recording
from common.stamp import HOST_CLOCK
from common.versions import REPORT_FORMAT
from phone_host.calibration.time_offset.misfit_plot import misfit_svg
from phone_host.calibration.time_offset.screen import PatternReader, counted, measure_screen, pattern_page
from phone_host.calibration.time_offset.shared_motion import measure_shared_motion
from phone_host.calibration.time_offset.shots import Measured, Times, require_shots, to_seconds
from phone_host.camera.factory import open_camera
from phone_host.camera.uris import EXAMPLE
from phone_host.discovery.opened import open_named
from phone_host.jobs.options import OneLinkOptions
from phone_host.jobs.output_folders import (
    announce_other_report,
    claim_names,
    require_alone,
    require_file,
    require_folder,
    unwritable,
    written_together,
)
from phone_host.model import Image, Rig
from phone_host.output.atomic import write_text
from phone_host.output.json_text import json_text
from phone_host.output.rig_files.imported import read_own_rig
from phone_host.output.rig_yaml import write_time_offset
from phone_host.recording.footage import Footage, film, keep, read, read_recording
from phone_host.run.progress_bar import share_bar, tell
from phone_host.serve.page import camera_page
from phone_host.settings import key_folder
from phone_host.stereo.raw_images import decode_frame
from phone_host.stereo.rectifier import Rectifier

EXAMPLES = """  phone-host calibrate-time --pattern pattern.html    # open it full screen in a browser, in view of both cameras
  phone-host calibrate-time --by screen --link tcp://192.168.7.2:5555 --camera v4l2:/dev/video0 --calibration rig.yaml --out timing
  phone-host calibrate-time --by scene --frames timing --calibration rig.yaml --out timing
  phone-host calibrate-time --by scene --frames session.mcap --calibration rig.yaml --out timing    # of a recording
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrateTimeRequest(Request):
    """What calibrate-time can be told."""

    pattern: Path | None = option(
        "--pattern", type=Path, metavar="FILE.html", help="write the page to show on a screen, then end"
    )
    by: str = option(
        "--by",
        choices=("screen", "scene"),
        default="screen",
        help="what both cameras film: the page of --pattern on a screen; or, with"
        " --calibration, any textured thing that moves up and down (default screen)",
    )
    cameras: OneLinkOptions = part(OneLinkOptions)
    frames: Path | None = option(
        "--frames",
        type=Path,
        metavar="DIR|FILE.mcap",
        help="use the frames that an earlier run kept with --keep, or those of a recording, instead of --link and --camera",
    )
    duration_s: float = option(
        "--seconds", number=seconds, default=20.0, metavar="S", help="seconds to film (default 20)"
    )
    calibration: Path | None = option(
        "--calibration", type=Path, metavar="rig.yaml", help="calibration to write the result into; --by scene needs it"
    )
    out: Path | None = option("--out", type=Path, metavar="DIR", help="folder for report.json and time-offset.svg")
    keep: bool = option("--keep", action="store_true", help="keep the frames in --out, for a later --frames")


_Reading = TypeVar("_Reading")
_FILES = "report.json", "time-offset.svg"


def run(request: CalibrateTimeRequest) -> int:
    """Film or read frames, measure and store."""
    if request.pattern is not None:
        return _write_pattern(request.pattern, as_json=request.as_json)
    _check(request)
    logs.set_up(log_level("warning"))
    rig = None if request.calibration is None else read_own_rig(request.calibration)
    if request.out is not None:
        require_folder(request.out)
        require_alone(request.out)
        announce_other_report(request.out, "calibrate-time", tell)
        claim_names(request.out, request.out, *_FILES)
    signals = StopSignals()
    footage = _footage(request, signals)
    if signals.interrupted:
        return INTERRUPTED
    measured = _measure(request.by, footage, rig)
    report = _report(request, measured, footage)
    _store(request, measured, report)
    print(json_text(report) if request.as_json else fitted(_summary(report)))
    return 0


def _check(request: CalibrateTimeRequest) -> None:
    if (request.frames is None) == (request.cameras.camera is None):
        raise SettingsError(
            "give either --camera or --frames",
            f"--camera {EXAMPLE}, --frames DIR of an earlier --keep, or --frames FILE.mcap",
        )
    if request.by == "scene" and request.calibration is None:
        raise SettingsError("--by scene without --calibration", "add --calibration rig.yaml, or use --by screen")
    if not 0 < request.duration_s <= 600:
        raise SettingsError(f"--seconds is {request.duration_s:g}", "give 1 to 600 seconds")
    if request.keep and (request.out is None or request.frames is not None):
        raise SettingsError("--keep needs --camera and --out", "add both, or leave --keep out")


def _write_pattern(file: Path, *, as_json: bool) -> int:
    require_file(file, "--pattern")
    try:
        make_folder(file.parent)
        write_text(file, pattern_page())
    except OSError as error:
        raise unwritable(file, error, "--pattern") from error
    print(json_text({"pattern": str(file)}) if as_json else fitted(f"written to {file}"))
    return 0


def _footage(request: CalibrateTimeRequest, signals: StopSignals) -> Footage:
    if request.frames is not None:
        return (read_recording if is_recording(str(request.frames)) else read)(request.frames)
    camera_uri = request.cameras.camera or ""
    keys = key_folder(request.cameras.keys or "")
    with camera_page(camera_uri, keys.path) as feed:
        camera = open_camera(camera_uri, HOST_CLOCK, now.monotonic_ns(), feed=feed)
        _, links = open_named((request.cameras.link,) if request.cameras.link else (), keys, request.cameras.wait_s)
        wait_ns = None if request.cameras.wait_s is None else round(request.cameras.wait_s * 1e9)
        with share_bar("waiting for the board", then="filming") as advance:
            footage = film(links, camera, request.duration_s, wait_ns, stop=lambda: signals.stop, advance=advance)
    if request.keep and request.out is not None:
        try:
            keep(footage, request.out)
        except OSError as error:
            raise unwritable(request.out, error) from error
    return footage


def _measure(by: str, footage: Footage, rig: Rig | None) -> Measured:
    require_shots(len(footage.board), len(footage.host))
    with share_bar(
        f"measuring the time offset by the {by}, {len(footage.board) + len(footage.host)} images"
    ) as advance:
        if by == "scene":
            assert rig is not None
            return measure_shared_motion(
                footage.board, footage.host, Rectifier(rig), lambda shot: decode_frame(shot.image), advance
            )
        board_s, host_s, _ = to_seconds(*([shot.exposed_ns for shot in side] for side in (footage.board, footage.host)))
        return _by_screen(footage, board_s, host_s, advance)


def _by_screen(footage: Footage, board_s: Times, host_s: Times, advance: Callable[[float], None]) -> Measured:
    board, host = _seen(footage, board_s, host_s, PatternReader().read, advance)
    return measure_screen(counted(*board), counted(*host))


def _seen(
    footage: Footage,
    board_s: Times,
    host_s: Times,
    read: Callable[[Image], _Reading],
    advance: Callable[[float], None],
) -> list[tuple[Times, list[_Reading]]]:
    """Return the readings of each camera's images with their times. A spoiled image is skipped as if it were lost."""
    done, sides = 0, []
    for shots, times_s in ((footage.board, board_s), (footage.host, host_s)):
        whole: list[int] = []
        readings: list[_Reading] = []
        for at, shot in enumerate(shots):
            with suppress(SpoiledImageError):
                readings.append(read(decode_frame(shot.image)))
                whole.append(at)
            done += 1
            advance(done / (len(board_s) + len(host_s)))
        sides.append((times_s[whole], readings))
    require_shots(len(sides[0][0]), len(sides[1][0]))
    return sides


def _report(request: CalibrateTimeRequest, measured: Measured, footage: Footage) -> dict[str, Any]:
    return {
        "format_version": REPORT_FORMAT,
        "command": "calibrate-time",
        "method": measured.method.value,
        "time_offset_ns": measured.offset.offset_ns,
        "uncertainty_ns": measured.offset.uncertainty_ns,
        "samples": measured.samples,
        "frames": {"board": len(footage.board), "host": len(footage.host)},
        "stored_in": None if request.calibration is None else str(request.calibration),
        "meaning": "stamp of the host's camera minus stamp of the board's camera for one moment; middle row of both images",
    }


def _store(request: CalibrateTimeRequest, measured: Measured, report: dict[str, Any]) -> None:
    if request.out is not None:
        with written_together(request.out, *_FILES, command="calibrate-time") as place:
            write_text(place / "report.json", json_text(report, indent=2) + "\n")
            write_text(place / "time-offset.svg", misfit_svg(measured))
    if request.calibration is None:
        print("phone-host: no --calibration: the result is stored nowhere", file=sys.stderr)
        return
    try:
        write_time_offset(request.calibration, measured.offset)
    except OSError as error:
        raise unwritable(request.calibration, error, "--calibration") from error


def _summary(report: dict[str, Any]) -> str:
    offset_ms, uncertainty_ms = report["time_offset_ns"] / 1e6, report["uncertainty_ns"] / 1e6
    stored = f"; stored in {report['stored_in']}" if report["stored_in"] else ""
    return (
        f"host's stamps minus board's: {offset_ms:+.3f} +- {uncertainty_ms:.3f} ms"
        f" (by {report['method']}, {report['samples']} samples){stored}"
    )
