"""The options of phone-host settings. Light, because every start of the command imports them."""

import argparse
from dataclasses import fields
from pathlib import Path

from common.program.quantities import reading
from phone_host.declared_settings import PhoneHostSettings

SUMMARY = "print each setting, its value and where the value comes from"

EXAMPLES = """  phone-host settings
  phone-host settings --config host.toml --tolerance 5
  PHONE_HOST_FIFO=2:block phone-host settings --json
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options, one for each setting."""
    parser.add_argument("--config", type=Path, metavar="FILE", help="settings file (TOML)")
    for item in fields(PhoneHostSettings):
        several, option = isinstance(item.default, tuple), f"--{item.name.replace('_', '-')}"
        read = item.metadata["read"]
        if isinstance(item.default, bool):
            parser.add_argument(option, action="store_true", default=None, help=item.metadata["doc"])
            continue
        parser.add_argument(
            option,
            type=str if several else reading(read, option) if read else type(item.default),
            action="append" if several else "store",
            metavar=item.name.rpartition("_")[2].upper(),
            help=item.metadata["doc"].replace("%", "%%"),
        )
