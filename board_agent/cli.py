"""board-agent: the board's command."""

import argparse
import json
import logging
import sys
from collections.abc import Sequence
from pathlib import Path

from board_agent.settings import ENVIRONMENT_PREFIX, BoardSettings
from common import logs, now
from common.camera.factory import EXAMPLE, open_camera
from common.errors import SettingsError, TandemError
from common.link.base import Link
from common.link.factory import open_link, parse_link
from common.settings import Resolved, resolve
from common.signals import StopSignals
from common.stamp import board_clock

_EXAMPLES = """examples:
  board-agent run --camera 'replay:frames?fps=30&loop=1'
  board-agent run --camera 'replay:frames?pace=demand' --link ipc:///tmp/board
  board-agent run --config /etc/tandemscan/board-agent.toml
  board-agent settings --json
"""

INTERRUPTED = 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: without the program's name; None for those of the process.

    Returns:
        The exit code: 0 done, 2 wrong usage, 3 device or link not to be had, 4 bad data, 130 interrupted.
    """
    options = _parser().parse_args(arguments)
    try:
        return _run(options) if options.verb == "run" else _settings(options)
    except TandemError as error:
        if options.debug:
            raise
        print(f"board-agent: error: {error}", file=sys.stderr)
        return error.exit_code


def _parser() -> argparse.ArgumentParser:
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser("board-agent", description=_EXAMPLES, formatter_class=raw)
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    run = verbs.add_parser("run", help="serve frames until stopped", description=_EXAMPLES, formatter_class=raw)
    show = verbs.add_parser(
        "settings", help="print each setting with its origin", description=_EXAMPLES, formatter_class=raw
    )
    for verb in (run, show):
        verb.add_argument("--config", type=Path, metavar="FILE", help="settings file (TOML)")
        verb.add_argument("--camera", metavar="URI", help=EXAMPLE.replace("%", "%%"))
        verb.add_argument(
            "--link", action="append", metavar="URI", help="tcp://HOST:PORT or ipc://PATH; may be given again"
        )
        verb.add_argument(
            "--log-level", choices=("debug", "info", "warning", "error"), help="how much to log to stderr"
        )
        verb.add_argument("--json", action="store_true", help="print one JSON object on stdout")
        verb.add_argument("--debug", action="store_true", help="show tracebacks")
    return parser


def _resolve(options: argparse.Namespace) -> Resolved[BoardSettings]:
    link = tuple(options.link) if options.link else None
    given = {"camera": options.camera, "link": link, "log_level": options.log_level}
    return resolve(BoardSettings, ENVIRONMENT_PREFIX, options.config, given)


def _settings(options: argparse.Namespace) -> int:
    resolved = _resolve(options)
    rows = [(name, getattr(resolved.values, name), origin) for name, origin in resolved.origins]
    if options.json:
        print(json.dumps({name: {"value": value, "origin": origin} for name, value, origin in rows}))
    else:
        for name, value, origin in rows:
            print(f"{name:12} {' '.join(value) if isinstance(value, tuple) else value!s:40} {origin}")
    return 0


def _run(options: argparse.Namespace) -> int:
    from board_agent.agent import Agent  # noqa: PLC0415 - --help and settings need no ZeroMQ

    settings = _resolve(options).values
    if settings.log_level.upper() not in logging.getLevelNamesMapping():
        raise SettingsError(f"log_level is {settings.log_level!r}", "give debug, info, warning or error")
    logs.set_up(logging.getLevelNamesMapping()[settings.log_level.upper()])
    if not settings.camera:
        raise SettingsError("no camera is given", f"use --camera {EXAMPLE}")
    boot_id, session = now.boot_id(), now.random_id()
    camera = open_camera(settings.camera, board_clock(boot_id), now.monotonic_ns())
    uris = [parse_link(uri, listens_by_default=True) for uri in settings.link]
    links: list[Link] = []
    signals = StopSignals()
    try:
        links.extend(open_link(uri) for uri in uris)
        log = logging.getLogger("board_agent")
        log.info(logs.event("serving", session=session, camera=settings.camera, links=",".join(settings.link)))
        summary = Agent(camera, links, session, boot_id, signals.reader).run()
    finally:
        for link in links:
            link.close()
        camera.close()
    counts = {"grabbed": summary.counts.grabbed, "sent": summary.counts.sent}
    dropped = {reason.value: count for reason, count in summary.counts.dropped}
    log.info(logs.event("stopped", session=session, **counts, dropped=dropped, garbage=summary.garbage))
    if options.json:
        print(
            json.dumps(
                {"session": session, **counts, "dropped": dropped, "garbage": summary.garbage, "ended": summary.ended}
            )
        )
    else:
        drops = "".join(f", {count} {reason}" for reason, count in dropped.items()) or ", none dropped"
        print(f"session {session}: {counts['grabbed']} frames grabbed, {counts['sent']} sent{drops}", file=sys.stderr)
    return INTERRUPTED if signals.interrupted else 0


if __name__ == "__main__":
    sys.exit(main())
