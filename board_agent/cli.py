"""board-agent: the board's command."""

import argparse
import json
import logging
import os
import sys
from collections.abc import Sequence
from contextlib import ExitStack, closing
from pathlib import Path
from typing import TYPE_CHECKING, Final

from board_agent.rate_control import RateControl, ladder, ways
from board_agent.sd_notify import Notifier
from board_agent.settings import ENVIRONMENT_PREFIX, SERVICE_SETTINGS, BoardSettings, key_folder
from board_agent.status import StatusLine
from common import now
from common.camera.base import CameraHealth, health_values
from common.camera.factory import EXAMPLE, open_camera, parse_camera
from common.errors import SettingsError
from common.keys import KeyFolder, change
from common.keys import listing as keys_listing
from common.link.factory import open_links, parse_link, tell_insecure
from common.program import logs
from common.program.commandline import INTERRUPTED, ExamplesFirstParser, run_command
from common.program.settings import Resolved, listing, log_level, resolve
from common.program.signals import StopSignals
from common.protocol.message import BoardCounts
from common.stamp import board_clock

if TYPE_CHECKING:
    from board_agent.agent import Summary

_LOG: Final = logging.getLogger("board_agent")

_EXAMPLES = """examples:
  board-agent run --camera 'v4l2:/dev/video0?size=640x480&fps=30' --link 'tcp://*:5555'
  board-agent run --camera 'replay:frames?fps=30&loop=1'
  board-agent run --camera 'replay:frames?pace=demand' --link ipc://$XDG_RUNTIME_DIR/board
  board-agent run --camera 'v4l2:auto?fps=30' --link 'rfcomm://*' --adapt quality,rate --least-fps 5
  board-agent run --config /etc/tandemscan/board-agent.toml
  board-agent cameras
  sudo board-agent pair
  sudo board-agent keys --forget phone
  board-agent doctor
  board-agent settings --json
"""

_LONGEST_IDLE_S: Final = 1e9
_HIGHEST_FPS: Final = 1000
"""Of any camera URI."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: without the program's name; None for those of the process.

    Returns:
        The exit code: 0 done, 2 wrong usage, 3 a device, a link or stdout not to be had, 4 bad data or a failed check, 130 interrupted.
    """
    verbs = {"run": _run, "settings": _settings, "cameras": _cameras, "doctor": _doctor, "keys": _keys, "pair": _pair}
    return run_command(_parser(), arguments, lambda options: verbs[options.verb](options))


def _parser() -> argparse.ArgumentParser:
    parser = ExamplesFirstParser("board-agent", description=_EXAMPLES)
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    run = verbs.add_parser("run", help="serve frames until stopped", description=_EXAMPLES)
    show = verbs.add_parser("settings", help="print each setting with its origin", description=_EXAMPLES)
    cameras = verbs.add_parser("cameras", help="list formats, rates and controls", description=_EXAMPLES)
    doctor = verbs.add_parser("doctor", help="check camera, links, clocks, disk and power", description=_EXAMPLES)
    keys = verbs.add_parser("keys", help="show or change this board's key and its hosts", description=_EXAMPLES)
    pair = verbs.add_parser("pair", help="show a code with which a new host may connect", description=_EXAMPLES)
    _add_keys_options(keys, pair)
    for verb in (run, show, cameras, doctor, keys, pair):
        verb.add_argument("--json", action="store_true", help="print one JSON object on stdout")
        verb.add_argument("--debug", action="store_true", help="show tracebacks")
    for verb in (run, show, doctor, keys, pair):
        verb.add_argument("--config", type=Path, metavar="FILE", help="settings file (TOML)")
        verb.add_argument(
            "--keys", metavar="DIR", help="folder of keys (default /var/lib/tandemscan or ~/.config/tandemscan)"
        )
    for verb in (run, show, doctor):
        verb.add_argument("--camera", metavar="URI", help=EXAMPLE.replace("%", "%%"))
        verb.add_argument(
            "--link",
            action="append",
            metavar="URI",
            help="tcp://HOST:PORT, ipc://PATH[?owner=USER], serial:DEVICE or rfcomm://*; may be given again",
        )
        verb.add_argument(
            "--adapt",
            metavar="WAYS",
            help="what gives way where the link is slow: quality, rate, size (default quality,rate; '' for nothing)",
        )
        verb.add_argument(
            "--least-fps",
            type=float,
            metavar="FPS",
            help="lower the camera's rate to this at most (default: not at all)",
        )
        verb.add_argument(
            "--log-level", choices=("debug", "info", "warning", "error"), help="how much to log to stderr"
        )
    return parser


