"""Which board `phone-host run` means when nobody said: the last one, the one on the USB cable, one on this machine, else one that the network knows.

Only what greets as ZeroMQ does counts as a board's port; whether it is the right board its key decides, not an answer on the network.
"""

import ipaddress
import socket
import sys
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common import now
from common.errors import TandemError, UnavailableError
from common.files import opened_folder, read_file, replacing_in

SERVICE: Final = "_tandemscan._tcp.local."
"""As deploy/board/tandemscan.service.xml announces it."""

GADGET: Final = "tcp://192.168.7.2:5555"
"""A BeagleBone on its USB cable."""

THIS_MACHINE: Final = "tcp://127.0.0.1:5555"

_LAST_FILE: Final = "last-board"
_MOST_BYTES: Final = 4096
_ANSWER_S: Final = 0.7
"""A board on a cable or in the same house answers within a few ms; a lost first packet of TCP is repeated after a second, and met next time."""

_LISTEN_S: Final = 2.5
"""A second question follows the first one after a second, and answers are delayed by up to 120 ms (RFC 6762, sections 5.2 and 6)."""

_GREETING_BYTES: Final = 10


@dataclass(frozen=True, slots=True)
class Found:
    """A board that answers.

    Attributes:
        name: for people; empty where nobody told it.
        link: its link.
    """

    name: str
    link: str


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


def find_aloud(state: Path, wait_s: float | None) -> str:
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
    try:
        import zeroconf  # noqa: F401, PLC0415 - optional
    except ImportError:
        return ", for which the package zeroconf is missing"
    return ""


def _announced() -> list[Found]:
    """Listen for boards that announce themselves, by name."""
    try:
        from zeroconf import ServiceBrowser, ServiceStateChange, Zeroconf  # noqa: PLC0415 - optional, slow to load
    except ImportError:
        threading.Event().wait(_LISTEN_S)
        return []
    names: set[str] = set()

    def heard(*, name: str, state_change: ServiceStateChange, **_: object) -> None:
        if state_change is ServiceStateChange.Added:
            names.add(name)

    try:
        network = Zeroconf()
    except OSError:  # no network at all
        threading.Event().wait(_LISTEN_S)
        return []
    with closing(network):
        ServiceBrowser(network, SERVICE, handlers=[heard])
        threading.Event().wait(_LISTEN_S)
        found = []
        for name in sorted(names):
            info = network.get_service_info(SERVICE, name, timeout=round(_LISTEN_S * 1000))
            for address in info.parsed_addresses() if info else ():
                if info is not None and info.port and not _needs_scope(address):
                    host = f"[{address}]" if ":" in address else address
                    found.append(Found(name.removesuffix(f".{SERVICE}"), f"tcp://{host}:{info.port}"))
                    break
    return found


def _needs_scope(address: str) -> bool:
    """Whether an address means nothing without the name of a network card, which a link cannot give."""
    read = ipaddress.ip_address(address.partition("%")[0])
    return read.version == 6 and read.is_link_local
