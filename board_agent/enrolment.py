"""What `board-agent pair` does: asks the running agent to let in a new host, and follows the outcome.

Rule: before it touches the folder's content, root takes on the rights of the folder's owner, for good: ZeroMQ connects in its own thread,
whenever it likes. The answer comes from that owner's process, so only its printable content is believed.
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
from common.keys import SERVICE_FOLDER, KeyFolder
from common.link.enrolment_door import CONTROL_PREFIX, DoorState

_LONGEST_FOLDER_BYTES: Final = 107 - len("/pairing-12345678")
"""What unix(7) leaves for a socket's folder."""

_ASK_NS: Final = 500_000_000
_SILENCE_NS: Final = 5_000_000_000
"""An agent on the smallest board answers within one round of its loop, at most a second."""

_MOST_AGENTS: Final = 16
_MOST_BYTES: Final = 4096
"""Anything longer is not a door's state: it has addresses of 16 links and names of 64 letters."""

NOBODY: Final = DoorState(address="", code="", asking="", paired="", failed=0)
"""No agent answers: none is running, or it waits for its camera and has not opened a link yet."""


def follow(keys: KeyFolder, seconds: float) -> Iterator[DoorState]:
    """Keep the door open and yield its state whenever it changes, until a host is let in. Wait for an agent that is not there yet.

    Args:
        keys: the running agent's folder.
        seconds: how long to wait for a host.

    Returns:
        States; NOBODY whenever no agent answers any more.

    Raises:
        UnavailableError: no agent with a secured link uses this folder, or no host came.
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
    """The error to report while nobody answers."""
    if len(os.fsencode(keys.path)) > _LONGEST_FOLDER_BYTES:
        return UnavailableError(
            f"the path {keys.path} is too long for a socket in it",
            "choose a shorter one with --keys, and use it for the service, too",
        )
    problem = f"no running board-agent with a secured link uses the keys in {keys.path}"
    if keys.path == SERVICE_FOLDER:
        return UnavailableError(
            problem,
            "look at `systemctl status board-agent`: it must run, with a camera, and with a link such as tcp://*:5555",
        )
    return UnavailableError(
        problem,
        "start one with `board-agent run --camera v4l2:auto --link 'tcp://*:5555'`; for links on 127.0.0.1 nothing needs pairing",
    )


def _is_socket(path: Path) -> bool:
    with suppress(OSError):
        return stat.S_ISSOCK(path.lstat().st_mode)
    return False


class _Agents:
    """The running agents that use a key folder: usually one."""

    def __init__(self, context: "zmq.Context[zmq.Socket[bytes]]", keys: KeyFolder) -> None:
        self._context, self._keys = context, keys
        self._poller = zmq.Poller()
        self._sockets: dict[Path, zmq.Socket[bytes]] = {}

    @property
    def are_none(self) -> bool:
        """Whether no agent's socket has been found."""
        return not self._sockets

    def ask(self) -> None:
        """Ask all agents that are there now to keep their doors open."""
        if not self._keys.become_owner():
            return
        for path in self._keys.path.glob(f"{CONTROL_PREFIX}*"):
            if path not in self._sockets and len(self._sockets) < _MOST_AGENTS and _is_socket(path):
                sock = self._sockets[path] = self._context.socket(zmq.DEALER)
                sock.setsockopt(zmq.LINGER, 0)
                sock.setsockopt(zmq.MAXMSGSIZE, _MOST_BYTES)
                sock.setsockopt(zmq.IMMEDIATE, 1)  # queue nothing for an agent that has gone
                sock.connect(f"ipc://{path}")
                self._poller.register(sock, zmq.POLLIN)
        for sock in self._sockets.values():
            if sock.poll(0, zmq.POLLOUT):
                sock.send(b"", zmq.DONTWAIT)

    def answers(self, until_ns: int) -> Iterator[DoorState]:
        """Yield their answers until then."""
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
            if len(shown) > _MOST_AGENTS:  # they are making addresses up
                shown.clear()
            if shown.get(state.address) != state:
                shown[state.address] = state
                yield state
        if not is_told and (agents.are_none or now.monotonic_ns() - silent_since_ns > _SILENCE_NS):
            is_told = True
            shown.clear()
            yield NOBODY