def _add_keys_options(keys: argparse.ArgumentParser, pair: argparse.ArgumentParser) -> None:
    what = keys.add_mutually_exclusive_group()
    what.add_argument("--forget", metavar="NAME", help="let this host in no longer")
    what.add_argument("--new", action="store_true", help="make a new key; every host must be paired again")
    what.add_argument("--add", nargs=2, metavar=("NAME", "KEY"), help="let in a host without pairing")
    pair.add_argument("--seconds", type=float, default=300.0, metavar="S", help="wait so long for a host (default 300)")
    for verb in (keys, pair):
        verb.set_defaults(camera=None, link=None, log_level=None, adapt=None, least_fps=None)


def _keys(options: argparse.Namespace) -> int:
    folder = _key_folder(options)
    change(folder, forget=options.forget, new=options.new, add=options.add, address="", when=now.wall_time())
    print(keys_listing(folder, as_json=options.json))
    if options.new:
        print("board-agent: a running service keeps its old key until it is restarted", file=sys.stderr)
    return 0


def _pair(options: argparse.Namespace) -> int:
    from board_agent.enrolment import NOBODY, absence, follow  # noqa: PLC0415 - needed by this verb alone

    if not 0 < options.seconds < _LONGEST_IDLE_S:
        raise SettingsError(f"--seconds {options.seconds:g}", "give seconds, more than 0")
    name, keys = "", _key_folder(options)
    for state in follow(keys, options.seconds):
        if state == NOBODY:
            print(f"board-agent: waiting: {absence(keys)}", file=sys.stderr)
        if state.problem:
            print(f"board-agent: waiting: {state.problem}: stop what uses that port, or move the link", file=sys.stderr)
        name = state.paired
        if state.code and not name:
            asks = f"{state.asking} asks; " if state.asking else ""
            words = f"{state.address}: {asks}type this code on the host: {state.code}"
            print(words, file=sys.stderr if options.json else None, flush=True)
    print(json.dumps({"paired": name}) if options.json else f"paired with {name}")
    return 0


def _key_folder(options: argparse.Namespace) -> KeyFolder:
    """The folder of whoever is meant; without any choice that of the service, where it is installed."""
    if not (options.config or options.keys) and SERVICE_SETTINGS.is_file():
        options.config = SERVICE_SETTINGS
    return key_folder(_resolve(options).values.keys)


def _resolve(options: argparse.Namespace) -> Resolved[BoardSettings]:
    link = tuple(options.link) if options.link else None
    adapt = None if options.adapt is None else tuple(way for way in options.adapt.split(",") if way)
    given = {"camera": options.camera, "link": link, "keys": options.keys, "log_level": options.log_level}
    given |= {"adapt": adapt, "least_fps": options.least_fps}
    return resolve(BoardSettings, ENVIRONMENT_PREFIX, options.config, given)


def _settings(options: argparse.Namespace) -> int:
    resolved = _resolve(options)
    _check(resolved.values)
    print(listing(resolved, as_json=options.json))
    return 0


def _check(settings: BoardSettings) -> None:
    """Refuse values that `run` could not use, as far as that can be said without opening anything.

    Raises:
        SettingsError: one makes no sense.
    """
    log_level(settings.log_level)
    if settings.camera:
        parse_camera(settings.camera, "")
    for uri in settings.link:
        parse_link(uri, listens_by_default=True)
    ways(settings.adapt)
    if not 0 <= settings.least_fps <= _HIGHEST_FPS:
        raise SettingsError(
            f"least_fps is {settings.least_fps:g}", f"give frames per second up to {_HIGHEST_FPS}, 0 to keep the rate"
        )
    if not 0 <= settings.idle_after < _LONGEST_IDLE_S:
        raise SettingsError(f"idle_after is {settings.idle_after}", "give seconds, 0 for never")


