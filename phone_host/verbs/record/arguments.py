"""The options of phone-host record. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

from common.program.quantities import reading, seconds
from phone_host.verbs.source_arguments import add_source_arguments

SUMMARY = "record what both cameras give, without computing anything, to replay it later"

EXAMPLES = """  phone-host record --link tcp://192.168.7.2:5555 --camera v4l2:/dev/video0 --out session.mcap
  phone-host record --link tcp://192.168.7.2:5555 --camera v4l2:/dev/video0 --calibration rig.yaml --seconds 60 --out session.mcap    # run --replay with the same rig computes depth from it
  phone-host record --alone --camera v4l2:/dev/video0 --out host.mcap    # the board runs board-agent record; then sessions join
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument("--config", type=Path, metavar="FILE", help="settings file (TOML)")
    add_source_arguments(parser)
    parser.add_argument(
        "--alone",
        action="store_true",
        help="record this machine's camera only, while the board records its own; sessions join puts both together",
    )
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.mcap", help="the recording; it must not exist")
    parser.add_argument(
        "--seconds",
        type=reading(seconds, "--seconds"),
        default=0.0,
        metavar="S",
        help="end after S seconds, counted from the board's first frame (default: when it is stopped)",
    )
    parser.add_argument(
        "--calibration",
        metavar="rig.yaml",
        help="calibration to keep in the recording; other programs read it as camera_info",
    )
    parser.add_argument(
        "--board-side",
        choices=("left", "right"),
        help="which view the board's camera gives (default: as in the calibration, else left)",
    )
