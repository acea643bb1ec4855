"""The options of phone-host doctor. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

from common.program.quantities import reading, seconds

SUMMARY = "check this machine, its camera, the board, the calibration and the disk"

EXAMPLES = """  phone-host doctor
  phone-host doctor --link tcp://192.168.7.2:5555 --camera v4l2:/dev/video0 --calibration rig.yaml --out scan
  phone-host doctor --camera http://192.168.1.5:8080/video --calibration rig.yaml --capture    # hold it, turn it a little
  phone-host doctor --config phone-host.toml --json
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument("--config", type=Path, metavar="FILE", help="settings file (TOML)")
    parser.add_argument(
        "--link",
        action="append",
        metavar="URI",
        help="address of the board to check; repeat the option for several links",
    )
    parser.add_argument(
        "--camera", metavar="URI", help="camera of this machine; the check streams from it for a second"
    )
    parser.add_argument("--calibration", metavar="FILE", help="rig.yaml to check")
    parser.add_argument(
        "--capture",
        type=reading(seconds, "--capture"),
        nargs="?",
        const=60.0,
        metavar="S",
        help="film with --camera for S seconds (default 60) and judge rate, stamps, shutter, and whether its software warps the"
        " images; kept as capture.json beside --calibration, or among your data until there is one",
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=Path(),
        metavar="DIR",
        help="folder for results; the check looks for free space there (default: the current folder)",
    )
    parser.add_argument(
        "--keys", metavar="DIR", help="folder of keys, with which the board is asked (default ~/.config/tandemscan)"
    )
    parser.add_argument(
        "--wait",
        type=reading(seconds, "--wait"),
        default=5.0,
        metavar="S",
        help="seconds to wait for the board (default 5)",
    )
