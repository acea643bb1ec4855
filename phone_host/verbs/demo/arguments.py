"""The options of phone-host demo. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

from common.program.quantities import reading, seconds

SUMMARY = "run both programs on this machine with a rendered scene or thing, and compare depth or model with the truth"

EXAMPLES = """  phone-host demo
  phone-host demo --seconds 30 --out demo
  phone-host demo --scan                   # scan a thing on the mat, as `scan --mat` does; about a minute
  phone-host demo --scan --object thin
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument(
        "--seconds",
        type=reading(seconds, "--seconds"),
        metavar="S",
        help="seconds to stream (default 12); not with --scan",
    )
    parser.add_argument(
        "--scan",
        action="store_true",
        help="scan a rendered thing that stands on the mat instead, compare the model with it, and slice it where PrusaSlicer is installed",
    )
    parser.add_argument(
        "--object",
        choices=("speckled", "thin", "shiny", "plain"),
        help="the thing to scan: speckled (default), with thin parts, shiny, or nearly without texture",
    )
    parser.add_argument(
        "--views", type=int, metavar="N", help="pairs all around the thing (default 36, 6 to 360), with --scan"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder for the results (default out/demo, with --scan out/demo-scan)"
    )
