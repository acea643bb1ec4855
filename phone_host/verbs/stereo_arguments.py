"""The options for the stereo core, shared by the verbs that need one. Light: the arguments halves import it."""

import argparse
from typing import Final

from phone_host.declared_settings import NEAR_M
from phone_host.stereo.matcher_names import MatcherName

_DEFAULT_NEAR_MM: Final = NEAR_M * 1000
"""Default nearest depth, mm: the near limit of hand-held scanners (Structure Sensor 350 mm, RealSense D435 280 mm).

A nearer limit costs time: the number of disparities is proportional to 1 / z."""


def add_stereo_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare --calibration, --rectified and their related options."""
    parser.add_argument(
        "--calibration", metavar="rig.yaml", help="calibration of the two cameras, made by phone-host calibrate"
    )
    parser.add_argument("--rectified", action="store_true", help="the images are already rectified")
    parser.add_argument(
        "--disparities",
        type=int,
        metavar="N",
        help="search disparities from 0 to N-1 px (default with --calibration: as --near needs)",
    )
    parser.add_argument(
        "--near",
        type=float,
        default=_DEFAULT_NEAR_MM,
        metavar="MM",
        help=f"nearest depth to look for, with --calibration (default {_DEFAULT_NEAR_MM:g})",
    )
    parser.add_argument("--focal", type=float, metavar="PX", help="focal length of the rectified images")
    parser.add_argument(
        "--baseline", type=float, metavar="MM", help="distance of the two cameras, for rectified images"
    )
    parser.add_argument(
        "--doffs",
        type=float,
        metavar="PX",
        help="x of the right principal point minus the left (default 0)",
    )
    parser.add_argument("--center", metavar="CX,CY", help="principal point of the left rectified image")
    own = " or ".join(name.value for name in MatcherName)
    parser.add_argument(
        "--matcher", metavar="NAME", help=f"stereo matcher: {own}, or one from an installed package (default sgbm)"
    )
