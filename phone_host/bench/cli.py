"""delay-bench: its options, and its command, which is imported only when it runs: help must not need OpenCV."""

import argparse
import importlib
import sys
from collections.abc import Sequence
from pathlib import Path

from common.program.commandline import ExamplesFirstParser, add_manual_options, add_version_option, run_command
from common.program.interrupts import interruptible
from common.program.invocation import as_found
from common.program.quantities import reading, seconds
from phone_host.stereo.matcher_names import default_words

_NEXT_STEPS = """delay-bench measures every delay of each link between board and host. It runs both itself and needs no camera.

a first look, in half a minute:
  delay-bench --links tcp,ipc --size 320x240 --fps 30 --out bench

every kind of link that works here, two sizes, two rates, in three minutes:
  delay-bench --out bench

as over USB, Bluetooth or Wi-Fi, without having them:
  delay-bench --emulate list
  delay-bench --emulate usb-serial,bluetooth,wifi --size 320x240 --quality 50 --fps 10 --out interfaces

a board on another machine, once `phone-host pair` made it known:
  delay-bench --links tcp://192.168.7.2:5555 --seconds 30 --out board

all options:
  delay-bench --help
"""

_EXAMPLES = """examples:
  delay-bench --out bench
  delay-bench --links tcp,ipc,serial --size 320x240,640x480 --quality 50,80 --fps 15,30 --seconds 20 --out bench
  delay-bench --emulate usb-serial,bluetooth,wifi --size 320x240 --quality 50 --fps 10 --out interfaces
  delay-bench --links tcp://192.168.7.2:5555 --seconds 30 --json
  delay-bench --size 320x240,640x480 --predict size=1280x720,fps=30 --predict link=bluetooth,processing=4
  delay-bench --replay session.mcap --predict fps=60 --out predicted    # from a recorded run, without running anything
  delay-bench --emulate list

For each link, size, quality and rate, the command runs a board-agent process and the host, and prints the median, 95th and 99th
percentile and maximum of each delay. It leaves the first second of each run out. A board on another machine is measured as it is:
its size, quality and rate cannot be set from here. --out receives delay-bench.json, delay-bench.html (plots, and the queueing model
beside the measurement), delay-bench.svg and trace.json for Perfetto.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: without the program's name; None for those of the process.

    Returns:
        The exit code: 0 done, 2 wrong usage, 3 a link, a process or stdout is not available, 4 nothing was measured,
        130 interrupted.
    """
    given = sys.argv[1:] if arguments is None else arguments
    return run_command(parser(), given, _run if given else _next_steps)


def parser() -> argparse.ArgumentParser:
    """Make the parser with all options."""
    made = ExamplesFirstParser("delay-bench", description=_EXAMPLES)
    add_version_option(made)
    add_manual_options(made)
    made.add_argument(
        "--links",
        metavar="NAMES",
        help="tcp, ipc, serial (over a pseudo terminal), rfcomm, or addresses of boards (default: every kind that works here)",
    )
    made.add_argument("--emulate", metavar="NAMES", help="make links behave like these interfaces; `list` shows them")
    made.add_argument(
        "--size", default="320x240,640x480", metavar="SIZES", help="image sizes (default 320x240,640x480)"
    )
    made.add_argument("--quality", default="80", metavar="PERCENTS", help="JPEG qualities (default 80)")
    made.add_argument("--fps", default="15,30", metavar="RATES", help="frames per second (default 15,30)")
    made.add_argument(
        "--seconds",
        type=reading(seconds, "--seconds"),
        default=4.0,
        metavar="S",
        help="seconds of each run after its warm-up (default 4)",
    )
    made.add_argument(
        "--predict",
        action="append",
        default=[],
        metavar="CHANGES",
        help="predict the delays of a setting without running it, for example fps=60,size=640x480,kB=40,fifo=4:block,processing=0.5,link=wifi",
    )
    made.add_argument(
        "--replay",
        type=Path,
        metavar="FILE.mcap",
        help="run nothing: tell the delays of a run that was recorded (`phone-host run --record`), and predict from them",
    )
    made.add_argument("--matcher", metavar="NAME", help=f"stereo matcher ({default_words()})")
    made.add_argument(
        "--fifo",
        default="1:drop-oldest",
        metavar="DEPTH:POLICY",
        help="queue before the matcher: drop-oldest, drop-newest or block (default 1:drop-oldest)",
    )
    made.add_argument(
        "--out", type=Path, metavar="DIR", help="folder for delay-bench.json, delay-bench.html and trace.json"
    )
    made.add_argument("--json", action="store_true", help="print one JSON object on stdout")
    made.add_argument("--debug", action="store_true", help="show tracebacks")
    return made


def _next_steps(_: argparse.Namespace) -> int:
    """Say what can be done: a bare name must not start minutes of work."""
    print(as_found(_NEXT_STEPS), end="")
    return 0


def _run(options: argparse.Namespace) -> int:
    """Import what the options ask for, and run it. The only place that imports by name."""
    if options.emulate == "list":
        module = "profile_list"
    else:
        module = "command"
        importlib.import_module("numpy")  # before OpenCV, as in phone_host/cli.py
    command = importlib.import_module(f"phone_host.bench.{module}")
    from phone_host.output.folder_lock import command_locks  # noqa: PLC0415 - the help needs none

    with interruptible(), command_locks():
        code: int = command.run(options)
    return code


if __name__ == "__main__":
    sys.exit(main())
