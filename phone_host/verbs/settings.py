"""phone-host settings: print each setting with its origin."""

import argparse
from dataclasses import fields
from pathlib import Path

from common.program.settings import listing
from phone_host.settings import PhoneHostSettings, check
from phone_host.verbs.run import resolve_settings

EXAMPLES = """  phone-host settings
  phone-host settings --config host.toml --tolerance 5
  PHONE_HOST_FIFO=2:block phone-host settings --json
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options: an option for each setting."""
    parser.add_argument("--config", type=Path, metavar="FILE", help="settings file (TOML)")
    for item in fields(PhoneHostSettings):
        several, option = isinstance(item.default, tuple), f"--{item.name.replace('_', '-')}"
        if isinstance(item.default, bool):
            parser.add_argument(option, action="store_true", default=None, help=item.metadata["doc"])
            continue
        parser.add_argument(
            option,
            type=str if several else type(item.default),
            action="append" if several else "store",
            metavar=item.name.rpartition("_")[2].upper(),
            help=item.metadata["doc"].replace("%", "%%"),
        )


def run(options: argparse.Namespace) -> int:
    """Print the settings; those that `run` would refuse are refused here too."""
    resolved = resolve_settings(options)
    check(resolved.values)
    print(listing(resolved, as_json=options.json))
    return 0
