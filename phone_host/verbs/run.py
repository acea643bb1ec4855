"""phone-host run: pair a board's frames with the own camera's, compute depth, measure every delay."""

import argparse
import json
import math
import sys
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from common import now
from common.errors import SettingsError
from common.link.factory import open_links, parse_link, tell_insecure
from common.program import logs
from common.program.commandline import INTERRUPTED
from common.program.settings import Resolved, log_level, resolve, with_origins
from common.program.signals import StopSignals
from common.stamp import HOST_CLOCK
from phone_host.camera.factory import EXAMPLE, open_camera
from phone_host.settings import ENVIRONMENT_PREFIX, MAX_MEGAPIXELS_HELP, PhoneHostSettings, check, key_folder
from phone_host.verbs.output_folders import spare_inputs

if TYPE_CHECKING:
    from phone_host.model import Side
    from phone_host.run.host import HostSettings
    from phone_host.stereo.core import StereoCore
    from phone_host.sync.fifo import FifoSettings

EXAMPLES = """  phone-host run --link tcp://192.168.7.2:5555 --camera 'replay:right?loop=1' --calibration rig.yaml --out scan
  phone-host run --link ipc://$XDG_RUNTIME_DIR/board --camera 'replay:right?pace=demand' --rectified --disparities 64 --pairs 20 --out scan
  phone-host run --link tcp://192.168.7.2:5555 --camera 'http://127.0.0.1:8080/video?latency_ms=120' --calibration rig.yaml --out scan
  phone-host run --link serial:/dev/ttyACM0 --link tcp://192.168.7.2:5555 --camera 'replay:right?loop=1' --out scan
  phone-host run --camera v4l2:/dev/video0 --calibration rig.yaml --align-phase        (both cameras expose together)
  phone-host run --camera 'replay:right?loop=1' --pairs 300 --json        (no depth: pairs and delays only)
"""

_CHECK_FAILED = 4


def replayed(uri: str) -> str:
    """The path of a camera that replays images; empty for any other."""
    return uri.removeprefix("replay:").partition("?")[0] if uri.startswith("replay:") else ""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    from phone_host.verbs.stereo_options import add_stereo_arguments  # noqa: PLC0415 - brings OpenCV in with its use

    parser.add_argument("--config", type=Path, metavar="FILE", help="settings file (TOML)")
    parser.add_argument(
        "--link",
        action="append",
        metavar="URI",
        help="the board: tcp://HOST:PORT, ipc://PATH[?owner=USER], serial:DEVICE or rfcomm://DEVICE (default: the board is looked for); may be given again:"
        " frames come over the best link that is up",
    )
    parser.add_argument("--camera", metavar="URI", help=f"the own camera: {EXAMPLE}")
    add_stereo_arguments(parser)
    parser.add_argument(
        "--board-side", choices=("left", "right"), help="which view the board's camera is (default left, or the rig's)"
    )
    parser.add_argument(
        "--tolerance",
        type=float,
        metavar="MS",
        help="greatest time skew of a pair (default: half of the longer frame period)",
    )
    parser.add_argument(
        "--fifo", metavar="DEPTH:POLICY", help="drop-oldest, drop-newest or block (default 1:drop-oldest)"
    )
    parser.add_argument(
        "--align-phase",
        nargs="?",
        const="either",
        choices=("either", "board", "host"),
        help="steer a camera until both expose together; which one may be steered (default either)",
    )
    parser.add_argument(
        "--interpolate",
        action="store_true",
        default=None,
        help="move the board's image to the host's moment along the optical flow, where no camera can be steered",
    )
    parser.add_argument(
        "--pairs", type=int, default=0, metavar="N", help="end after N pairs; fewer when the stream ends: exit 4"
    )
    parser.add_argument(
        "--wait", type=float, metavar="S", help="wait this long for an absent board, then exit 3 (default: for ever)"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder for delays.jsonl, report.json, index.html and saved pairs"
    )
    parser.add_argument(
        "--save-every",
        type=int,
        default=30,
        metavar="N",
        help="save every Nth pair from the first on; 0: none (default 30)",
    )
    parser.add_argument("--keys", metavar="DIR", help="folder of keys (default ~/.config/tandemscan)")
    parser.add_argument("--max-megapixels", type=int, metavar="N", help=MAX_MEGAPIXELS_HELP)
    parser.add_argument("--log-level", choices=("debug", "info", "warning", "error"), help="how much to log to stderr")


def resolve_settings(options: argparse.Namespace) -> Resolved[PhoneHostSettings]:
    """Work out the settings from file, environment and options."""
    names = (
        "link",
        "camera",
        "calibration",
        "matcher",
        "tolerance",
        "fifo",
        "align_phase",
        "interpolate",
        "keys",
        "max_megapixels",
        "log_level",
    )
    given = {name: getattr(options, name, None) for name in names}
    given["link"] = tuple(given["link"]) if given["link"] else None
    return resolve(PhoneHostSettings, ENVIRONMENT_PREFIX, options.config, given)


