"""phone-host demo: run both programs on this machine with a rendered scene of known depth, and write a full report."""

import shlex
import sys
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from common.diagnostic import diagnostic_of
from common.errors import SettingsError, UnavailableError
from common.program import logs
from common.program.commandline import CHECK_FAILED, INTERRUPTED
from common.program.invocation import command_line, program_name
from common.program.quantities import seconds
from common.program.request import Request, option
from common.program.settings import with_origins
from common.program.signals import StopSignals
from common.program.terminal import columns, headed, rows, say
from common.words import counted
from phone_host.demo.demonstration import FPS, DemoRun, DepthErrors, demo_page, truth_json
from phone_host.model import Rig
from phone_host.output.folder_lock import lock_for_command
from phone_host.output.json_text import json_text
from phone_host.output.listed import ListedFolder
from phone_host.output.rig_yaml import write_rig
from phone_host.report.page_links import NextCommand
from phone_host.report.run_json import build
from phone_host.report.summary import summary
from phone_host.run.file_sink import NAMES
from phone_host.run.progress_bar import announced, busy_bar, progress_bar
from phone_host.run.terminal_view import LiveTable
from phone_host.scene.film import Film, render_film
from phone_host.scene.scene import DEMO_PERIOD_S, PHONE_LOOK, WEBCAM_LOOK, demo_scene, unlike_rig
from phone_host.scene.scene_model import Scene
from phone_host.stereo.rectify import rectify_rig
from phone_host.subprocesses.board_process import socket_folder

