"""The options of phone-host calibrate. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

from phone_host.declared_settings import MAX_MEGAPIXELS_HELP
from phone_host.verbs.orientation_arguments import add_orientation_arguments

SUMMARY = "calibrate two cameras from pictures of a chessboard"

EXAMPLES = """  phone-host calibrate left/ right/ --board 9x6 --square 25mm --out rig.yaml
  phone-host calibrate 'views/left*.png' 'views/right*.png' --board 9x6 --square 25mm --out rig.yaml --json
  phone-host calibrate left/ right/ --board 9x6 --square 25mm --rotate-right 180 --out rig.yaml    # right camera on its head
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument(
        "images",
        nargs="+",
        metavar="LEFT RIGHT",
        help="pictures of the left and of the right camera: two folders or two globs; each left picture is paired with the"
        " right one that has the same number in its name. Pictures are turned upright by their EXIF orientation",
    )
    parser.add_argument("--board", required=True, metavar="9x6", help="inner corners of the chessboard: columns x rows")
    parser.add_argument(
        "--square",
        required=True,
        metavar="25mm",
        help="side of one square: 25mm, 2.5cm or 0.025m; a number alone means mm",
    )
    parser.add_argument(
        "--board-side",
        choices=("left", "right"),
        default="left",
        help="which of the two is the board's camera (default left)",
    )
    add_orientation_arguments(parser)
    parser.add_argument("--max-megapixels", type=int, metavar="N", help=MAX_MEGAPIXELS_HELP)
    parser.add_argument(
        "--out",
        type=Path,
        required=True,
        metavar="rig.yaml",
        help="file for the calibration; report.json is written beside it",
    )
