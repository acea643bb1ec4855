"""phone-host: the host's command. A verb's module is imported when that verb is parsed."""

import argparse
import importlib
import sys
from collections.abc import Callable, Sequence
from typing import Any, Final

from common.program.commandline import ExamplesFirstParser, add_manual_options, add_version_option, run_command
from common.program.interrupts import interruptible
from common.program.invocation import as_found
from common.program.request import add_options, read_request

_VERBS: Final = {
    "demo": "run both programs on this machine with a rendered scene or thing, and compare depth or model with the truth",
    "serve": "the page: find, check, calibrate and run both cameras in a browser",
    "run": "pair the board's frames with those of this machine's camera, compute depth, measure every delay",
    "record": "record what both cameras give, without computing anything, to replay it later",
    "sessions": "look into recordings, mend, cut and join them, and turn them into folders and back",
    "target": "make a calibration board or an object mat to print, as PDF and SVG to scale",
    "calibrate": "calibrate two cameras, live or from pictures of a board",
    "calibrate-time": "measure the time offset between the two cameras with a screen or a moving scene",
    "stereo": "compute disparity and point clouds of pairs of images",
    "scan": "put pairs from several places together to one model with colours",
    "export": "write a scan or mesh as STL, OBJ, 3DS, PLY, 3MF or GLB for other programs and printers",
    "relief": "make a printable relief of one pair of images",
    "printcheck": "tell whether a scan or mesh can be printed, and what to do if not",
    "print": "slice a model, or take G-code, and send it to a 3D printer",
    "measure": "measure points of a pair of images in millimetres, with their uncertainty",
    "quality": "measure how good a rig's depth is, on a flat wall or board",
    "pair": "make this host and a board known to each other, with the code that the board shows",
    "keys": "list the boards that this host trusts, or change the list or this host's key",
    "doctor": "check this machine, its camera, the board, the calibration and the disk",
    "settings": "print each setting, its value and where the value comes from",
}
"""What each verb does. A verb's module is imported when that verb is parsed."""

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
    """Run the verb."""
    if options.verb is None:
        print(as_found(_NEXT_STEPS), end="")
        return 0
    from phone_host.output.folder_lock import command_locks  # noqa: PLC0415 - the help needs none

    run, kind = command_of(options.verb)
    request: Any = read_request(kind, vars(options))
    with interruptible(native=options.verb in _NATIVE), command_locks():
        return run(request)


def command_of(verb: str) -> tuple[Callable[[Any], int], type]:
    """Import a verb's module; return what runs it, and what that takes."""
    if verb not in _WITHOUT_NUMPY:
        importlib.import_module("numpy")  # before OpenCV, which prints three lines on stdout where numpy is missing
    module = importlib.import_module(f"phone_host.verbs.{verb.replace('-', '_')}")
    return module.run, next(iter(module.run.__annotations__.values()))


class _VerbParser(ExamplesFirstParser):
    """The parser of one verb, which learns its options when it is first used."""

    _is_known = False

    def parse_known_args(  # type: ignore[override]  # of one type only
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """See ExamplesFirstParser. Versions are told without the verb, which may lack a package."""
        if "--version" in (args or ()):
            only = argparse.ArgumentParser(self.prog, add_help=False)
            add_version_option(only)
            only.parse_known_args(args)
        self.learn()
        return super().parse_known_args(args, namespace)

    def learn(self) -> None:
        """Import the verb's module, and declare what it takes."""
        if self._is_known:
            return
        self._is_known, verb = True, self.prog.split()[-1]
        run, kind = command_of(verb)
        self.description = f"examples:\n{run.__globals__['EXAMPLES']}"
        add_options(self, kind)
        add_version_option(self)
        self.add_argument("--json", action="store_true", help="print one JSON object on stdout")
        self.add_argument("--debug", action="store_true", help="show tracebacks")


def parser() -> argparse.ArgumentParser:
    """Return the parser with all verbs."""
    made = ExamplesFirstParser("phone-host", description=_EXAMPLES)
    add_version_option(made)
    add_manual_options(made)
    verbs = made.add_subparsers(dest="verb", metavar="VERB", parser_class=_VerbParser)
    for name, summary in _VERBS.items():
        verbs.add_parser(name, help=summary)
    return made


if __name__ == "__main__":
    sys.exit(main())