EXAMPLES = """  phone-host demo
  phone-host demo --seconds 30 --out demo
  phone-host demo --scan                   # scan a thing on the mat, as `scan --mat` does; about a minute
  phone-host demo --scan --object thin
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class DemoRequest(Request):
    """What demo can be told."""

    duration_s: float | None = option(
        "--seconds", number=seconds, metavar="S", help="seconds to stream (default 12); not with --scan"
    )
    scan: bool = option(
        "--scan",
        action="store_true",
        help="scan a rendered thing that stands on the mat instead, compare the model with it, and slice it where PrusaSlicer is installed",
    )
    thing: str | None = option(
        "--object",
        choices=("speckled", "thin", "shiny", "plain"),
        help="the thing to scan: speckled (default), with thin parts, shiny, or nearly without texture",
    )
    views: int | None = option(
        "--views", type=int, metavar="N", help="pairs all around the thing (default 36, 6 to 360), with --scan"
    )
    out: Path | None = option(
        "--out", type=Path, metavar="DIR", help="folder for the results (default out/demo, with --scan out/demo-scan)"
    )


_SECONDS = 12.0
_OUT = Path("out/demo")


def run(request: DemoRequest) -> int:
    """Render, stream, measure and compare with the truth."""
    if request.scan:
        from phone_host.verbs.demo_scan import run_scan_demo  # noqa: PLC0415 - the other demo needs none of it

        return run_scan_demo(request.duration_s, request.thing, request.views, request.out, as_json=request.as_json)
    for name in ("object", "views"):
        if request.given[name]:
            raise SettingsError(f"--{name} is for a scan", "add --scan, or leave it out")
    seconds_s = _SECONDS if request.duration_s is None else request.duration_s
    if not 1 <= seconds_s <= 3600:
        raise SettingsError(f"--seconds is {seconds_s:g}", "give 1 to 3600 seconds")
    logs.set_up(30)
    signals = StopSignals()
    console = Console(stderr=True)
    out = request.out or _OUT
    rig, scene = unlike_rig(), demo_scene()

    try:
        _claim(out)
        film = _render(scene, rig, out / "film", console, signals)
        write_rig(out / "rig.yaml", rig, rectify_rig(rig))
        with socket_folder() as sockets:
            demo = DemoRun(
                film,
                rig,
                out,
                sockets,
                with_origins(None, {**request.given, "seconds": seconds_s, "out": out}, sys.argv),
            )
            live = LiveTable(demo.host.snapshot, console, seconds=seconds_s) if console.is_terminal else None
            try:
                with announced(f"streaming and computing depth for {seconds_s:g} s", console), live or nullcontext():
                    demo.run(seconds_s, lambda: signals.stop, live.refresh if live else None)
            except BaseException as error:
                failed = build(demo.host.snapshot("failed", diagnostic_of(error)), "demo")
                demo.host.write_report(failed, replaces_earlier=False)
                raise
        snapshot = demo.host.snapshot("stopped" if signals.stop else "time_over")
        stage = "comparing the depth with the known scene, writing the page"
        with announced(stage, console), busy_bar(stage, console):
            errors = demo.check(scene)
            report = build(snapshot, "demo") | {"truth": truth_json(errors)}
            page = demo_page(snapshot, errors, demo.last, demo.ledgers, _by_hand(out, film))
            demo.write_pictures(out)
            complete = demo.host.write_report(report, page, replaces_earlier=snapshot.processed > 0)
    except _StoppedError:
        if signals.interrupted:
            raise KeyboardInterrupt from None  # told as by every other command
        return 0
    except OSError as error:
        raise UnavailableError(
            f"{error.filename or out} cannot be written ({error.strerror})",
            "make room on the disk, or give another folder with --out",
        ) from None
    print(json_text(report) if request.as_json else headed(summary(snapshot, columns()), columns(), rows()))
    say(closing(out, film, errors), sys.stderr)
    if signals.stop:
        return INTERRUPTED if signals.interrupted else 0
    return 0 if errors.pairs and not errors.wrong_pairs and complete else CHECK_FAILED


def _claim(out: Path) -> None:
    """Take the folder for this demo alone, and report anything in the way before rendering. An earlier demo's results stay until they are replaced.

    Raises:
        UnavailableError: something that is not ours is in the way, or another program writes there.
        OSError: the folder cannot be used.
    """
    lock_for_command(out)
    names = rf"{NAMES}|film|rig\.yaml|cloud\.ply|disparity\.png"
    with ListedFolder(out, "(?!)", kept=names) as folder:
        folder.add("film", "rig.yaml", "cloud.ply", "disparity.png", "index.html")


class _StoppedError(Exception):
    """Ends a rendering that is no longer wanted."""


def _render(scene: Scene, rig: Rig, folder: Path, console: Console, signals: StopSignals) -> Film:
    """Render the film with a progress bar.

    Raises:
        _StoppedError: a stop signal came.
        OSError: the folder cannot be written to.
    """
    stage = "rendering a moving scene for two cameras"
    with progress_bar(console) as progress, announced(stage, console, lambda: f"{progress.tasks[0].percentage:.0f} %"):
        task = progress.add_task(stage, total=2 * FPS * DEMO_PERIOD_S)

        def advance() -> None:
            progress.advance(task)
            if signals.stop:
                raise _StoppedError

        looks = (WEBCAM_LOOK, PHONE_LOOK)
        return render_film(scene, rig, looks, folder, fps=FPS, seconds=DEMO_PERIOD_S, advance=advance)


def _by_hand(out: Path, film: Film) -> tuple[NextCommand, ...]:
    """Return the commands that do the same as the demo, and what comes after it."""
    board = command_line("board-agent", "run", "--camera", film.replay_uri(film.left))
    own, rig = film.replay_uri(film.right), out / "rig.yaml"
    host = command_line("phone-host", "run", "--camera", own, "--calibration", rig, "--out", "scan")
    return (
        NextCommand("The same by hand: the board, in one terminal", board),
        NextCommand("and the host, in another one", host),
        NextCommand(
            "Your own two cameras: calibrate them from photographs of a chessboard",
            command_line("phone-host", "calibrate", "--help"),
        ),
    )


def closing(out: Path, film: Film, errors: DepthErrors) -> str:
    """Return the demo's last words: how good the depth was, and what to do by hand next."""
    board, host = (one.command for one in _by_hand(out, film)[:2])
    if not errors.pairs:
        return f"no pair was processed in that time, so nothing could be checked: give more --seconds; see {out}/index.html"
    wrong = (
        f"\nWRONG: {errors.wrong_pairs} of {counted(errors.pairs, 'checked pair')} show two different moments"
        if errors.wrong_pairs
        else ""
    )
    return f"""depth against the known scene: {errors.depth_mm:.1f} mm median error ({errors.depth_percent:.2f} %), {errors.at_1_m_mm:.1f} mm at 1 m, {errors.at_2_m_mm:.1f} mm at 2 m, {errors.density:.0%} of the pixels{wrong}

look at   {out}/index.html       the scene, its depth and every delay
          {out}/cloud.ply        the point cloud, in any 3D viewer
          {out}/report.json, {out}/delays.jsonl
try next  the same by hand, in two terminals:
  {board}
  {host}
then what you can do with your own cameras or photographs:
  {program_name("phone-host")}{_how_found()}"""


def _how_found() -> str:
    """Say how the shell finds the programs by their names, unless it does."""
    path = program_name("phone-host")
    activate = Path(shlex.split(path)[0]).parent / "activate"
    if path == "phone-host" or not activate.is_file():
        return ""
    return f"""
to use phone-host, board-agent and delay-bench by their names, once in each terminal:
  . {shlex.quote(str(activate))}"""
