"""The options for the stereo core, shared by the verbs that need one. Light: the arguments halves import it."""

import argparse
from pathlib import Path
from typing import Final

from phone_host.declared_settings import NEAR_M
from phone_host.stereo.matcher_names import MatcherName, default_words

DEFAULT_NEAR_MM: Final = NEAR_M * 1000
"""Default nearest depth, mm: the near limit of hand-held scanners (Structure Sensor 350 mm, RealSense D435 280 mm).

A nearer limit costs time: the number of disparities is proportional to 1 / z."""


PAIRED: Final = (
    "two files, two folders or two globs; images of folders and globs are paired by the number in the name, else by equal names,"
    " else in name order. Or a recording, FILE.mcap: its stillest pair of each second, at most a hundred, written to DIR/views"
)
"""How LEFT and RIGHT are given, for the verbs that take pairs of images."""


def add_stereo_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare --calibration, --rectified and their related options, and those that say which points are written."""
    add_core_arguments(parser)
    add_limit_arguments(parser)


def add_limit_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare --far, --crop and --axes: which points are written, and how."""
    parser.add_argument(
        "--far",
        metavar="MM",
        help="cut points with a coordinate beyond this (default: where an error of 0.25 px, or the rig's own, makes the depth wrong by 20 %%)",
    )
    parser.add_argument(
        "--crop", metavar="X,Y,W,H", help="only this part of the rectified left image gets depth, px of the full size"
    )
    parser.add_argument(
        "--axes",
        choices=("camera", "y-up"),
        default="camera",
        help="axes of the points in files: the camera's (x right, y down, z forward), or y up and z backward as many viewers expect",
    )


def add_overlay_argument(parser: argparse.ArgumentParser) -> None:
    """Declare --overlay."""
    parser.add_argument(
        "--overlay",
        type=Path,
        metavar="FILE",
        help="overlay.yaml that a run saved: how the cameras had turned against each other since the calibration",
    )


def add_core_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare what a stereo core needs: --calibration, --rectified and their related options, and how to match."""
    parser.set_defaults(far=None, crop=None, axes="camera")
    parser.add_argument(
        "--calibration",
        metavar="FILE",
        help="rig.yaml of the two cameras, made by phone-host calibrate; or, for rectified images, the calib.txt of Middlebury, ETH3D or KITTI",
    )
    parser.add_argument(
        "--use-rejected-rig",
        action="store_true",
        help="use a rig.yaml that its calibration rejected; expect wrong depth",
    )
    parser.add_argument("--rectified", action="store_true", help="the images are already rectified")
    parser.add_argument(
        "--disparities",
        type=int,
        metavar="N",
        help="search disparities from 0 to N-1 px (default: as --near needs, where focal length and baseline are known)",
    )
    parser.add_argument(
        "--near",
        metavar="MM",
        help=f"cut what is nearer, and look for nothing nearer; 20cm and 0.2m work, too (default: look from {DEFAULT_NEAR_MM:g} mm on, cut nothing)",
    )
    parser.add_argument(
        "--scale",
        metavar="S",
        help="match images of this share of the size, 0.1 to 1; results keep the full size (default: 1, less for large images)",
    )
    parser.add_argument("--focal", metavar="PX", help="focal length of the rectified images, px")
    parser.add_argument("--baseline", metavar="MM", help="distance of the two cameras, for rectified images")
    parser.add_argument("--doffs", metavar="PX", help="x of the right principal point minus the left, px (default 0)")
    parser.add_argument("--center", metavar="CX,CY", help="principal point of the left rectified image")
    own = " or ".join(name.value for name in MatcherName)
    parser.add_argument(
        "--matcher",
        metavar="NAME",
        help=f"stereo matcher: {own}, onnx:PATH for a network, or one from an installed package ({default_words()})",
    )
