"""The options of phone-host stereo. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

from common.program.request import add_options
from phone_host.jobs.depth import LimitedDepthOptions
from phone_host.jobs.options import PAIRED, ImageOptions

EXAMPLES = """  phone-host stereo left.png right.png --calibration rig.yaml --out scan
  phone-host stereo left/ right/ --calibration rig.yaml --out scans    # folders: a folder scans/pair-NNNNNN per pair
  phone-host stereo 'views/left*.jpg' 'views/right*.jpg' --calibration rig.yaml --out scans
  phone-host stereo im0.png im1.png --rectified --disparities 64 --out scan    # no focal length: no cloud.ply
  phone-host stereo im0.png im1.png --rectified --disparities 80 --focal 994.978 --baseline 193.001 \\
      --doffs 31.086 --center 311.193,254.877 --out scan
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument(
        "images",
        nargs="+",
        metavar="LEFT RIGHT",
        help=f"images of the left and of the right camera: {PAIRED}",
    )
    add_options(parser, LimitedDepthOptions)
    add_options(parser, ImageOptions)
    parser.add_argument(
        "--out",
        type=Path,
        required=True,
        metavar="DIR",
        help="folder for the results, not that of the images; it is created if it does not exist. Several pairs get a folder"
        " DIR/pair-NNNNNN each, with the number in their names",
    )
