"""The options of phone-host relief. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

from common.program.request import add_options
from phone_host.jobs.depth import DEFAULT_NEAR_MM
from phone_host.jobs.options import ImageOptions
from phone_host.stereo.matcher_names import default_words

EXAMPLES = """  phone-host relief left.png right.png --calibration rig.yaml --out print
  phone-host relief left.png right.png --calibration rig.yaml --width 150mm --far 2m --out print
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
    parser.add_argument("--width", metavar="MM", default="100mm", help="longer side of the plaque (default 100mm)")
    parser.add_argument(
        "--height",
        metavar="MM",
        help="of the relief above its plate at most; what is deeper at that scale is flattened (default: a third of --width)",
    )
    parser.add_argument("--base", metavar="MM", default="2mm", help="thickness of the plate (default 2mm)")
    parser.add_argument(
        "--out", type=Path, default=Path(), metavar="DIR", help="folder for the files (default: the current folder)"
    )
    parser.add_argument(
        "--use-rejected-rig",
        action="store_true",
        help="use a rig.yaml that its calibration rejected; expect wrong lengths",
    )
    parser.add_argument("--near", metavar="MM", help=f"look for nothing nearer (default: {DEFAULT_NEAR_MM:g} mm)")
    parser.add_argument("--far", metavar="MM", help="what is farther is bare plate (default: as the rig can tell)")
    parser.add_argument("--crop", metavar="X,Y,W,H", help="part of the rectified left image, px")
    parser.add_argument("--disparities", type=int, metavar="N", help="search disparities from 0 to N-1 px")
    parser.add_argument("--matcher", metavar="NAME", help=f"as for phone-host stereo ({default_words()})")
    add_options(parser, ImageOptions)
    parser.set_defaults(rectified=False, scale=None, focal=None, baseline=None, doffs=None, center=None)
