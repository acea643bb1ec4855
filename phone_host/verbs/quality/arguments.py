"""The options of phone-host quality. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

from common.program.request import add_options
from phone_host.jobs.depth import DepthOptions
from phone_host.jobs.options import PAIRED, ImageOptions

EXAMPLES = """  phone-host quality left.png right.png --calibration rig.yaml --distance 1.2m --out quality
  phone-host quality left/ right/ --calibration rig.yaml --board 9x6 --square 25mm --out quality    # the board gives the true distance
  phone-host quality left/ right/ --calibration rig.yaml --distance 500mm,1m,2m --out quality    # one distance for each pair, in name order
  phone-host quality session.mcap --calibration rig.yaml --distance 1.2m --out quality    # a recording of the wall
  phone-host quality left.png right.png --calibration rig.yaml --roi 0,0,640,480 --out quality    # RMS and fill rate alone
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument(
        "images",
        nargs="+",
        metavar="LEFT RIGHT",
        help=f"images of a flat textured wall or of a board: {PAIRED}",
    )
    parser.add_argument(
        "--distance",
        metavar="MM",
        help="true distance of the wall from the left camera, along its optical axis: 1200, 120cm or 1.2m; one for all pairs, or one"
        " for each, with commas between",
    )
    parser.add_argument(
        "--board",
        metavar="9x6",
        help="inner corners of a chessboard that is seen, columns x rows: its corners in the left image give the true plane",
    )
    parser.add_argument(
        "--square", metavar="25mm", help="side of one of its squares: 25mm, 2.5cm or 0.025m; a number alone means mm"
    )
    parser.add_argument(
        "--roi",
        metavar="X,Y,W,H",
        help="the region that counts, px of the rectified left image (default: the middle 40 %% x 40 %%, or the board inside its"
        " outermost inner corners)",
    )
    add_options(parser, DepthOptions)
    add_options(parser, ImageOptions)
    parser.add_argument(
        "--out",
        type=Path,
        required=True,
        metavar="DIR",
        help="folder for report.json and index.html, not that of the images; it is created if it does not exist",
    )
