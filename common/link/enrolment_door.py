"""Where a board lets in hosts that it does not know yet: the ports after its secured links' own, open only while that is wanted.

The door is wanted while no host is known at all, and while the owner's `board-agent pair` asks for it. That command asks over a socket in the
key folder, which only the owner can reach. All links of a board share one door, one code and one count of tries. It understands nothing but
the words of pairing. A stranger gets one guess at a code there, and costs one line in the log.

Rule: only that command is told the code. No log line contains one: more people read logs than may let a host in.
"""

import logging
import os
import socket
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import astuple, dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Final, assert_never

import msgpack
import zmq
from zmq.utils import z85

from common import now
from common.errors import ProtocolError, SettingsError, TandemError
from common.keys import KeyFolder
from common.link.callers import Call, Callers, Left, Nonsense, Said
from common.link.curve import Guard, Seldom
from common.link.waiter import Inbox
from common.peers import Peer, clean_name
from common.program.logs import event
from common.protocol.enrolment_code import Desk, Enrolled, Failed, Output, Say, ShowCode, code_text
from common.protocol.enrolment_words import Denial, Identity, Refuse

_LOG = logging.getLogger(__name__)

_NOW: Final = int(zmq.DONTWAIT)
_LOOK_NS: Final = 1_000_000_000
"""Time between two checks whether the door should be open."""

_OWNER_NS: Final = 3_000_000_000
"""`board-agent pair` reports every half second that it is still there. The door closes a moment after it has gone."""

_LAST_PORT: Final = 65535

CONTROL_PREFIX: Final = "pairing-"
_NAME_DIGITS: Final = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class DoorState:
    """What `board-agent pair` is told.

    Attributes:
        address: the links that this door belongs to.
        code: what to type on the host now.
        asking: name of the host that asked last; empty if none.
        paired: name of the host that was let in last since the command began; empty if none.
        failed: number of failed attempts since then.
        problem: why the door cannot be opened; empty if it is open.
    """

    address: str
    code: str
    asking: str
    paired: str
    failed: int
    problem: str = ""

    def encode(self) -> bytes:
        """Encode the state."""
        packed: bytes = msgpack.packb(astuple(self))
        return packed

    @staticmethod
    def decode(packed: bytes) -> "DoorState":
        """Decode a state. The owner's terminal shows it, but the service may have been taken over, so nothing in it may control a terminal.

        Raises:
            ProtocolError: these bytes are not a state.
        """
        try:
            fields = msgpack.unpackb(packed)
        except (ValueError, msgpack.UnpackException):
            fields = ()
        kinds = [str, str, str, str, int, str]
        if not isinstance(fields, list) or [type(value) for value in fields] not in (kinds, kinds[:-1]):
            raise ProtocolError("that is no state of a door", "update the board's programs")
        if not all(value.isprintable() for value in fields if isinstance(value, str)):
            raise ProtocolError("a state of a door would command a terminal", "look at who runs the board's service")
        address, code, asking, paired, failed, *problem = fields
        return DoorState(
            address=address, code=code, asking=asking, paired=paired, failed=failed, problem="".join(problem)
        )


