"""phone-host keys: this host's public key and the boards that it knows."""

import argparse
from pathlib import Path

from common import now
from common.errors import SettingsError
from common.keys import change, listing
from phone_host.settings import chosen_keys

EXAMPLES = """  phone-host keys
  phone-host keys --forget beaglebone
  phone-host keys --new                                   (then pair with every board again)
  phone-host keys --add beaglebone 'tcp://192.168.7.2:5555' 'PUBLIC-KEY'      (as `board-agent keys` shows it)
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--forget", metavar="NAME", help="trust this board no longer")
    what.add_argument("--new", action="store_true", help="make a new key in place of the old one")
    what.add_argument("--add", nargs=3, metavar=("NAME", "LINK", "KEY"), help="trust a board without pairing")
    parser.add_argument("--config", type=Path, metavar="FILE", help="settings file (TOML)")
    parser.add_argument("--keys", metavar="DIR", help="folder of keys (default ~/.config/tandemscan)")


def run(options: argparse.Namespace) -> int:
    """Change what is asked for and print what there is."""
    folder = chosen_keys(options.config, options.keys)
    name, address, key = options.add or ("", "", "")
    if options.add and not address.startswith("tcp://"):
        raise SettingsError(f"{address!r} is no tcp link", "give tcp://HOST:PORT")
    add = (name, key) if options.add else None
    change(folder, forget=options.forget, new=options.new, add=add, address=address, when=now.wall_time())
    print(listing(folder, as_json=options.json))
    return 0
