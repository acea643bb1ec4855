"""phone-host pair: exchange keys with a board by a code that the board shows; or name a board on a USB cable."""

import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from common.android import is_android
from common.errors import DataError, SettingsError, UnavailableError
from common.keys import KeyFolder
from common.link.enrolment_door import pairing_address
from common.link.factory import needs_keys, parse_link
from common.peers import Peer
from common.program.invocation import command_line
from common.program.request import Request, option
from common.program.terminal import fitted, say
from common.protocol.enrolment_code import CODE_DIGITS, read_code
from phone_host.discovery.discovery import find_board_and_say
from phone_host.discovery.enrolment import PairingCall
from phone_host.discovery.udev_rule import RULES, find_usb_board, write_rule
from phone_host.output.json_text import json_text
from phone_host.settings import chosen_keys

EXAMPLES = """  phone-host pair
  phone-host pair --link tcp://192.168.7.2:5555
  phone-host pair --link tcp://raspberrypi.local:5555 --code 123456    # the code that `board-agent pair` shows
  sudo phone-host pair --udev    # names the board on the USB cable: /dev/tandemscan-board

`sudo board-agent pair` on the board shows a code of six digits; it stands in no log.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class PairRequest(Request):
    """What pair can be told."""

    link: str | None = option(
        "--link",
        metavar="URI",
        help="address of the board: tcp://HOST:PORT, or serial:DEVICE with --udev (default: look for one)",
    )
    code: str | None = option(
        "--code", metavar="DIGITS", help="the code, if the board already shows it (default: ask for it)"
    )
    pairing_port: int | None = option(
        "--pairing-port",
        type=int,
        metavar="PORT",
        help="port on which the board takes in new hosts (default: the link's port + 1)",
    )
    udev: bool = option(
        "--udev",
        action="store_true",
        help=f"write {RULES}, which gives the board on the USB cable the names /dev/tandemscan-board and tandemscan0; the rule goes"
        " by vendor, product and serial number and so authenticates nobody; needs root",
    )
    config: Path | None = option("--config", type=Path, metavar="FILE", help="settings file (TOML)")
    keys: str | None = option("--keys", metavar="DIR", help="folder of keys (default ~/.config/tandemscan)")


_TRIES = 3
_PATIENCE_S = 20.0
"""How long to look for a board if none is named. It should be there, because its owner is in front of it."""


def run(request: PairRequest) -> int:
    """Enrol with a board; ask for the code on the terminal if needed."""
    if request.udev:
        return _name_device(request)
    keys = chosen_keys(request.config, request.keys)
    link = parse_link(request.link or find_board_and_say(keys.path, _PATIENCE_S), listens_by_default=False)
    if not link.address.startswith("tcp://") or link.listens:
        raise SettingsError(f"link {request.link!r} needs no keys", "pair over tcp://HOST:PORT")
    door = _door(link.address, request.pairing_port)
    board = _paired(keys, door, link.address, request.code)
    known = {"name": board.name, "key": board.key, "link": link.address}
    to = ("--link", link.address) if needs_keys(link) else ()
    with_keys = ("--keys", request.keys) if request.keys else ()
    next_step = command_line("phone-host", "run", *to, *with_keys, "--camera", "v4l2:auto", "--pairs", "100")
    if is_android():  # the page's browser is the camera there
        next_step = "sh deploy/host/termux-run.sh"
    print(json_text(known) if request.as_json else fitted(f"paired with {board.name}; now try\n  {next_step}"))
    return 0


def _name_device(request: PairRequest) -> int:
    """Write the udev rule and let udev reload its rules."""
    if request.code is not None or request.pairing_port is not None:
        raise SettingsError("--udev does not pair: it only writes a rule", "leave --code and --pairing-port out")
    link = request.link and parse_link(request.link, listens_by_default=False)
    if link and not link.address.startswith("serial:"):
        raise SettingsError(
            f"link {request.link!r} is not a serial port on a USB cable",
            "give --link serial:DEVICE, or leave --link out",
        )
    board = find_usb_board(Path(link.address.removeprefix("serial:")) if link else None)
    write_rule(board)
    if udevadm := shutil.which("udevadm"):
        subprocess.run([udevadm, "control", "--reload"], check=False)
    if request.as_json:
        print(json_text({"file": str(RULES), "vendor": board.vendor, "product": board.product, "serial": board.serial}))
    else:
        next_step = command_line("phone-host", "run", "--link", "serial:/dev/tandemscan-board", "--camera", "v4l2:auto")
        say(f"written to {RULES}; plug the board in again, then try\n  {next_step}")
    return 0


def _paired(keys: KeyFolder, door: tuple[str, int], link: str, given: str | None) -> Peer:
    """Enrol with the board. On a terminal, ask again after a wrong code."""
    tries = 1
    while True:
        call = PairingCall(door, keys, link, lambda line: say(f"phone-host: {line}", sys.stderr))
        code = _code(given, call.ask())
        try:
            return call.prove(code, link, lambda: None)
        except DataError as error:
            if given is not None or not sys.stdin.isatty() or tries >= _TRIES:
                raise
            tries += 1
            say(f"phone-host: {error}", sys.stderr)


def _door(address: str, port: int | None) -> tuple[str, int]:
    if port is None:
        return pairing_address(address)
    if not 1 <= port <= 65535:
        raise SettingsError(f"--pairing-port is {port}", "give a port from 1 to 65535")
    return pairing_address(address)[0], port


def _code(given: str | None, name: str) -> int:
    """Return the code from the option, or ask for it."""
    if given is None:
        words = f"run `sudo board-agent pair` on {name} and type the {CODE_DIGITS} digits that it shows: "
        print(fitted(words, sys.stderr), end="", file=sys.stderr, flush=True)
        given = sys.stdin.readline()
        if not given:
            raise UnavailableError("no code was typed", "type the code that the board shows, or give it with --code")
    return read_code(given)
