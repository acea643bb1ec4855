"""The options of phone-host scan. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

from common.program.quantities import reading, seconds
from common.program.request import add_options
from phone_host.jobs.depth import LimitedDepthOptions
from phone_host.jobs.options import PAIRED, ImageOptions, PairOptions
from phone_host.verbs.scan.wanted import ModelOptions

EXAMPLES = """  phone-host scan left/ right/ --calibration rig.yaml --out cup    # folders: photographs on the way around the cup
  phone-host scan left/ right/ --calibration rig.yaml --voxel 2mm --far 80cm --out cup    # finer, and without the background
  phone-host scan left/ right/ --calibration rig.yaml --box 400x300x400@0,100,900 --out cup    # only what is in this box
  phone-host scan left/ right/ --calibration rig.yaml --mat --out cup    # on the sheet of `phone-host target mat`, any way around
  phone-host scan left/ right/ --calibration rig.yaml --object --out cup    # what stands on a table, without a mat
  phone-host scan left/ right/ --rectified --focal 525 --baseline 60 --out room
  phone-host scan --link tcp://192.168.7.2:5555 --camera v4l2:/dev/video0 --calibration rig.yaml --record cup.mcap --out cup    # live
  phone-host scan left/ right/ --calibration rig.yaml --turntable --out cup    # the cup was turned, the cameras stood still
  phone-host scan left2/ right2/ --calibration rig.yaml --turntable --onto cup --out whole    # turned over: its underside, too
  phone-host scan left/ right/ --calibration rig.yaml --resume cup --out cup    # go on after it was killed
  phone-host scan --replay session.mcap --calibration rig.yaml --out cup    # every pair of a recording
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument(
        "images",
        nargs="*",
        metavar="LEFT RIGHT",
        help=f"images in the order in which they were taken, each pair sharing most of what the last one shows; without them two cameras are"
        f" scanned live: {PAIRED}",
    )
    _add_live_arguments(parser)
    add_options(parser, LimitedDepthOptions)
    add_options(parser, ImageOptions)
    add_options(parser, ModelOptions)
    _add_resume_arguments(parser)
    parser.add_argument(
        "--out",
        type=Path,
        required=True,
        metavar="DIR",
        help="folder for model.ply, trajectory.txt, report.json and index.html, not that of the images; it is created if it does not exist",
    )


def _add_live_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--config", type=Path, metavar="FILE", help="live: settings file (TOML)")
    add_options(parser, PairOptions, "live: ")
    parser.add_argument(
        "--board-side",
        choices=("left", "right"),
        help="live: which view the board's camera gives (default: as in the calibration, else left)",
    )
    parser.add_argument(
        "--replay",
        metavar="FILE.mcap",
        help="play a recording in place of --link and --camera: all of its pairs, the same each time; without --calibration the rig.yaml in it counts",
    )
    parser.add_argument(
        "--record",
        type=Path,
        metavar="FILE.mcap",
        help="live: also keep what both cameras give, to scan it again with --replay: finer, or after a crash",
    )
    parser.add_argument("--pairs", type=int, metavar="N", help="live: end after N pairs (default 0: no limit)")
    parser.add_argument(
        "--seconds",
        type=reading(seconds, "--seconds"),
        default=0.0,
        metavar="S",
        help="live: end S seconds after the first pair (default: with Ctrl-C or SIGTERM)",
    )


def _add_resume_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--resume",
        type=Path,
        metavar="DIR",
        help="go on with a scan that was killed, from the last submap that it has written into its folder, one every 20 pairs of the model;"
        " DIR may be that of --out",
    )
    parser.add_argument(
        "--restart",
        action="store_true",
        help="start again where --out holds what a scan that was killed has written; without it that is refused",
    )
