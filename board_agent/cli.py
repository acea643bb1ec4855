"""board-agent: the board's command. It knows all options; a verb's implementation is imported when it runs."""

import argparse
import gc
import importlib
import sys
from collections.abc import Sequence
from pathlib import Path

from board_agent import examples
from common.camera.options import EXAMPLE
from common.program.commandline import ExamplesFirstParser, add_manual_options, add_version_option, run_command
from common.program.interrupts import interruptible
from common.program.invocation import as_found
from common.program.quantities import file_size, frames_per_second, reading, seconds


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
        print(as_found(examples.NEXT_STEPS), end="")
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
    made = ExamplesFirstParser("board-agent", description=examples.GENERAL)
    add_version_option(made)
    add_manual_options(made)
    verbs = made.add_subparsers(dest="verb", metavar="VERB")
    run = verbs.add_parser("run", help="stream the camera's frames to a host until stopped", description=examples.RUN)
    record = verbs.add_parser(
        "record", help="keep the camera's frames on this board's disk, without a host", description=examples.RECORD
    )
    show = verbs.add_parser(
        "settings", help="print each setting, its value and where the value comes from", description=examples.SETTINGS
    )
    cameras = verbs.add_parser(
        "cameras", help="list the cameras with their formats, rates and controls", description=examples.CAMERAS
    )
    doctor = verbs.add_parser(
        "doctor", help="check camera, links, clocks, disk and power, and say what to mend", description=examples.DOCTOR
    )
    keys = verbs.add_parser(
        "keys",
        help="list the hosts that this board lets in, or change the list or the board's key",
        description=examples.KEYS,
    )
    pair = verbs.add_parser("pair", help="show a code that lets a new host in", description=examples.PAIR)
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
