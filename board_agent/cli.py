"""board-agent: the board's command. It knows all options; a verb's implementation is imported when it runs."""

import argparse
import gc
import importlib
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from common.camera.options import EXAMPLE
from common.program.commandline import ExamplesFirstParser, add_manual_options, add_version_option, run_command
from common.program.interrupts import interruptible
from common.program.invocation import as_found
from common.program.quantities import file_size, frames_per_second, reading, seconds

NEXT_STEPS: Final = """board-agent streams this machine's camera to a phone or laptop, each frame with the moment of its exposure.

see which cameras are here, and what keeps them from streaming:
  board-agent cameras
  board-agent doctor

try it without a camera, with a folder of pictures; a host on this machine can then connect to tcp://127.0.0.1:5555:
  board-agent run --camera 'replay:frames?fps=30&loop=1'

stream a webcam to other machines:
  board-agent run --camera v4l2:auto --link 'tcp://*:5555'

let a new host in, while it runs (type the code on the host):
  sudo board-agent pair

every verb and its options:
  board-agent --help
  board-agent run --help
"""

GENERAL: Final = """examples:
  board-agent run --camera 'v4l2:/dev/video0?size=640x480&fps=30' --link 'tcp://*:5555'
  board-agent run --config /etc/tandemscan/board-agent.toml
  board-agent record --camera v4l2:auto --out walk.mcap
  board-agent cameras
  board-agent doctor
  sudo board-agent pair
  sudo board-agent keys --forget phone
"""

RUN: Final = """examples:
  board-agent run --camera 'v4l2:/dev/video0?size=640x480&fps=30' --link 'tcp://*:5555'
  board-agent run --camera 'replay:frames?fps=30&loop=1'
  board-agent run --camera 'replay:frames?pace=demand' --link ipc://$XDG_RUNTIME_DIR/board
  board-agent run --camera 'v4l2:auto?fps=30' --link 'rfcomm://*' --adapt quality,rate --least-fps 5
  board-agent run --config /etc/tandemscan/board-agent.toml
"""

RECORD: Final = """examples:
  board-agent record --camera v4l2:auto --out walk.mcap    # until Ctrl-C, or until nine tenths of the disk are full
  board-agent record --camera v4l2:auto --out drive.mcap --ring 2GB    # the newest 2 GB: drive-000001.mcap and so on
  board-agent record --camera 'replay:frames?fps=30' --seconds 60 --out minute.mcap
  board-agent record --config /etc/tandemscan/board-agent.toml --out walk.mcap --most 500MB
"""

SETTINGS: Final = """examples:
  board-agent settings
  board-agent settings --config /etc/tandemscan/board-agent.toml
  BOARD_AGENT_CAMERA=v4l2:auto board-agent settings --json
"""

CAMERAS: Final = """examples:
  board-agent cameras
  board-agent cameras --json
"""

DOCTOR: Final = """examples:
  board-agent doctor    # what the service would use, where it is installed
  board-agent doctor --camera v4l2:auto --link 'tcp://*:5555'
  board-agent doctor --config /etc/tandemscan/board-agent.toml --json
"""

KEYS: Final = """examples:
  sudo board-agent keys    # the service's keys, where it is installed
  board-agent keys    # your own
  sudo board-agent keys --forget phone
  sudo board-agent keys --new    # then pair with every host again
  sudo board-agent keys --add phone 'PUBLIC-KEY'    # as `phone-host keys` shows it
"""

PAIR: Final = """examples:
  sudo board-agent pair    # for the service
  board-agent pair --seconds 60    # for an agent that you started yourself
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: without the program's name; None: those of the process.

    Returns:
        The exit code: 0 done, 2 wrong usage, 3 a device, link or stdout cannot be had, 4 bad data or a failed check, 129, 130, 131 and 143 ended by a signal.
    """
    return run_command(parser(), arguments, _run)


def _run(options: argparse.Namespace) -> int:
    """Import the verb and run it. Only here are modules imported by a verb's name."""
    if options.verb is None:
        print(as_found(NEXT_STEPS), end="")
        return 0
    gc.disable()  # imported objects stay: looking for garbage among them only costs a board time
    try:
        verb = importlib.import_module(f"board_agent.verbs.{options.verb}")
    finally:
        gc.freeze()
        gc.enable()
    with interruptible():
        code: int = verb.run(options)
    return code