def _cameras(options: argparse.Namespace) -> int:
    from board_agent.cameras import list_cameras, table, values  # noqa: PLC0415 - needed by this verb alone

    found = list_cameras()
    print(json.dumps(values(found)) if options.json else table(found))
    return 0


def _doctor(options: argparse.Namespace) -> int:
    """Check what `run` would use; without any choice that is what the service uses, where it is installed."""
    from board_agent.doctor.board_doctor import examine  # noqa: PLC0415 - needed by this verb alone
    from common.doctor.finding import exit_code, table, values  # noqa: PLC0415

    if not (options.config or options.camera or options.link) and SERVICE_SETTINGS.is_file():
        options.config = SERVICE_SETTINGS
    settings = _resolve(options).values
    _check(settings)
    logs.set_up(logging.ERROR)  # the findings say it all
    findings = examine(settings, options.config)
    print(json.dumps(values(findings)) if options.json else table(findings))
    return exit_code(findings)


def _run(options: argparse.Namespace) -> int:
    settings = _resolve(options).values
    _check(settings)
    logs.set_up(log_level(settings.log_level))
    if not settings.camera:
        raise SettingsError("no camera is given", f"use --camera {EXAMPLE}")
    signals = StopSignals()
    summary = _serve(settings, signals)
    session, counts = summary.session, {"grabbed": summary.counts.grabbed, "sent": summary.counts.sent}
    dropped = {reason.value: count for reason, count in summary.counts.dropped}
    camera = health_values(summary.camera)
    _LOG.info(logs.event("stopped", session=session, **counts, dropped=dropped, garbage=summary.garbage, camera=camera))
    if options.json:
        account = {"session": session, **counts, "dropped": dropped, "garbage": summary.garbage}
        print(json.dumps({**account, "ended": summary.ended, "camera": camera}))
    else:
        drops = "".join(f", {count} {reason}" for reason, count in dropped.items()) or ", none dropped"
        print(f"session {session}: {counts['grabbed']} frames grabbed, {counts['sent']} sent{drops}", file=sys.stderr)
    return INTERRUPTED if signals.interrupted else 0


def _serve(settings: BoardSettings, signals: StopSignals) -> "Summary":
    """Open everything in the order in which it may fail at once, serve, and close it again."""
    from board_agent.agent import Agent, Service, Summary, wait_for_camera  # noqa: PLC0415 - --help and settings need no ZeroMQ

    boot_id, session = now.boot_id(), now.random_id()
    clock, uris = board_clock(boot_id), [parse_link(uri, listens_by_default=True) for uri in settings.link]
    with ExitStack() as opened:
        notifier = opened.enter_context(closing(Notifier(os.environ)))
        if settings.wait_for_camera:
            camera = wait_for_camera(settings.camera, clock, signals.reader, notifier)
        else:
            camera = open_camera(settings.camera, clock, now.monotonic_ns())
        if camera is None:
            return Summary(session=session, counts=BoardCounts(), garbage=0, ended=False, camera=CameraHealth())
        opened.enter_context(closing(camera))
        for uri in uris:
            tell_insecure(uri)
        keys = key_folder(settings.keys)
        links = [opened.enter_context(closing(link)) for link in open_links(uris, keys, board=True)]
        _LOG.info(logs.event("serving", session=session, camera=settings.camera, links=",".join(settings.link)))
        idle_ns = round(settings.idle_after * 1e9) or None
        status = StatusLine(settings.camera, camera.description.pacing, settings.link, now.monotonic_ns())
        modes = ladder(camera.offers, ways(settings.adapt), settings.least_fps)
        control = RateControl(modes) if len(modes) > 1 else None
        service = Service(notifier, status)
        summary = Agent(
            camera, links, session, boot_id, signals.reader, service=service, idle_ns=idle_ns, control=control
        ).run()
        notifier.stopping("stopped")
        return summary


if __name__ == "__main__":
    sys.exit(main())
