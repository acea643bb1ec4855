"""The options of phone-host keys. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

SUMMARY = "list the boards that this host trusts, or change the list or this host's key"

EXAMPLES = """  phone-host keys
  phone-host keys --forget beaglebone
  phone-host keys --new    # then pair with every board again
  phone-host keys --add beaglebone 'tcp://192.168.7.2:5555' 'PUBLIC-KEY'    # as `board-agent keys` shows it
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--forget", metavar="NAME", help="stop trusting this board")
    what.add_argument(
        "--new", action="store_true", help="replace this host's key; every board must then be paired again"
    )
    what.add_argument("--add", nargs=3, metavar=("NAME", "LINK", "KEY"), help="trust a board without pairing")
    parser.add_argument("--config", type=Path, metavar="FILE", help="settings file (TOML)")
    parser.add_argument("--keys", metavar="DIR", help="folder of keys (default ~/.config/tandemscan)")
