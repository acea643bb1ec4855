"""board-agent: the board's command. It knows all options; what a verb does is imported when it runs."""

import argparse
import gc
import importlib
import sys
from collections.abc import Sequence
from pathlib import Path

from common.camera.options import EXAMPLE
from common.program.commandline import ExamplesFirstParser, add_version_option, run_command

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


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: without the program's name; None for those of the process.

    Returns:
        The exit code: 0 done, 2 wrong usage, 3 a device, a link or stdout not to be had, 4 bad data or a failed check, 130 interrupted.
    """
    return run_command(_parser(), arguments, _run)


def _run(options: argparse.Namespace) -> int:
    """Import the verb, and run it. The only place that imports by a verb's name."""
    gc.disable()  # what is imported stays: to look for garbage in it, now and later, only costs a board time
    try:
        verb = importlib.import_module(f"board_agent.verbs.{options.verb}")
    finally:
        gc.freeze()
        gc.enable()
    code: int = verb.run(options)
    return code


def _parser() -> argparse.ArgumentParser:
    parser = ExamplesFirstParser("board-agent", description=_EXAMPLES)
    add_version_option(parser)
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


if __name__ == "__main__":
    sys.exit(main())
