"""Finds a board for `phone-host run` without --link.

It tries the last board, one on this machine's documented ipc socket, the board on the USB cable, one on this machine's port, one whose own Wi-Fi this machine is in, and then
one that announces itself on the network. Only a port with ZeroMQ's greeting counts as a board's port. The key, not an answer on the network, decides
whether it is the right board.
"""

import os
import socket
import sys
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from common import now
from common.android import is_android
from common.errors import TandemError, UnavailableError
from common.files import opened_folder, read_file, replacing_in
from phone_host.discovery.found import LISTEN_S, Found
from phone_host.discovery.udev_rule import find_usb_board

GADGET: Final = "tcp://192.168.7.2:5555"
"""A BeagleBone on its USB cable."""

ACCESS_POINT: Final = "tcp://10.42.0.1:5555"
"""A board that is its own Wi-Fi, as NetworkManager makes it."""

THIS_MACHINE: Final = "tcp://127.0.0.1:5555"

_NEAR: Final = (GADGET, THIS_MACHINE, ACCESS_POINT)

_SOCKET: Final = "board"
"""Name of the socket in $XDG_RUNTIME_DIR that docs/links.md gives to a board on the same machine."""

_LAST_FILE: Final = "last-board"
_MOST_BYTES: Final = 4096
_ANSWER_S: Final = 0.7
"""A board on a cable or in the same house answers within a few ms.

TCP repeats a lost first packet after a second; the next round then finds the board."""

_GREETING_BYTES: Final = 10


def find_board(state: Path, now_s: Callable[[], float], wait_s: float | None) -> str:
    """Look for a board until there is one.

    Args:
        state: the folder in which the last board is remembered.
        now_s: a steady clock, s.
        wait_s: how long to look; None: for ever.

    Raises:
        UnavailableError: no board was found in time, or there are several.
    """
    deadline_s = float("inf") if wait_s is None else now_s() + wait_s
    while True:
        near = _near(state)
        if there := answering(near):
            return there[0]
        announced = _announced()
        alive = set(answering([board.link for board in announced]))
        boards = [board for board in announced if board.link in alive]
        if len(boards) == 1:
            return boards[0].link
        if boards:
            listed = ", ".join(f"{board.name} at {board.link}" for board in boards)
            raise UnavailableError(f"{len(boards)} boards answer ({listed})", "choose one with --link")
        if now_s() >= deadline_s:
            tried = ", ".join(near)
            raise UnavailableError(f"no board answers at {tried}, nor by mDNS{_why_not()}", "start it, or give --link")


def find_board_and_say(state: Path, wait_s: float | None) -> str:
    """Call `find_board`, and report the search and the result on stderr."""
    sys.stderr.write("phone-host: looking for a board (--link names one)\n")
    link = find_board(state, lambda: now.monotonic_ns() / 1e9, wait_s)
    sys.stderr.write(f"phone-host: found {link}\n")
    return link


def list_boards(state: Path) -> list[Found]:
    """Look once everywhere, for some seconds; return each board that answers."""
    announced = _announced()
    names = {board.link: board.name for board in announced}
    asked = tuple(dict.fromkeys((*_near(state), *names)))
    found = [Found(names.get(link, ""), link) for link in answering(asked)]
    with suppress(TandemError):
        found.append(Found("board on the USB cable", f"serial:/dev/{find_usb_board(None).device}"))
    return found


def remember(state: Path, link: str) -> None:
    """Remember a board for the next time. Write errors are ignored."""
    with (
        suppress(OSError, UnavailableError),
        opened_folder(state, make=True) as folder,
        replacing_in(folder, _LAST_FILE, mode=0o600, durable=False) as file,
    ):
        file.write(f"{link}\n".encode())


def answering(links: Sequence[str]) -> list[str]:
    """Return those of the tcp and ipc links that answer with ZeroMQ's greeting, in the same order."""
    if not links:
        return []
    with ThreadPoolExecutor(min(16, len(links))) as pool:
        return [link for link, greets in zip(links, pool.map(_greets, links), strict=True) if greets]


def _near(state: Path) -> tuple[str, ...]:
    """Return the links to try before the network: the last board's, this machine's, those of a cable and of a board's own Wi-Fi."""
    return tuple(dict.fromkeys((*remembered(state), *_sockets(), *_NEAR)))


def _sockets() -> list[str]:
    """Return the ipc link to a board on this machine, if its socket exists."""
    path = Path(os.environ.get("XDG_RUNTIME_DIR", "")) / _SOCKET
    with suppress(OSError):
        if path.is_absolute() and path.is_socket():
            return [f"ipc://{path}"]
    return []


def remembered(state: Path) -> list[str]:
    """Return the link of the last board, as `remember` has kept it; none, or none that is one: empty."""
    try:
        with opened_folder(state) as folder:
            text = read_file(folder, state / _LAST_FILE, _MOST_BYTES)[0].decode().strip()
    except (OSError, UnicodeDecodeError, TandemError):
        return []
    host, _, port = text.removeprefix("tcp://").rpartition(":")
    return [text] if text.startswith("tcp://") and host and port.isascii() and port.isdigit() else []


def _greets(link: str) -> bool:
    """Return whether ZMTP's signature comes (RFC 23: ff, eight bytes, 7f), which both sides send unasked."""
    greeting = b""
    with suppress(OSError, OverflowError), _connected(link) as probe:
        while len(greeting) < _GREETING_BYTES and (part := probe.recv(_GREETING_BYTES - len(greeting))):
            greeting += part
    return len(greeting) == _GREETING_BYTES and greeting[0] == 0xFF and greeting[-1] == 0x7F


def _connected(link: str) -> socket.socket:
    """Connect to a tcp or ipc link.

    Raises:
        OSError: nobody listens there.
    """
    if link.startswith("ipc://"):
        probe = socket.socket(socket.AF_UNIX)
        probe.settimeout(_ANSWER_S)
        try:
            probe.connect(link.removeprefix("ipc://"))
        except OSError:
            probe.close()
            raise
        return probe
    host, _, port = link.removeprefix("tcp://").rpartition(":")
    return socket.create_connection((host.strip("[]"), int(port)), _ANSWER_S)


def _why_not() -> str:
    if is_android():
        return ", which Android keeps from Termux"
    return "" if find_spec("zeroconf") else ", for which the package zeroconf is missing"


def _announced() -> list[Found]:
    """Listen for boards that announce themselves. Without zeroconf, wait as long and return none."""
    try:
        from phone_host.discovery.announced import announced  # noqa: PLC0415 - zeroconf is optional, slow to load and seldom needed
    except ImportError:
        threading.Event().wait(LISTEN_S)
        return []
    return announced()
