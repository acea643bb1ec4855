"""phone-host demo --scan: a rendered thing on the mat is scanned with both programs, compared with what it is, and sliced."""

import math
import sys
from contextlib import nullcontext
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from rich.console import Console

from common.errors import DataError, SettingsError, UnavailableError
from common.program import logs
from common.program.commandline import CHECK_FAILED, INTERRUPTED
from common.program.invocation import command_line
from common.program.signals import StopSignals
from common.program.terminal import say
from common.words import counted
from phone_host.demo.scan_demonstration import ModelErrors, ScanDemo, render_pictures, with_truth
from phone_host.output.atomic import write_bytes
from phone_host.output.folder_lock import lock_for_command
from phone_host.output.json_text import json_text
from phone_host.output.meshes.formats import mesh_bytes
from phone_host.output.meshes.solid import Solid
from phone_host.output.result_files import claim
from phone_host.output.rig_yaml import write_rig
from phone_host.output.upright import upright_model
from phone_host.printers.bed import USUAL_BED
from phone_host.printers.preparing import Wanted, job_of
from phone_host.printers.printer_uri import FileUri
from phone_host.printers.slicing import SlicingWanted
from phone_host.report.page_links import NextCommand
from phone_host.report.scan_lines import scan_lines
from phone_host.run.progress_bar import announced, busy_bar, progress_bar, step_bar
from phone_host.run.scan_job import FinishedScan, report_values, write_scan
from phone_host.run.scan_result import require_something
from phone_host.run.scan_view import ScanPicture
from phone_host.scene.object_scene import ObjectScene, Setting, object_scene
from phone_host.stereo.default_matcher import default_matcher
from phone_host.stereo.rectify import rectify_rig
from phone_host.subprocesses.board_process import socket_folder

_OUT: Final = Path("out/demo-scan")
_OBJECT: Final = "speckled"
_VIEWS: Final = 36
"""A step of 10 degrees, as one takes photographs around a thing."""

_LEAST_VIEWS, _MOST_VIEWS = 6, 360
_STL, _GCODE = "model.stl", "model.gcode"

_WORST_MM: Final = 1.5
"""A model that is farther off on average is no model: thin parts come out 1 mm off, and a scan that was lost several."""


def run_scan_demo(
    seconds_s: float | None, thing: str | None, views: int | None, out: Path | None, *, as_json: bool
) -> int:
    """Render, scan, compare with the thing, slice.

    Args:
        seconds_s: how long to stream; it must not be given.
        thing: what is scanned; None: the usual thing.
        views: pairs all around it; None: the usual number.
        out: folder for the results; None: the usual one.
        as_json: whether to print one JSON object.
    """
    if seconds_s is not None:
        raise SettingsError(
            "--seconds is of the demo that streams", "leave it out: a scan takes as many pairs as --views says"
        )
    views, out = _VIEWS if views is None else views, out or _OUT
    if not _LEAST_VIEWS <= views <= _MOST_VIEWS:
        raise SettingsError(f"--views is {views}", f"give {_LEAST_VIEWS} to {_MOST_VIEWS}")
    logs.set_up(30)
    signals, console = StopSignals(), Console(stderr=True)
    scene = object_scene(thing or _OBJECT, Setting(views=views))
    try:
        done = _scanned(scene, out, console, signals)
        if done is None:
            if signals.interrupted:
                raise KeyboardInterrupt  # told as by every other command
            return 0
        scan, errors = done
        require_something(scan.report)
        scan = replace(scan, command="demo", told={"truth": _truth_json(errors)})
        write_scan(out, scan)
        printed = {} if signals.stop else _printed(out, console)
    except OSError as error:
        raise UnavailableError(
            f"{error.filename or out} cannot be written ({error.strerror})",
            "make room on the disk, or give another folder with --out",
        ) from None
    if as_json:
        print(json_text(report_values(scan) | {"print": printed}))
    else:
        say(scan_lines(scan.report, str(out)))
    say(_closing(out, printed), sys.stderr)
    if signals.stop:
        return INTERRUPTED if signals.interrupted else 0
    return 0 if scan.report.is_sound and errors.mean_mm <= _WORST_MM else CHECK_FAILED


