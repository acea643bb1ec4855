"""The options of phone-host measure. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

from common.program.request import add_options
from phone_host.jobs.depth import DEFAULT_NEAR_MM
from phone_host.jobs.options import ImageOptions
from phone_host.stereo.matcher_names import default_words

EXAMPLES = """  phone-host measure left.png right.png --calibration rig.yaml --points 220,220
  phone-host measure left.png right.png --calibration rig.yaml --points 220,220 310,230.5    # and the distance between the two
  phone-host measure im0.png im1.png --calibration calib.txt --points 350,200 --json
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument("left", metavar="LEFT", help="image of the left camera")
    parser.add_argument("right", metavar="RIGHT", help="image of the right camera, taken at the same moment")
    parser.add_argument(
        "--calibration",
        metavar="FILE",
        required=True,
        help="rig.yaml of the two cameras; or, for rectified images, the calib.txt of Middlebury, ETH3D or KITTI",
    )
    parser.add_argument(
        "--overlay",
        type=Path,
        metavar="FILE",
        help="overlay.yaml that a run saved: how the cameras had turned against each other since the calibration",
    )
    parser.add_argument(
        "--points",
        nargs="+",
        required=True,
        metavar="X,Y",
        help="points of the left image, px, as it is taken and upright; the centre of the first pixel is 0,0. Of several, the distance"
        " from each to the next is told, too. A point that cannot be measured is named, the others are told; the exit code is then 4",
    )
    parser.add_argument(
        "--use-rejected-rig",
        action="store_true",
        help="use a rig.yaml that its calibration rejected; expect wrong lengths",
    )
    parser.add_argument(
        "--near",
        metavar="MM",
        help=f"look for nothing nearer; 20cm and 0.2m work, too (default: {DEFAULT_NEAR_MM:g} mm)",
    )
    parser.add_argument(
        "--disparities", type=int, metavar="N", help="search disparities from 0 to N-1 px (default: as --near needs)"
    )
    parser.add_argument("--matcher", metavar="NAME", help=f"as for phone-host stereo ({default_words()})")
    add_options(parser, ImageOptions)
    # What the stereo core could be told besides. Limits and crops would only hide the points that are asked for.
    parser.set_defaults(
        rectified=False,
        far=None,
        crop=None,
        scale=None,
        focal=None,
        baseline=None,
        doffs=None,
        center=None,
    )
