"""phone-host run: pair a board's frames with the host camera's, compute depth and measure every delay."""

import argparse
import math
import sys
from contextlib import nullcontext, suppress
from dataclasses import replace
from pathlib import Path

from common import now
from common.camera.base import upright_px
from common.errors import SettingsError
from common.link.factory import open_links, parse_link, tell_insecure
from common.places import Kind, kind_of, resolved
from common.program import logs
from common.program.commandline import INTERRUPTED
from common.program.interrupts import leave
from common.program.settings import Resolved, log_level, with_origins
from common.program.signals import StopSignals
from common.program.terminal import columns, headed, rows, say
from common.stamp import HOST_CLOCK
from phone_host.boards.discovery import find_board_and_say, remember
from phone_host.camera.examples import EXAMPLE
from phone_host.camera.factory import open_camera
from phone_host.camera.http_uri import without_password
from phone_host.declared_settings import PhoneHostSettings
from phone_host.measure.run_snapshot import RunSnapshot, depth_is_wrong
from phone_host.measure.trouble import Trouble, trouble_of
from phone_host.model import Side, TimeOffset
from phone_host.output.json_text import json_text
from phone_host.report.run_json import build
from phone_host.report.run_page import run_page
from phone_host.report.summary import summary
from phone_host.run.file_sink import NAMES
from phone_host.run.host import Host
from phone_host.run.host_settings import EndReason, HostSettings
from phone_host.run.terminal_view import LiveTable
from phone_host.run.time_limit import patience_s
from phone_host.run.waiting_note import WaitingNote
from phone_host.settings import check, key_folder, matcher_is_given, resolve_settings
from phone_host.stereo.core import StereoCore
from phone_host.stereo.default_matcher import default_note
from phone_host.sync.fifo import FifoSettings
from phone_host.sync.phase import Whose
from phone_host.verbs.output_folders import keep_other_report, spare_inputs
from phone_host.verbs.run.budget import budget_wanted
from phone_host.verbs.stereo_options import build_core, output_options, overlay_of

_CHECK_FAILED = 4

_MOST_SECONDS = 10_000_000
"""Four months; more than that is a slip of the hand."""


def replayed(uri: str) -> str:
    """Return the path of a camera that replays images; empty for any other camera."""
    return uri.removeprefix("replay:").partition("?")[0] if uri.startswith("replay:") else ""


def run(options: argparse.Namespace) -> int:
    """Run until stopped, until the number of pairs is reached, or until a stream ends."""
    resolved = resolve_settings(options)
    settings = resolved.values
    check(settings)
    logs.set_up(log_level(settings.log_level))
    if not settings.camera:
        raise SettingsError("no camera of this machine is given", f"use --camera {EXAMPLE}")
    _check_numbers(options)
    if options.out is not None:
        spare(options.out, replayed(settings.camera), settings.calibration, options.overlay)
    fifo = FifoSettings.parse(settings.fifo)
    camera = open_camera(settings.camera, HOST_CLOCK, now.monotonic_ns(), settings.most_pixels)
    core, board_side = _core(options, settings, upright_px(camera))
    overlay = overlay_of(options, core)
    budget = budget_wanted(options, resolved, core)
    keys = key_folder(settings.keys)
    named = settings.link or (find_board_and_say(keys.path, patience_s(options.wait, options.seconds)),)
    uris = [parse_link(uri, listens_by_default=False) for uri in named]
    for uri in uris:
        tell_insecure(uri)
    links = open_links(uris, keys)
    if core is not None and options.complete and (options.out is None or not options.save_every):
        say("phone-host: --complete does nothing here: no pair is saved; give --out DIR and --save-every N", sys.stderr)
    signals = StopSignals()
    if options.out is not None:
        keep_other_report(options.out, "run")
    host_settings = replace(_host_settings(options, resolved, fifo, board_side, core), budget=budget, overlay=overlay)
    host = Host(host_settings, camera, links, core)
    on_terminal = sys.stderr.isatty()
    live = LiveTable(host.snapshot, pairs=options.pairs, seconds=options.seconds) if on_terminal else None
    note = WaitingNote(
        named, lambda: host.has_met_board, lambda: host.refused, lambda line: say(line, sys.stderr, flush=True)
    )
    try:
        with live or nullcontext():
            ended = host.run(lambda: signals.stop, live.refresh if live else note.refresh)
    except BaseException as error:
        with suppress(Exception):  # tell what ended the run, not what followed
            _report_failure(options, host, trouble_of(error), board_side)
        raise
    if host.has_met_board and len(named) == 1 and "?" not in named[0] and named[0].startswith("tcp://"):
        remember(keys.path, named[0])
    return _finish(options, host, signals, ended, board_side)


def _finish(options: argparse.Namespace, host: Host, signals: StopSignals, ended: EndReason, board_side: Side) -> int:
    """Write and print the report of a run; return its exit code."""
    snapshot = host.snapshot(ended.value)
    report = build(snapshot)
    page = _page(host, snapshot, board_side, options.out) if options.out else ""
    complete = host.write_report(report, page)
    missing = f"\nnot written: {host.missing_files}: make room and run again" if host.missing_files else ""
    told = summary(snapshot, columns()) + missing
    text = json_text(report) if options.json else headed(told, columns(), rows())
    print(text, flush=host.has_given_up)
    if options.json and snapshot.shortfall:
        say(f"phone-host: {snapshot.shortfall}", sys.stderr)
    if signals.interrupted and host.has_given_up:
        leave()  # the interpreter's end would wait for native code
    if signals.interrupted:
        return INTERRUPTED
    too_few = options.pairs and ended is EndReason.STREAM_ENDED
    too_few = too_few or (ended is EndReason.SECONDS_OVER and not snapshot.processed)
    is_wrong = not signals.stop and (depth_is_wrong(snapshot) or snapshot.spoiled_counts.nothing_whole)
    return _CHECK_FAILED if too_few or is_wrong or not complete else 0


