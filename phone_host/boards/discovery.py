"""Which board `phone-host run` means when nobody said: the last one, the one on the USB cable, one on this machine, else one that the network knows.

Only what greets as ZeroMQ does counts as a board's port; whether it is the right board its key decides, not an answer on the network.
"""

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
from common.errors import TandemError, UnavailableError
from common.files import opened_folder, read_file, replacing_in
from phone_host.boards.found import LISTEN_S, Found

GADGET: Final = "tcp://192.168.7.2:5555"
"""A BeagleBone on its USB cable."""

THIS_MACHINE: Final = "tcp://127.0.0.1:5555"

_LAST_FILE: Final = "last-board"
_MOST_BYTES: Final = 4096
_ANSWER_S: Final = 0.7
"""A board on a cable or in the same house answers within a few ms; a lost first packet of TCP is repeated after a second, and met next time."""

_GREETING_BYTES: Final = 10


def find_board(state: Path, now_s: Callable[[], float], wait_s: float | None) -> str:
    """Find a board, however long it takes until there is one.

    Args:
        state: the folder in which the last board is remembered.
        now_s: a steady clock, s.
        wait_s: for so long; None: for ever.

    Returns:
        Its link.

    Raises:
        UnavailableError: there is none in time, or there are several.
    """
    deadline_s = float("inf") if wait_s is None else now_s() + wait_s
    near = tuple(dict.fromkeys((*_last(state), GADGET, THIS_MACHINE)))
    while True:
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
    """As `find_board`, telling on stderr that it looks and what it has found."""
    sys.stderr.write("phone-host: looking for a board (--link names one)\n")
    link = find_board(state, lambda: now.monotonic_ns() / 1e9, wait_s)
    sys.stderr.write(f"phone-host: found {link}\n")
    return link


def remember(state: Path, link: str) -> None:
    """Remember a board for the next time; a disk that does not take it is no matter."""
    with (
        suppress(OSError, UnavailableError),
        opened_folder(state, make=True) as folder,
        replacing_in(folder, _LAST_FILE, mode=0o600, durable=False) as file,
    ):
        file.write(f"{link}\n".encode())


def answering(links: Sequence[str]) -> list[str]:
    """Give those of some tcp links behind which somebody greets as ZeroMQ does, in their order."""
    if not links:
        return []
    with ThreadPoolExecutor(min(16, len(links))) as pool:
        return [link for link, greets in zip(links, pool.map(_greets, links), strict=True) if greets]


def _last(state: Path) -> list[str]:
    try:
        with opened_folder(state) as folder:
            text = read_file(folder, state / _LAST_FILE, _MOST_BYTES)[0].decode().strip()
    except (OSError, UnicodeDecodeError, TandemError):
        return []
    host, _, port = text.removeprefix("tcp://").rpartition(":")
    return [text] if text.startswith("tcp://") and host and port.isascii() and port.isdigit() else []


def _greets(link: str) -> bool:
    """Whether ZMTP's signature comes (RFC 23: ff, eight bytes, 7f), which both sides send unasked."""
    host, _, port = link.removeprefix("tcp://").rpartition(":")
    greeting = b""
    with suppress(OSError, OverflowError), socket.create_connection((host.strip("[]"), int(port)), _ANSWER_S) as probe:
        while len(greeting) < _GREETING_BYTES and (part := probe.recv(_GREETING_BYTES - len(greeting))):
            greeting += part
    return len(greeting) == _GREETING_BYTES and greeting[0] == 0xFF and greeting[-1] == 0x7F


def _why_not() -> str:
    return "" if find_spec("zeroconf") else ", for which the package zeroconf is missing"


def _announced() -> list[Found]:
    """Listen for boards that announce themselves; without zeroconf they get the time all the same, and are not heard."""
    try:
        from phone_host.boards.announced import announced  # noqa: PLC0415 - zeroconf is optional and slow to load, and seldom asked
    except ImportError:
        threading.Event().wait(LISTEN_S)
        return []
    return announced()
