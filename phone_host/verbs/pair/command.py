"""phone-host pair: exchange keys with a board by a code that the board shows; or name a board on a USB cable."""

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

from common.android import is_android
from common.errors import DataError, SettingsError, UnavailableError
from common.keys import KeyFolder
from common.link.enrolment_door import pairing_address
from common.link.factory import needs_keys, parse_link
from common.peers import Peer
from common.program.invocation import command_line
from common.program.terminal import fitted, say
from common.protocol.enrolment_code import CODE_DIGITS, read_code
from phone_host.boards.discovery import find_board_and_say
from phone_host.boards.enrolment import PairingCall
from phone_host.boards.udev_rule import RULES, find_usb_board, write_rule
from phone_host.output.json_text import json_text
from phone_host.settings import chosen_keys

_TRIES = 3
_PATIENCE_S = 20.0
"""How long to look for a board if none is named. It should be there, because its owner is in front of it."""


def run(options: argparse.Namespace) -> int:
    """Enrol with a board; ask for the code on the terminal if needed."""
    if options.udev:
        return _name_device(options)
    keys = chosen_keys(options.config, options.keys)
    link = parse_link(options.link or find_board_and_say(keys.path, _PATIENCE_S), listens_by_default=False)
    if not link.address.startswith("tcp://") or link.listens:
        raise SettingsError(f"link {options.link!r} needs no keys", "pair over tcp://HOST:PORT")
    door = _door(link.address, options.pairing_port)
    board = _paired(keys, door, link.address, options.code)
    known = {"name": board.name, "key": board.key, "link": link.address}
    to = ("--link", link.address) if needs_keys(link) else ()
    with_keys = ("--keys", options.keys) if options.keys else ()
    next_step = command_line("phone-host", "run", *to, *with_keys, "--camera", "v4l2:auto", "--pairs", "100")
    if is_android():  # the page's browser is the camera there
        next_step = "sh deploy/host/termux-run.sh"
    print(json_text(known) if options.json else fitted(f"paired with {board.name}; now try\n  {next_step}"))
    return 0


def _name_device(options: argparse.Namespace) -> int:
    """Write the udev rule and let udev reload its rules."""
    if options.code is not None or options.pairing_port is not None:
        raise SettingsError("--udev does not pair: it only writes a rule", "leave --code and --pairing-port out")
    link = options.link and parse_link(options.link, listens_by_default=False)
    if link and not link.address.startswith("serial:"):
        raise SettingsError(
            f"link {options.link!r} is not a serial port on a USB cable",
            "give --link serial:DEVICE, or leave --link out",
        )
    board = find_usb_board(Path(link.address.removeprefix("serial:")) if link else None)
    write_rule(board)
    if udevadm := shutil.which("udevadm"):
        subprocess.run([udevadm, "control", "--reload"], check=False)
    if options.json:
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
