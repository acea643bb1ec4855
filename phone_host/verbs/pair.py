"""phone-host pair: learn a board's key, and let it learn ours, by a code that the board shows."""

import argparse
import json
import sys
from contextlib import closing
from pathlib import Path

from common.errors import DataError, SettingsError, UnavailableError
from common.link.factory import needs_keys, parse_link
from common.protocol.pairing_code import CODE_DIGITS, read_code

EXAMPLES = """  phone-host pair
  phone-host pair --link tcp://192.168.7.2:5555
  phone-host pair --link tcp://raspberrypi.local:5555 --code 123456        (the code that `board-agent pair` shows)

The board shows a code of six digits: in its journal (journalctl -u board-agent), or where `sudo board-agent pair` runs.
"""

_TRIES = 3
_PATIENCE_S = 20.0
"""A board that is not named is looked for so long: it is there, since its owner stands before it."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the verb's options."""
    parser.add_argument("--link", metavar="URI", help="the board: tcp://HOST:PORT (default: the board is looked for)")
    parser.add_argument("--code", metavar="DIGITS", help="the code, if the board shows it already")
    parser.add_argument(
        "--pairing-port", type=int, metavar="PORT", help="the board's door (default: the port behind the link's)"
    )
    parser.add_argument("--config", type=Path, metavar="FILE", help="settings file (TOML)")
    parser.add_argument("--keys", metavar="DIR", help="folder of keys (default ~/.config/tandemscan)")


def run(options: argparse.Namespace) -> int:
    """Pair; asks for the code on the terminal."""
    from phone_host.discovery import find_aloud  # noqa: PLC0415
    from phone_host.pairing_call import PairingCall  # noqa: PLC0415 - ZeroMQ, only now
    from phone_host.settings import chosen_keys  # noqa: PLC0415

    keys = chosen_keys(options.config, options.keys)
    link = parse_link(options.link or find_aloud(keys.path, _PATIENCE_S), listens_by_default=False)
    if not link.address.startswith("tcp://") or link.listens:
        raise SettingsError(f"link {options.link!r} needs no keys", "pair over tcp://HOST:PORT")
    door = _door(link.address, options.pairing_port)
    used: set[int] = set()
    while True:
        with closing(PairingCall(door, keys)) as call:
            name = call.ask()
            code = _code(options.code, name, used)
            try:
                board = call.prove(code, link.address, lambda: None)
            except DataError as error:
                if options.code is not None or not sys.stdin.isatty() or len(used) >= _TRIES:
                    raise
                print(f"phone-host: {error}", file=sys.stderr)
                continue
        break
    known = {"name": board.name, "key": board.key, "link": link.address}
    run_with = f"phone-host run --link {link.address}" if needs_keys(link) else "phone-host run"
    print(json.dumps(known) if options.json else f"paired with {board.name}; now: {run_with} --camera ...")
    return 0


def _door(address: str, port: int | None) -> str:
    from common.link.pairing_door import pairing_address  # noqa: PLC0415 - ZeroMQ, only now

    if port is None:
        return pairing_address(address)
    if not 1 <= port <= 65535:
        raise SettingsError(f"--pairing-port {port}", "give 1 to 65535")
    return f"{address.rpartition(':')[0]}:{port}"


def _code(given: str | None, name: str, used: set[int]) -> int:
    """Take the code from the option, or from whoever types it. A code that was typed before is refused: who meddles could learn it bit by bit."""
    if given is None:
        print(f"{name} shows a code of {CODE_DIGITS} digits now; type it: ", end="", file=sys.stderr, flush=True)
        given = sys.stdin.readline()
        if not given:
            raise UnavailableError("no code was typed", "type what the board shows, or give --code")
    code = read_code(given)
    if code is None:
        raise SettingsError(f"{given.strip()!r} is no code", f"type the {CODE_DIGITS} digits that the board shows")
    if code in used:
        raise SettingsError("this code has failed already", "start again and type the new one that the board shows")
    used.add(code)
    return code