def _scanned(
    scene: ObjectScene, out: Path, console: Console, signals: StopSignals
) -> tuple[FinishedScan, ModelErrors] | None:
    """Render and scan; None: it was stopped before there was anything to scan.

    Raises:
        OSError: the folder cannot be written to.
        UnavailableError: something that is not ours is in the way, or the board process died.
    """
    _claim(out)
    views = scene.setting.views
    stage = f"rendering {views} views of a thing for two cameras"
    with progress_bar(console) as progress, announced(stage, console, lambda: f"{progress.tasks[0].percentage:.0f} %"):
        task = progress.add_task(stage, total=2 * views)
        pictures = render_pictures(scene, out / "film", lambda: progress.advance(task), lambda: signals.stop)
    if pictures is None:
        return None
    write_rig(out / "rig.yaml", scene.rig, rectify_rig(scene.rig))
    with socket_folder() as sockets:
        demo = ScanDemo(scene, pictures, out, sockets, default_matcher())
        picture = ScanPicture(demo.live, console) if console.is_terminal else None
        with (
            announced("scanning with both programs", console, lambda: f"{demo.live.counts[0]} of {views} pairs"),
            picture or nullcontext(),
        ):
            demo.run(lambda: signals.stop, picture.refresh if picture else None)
            if picture:
                picture.end()
    if signals.stop and not demo.live.counts[1]:
        return None
    stage = "making the surface, comparing it with the thing"
    with announced(stage, console), busy_bar(stage, console):
        scan, errors = demo.finished()
    demo.live.work.kept.done()
    return replace(with_truth(scan, errors), commands=_by_hand(out)), errors


def _claim(out: Path) -> None:
    """Take the folder for this demo alone, and report anything in the way before rendering. An earlier demo's results stay until they are replaced.

    Raises:
        UnavailableError: something that is not ours is in the way, or another program writes there.
        OSError: the folder cannot be used.
    """
    lock_for_command(out)
    claim(out, "film", "rig.yaml", _STL, _GCODE)


def _printed(out: Path, console: Console) -> dict[str, Any]:
    """Write the model for printers, and slice it where a slicer is installed.

    Returns:
        What came of it, for --json.

    Raises:
        OSError: the folder cannot be written to.
    """
    upright = upright_model(out, None, None)
    points_m = (upright.points_mm / 1000.0).astype(np.float32)
    solid = Solid(points_m, upright.model.solid.triangles, np.zeros((0, 3), np.uint8))
    write_bytes(out / _STL, mesh_bytes(solid, "stl", None))
    found: dict[str, Any] = {"stl": str(out / _STL), "gcode": None, "seconds": None, "problem": None}
    wanted = Wanted(SlicingWanted(USUAL_BED))
    try:
        with (
            announced("slicing", console),
            step_bar("slicing", None, console) as watcher,
            job_of(out, wanted, FileUri(f"file:{out / _GCODE}", str(out / _GCODE)), watcher.say) as job,
        ):
            write_bytes(out / _GCODE, job.gcode.read_bytes())
    except (UnavailableError, DataError) as error:
        return found | {"problem": error.problem, "remedy": error.remedy}
    seconds = None if math.isnan(job.facts.seconds) else round(job.facts.seconds)
    return found | {"gcode": str(out / _GCODE), "seconds": seconds}


def _truth_json(errors: ModelErrors) -> dict[str, float | int | None]:
    return {
        name: None if isinstance(value, float) and math.isnan(value) else value
        for name, value in asdict(errors).items()
    }


def _by_hand(out: Path) -> tuple[NextCommand, ...]:
    """Return the commands that do the same, and what comes after it."""
    film = out / "film"
    own = command_line(
        "phone-host", "scan", film / "left", film / "right", "--mat", "--calibration", out / "rig.yaml", "--out", "scan"
    )
    return (
        NextCommand("The same by hand, from the pictures", own),
        NextCommand("Your own things: print the mat", command_line("phone-host", "target", "mat")),
    )


def _closing(out: Path, printed: dict[str, Any]) -> str:
    lines = [
        f"look at   {out}/index.html       the model, to turn",
        f"          {out}/model.ply        its surface, in any 3D viewer",
    ]
    if printed:
        lines.append(f"          {out}/{_STL}        for any slicer, mm, z up")
    if printed.get("gcode"):
        minutes = (
            f": {counted(round(printed['seconds'] / 60), 'minute')} on a usual printer" if printed["seconds"] else ""
        )
        lines.append(f"          {out}/{_GCODE}      sliced{minutes}")
    elif printed.get("problem"):
        lines.append(f"not sliced: {printed['problem']}; {printed['remedy']}")
    lines.append("try next")
    lines += [f"  {one.command}" for one in _by_hand(out)]
    return "\n".join(lines)
