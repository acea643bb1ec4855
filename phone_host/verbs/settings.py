"""phone-host settings: print each setting with its origin."""

import argparse
import json
from pathlib import Path

from phone_host.verbs.run import resolve_settings

EXAMPLES = """  phone-host settings
  PHONE_HOST_FIFO=2:block phone-host settings --json
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument("--config", type=Path, metavar="FILE", help="settings file (TOML)")


def run(options: argparse.Namespace) -> int:
    """Print the settings."""
    resolved = resolve_settings(options)
    rows = [(name, getattr(resolved.values, name), origin) for name, origin in resolved.origins]
    if options.json:
        print(json.dumps({name: {"value": value, "origin": origin} for name, value, origin in rows}))
    else:
        for name, value, origin in rows:
            print(f"{name:12} {value!s:40} {origin}")
    return 0
