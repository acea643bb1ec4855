"""The options of phone-host serve. Light, because every start of the command imports them."""

import argparse
from pathlib import Path

from phone_host.jobs.options import LAN_HELP

EXAMPLES = """  phone-host serve --open    # the page in this machine's browser
  phone-host serve 127.0.0.1:9000
  phone-host serve --lan    # for a phone in the same network: https, with a code to scan
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument(
        "address",
        nargs="?",
        metavar="HOST:PORT",
        help="where the page is served (default 127.0.0.1:8765; with --lan 0.0.0.0:8765); port 0: any that is free",
    )
    parser.add_argument("--open", action="store_true", help="open the page in the browser")
    parser.add_argument("--lan", action="store_true", help=LAN_HELP)
    parser.add_argument(
        "--config",
        type=Path,
        metavar="FILE",
        help="settings file in which the page keeps what is chosen (default ~/.config/tandemscan/phone-host.toml)",
    )
    parser.add_argument("--keys", metavar="DIR", help="folder of keys (default ~/.config/tandemscan)")
