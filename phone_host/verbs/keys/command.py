"""phone-host keys: this host's public key and the boards that it knows."""

import argparse
import sys

from common import now
from common.errors import SettingsError
from common.keys_verb import change, listing
from phone_host.settings import chosen_keys


def run(options: argparse.Namespace) -> int:
    """Make the requested change, then print the keys."""
    folder = chosen_keys(options.config, options.keys)
    name, address, key = options.add or ("", "", "")
    if options.add and not address.startswith("tcp://"):
        raise SettingsError(f"{address!r} is not a tcp link", "give tcp://HOST:PORT")
    add = (name, key) if options.add else None
    told = change(folder, forget=options.forget, new=options.new, add=add, address=address, when=now.wall_time())
    print(listing(folder, as_json=options.json))
    if told:
        print(f"phone-host: {told}", file=sys.stderr)
    return 0
