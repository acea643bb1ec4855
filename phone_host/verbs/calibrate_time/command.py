"""phone-host calibrate-time: measure the time offset between the two cameras and store it in rig.yaml."""

import argparse
import math
import sys
from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeVar

from common import now
from common.errors import SettingsError
from common.frame import SpoiledImageError
from common.places import make_folder
from common.program import logs
from common.program.commandline import INTERRUPTED
from common.program.settings import log_level
from common.program.signals import StopSignals
from common.program.terminal import fitted
from common.recording.opened import is_recording
from common.stamp import HOST_CLOCK
from common.versions import REPORT_FORMAT
from phone_host.boards.opened import open_named
from phone_host.calibration.time_offset.misfit_plot import misfit_svg
from phone_host.calibration.time_offset.screen import PatternReader, counted, measure_screen, pattern_page
from phone_host.calibration.time_offset.shared_motion import measure_shared_motion
from phone_host.calibration.time_offset.shots import Measured, Times, require_shots, to_seconds
from phone_host.camera.examples import EXAMPLE
from phone_host.camera.factory import open_camera
from phone_host.model import Image, Rig
from phone_host.output.atomic import write_text
from phone_host.output.json_text import json_text
from phone_host.output.rig_files.imported import read_own_rig
from phone_host.output.rig_yaml import write_time_offset
from phone_host.recording.footage import Footage, film, keep, read, read_recording
from phone_host.run.progress_bar import share_bar
from phone_host.settings import key_folder
from phone_host.stereo.raw_images import decode_frame
from phone_host.stereo.rectifier import Rectifier
from phone_host.verbs.output_folders import (
    announce_other_report,
    claim_names,
    require_alone,
    require_file,
    require_folder,
    unwritable,
    written_together,
)
from phone_host.verbs.run.page_beside import camera_page

_Reading = TypeVar("_Reading")
_FILES = "report.json", "time-offset.svg"


def run(options: argparse.Namespace) -> int:
    """Film or read frames, measure and store."""
    if options.pattern is not None:
        return _write_pattern(options)
    _check(options)
    logs.set_up(log_level("warning"))
    rig = None if options.calibration is None else read_own_rig(options.calibration)
    if options.out is not None:
        require_folder(options.out)
        require_alone(options.out)
        announce_other_report(options.out, "calibrate-time")
        claim_names(options.out, options.out, *_FILES)
    signals = StopSignals()
    footage = _footage(options, signals)
    if signals.interrupted:
        return INTERRUPTED
    measured = _measure(options.by, footage, rig)
    report = _report(options, measured, footage)
    _store(options, measured, report)
    print(json_text(report) if options.json else fitted(_summary(report)))
    return 0


def _check(options: argparse.Namespace) -> None:
    if (options.frames is None) == (options.camera is None):
        raise SettingsError(
            "give either --camera or --frames",
            f"--camera {EXAMPLE}, --frames DIR of an earlier --keep, or --frames FILE.mcap",
        )
    if options.by == "scene" and options.calibration is None:
        raise SettingsError("--by scene without --calibration", "add --calibration rig.yaml, or use --by screen")
    if not (math.isfinite(options.seconds) and 0 < options.seconds <= 600):
        raise SettingsError(f"--seconds is {options.seconds:g}", "give 1 to 600 seconds")
    if options.wait is not None and not (math.isfinite(options.wait) and options.wait >= 0):
        raise SettingsError(f"--wait is {options.wait}", "give 0 or more seconds, or leave it out to wait for ever")
    if options.keep and (options.out is None or options.frames is not None):
        raise SettingsError("--keep needs --camera and --out", "add both, or leave --keep out")


def _write_pattern(options: argparse.Namespace) -> int:
    require_file(options.pattern, "--pattern")
    try:
        make_folder(options.pattern.parent)
        write_text(options.pattern, pattern_page())
    except OSError as error:
        raise unwritable(options.pattern, error, "--pattern") from error
    print(json_text({"pattern": str(options.pattern)}) if options.json else fitted(f"written to {options.pattern}"))
    return 0


def _footage(options: argparse.Namespace, signals: StopSignals) -> Footage:
    if options.frames is not None:
        return (read_recording if is_recording(str(options.frames)) else read)(options.frames)
    keys = key_folder(options.keys or "")
    with camera_page(options.camera, keys.path) as feed:
        camera = open_camera(options.camera, HOST_CLOCK, now.monotonic_ns(), feed=feed)
        _, links = open_named((options.link,) if options.link else (), keys, options.wait)
        wait_ns = None if options.wait is None else round(options.wait * 1e9)
        with share_bar("waiting for the board", then="filming") as advance:
            footage = film(links, camera, options.seconds, wait_ns, stop=lambda: signals.stop, advance=advance)
    if options.keep:
        try:
            keep(footage, options.out)
        except OSError as error:
            raise unwritable(options.out, error) from error
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
    for shots, seconds in ((footage.board, board_s), (footage.host, host_s)):
        whole: list[int] = []
        readings: list[_Reading] = []
        for at, shot in enumerate(shots):
            with suppress(SpoiledImageError):
                readings.append(read(decode_frame(shot.image)))
                whole.append(at)
            done += 1
            advance(done / (len(board_s) + len(host_s)))
        sides.append((seconds[whole], readings))
    require_shots(len(sides[0][0]), len(sides[1][0]))
    return sides


def _report(options: argparse.Namespace, measured: Measured, footage: Footage) -> dict[str, Any]:
    return {
        "format_version": REPORT_FORMAT,
        "command": "calibrate-time",
        "method": measured.method.value,
        "time_offset_ns": measured.offset.offset_ns,
        "uncertainty_ns": measured.offset.uncertainty_ns,
        "samples": measured.samples,
        "frames": {"board": len(footage.board), "host": len(footage.host)},
        "stored_in": None if options.calibration is None else str(options.calibration),
        "meaning": "stamp of the host's camera minus stamp of the board's camera for one moment; middle row of both images",
    }


def _store(options: argparse.Namespace, measured: Measured, report: dict[str, Any]) -> None:
    if options.out is not None:
        with written_together(options.out, *_FILES, command="calibrate-time") as place:
            write_text(place / "report.json", json_text(report, indent=2) + "\n")
            write_text(place / "time-offset.svg", misfit_svg(measured))
    if options.calibration is None:
        print("phone-host: no --calibration: the result is stored nowhere", file=sys.stderr)
        return
    try:
        write_time_offset(options.calibration, measured.offset)
    except OSError as error:
        raise unwritable(options.calibration, error, "--calibration") from error


def _summary(report: dict[str, Any]) -> str:
    offset_ms, uncertainty_ms = report["time_offset_ns"] / 1e6, report["uncertainty_ns"] / 1e6
    stored = f"; stored in {report['stored_in']}" if report["stored_in"] else ""
    return (
        f"host's stamps minus board's: {offset_ms:+.3f} +- {uncertainty_ms:.3f} ms"
        f" (by {report['method']}, {report['samples']} samples){stored}"
    )