class Door:
    """Lets in new hosts.

    Args:
        context: context of a link's sockets.
        links: the secured links' bound addresses, `tcp://ADDRESS:PORT`.
        keys: the board's keys; a host that has proved the code is added there.
        guard: knows whether any host is known; it lets in the added one.

    Raises:
        SettingsError: a link has no port after its own.
        DataError: the key files are bad.
        UnavailableError: they cannot be used.
    """

    def __init__(
        self, context: "zmq.Context[zmq.Socket[bytes]]", links: Sequence[str], keys: KeyFolder, guard: Guard
    ) -> None:
        self._keys, self._guard = keys, guard
        self._addresses = [pairing_address(link) for link in links]
        name = clean_name(socket.gethostname())
        self._desk = Desk(Identity(z85.decode(keys.own().public.encode()), name), os.urandom)
        self._callers = Callers(self._desk.is_proving)
        self._control = context.socket(zmq.ROUTER)
        self._control.setsockopt(zmq.LINGER, 0)
        # The name reveals nothing and is short: a socket's path has 107 bytes (unix(7)), most of which the folder may take.
        self._bind_control(
            keys.path / f"{CONTROL_PREFIX}{sha256(_as_given(links[0]).encode()).hexdigest()[:_NAME_DIGITS]}"
        )
        self._inbox = Inbox(self._control)
        self._is_open = False
        self._owner_until_ns = 0
        self._state = self._before = DoorState(
            address=", ".join(map(_as_given, links)), code="", asking="", paired="", failed=0
        )
        self._told_code = -1
        self._askers, self._strangers, self._troubles = Seldom(), Seldom(), Seldom()
        self.due_ns = 0

    @property
    def pollables(self) -> tuple[Callers, Inbox]:
        """What to wait on."""
        return self._callers, self._inbox

    def answer(self) -> None:
        """Do everything that is due now."""
        now_ns = now.monotonic_ns()
        if self._inbox.may_have and self._inbox.has_news():
            self._hear_owner(now_ns)
        for call in self._callers.receive(now_ns):
            self._hear(call, now_ns)
        if now_ns >= self.due_ns:
            self.due_ns = now_ns + _LOOK_NS
            for call in self._callers.tick(now_ns):
                self._hear(call, now_ns)
            self._do(self._desk.tick(now_ns), "", now_ns)
            self._open_or_close(now_ns)

    def close(self) -> None:
        """Hang up on everybody."""
        self._callers.close()

    def _hear_owner(self, now_ns: int) -> None:
        """Answer `board-agent pair`, which opens the door and, when it starts, ends a pause."""
        if now_ns >= self._owner_until_ns:
            self._desk.pardon()
            self._state = self._before
        self._owner_until_ns = now_ns + _OWNER_NS
        self._open_or_close(now_ns)
        self._state = replace(self._state, code=code_text(self._desk.code(now_ns)) if self._is_open else "")
        while self._control.poll(0):
            connection = self._control.recv_multipart(_NOW)[0]
            with suppress(zmq.ZMQError):  # already gone
                self._control.send_multipart([connection, self._state.encode()], _NOW)

    def _open_or_close(self, now_ns: int) -> None:
        wanted = now_ns < self._owner_until_ns or self._guard.knows_nobody()
        if wanted == self._is_open:
            return
        addresses = ", ".join(
            _as_given(f"tcp://{f'[{host}]' if ':' in host else host}:{port}") for host, port in self._addresses
        )
        try:
            if wanted:
                self._callers.listen(self._addresses)
            else:
                self._callers.shut()
        except OSError as error:
            self._state = replace(self._state, problem=f"{addresses} cannot be used ({os.strerror(error.errno or 0)})")
            if self._troubles.now(now_ns):
                _LOG.warning(event("pairing_impossible", address=addresses, problem=os.strerror(error.errno or 0)))
            return
        self._is_open = wanted
        self._state = replace(self._state, problem="")
        _LOG.info(event("pairing_open" if wanted else "pairing_closed", address=addresses))

    def _hear(self, call: Call, now_ns: int) -> None:
        match call:
            case Said(connection, address, word):
                self._do(self._desk.receive(connection, word, now_ns), address, now_ns)
            case Left(connection):
                self._do(self._desk.receive(connection, Refuse(Denial.CLOSED), now_ns), "", now_ns)
            case Nonsense(_, address, problem):
                if self._strangers.now(now_ns):
                    count = self._strangers.count
                    _LOG.warning(event("pairing_garbage", address=address, count=count, problem=problem))
            case _:
                assert_never(call)

    def _do(self, outputs: list[Output], address: str, now_ns: int) -> None:
        for output in outputs:
            match output:
                case Say(connection, word):
                    self._callers.say(connection, word)
                case ShowCode(code, name):
                    self._show(code, clean_name(name), address, now_ns)
                case Failed(name, pause_ns):
                    self._state = replace(self._state, code="", asking="", failed=self._state.failed + 1)
                    pause_s = pause_ns // 1_000_000_000
                    _LOG.warning(event("pairing_failed", host=clean_name(name), pause_s=pause_s))
                case Enrolled(host):
                    if not self._take_in(host, address):
                        return
                case _:
                    assert_never(output)

    def _show(self, code: int, name: str, address: str, now_ns: int) -> None:
        """Show the code to the owner's command and log who asks: at once if the code is new, rarely for further askers."""
        if self._askers.now(now_ns) or code != self._told_code:
            self._told_code = code
            self._state = replace(self._state, code=code_text(code), asking=name)
            _LOG.warning(event("pairing_asked", host=name, address=address, code="shown by sudo board-agent pair"))

    def _take_in(self, host: Identity, address: str) -> bool:
        try:
            peer = self._keys.add(Peer(name=host.name, key=z85.encode(host.key).decode(), added=now.wall_time()))
        except TandemError as error:
            _LOG.error(event("pairing_not_kept", host=clean_name(host.name), problem=error))
            return False
        self._state = replace(self._state, code="", asking="", paired=peer.name)
        self.due_ns = now.monotonic_ns() + _LOOK_NS  # let the last word leave first
        _LOG.info(event("paired", host=peer.name, address=address))
        return True

    def _bind_control(self, path: Path) -> None:
        before = os.umask(0o177)  # for its owner only
        try:
            with self._keys.with_owners_rights():
                self._control.bind(f"ipc://{path}")
        except zmq.ZMQError as error:
            remedy = "choose another folder with --keys, of a shorter path if it is too long"
            _LOG.warning(event("pair_command_off", path=path, problem=error.strerror, remedy=remedy))
        finally:
            os.umask(before)


def pairing_address(link: str) -> tuple[str, int]:
    """Where a secured link's board lets in new hosts: the port after the link's own.

    Args:
        link: its address, `tcp://HOST:PORT`.

    Raises:
        SettingsError: there is no such port.
    """
    host, _, port = link.removeprefix("tcp://").rpartition(":")
    if int(port) >= _LAST_PORT:
        raise SettingsError(f"{link} leaves no free port for pairing", f"choose one below {_LAST_PORT}")
    return host.strip("[]"), int(port) + 1


def _as_given(link: str) -> str:
    """A bound link as people write it: a star stands for all interfaces."""
    return link.replace("[::]", "*").replace("0.0.0.0", "*")  # noqa: S104 - only to show it
