"""phone-host: the host's command.

Every start imports the options of all verbs, which are light. A verb's code is imported only when the verb runs.
"""

import argparse
import importlib
import sys
from collections.abc import Sequence
from typing import Final, Protocol

from common.program.commandline import ExamplesFirstParser, add_version_option, run_command
from common.program.interrupts import interruptible
from common.program.invocation import as_found
from phone_host.verbs.calibrate import arguments as calibrate
from phone_host.verbs.calibrate_time import arguments as calibrate_time
from phone_host.verbs.demo import arguments as demo
from phone_host.verbs.doctor import arguments as doctor
from phone_host.verbs.export import arguments as export
from phone_host.verbs.keys import arguments as keys
from phone_host.verbs.measure import arguments as measure
from phone_host.verbs.pair import arguments as pair
from phone_host.verbs.print import arguments as print_
from phone_host.verbs.printcheck import arguments as printcheck
from phone_host.verbs.quality import arguments as quality
from phone_host.verbs.record import arguments as record
from phone_host.verbs.relief import arguments as relief
from phone_host.verbs.run import arguments as run
from phone_host.verbs.scan import arguments as scan
from phone_host.verbs.serve import arguments as serve
from phone_host.verbs.sessions import arguments as sessions
from phone_host.verbs.settings import arguments as settings
from phone_host.verbs.stereo import arguments as stereo
from phone_host.verbs.target import arguments as target


class Arguments(Protocol):
    """The light half of a verb: what the help and the parser need."""

    SUMMARY: str
    EXAMPLES: str

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Declare the verb's options."""


_VERBS: Final[dict[str, Arguments]] = {
    "demo": demo,
    "serve": serve,
    "run": run,
    "record": record,
    "sessions": sessions,
    "target": target,
    "calibrate": calibrate,
    "calibrate-time": calibrate_time,
    "stereo": stereo,
    "scan": scan,
    "export": export,
    "relief": relief,
    "printcheck": printcheck,
    "print": print_,
    "measure": measure,
    "quality": quality,
    "pair": pair,
    "keys": keys,
    "doctor": doctor,
    "settings": settings,
}

_NATIVE: Final = frozenset({"calibrate", "measure", "quality", "relief", "scan", "stereo"})
"""Verbs that spend seconds in native code on large images."""

_WITHOUT_NUMPY: Final = frozenset({"doctor", "keys", "pair", "settings"})
"""Verbs that run where numpy is missing; the doctor names it."""

_NEXT_STEPS = """phone-host makes depth out of two cameras: this machine's and a board's, or of two folders of photographs.

try it without hardware, in a minute or two:
  phone-host demo

your own photographs, taken by two cameras side by side (first of a chessboard that you print, then of the scene):
  phone-host target chessboard
  phone-host calibrate left/ right/ --square 25mm --out rig.yaml
  phone-host stereo left/ right/ --calibration rig.yaml --out scans
  phone-host scan left/ right/ --calibration rig.yaml --out model    # pictures from all around: one model

two photographs whose rows already match, without a calibration:
  phone-host stereo left.png right.png --rectified --disparities 64 --out scan

two cameras, live; the other one hangs on a board or a second computer that runs board-agent:
  phone-host serve --open    # leads through all of it in the browser
  phone-host doctor
  phone-host pair
  phone-host run --camera v4l2:auto --calibration rig.yaml --out scan

every verb and its options:
  phone-host --help
  phone-host stereo --help
"""

_EXAMPLES = """examples:
  phone-host demo
  phone-host calibrate 'left*.png' 'right*.png' --board 9x6 --square 25mm --out rig.yaml
  phone-host stereo left.png right.png --calibration rig.yaml --out scan
  phone-host run --link tcp://192.168.7.2:5555 --camera 'replay:frames?loop=1' --calibration rig.yaml --out scan
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: without the program's name. None: the arguments of the process.

    Returns:
        The exit code: 0 done, 2 wrong usage, 3 a device, a link or stdout is unavailable, 4 bad data, 129, 130, 131 and 143 ended by a signal.
    """
    return run_command(parser(), arguments, _run)


def _run(options: argparse.Namespace) -> int:
    """Import the command half of the verb, and run it. The only place that imports by a verb's name."""
    if options.verb is None:
        print(as_found(_NEXT_STEPS), end="")
        return 0
    if options.verb not in _WITHOUT_NUMPY:
        importlib.import_module("numpy")  # before OpenCV, which prints three lines on stdout where numpy is missing
    command = importlib.import_module(f"phone_host.verbs.{options.verb.replace('-', '_')}.command")
    from phone_host.output.folder_lock import command_locks  # noqa: PLC0415 - the help needs none

    with interruptible(native=options.verb in _NATIVE), command_locks():
        code: int = command.run(options)
    return code


def parser() -> argparse.ArgumentParser:
    """Return the parser with all verbs and their options."""
    made = ExamplesFirstParser("phone-host", description=_EXAMPLES)
    add_version_option(made)
    verbs = made.add_subparsers(dest="verb", metavar="VERB")
    for name, arguments in _VERBS.items():
        verb = verbs.add_parser(name, help=arguments.SUMMARY, description=f"examples:\n{arguments.EXAMPLES}")
        arguments.add_arguments(verb)
        add_version_option(verb)
        verb.add_argument("--json", action="store_true", help="print one JSON object on stdout")
        verb.add_argument("--debug", action="store_true", help="show tracebacks")
    return made


if __name__ == "__main__":
    sys.exit(main())
