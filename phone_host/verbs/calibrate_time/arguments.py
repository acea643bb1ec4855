"""The options of phone-host calibrate-time. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

from common.program.quantities import reading, seconds
from phone_host.verbs.source_arguments import add_source_arguments

SUMMARY = "measure the time offset between the two cameras with a screen or a moving scene"

EXAMPLES = """  phone-host calibrate-time --pattern pattern.html    # open it full screen in a browser, in view of both cameras
  phone-host calibrate-time --by screen --link tcp://192.168.7.2:5555 --camera v4l2:/dev/video0 --calibration rig.yaml --out timing
  phone-host calibrate-time --by scene --frames timing --calibration rig.yaml --out timing
  phone-host calibrate-time --by scene --frames session.mcap --calibration rig.yaml --out timing    # of a recording
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument(
        "--pattern", type=Path, metavar="FILE.html", help="write the page to show on a screen, then end"
    )
    parser.add_argument(
        "--by",
        choices=("screen", "scene"),
        default="screen",
        help="what both cameras film: the page of --pattern on a screen; or, with"
        " --calibration, any textured thing that moves up and down (default screen)",
    )
    add_source_arguments(parser, several=False)
    parser.add_argument(
        "--frames",
        type=Path,
        metavar="DIR|FILE.mcap",
        help="use the frames that an earlier run kept with --keep, or those of a recording, instead of --link and --camera",
    )
    parser.add_argument(
        "--seconds", type=reading(seconds, "--seconds"), default=20.0, metavar="S", help="seconds to film (default 20)"
    )
    parser.add_argument(
        "--calibration", type=Path, metavar="rig.yaml", help="calibration to write the result into; --by scene needs it"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for report.json and time-offset.svg")
    parser.add_argument("--keep", action="store_true", help="keep the frames in --out, for a later --frames")
