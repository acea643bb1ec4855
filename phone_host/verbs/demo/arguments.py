"""The options of phone-host demo. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

from common.program.quantities import reading, seconds

SUMMARY = "run both programs on this machine with a rendered scene, and report the depth error and every delay"

EXAMPLES = """  phone-host demo
  phone-host demo --seconds 30 --out scan-demo
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument(
        "--seconds",
        type=reading(seconds, "--seconds"),
        default=12.0,
        metavar="S",
        help="seconds to stream (default 12)",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("out/demo"), metavar="DIR", help="folder for the results (default out/demo)"
    )