def parser() -> argparse.ArgumentParser:
    """All verbs with their options."""
    made = ExamplesFirstParser("board-agent", description=GENERAL)
    add_version_option(made)
    add_manual_options(made)
    verbs = made.add_subparsers(dest="verb", metavar="VERB")
    run = verbs.add_parser("run", help="stream the camera's frames to a host until stopped", description=RUN)
    record = verbs.add_parser(
        "record", help="keep the camera's frames on this board's disk, without a host", description=RECORD
    )
    show = verbs.add_parser(
        "settings", help="print each setting, its value and where the value comes from", description=SETTINGS
    )
    cameras = verbs.add_parser(
        "cameras", help="list the cameras with their formats, rates and controls", description=CAMERAS
    )
    doctor = verbs.add_parser(
        "doctor", help="check camera, links, clocks, disk and power, and say what to mend", description=DOCTOR
    )
    keys = verbs.add_parser(
        "keys",
        help="list the hosts that this board lets in, or change the list or the board's key",
        description=KEYS,
    )
    pair = verbs.add_parser("pair", help="show a code that lets a new host in", description=PAIR)
    _add_keys_options(keys, pair)
    _add_record_options(record)
    for verb in (run, record, show, cameras, doctor, keys, pair):
        add_version_option(verb)
        verb.add_argument("--json", action="store_true", help="print one JSON object on stdout")
        verb.add_argument("--debug", action="store_true", help="show tracebacks")
    for verb in (run, record, show, doctor, keys, pair):
        verb.add_argument("--config", type=Path, metavar="FILE", help="settings file (TOML)")
    for verb in (run, show, doctor, keys, pair):
        verb.add_argument(
            "--keys", metavar="DIR", help="folder of keys (default /var/lib/tandemscan or ~/.config/tandemscan)"
        )
    for verb in (run, record, show, doctor):
        verb.add_argument("--camera", metavar="URI", help=EXAMPLE.replace("%", "%%"))
        verb.add_argument(
            "--log-level",
            choices=("debug", "info", "warning", "error"),
            help="least important messages that are logged to stderr",
        )
    for verb in (run, show, doctor):
        verb.add_argument(
            "--link",
            action="append",
            metavar="URI",
            help="where to listen: tcp://HOST:PORT, ipc://PATH[?owner=USER], serial:DEVICE or rfcomm://*; repeat the option for several",
        )
        verb.add_argument(
            "--adapt",
            metavar="WAYS",
            help="what may be lowered when the link is too slow: quality, rate, size (default quality,rate; '' for nothing)",
        )
        verb.add_argument(
            "--least-fps",
            type=reading(frames_per_second, "--least-fps"),
            metavar="FPS",
            help="never lower the frame rate below FPS (default: never lower the rate)",
        )
    return made


def _add_record_options(record: argparse.ArgumentParser) -> None:
    record.add_argument("--out", type=Path, required=True, metavar="FILE.mcap", help="the recording; it must not exist")
    bound = record.add_mutually_exclusive_group()
    bound.add_argument(
        "--most",
        type=reading(file_size, "--most"),
        metavar="SIZE",
        help="end at this size, for example 2GB (default: nine tenths of what is free on its disk)",
    )
    bound.add_argument(
        "--ring",
        type=reading(file_size, "--ring"),
        metavar="SIZE",
        help="keep the newest SIZE: parts FILE-000001.mcap and so on, the oldest of which give way",
    )
    record.add_argument(
        "--seconds",
        type=reading(seconds, "--seconds"),
        default=0.0,
        metavar="S",
        help="end after S seconds (default: when it is stopped)",
    )
    record.set_defaults(keys=None, link=None, adapt=None, least_fps=None)


def _add_keys_options(keys: argparse.ArgumentParser, pair: argparse.ArgumentParser) -> None:
    what = keys.add_mutually_exclusive_group()
    what.add_argument("--forget", metavar="NAME", help="stop letting this host in")
    what.add_argument(
        "--new", action="store_true", help="replace this board's key; every host must then be paired again"
    )
    what.add_argument("--add", nargs=2, metavar=("NAME", "KEY"), help="let in a host without pairing")
    pair.add_argument(
        "--seconds",
        type=reading(seconds, "--seconds"),
        default=300.0,
        metavar="S",
        help="seconds to wait for a host (default 300)",
    )
    for verb in (keys, pair):
        verb.set_defaults(camera=None, link=None, log_level=None, adapt=None, least_fps=None)


if __name__ == "__main__":
    sys.exit(main())
