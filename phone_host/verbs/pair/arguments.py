"""The options of phone-host pair: light, for every start of the command imports them."""

import argparse
from pathlib import Path

from phone_host.boards.udev_rule import RULES

SUMMARY = "get to know a board by the code that it shows"

EXAMPLES = """  phone-host pair
  phone-host pair --link tcp://192.168.7.2:5555
  phone-host pair --link tcp://raspberrypi.local:5555 --code 123456        (the code that `board-agent pair` shows)
  sudo phone-host pair --udev                              (names the board on the USB cable: /dev/tandemscan-board)

`sudo board-agent pair` on the board shows a code of six digits; it stands in no log.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument(
        "--link",
        metavar="URI",
        help="the board: tcp://HOST:PORT, or serial:DEVICE for --udev (default: it is looked for)",
    )
    parser.add_argument("--code", metavar="DIGITS", help="the code, if the board shows it already")
    parser.add_argument(
        "--pairing-port", type=int, metavar="PORT", help="the board's door (default: the port behind the link's)"
    )
    parser.add_argument(
        "--udev",
        action="store_true",
        help=f"write {RULES} for the board on the USB cable: by its vendor, product and serial number it gets the names"
        " /dev/tandemscan-board and tandemscan0; this names the device and authenticates nobody; needs root",
    )
    parser.add_argument("--config", type=Path, metavar="FILE", help="settings file (TOML)")
    parser.add_argument("--keys", metavar="DIR", help="folder of keys (default ~/.config/tandemscan)")
