"""phone-host: the host's command. Each verb is a module of its own and is imported only when it is asked for."""

import argparse
import importlib
import sys
from collections.abc import Sequence
from types import ModuleType

from common.program.commandline import ExamplesFirstParser, run_command

_VERBS = {
    "demo": "both programs on this machine, a rendered scene with known truth, a full report",
    "run": "pair a board's frames with the own camera's, compute depth, measure every delay",
    "calibrate": "calibrate two cameras from pictures of a chessboard",
    "calibrate-time": "measure what lies between the two cameras' stamps, with a screen, a lamp or a moving scene",
    "stereo": "disparity and point cloud of one pair of images",
    "pair": "get to know a board by the code that it shows",
    "keys": "show or change this host's key and the boards that it knows",
    "doctor": "check Python, camera, link, rig and disk",
    "settings": "print each setting with its origin",
}

_EXAMPLES = """examples:
  phone-host demo
  phone-host calibrate 'left*.png' 'right*.png' --board 9x6 --square 25mm --out rig.yaml
  phone-host stereo left.png right.png --calibration rig.yaml --out scan
  phone-host run --link tcp://192.168.7.2:5555 --camera 'replay:frames?loop=1' --calibration rig.yaml --out scan
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: without the program's name; None for those of the process.

    Returns:
        The exit code: 0 done, 2 wrong usage, 3 a device, a link or stdout not to be had, 4 bad data, 130 interrupted.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    parser = _parser(next((word for word in given if not word.startswith("-")), ""))
    return run_command(parser, given, _run)


def _run(options: argparse.Namespace) -> int:
    code: int = _module(options.verb).run(options)
    return code


def _parser(asked: str) -> argparse.ArgumentParser:
    """Make the parser; only the verb that is asked for brings its options, so that no other one is imported."""
    parser = ExamplesFirstParser("phone-host", description=_EXAMPLES)
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    for name, explanation in _VERBS.items():
        if name != asked:
            verbs.add_parser(name, help=explanation)
            continue
        module = _module(name)
        verb = verbs.add_parser(name, help=explanation, description=f"examples:\n{module.EXAMPLES}")
        module.add_arguments(verb)
        verb.add_argument("--json", action="store_true", help="print one JSON object on stdout")
        verb.add_argument("--debug", action="store_true", help="show tracebacks")
    return parser


def _module(verb: str) -> ModuleType:
    return importlib.import_module(f"phone_host.verbs.{verb.replace('-', '_')}")


if __name__ == "__main__":
    sys.exit(main())
