"""The options of phone-host demo: light, for every start of the command imports them."""

import argparse
from pathlib import Path

SUMMARY = "both programs on this machine, a rendered scene with known truth, a full report"

EXAMPLES = """  phone-host demo
  phone-host demo --seconds 30 --out scan-demo
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument("--seconds", type=float, default=12.0, metavar="S", help="how long to stream (default 12)")
    parser.add_argument(
        "--out", type=Path, default=Path("out/demo"), metavar="DIR", help="folder for results (default out/demo)"
    )
