"""phone-host settings: print each setting with its origin."""

import argparse

from common.program.settings import listing
from phone_host.settings import check, resolve_settings


def run(options: argparse.Namespace) -> int:
    """Print the settings. Refuse those that `run` would refuse."""
    resolved = resolve_settings(options)
    check(resolved.values)
    print(listing(resolved, as_json=options.json))
    return 0
