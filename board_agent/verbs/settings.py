"""board-agent settings: print each setting with its origin."""

import argparse

from board_agent.settings import check, resolve_settings
from common.program.settings import listing


def run(options: argparse.Namespace) -> int:
    """Print the settings. Refuse those that `run` would refuse."""
    resolved = resolve_settings(options)
    check(resolved.values)
    print(listing(resolved, as_json=options.json))
    return 0
