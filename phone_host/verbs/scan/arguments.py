"""The options of phone-host scan. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

from common.program.quantities import file_size, reading
from phone_host.verbs.orientation_arguments import add_image_arguments
from phone_host.verbs.stereo_arguments import (
    PAIRED,
    add_core_arguments,
    add_limit_arguments,
    add_overlay_argument,
)

SUMMARY = "put pairs from several places together to one model with colours"

EXAMPLES = """  phone-host scan left/ right/ --calibration rig.yaml --out cup    # folders: photographs on the way around the cup
  phone-host scan left/ right/ --calibration rig.yaml --voxel 2mm --far 80cm --out cup    # finer, and without the background
  phone-host scan left/ right/ --calibration rig.yaml --box 400x300x400@0,100,900 --out cup    # only what is in this box
  phone-host scan left/ right/ --rectified --focal 525 --baseline 60 --out room
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument(
        "images",
        nargs="+",
        metavar="LEFT RIGHT",
        help=f"images in the order in which they were taken, each pair sharing most of what the last one shows: {PAIRED}",
    )
    add_core_arguments(parser)
    add_limit_arguments(parser)
    add_overlay_argument(parser)
    add_image_arguments(parser)
    add_model_arguments(parser)
    parser.add_argument(
        "--out",
        type=Path,
        required=True,
        metavar="DIR",
        help="folder for model.ply, trajectory.txt, report.json and index.html, not that of the images; it is created if it does not exist",
    )


def add_model_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare --voxel, --box and --memory: how the model is made."""
    parser.add_argument(
        "--voxel",
        metavar="MM",
        help="how fine the model is, such as 2mm (default: half the noise of the near depths of the first pair)",
    )
    parser.add_argument(
        "--box",
        metavar="WxHxD@X,Y,Z",
        help="keep only the surface in this box, mm: its sides, and its middle in the axes of the first left camera (x right, y down, z forward)",
    )
    parser.add_argument(
        "--memory",
        type=reading(file_size, "--memory"),
        default=300e6,
        metavar="SIZE",
        help="memory of the model at most; what does not fit is left out, and told (default 300MB)",
    )
