"""phone-host keys: this host's public key and the boards that it knows."""

import sys
from dataclasses import dataclass
from pathlib import Path

from common import now
from common.errors import SettingsError
from common.keys_verb import change, listing
from common.program.request import Request, option
from phone_host.settings import chosen_keys

EXAMPLES = """  phone-host keys
  phone-host keys --forget beaglebone
  phone-host keys --new    # then pair with every board again
  phone-host keys --add beaglebone 'tcp://192.168.7.2:5555' 'PUBLIC-KEY'    # as `board-agent keys` shows it
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class KeysRequest(Request):
    """What keys can be told."""

    forget: str | None = option("--forget", alone=True, metavar="NAME", help="stop trusting this board")
    new: bool = option(
        "--new", alone=True, action="store_true", help="replace this host's key; every board must then be paired again"
    )
    add: tuple[str, ...] | None = option(
        "--add", alone=True, nargs=3, metavar=("NAME", "LINK", "KEY"), help="trust a board without pairing"
    )
    config: Path | None = option("--config", type=Path, metavar="FILE", help="settings file (TOML)")
    keys: str | None = option("--keys", metavar="DIR", help="folder of keys (default ~/.config/tandemscan)")


def run(request: KeysRequest) -> int:
    """Make the requested change, then print the keys."""
    folder = chosen_keys(request.config, request.keys)
    name, address, key = request.add or ("", "", "")
    if request.add and not address.startswith("tcp://"):
        raise SettingsError(f"{address!r} is not a tcp link", "give tcp://HOST:PORT")
    add = (name, key) if request.add else None
    told = change(folder, forget=request.forget, new=request.new, add=add, address=address, when=now.wall_time())
    print(listing(folder, as_json=request.as_json))
    if told:
        print(f"phone-host: {told}", file=sys.stderr)
    return 0