def run(options: argparse.Namespace) -> int:
    """Run until stopped, the pairs are reached or a stream ends."""
    from phone_host.boards.discovery import find_aloud, remember  # noqa: PLC0415
    from phone_host.report.run_json import build  # noqa: PLC0415
    from phone_host.report.run_page import run_page  # noqa: PLC0415
    from phone_host.report.summary import summary  # noqa: PLC0415
    from phone_host.run.file_sink import NAMES  # noqa: PLC0415
    from phone_host.run.host import EndReason, Host  # noqa: PLC0415 - OpenCV, only now
    from phone_host.run.terminal_view import LiveTable  # noqa: PLC0415
    from phone_host.sync.fifo import FifoSettings  # noqa: PLC0415

    resolved = resolve_settings(options)
    settings = resolved.values
    check(settings)
    logs.set_up(log_level(settings.log_level))
    if not settings.camera:
        raise SettingsError("no own camera is given", f"use --camera {EXAMPLE}")
    _check_numbers(options)
    if options.out is not None:
        inputs = {"--camera": replayed(settings.camera), "--calibration": settings.calibration}
        spare_inputs(options.out, NAMES, {what: Path(path) for what, path in inputs.items() if path})
    fifo = FifoSettings.parse(settings.fifo)
    camera = open_camera(settings.camera, HOST_CLOCK, now.monotonic_ns(), settings.most_pixels)
    core, board_side = _core(options, settings, (camera.description.width_px, camera.description.height_px))
    keys = key_folder(settings.keys)
    named = settings.link or (find_aloud(keys.path, options.wait),)
    uris = [parse_link(uri, listens_by_default=False) for uri in named]
    for uri in uris:
        tell_insecure(uri)
    links = open_links(uris, keys)
    signals = StopSignals()
    host = Host(_host_settings(options, resolved, fifo, board_side, core), camera, links, core)
    live = LiveTable(host.snapshot, pairs=options.pairs) if sys.stderr.isatty() else None
    with live or nullcontext():
        try:
            ended = host.run(lambda: signals.stop, live.refresh if live else None)
        except BaseException:
            host.write_report(build(host.snapshot("failed")))
            raise
    if host.has_met_board and len(named) == 1 and "?" not in named[0] and named[0].startswith("tcp://"):
        remember(keys.path, named[0])
    snapshot = host.snapshot(ended.value)
    report = build(snapshot)
    page = run_page(snapshot, host.last, board_side, host.sample()) if options.out else ""
    complete = host.write_report(report, page)
    print(json.dumps(report) if options.json else summary(snapshot))
    if signals.interrupted:
        return INTERRUPTED
    too_few = options.pairs and ended is EndReason.STREAM_ENDED
    return _CHECK_FAILED if too_few or not complete else 0


def _core(
    options: argparse.Namespace, settings: PhoneHostSettings, size_px: tuple[int, int]
) -> "tuple[StereoCore | None, Side]":
    """The stereo core, if any, and the side of the board's camera: as the option says, else as the rig does, else left."""
    from phone_host.model import Side  # noqa: PLC0415 - OpenCV, only now
    from phone_host.verbs.stereo_options import build_core  # noqa: PLC0415

    core, rig_side = build_core(options, settings.calibration, settings.matcher, size_px)
    board_side = Side(options.board_side) if options.board_side else rig_side or Side.LEFT
    if rig_side not in {None, board_side}:
        raise SettingsError(
            f"--board-side {board_side.value} contradicts {settings.calibration}",
            "leave it out, or calibrate with the board there",
        )
    if core is None:
        print("phone-host: no --calibration and not --rectified: pairs and delays only, no depth", file=sys.stderr)
    return core, board_side


def _host_settings(
    options: argparse.Namespace,
    resolved: Resolved[PhoneHostSettings],
    fifo: "FifoSettings",
    board_side: "Side",
    core: "StereoCore | None",
) -> "HostSettings":
    from phone_host.model import TimeOffset  # noqa: PLC0415
    from phone_host.run.host import HostSettings  # noqa: PLC0415 - OpenCV, only now
    from phone_host.sync.phase import Whose  # noqa: PLC0415

    settings = resolved.values
    return HostSettings(
        resolved=with_origins(resolved, vars(options)),
        board_side=board_side,
        tolerance_ns=round(settings.tolerance * 1e6) if settings.tolerance else None,
        fifo=fifo,
        pairs=options.pairs,
        wait_ns=None if options.wait is None else round(options.wait * 1e9),
        out=options.out,
        save_every=options.save_every,
        time_offset=TimeOffset() if core is None or core.rig is None else core.rig.time_offset,
        interpolate=settings.interpolate,
        most_pixels=settings.most_pixels,
        steered=frozenset(whose for whose in Whose if settings.align_phase in {"either", whose.value}),
    )


def _check_numbers(options: argparse.Namespace) -> None:
    for name, value in (("--pairs", options.pairs), ("--save-every", options.save_every)):
        if value < 0:
            raise SettingsError(f"{name} {value}", "give 0 or more")
    if options.wait is not None and not (math.isfinite(options.wait) and options.wait >= 0):
        raise SettingsError(f"--wait {options.wait}", "give seconds, 0 or more; leave it out to wait for ever")