def _report_failure(options: argparse.Namespace, host: Host, failure: Trouble, board_side: Side) -> None:
    """Write and print the report of a run that an error ended. The error itself goes to stderr."""
    snapshot = host.snapshot("failed", failure)
    report = build(snapshot)
    host.write_report(report, _page(host, snapshot, board_side, options.out) if options.out else "")
    if options.json:
        print(json_text(report))


def spare(out: Path, replay: str, calibration: str, overlay: Path | None = None) -> None:
    """Refuse a results folder that would lose the inputs, or holds the replay's photographs.

    Args:
        out: folder for the results.
        replay: folder, glob or file that the own camera replays; empty: another camera.
        calibration: path of the rig; empty: none.
        overlay: correction of an earlier run; None: none.

    Raises:
        SettingsError: it is such a folder.
    """
    inputs = {"--camera": replay, "--calibration": calibration, "--overlay": "" if overlay is None else str(overlay)}
    spare_inputs(out, NAMES, {what: Path(path) for what, path in inputs.items() if path})
    if not replay:
        return
    try:
        folder = Path(replay) if kind_of(replay) is Kind.FOLDER else Path(replay).parent
    except OSError:  # the camera will say why
        return
    if resolved(out) == resolved(folder):
        raise SettingsError(
            f"--out {out} is the folder of the photographs of --camera",
            f"give a folder of its own, such as --out {out / 'scan'}",
        )


def _page(host: Host, snapshot: RunSnapshot, board_side: Side, out: Path) -> str:
    """Make the page of a run, with links to the clouds it saved (maps where it has no geometry)."""
    saved = sorted(path.relative_to(out).as_posix() for path in out.glob("pair-*/cloud.ply"))
    saved = saved or sorted(path.relative_to(out).as_posix() for path in out.glob("pair-*/disparity.pfm"))
    return run_page(snapshot, host.last, board_side, host.sample(), saved)


def _core(
    options: argparse.Namespace, settings: PhoneHostSettings, size_px: tuple[int, int]
) -> tuple[StereoCore | None, Side]:
    """Return the stereo core, if any, and the side of the board's camera: from the option, else the rig, else left."""
    images = replayed(settings.camera)
    core, rig_side = build_core(
        options,
        settings.calibration,
        settings.matcher,
        size_px,
        Path(images) if images else None,
        temporal=settings.temporal,
    )
    board_side = Side(options.board_side) if options.board_side else rig_side or Side.LEFT
    if rig_side not in {None, board_side}:
        raise SettingsError(
            f"--board-side {board_side.value} contradicts {settings.calibration}",
            "leave it out, or calibrate with the board there",
        )
    if core is None and options.temporal:
        raise SettingsError(
            "--temporal without --calibration or --rectified, so no depth is computed",
            "add one of them, or leave it out",
        )
    if core is None:
        print("phone-host: no --calibration and not --rectified: pairs and delays only, no depth", file=sys.stderr)
    return core, board_side


def _host_settings(
    options: argparse.Namespace,
    resolved: Resolved[PhoneHostSettings],
    fifo: FifoSettings,
    board_side: Side,
    core: StereoCore | None,
) -> HostSettings:
    settings, wait_s = resolved.values, patience_s(options.wait, options.seconds)
    return HostSettings(
        matcher_note="" if core is None or matcher_is_given(resolved) else default_note(),
        resolved=with_origins(
            replace(resolved, values=replace(settings, camera=without_password(settings.camera))),
            vars(options),
            sys.argv,
        ),
        board_side=board_side,
        tolerance_ns=round(settings.tolerance * 1e6) if settings.tolerance else None,
        fifo=fifo,
        pairs=options.pairs,
        seconds_ns=round(options.seconds * 1e9),
        wait_ns=None if wait_s is None else round(wait_s * 1e9),
        out=options.out,
        save_every=options.save_every,
        axes=output_options(options).axes,
        corrects=not options.no_correction,
        time_offset=TimeOffset() if core is None or core.rig is None else core.rig.time_offset,
        interpolate=settings.interpolate,
        most_pixels=settings.most_pixels,
        steered=frozenset(whose for whose in Whose if settings.align_phase in {"either", whose.value}),
    )


def _check_numbers(options: argparse.Namespace) -> None:
    for name, value in (("--pairs", options.pairs), ("--save-every", options.save_every)):
        if value < 0:
            raise SettingsError(f"{name} {value}", "give 0 or more")
    if options.budget == 0:
        raise SettingsError("--budget is 0 ms", "give the time for each pair, for example 30ms, or leave it out")
    if not 0 <= options.seconds <= _MOST_SECONDS:
        raise SettingsError(f"--seconds is {options.seconds:g}", f"give 0 (no limit) to {_MOST_SECONDS} seconds")
    if options.wait is not None and not (math.isfinite(options.wait) and options.wait >= 0):
        raise SettingsError(f"--wait is {options.wait}", "give 0 or more seconds, or leave it out to wait for ever")
