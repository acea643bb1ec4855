"""The options of phone-host pair. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

from phone_host.boards.udev_rule import RULES

SUMMARY = "make this host and a board known to each other, with the code that the board shows"

EXAMPLES = """  phone-host pair
  phone-host pair --link tcp://192.168.7.2:5555
  phone-host pair --link tcp://raspberrypi.local:5555 --code 123456    # the code that `board-agent pair` shows
  sudo phone-host pair --udev    # names the board on the USB cable: /dev/tandemscan-board

`sudo board-agent pair` on the board shows a code of six digits; it stands in no log.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument(
        "--link",
        metavar="URI",
        help="address of the board: tcp://HOST:PORT, or serial:DEVICE with --udev (default: look for one)",
    )
    parser.add_argument(
        "--code", metavar="DIGITS", help="the code, if the board already shows it (default: ask for it)"
    )
    parser.add_argument(
        "--pairing-port",
        type=int,
        metavar="PORT",
        help="port on which the board takes in new hosts (default: the link's port + 1)",
    )
    parser.add_argument(
        "--udev",
        action="store_true",
        help=f"write {RULES}, which gives the board on the USB cable the names /dev/tandemscan-board and tandemscan0; the rule goes"
        " by vendor, product and serial number and so authenticates nobody; needs root",
    )
    parser.add_argument("--config", type=Path, metavar="FILE", help="settings file (TOML)")
    parser.add_argument("--keys", metavar="DIR", help="folder of keys (default ~/.config/tandemscan)")
