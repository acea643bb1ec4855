"""board-agent keys: show or change this board's key and its hosts."""

import argparse
import sys

from board_agent.settings import chosen_keys, is_service_hidden
from common import now
from common.keys_verb import change, listing


def run(options: argparse.Namespace) -> int:
    """Make the requested changes and print the result."""
    folder = chosen_keys(options)
    told = change(folder, forget=options.forget, new=options.new, add=options.add, address="", when=now.wall_time())
    print(listing(folder, as_json=options.json))
    if told:
        print(f"board-agent: {told}", file=sys.stderr)
    if is_service_hidden(folder):
        print("board-agent: these are your own keys; for the service's: sudo board-agent keys", file=sys.stderr)
    if options.new:
        print("board-agent: a running service keeps its old key until it is restarted", file=sys.stderr)
    return 0
