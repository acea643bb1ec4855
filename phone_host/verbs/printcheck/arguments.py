"""The options of phone-host printcheck. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

from phone_host.verbs.printer_bed import BED_HELP

SUMMARY = "tell whether a scan or mesh can be printed, and what to do if not"

EXAMPLES = """  phone-host printcheck scan                          # scan: the folder that phone-host scan wrote
  phone-host printcheck part.stl --unit mm --bed 180,180,180 --out print    # and draws what is wrong
  phone-host printcheck scan --fix --out print        # cuts a base, drops crumbs, scales; says what it did
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument("model", metavar="MODEL", help="the folder of a scan, or a mesh: .ply, .stl, .obj, .glb, .3mf")
    parser.add_argument(
        "--unit", choices=("m", "mm"), help="unit of a mesh file of another program (default m; our own files say it)"
    )
    parser.add_argument(
        "--up",
        choices=("z", "y", "-y"),
        help="axis of the model that points up (default: -y or y for a scan in the camera's axes, as its report says; z otherwise)",
    )
    parser.add_argument("--bed", metavar="X,Y,Z", help=f"{BED_HELP} (default 220,220,250)")
    parser.add_argument("--wall", metavar="MM", default="0.8mm", help="least thickness of a wall (default 0.8mm)")
    parser.add_argument(
        "--overhang",
        metavar="DEG",
        type=float,
        default=45.0,
        help="what hangs over by more needs supports (default 45)",
    )
    parser.add_argument("--fix", action="store_true", help="write a mended model, and say what was done")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="folder for a picture of what is wrong and for the mended model (default: nothing is written)",
    )
