"""What `board-agent pair` does: asks the running agent to take in a new host, and follows what becomes of it.

Rule: root gives up its rights for those of the folder's owner before it touches what lies there, for good: ZeroMQ connects in a thread of its
own, whenever it likes. What answers is that owner's process, and no more is believed of it than what can be printed.
"""

import os
import stat
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

import zmq

from common import now
from common.errors import ProtocolError, UnavailableError
from common.keys import KeyFolder
from common.link.enrolment_door import CONTROL_PREFIX, DoorState

_LONGEST_FOLDER_BYTES: Final = 107 - len("/pairing-12345678")
"""What unix(7) leaves for the folder of a socket."""

_ASK_NS: Final = 500_000_000
_SILENCE_NS: Final = 5_000_000_000
"""An agent on the smallest board answers within one round of its loop, a second at most."""

_MOST_AGENTS: Final = 16
_MOST_BYTES: Final = 4096
"""More is no state of a door: addresses of 16 links and names of 64 letters."""

NOBODY: Final = DoorState(address="", code="", asking="", paired="", failed=0)
"""No agent answers: none is running, or it waits for its camera and has opened no link yet."""


def follow(keys: KeyFolder, seconds: float) -> Iterator[DoorState]:
    """Keep the door open and give its state whenever that has changed, until a host was taken in. An agent that is not there yet is waited for.

    Args:
        keys: the running agent's folder.
        seconds: for so long; then it ends without a host.

    Returns:
        States; NOBODY whenever no agent answers any more.

    Raises:
        UnavailableError: no agent with a secured link uses this folder, or nobody came.
    """
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    state = NOBODY
    try:
        for state in _follow(_Agents(context, keys), now.monotonic_ns() + round(seconds * 1e9)):
            yield state
            if state.paired:
                return
    finally:
        context.destroy(linger=0)
    if state == NOBODY:
        raise absence(keys)
    raise UnavailableError(
        f"no host paired within {seconds:g} s",
        "run `phone-host pair --link tcp://BOARD:5555` on the host, then try again",
    )


def absence(keys: KeyFolder) -> UnavailableError:
    """What is wrong while nobody answers."""
    if len(os.fsencode(keys.path)) > _LONGEST_FOLDER_BYTES:
        return UnavailableError(
            f"the path {keys.path} is too long for a socket in it",
            "choose a shorter one with --keys, and use it for the service, too",
        )
    return UnavailableError(
        f"no running board-agent with a secured link uses the keys in {keys.path}",
        "start it with a link such as tcp://*:5555 and a camera plugged in; for the service use sudo",
    )


def _is_socket(path: Path) -> bool:
    with suppress(OSError):
        return stat.S_ISSOCK(path.lstat().st_mode)
    return False


class _Agents:
    """The running agents that use a folder of keys: one, as a rule.

    Args:
        context: of the sockets.
        keys: the folder.
    """

    def __init__(self, context: "zmq.Context[zmq.Socket[bytes]]", keys: KeyFolder) -> None:
        self._context, self._keys = context, keys
        self._poller = zmq.Poller()
        self._sockets: dict[Path, zmq.Socket[bytes]] = {}

    @property
    def are_none(self) -> bool:
        """Whether none has left a sign of itself."""
        return not self._sockets

    def ask(self) -> None:
        """Ask all that there are now to keep their doors open."""
        if not self._keys.become_owner():
            return
        for path in self._keys.path.glob(f"{CONTROL_PREFIX}*"):
            if path not in self._sockets and len(self._sockets) < _MOST_AGENTS and _is_socket(path):
                sock = self._sockets[path] = self._context.socket(zmq.DEALER)
                sock.setsockopt(zmq.LINGER, 0)
                sock.setsockopt(zmq.MAXMSGSIZE, _MOST_BYTES)
                sock.setsockopt(zmq.IMMEDIATE, 1)  # nothing is kept for an agent that has gone
                sock.connect(f"ipc://{path}")
                self._poller.register(sock, zmq.POLLIN)
        for sock in self._sockets.values():
            if sock.poll(0, zmq.POLLOUT):
                sock.send(b"", zmq.DONTWAIT)

    def answers(self, until_ns: int) -> Iterator[DoorState]:
        """Give what they say until then."""
        while (left_ns := until_ns - now.monotonic_ns()) > 0:
            ready = dict(self._poller.poll(left_ns // 1_000_000 + 1))
            for sock in ready:
                try:
                    state = DoorState.decode(sock.recv(zmq.DONTWAIT))
                except ProtocolError:
                    continue
                yield state


def _follow(agents: _Agents, deadline_ns: int) -> Iterator[DoorState]:
    shown: dict[str, DoorState] = {}
    silent_since_ns = now.monotonic_ns()
    is_told = False
    while (now_ns := now.monotonic_ns()) < deadline_ns:
        agents.ask()
        for state in agents.answers(now_ns + _ASK_NS):
            silent_since_ns, is_told = now.monotonic_ns(), False
            if len(shown) > _MOST_AGENTS:  # they make addresses up
                shown.clear()
            if shown.get(state.address) != state:
                shown[state.address] = state
                yield state
        if not is_told and (agents.are_none or now.monotonic_ns() - silent_since_ns > _SILENCE_NS):
            is_told = True
            shown.clear()
            yield NOBODY
