"""Where a board takes in hosts that it does not know yet: the port behind a secured link's own, open only while that is wanted.

It is wanted while no host is known at all, and while the owner's `board-agent pair` asks for it over a socket in the folder of keys, which
only the owner can reach. The port speaks ZeroMQ without keys and understands nothing but the words of pairing; a stranger there gets one
guess at a code, and costs a line in the log.
"""

import logging
import os
import socket
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, assert_never

import msgpack
import zmq
from zmq.utils import z85

from common import now
from common.errors import ProtocolError, SettingsError, TandemError
from common.keys import KeyFolder, Peer, clean_name
from common.link.curve import Guard, Seldom
from common.link.wait import is_readable
from common.logs import event
from common.protocol.pairing_code import (
    Desk,
    Failed,
    Identity,
    Output,
    Paired,
    Say,
    ShowCode,
    code_text,
)
from common.protocol.pairing_wire import MAX_WORD_BYTES, decode_word, encode_word
from common.protocol.zap import plain_address

_LOG = logging.getLogger(__name__)

_NOW: Final = int(zmq.DONTWAIT)
_LOOK_NS: Final = 1_000_000_000
"""Between two looks at whether the door should be open."""

_OWNER_NS: Final = 3_000_000_000
"""`board-agent pair` says that it is still there every half second; a moment after it has gone the door closes."""

_AT_ONCE: Final = 32
"""Words taken in one round of the poll loop: a flood of them must not hold up frames."""

_HANDSHAKE_MS: Final = 3000
_LINGER_MS: Final = 500

_LAST_PORT: Final = 65535

CONTROL_PREFIX: Final = "pairing-"


@dataclass(frozen=True, slots=True)
class DoorState:
    """What `board-agent pair` is told.

    Attributes:
        address: the link that this is the door of; a board may have several, each with a code of its own.
        code: what to type on the host now.
        asking: name of the host that has asked and must now prove the code; empty if none.
        paired: name of the host that was taken in last since the command began; empty if none.
        failed: attempts that came to nothing since then.
    """

    address: str
    code: str
    asking: str
    paired: str
    failed: int

    def encode(self) -> bytes:
        """Its bytes."""
        packed: bytes = msgpack.packb([self.address, self.code, self.asking, self.paired, self.failed])
        return packed

    @staticmethod
    def decode(packed: bytes) -> "DoorState":
        """Read it; from the own service only."""
        address, code, asking, paired, failed = msgpack.unpackb(packed)
        return DoorState(address, code, asking, paired, failed)


class Door:
    """Takes in hosts.

    Args:
        context: of the link's sockets.
        address: the link's own, `tcp://HOST:PORT`.
        keys: the board's key; a host that has proved the code is added there.
        guard: knows whether any host is known; it lets in the one that is added.

    Raises:
        SettingsError: there is no port behind the link's own.
        DataError: the files of keys are bad.
        UnavailableError: they cannot be used.
    """

    def __init__(self, context: "zmq.Context[zmq.Socket[bytes]]", address: str, keys: KeyFolder, guard: Guard) -> None:
        self._keys, self._guard = keys, guard
        self._address = pairing_address(address)
        name = clean_name(socket.gethostname())
        self._desk = Desk(Identity(z85.decode(keys.own().public.encode()), name), os.urandom)
        self._socket = _socket(context, MAX_WORD_BYTES)
        self._control = _socket(context, MAX_WORD_BYTES)
        self._bind_control(keys.path / f"{CONTROL_PREFIX}{clean_name(address.removeprefix('tcp://'))}")
        self._is_open = False
        self._bound = ""
        self._owner_until_ns = 0
        self._state = self._before = DoorState(address, "", "", "", 0)
        self._strangers, self._troubles = Seldom(), Seldom()
        self.due_ns = 0

    @property
    def pollables(self) -> "tuple[zmq.Socket[bytes], zmq.Socket[bytes]]":
        """The sockets to wait on."""
        return self._socket, self._control

    def answer(self) -> None:
        """Do all that is to be done now."""
        now_ns = now.monotonic_ns()
        if is_readable(self._control):
            self._hear_owner(now_ns)
        if is_readable(self._socket):
            self._hear_hosts(now_ns)
        if now_ns >= self.due_ns:
            self.due_ns = now_ns + _LOOK_NS
            self._do(self._desk.tick(now_ns), "")
            self._open_or_close(now_ns)

    def _hear_owner(self, now_ns: int) -> None:
        """Answer `board-agent pair`; it opens the door, and ends a pause when it comes."""
        if now_ns >= self._owner_until_ns:
            self._desk.pardon()
            self._state = self._before
        self._owner_until_ns = now_ns + _OWNER_NS
        self._open_or_close(now_ns)
        self._state = replace(self._state, code=code_text(self._desk.code(now_ns)))
        while self._control.poll(0):
            connection = self._control.recv_multipart(_NOW)[0]
            self._control.send_multipart([connection, self._state.encode()], _NOW)

    def _open_or_close(self, now_ns: int) -> None:
        wanted = now_ns < self._owner_until_ns or self._guard.knows_nobody()
        if wanted == self._is_open:
            return
        try:
            if wanted:
                self._socket.bind(self._address)
                self._bound = self._socket.getsockopt_string(zmq.LAST_ENDPOINT)  # `*` is unbound by what it became
            else:
                self._socket.unbind(self._bound)
        except zmq.ZMQError as error:
            if self._troubles.now(now_ns):
                _LOG.warning(event("pairing_impossible", address=self._address, problem=error.strerror))
            return
        self._is_open = wanted
        _LOG.info(event("pairing_open" if wanted else "pairing_closed", address=self._address))

    def _hear_hosts(self, now_ns: int) -> None:
        for _ in range(_AT_ONCE):
            if not self._socket.poll(0):
                return
            connection, *parts = self._socket.recv_multipart(_NOW, copy=False)
            address = _peer_address(connection)
            try:
                if len(parts) != 1:
                    raise ProtocolError(f"{len(parts)} parts", "")
                word = decode_word(parts[0].bytes)
            except ProtocolError as error:
                if self._strangers.now(now_ns):
                    count = self._strangers.count
                    _LOG.warning(event("pairing_garbage", address=address, count=count, problem=error.problem))
            else:
                self._do(self._desk.receive(connection.bytes, word, now_ns), address)

    def _do(self, outputs: list[Output], address: str) -> None:
        for output in outputs:
            match output:
                case Say(connection, word):
                    with suppress(zmq.ZMQError):  # gone, or does not read
                        self._socket.send_multipart([connection, encode_word(word)], _NOW)
                case ShowCode(code, name):
                    self._state = replace(self._state, code=code_text(code), asking=clean_name(name))
                    _LOG.warning(event("pairing_code", code=code_text(code), host=clean_name(name), address=address))
                case Failed(name, pause_ns):
                    self._state = replace(self._state, code="", asking="", failed=self._state.failed + 1)
                    pause_s = pause_ns // 1_000_000_000
                    _LOG.warning(event("pairing_failed", host=clean_name(name), pause_s=pause_s))
                case Paired(host):
                    if not self._take_in(host, address):
                        return
                case _:
                    assert_never(output)

    def _take_in(self, host: Identity, address: str) -> bool:
        try:
            peer = self._keys.add(Peer(host.name, z85.encode(host.key).decode(), now.wall_time()))
        except TandemError as error:
            _LOG.error(event("pairing_not_kept", host=clean_name(host.name), problem=error))
            return False
        self._state = replace(self._state, code="", asking="", paired=peer.name)
        self.due_ns = now.monotonic_ns() + _LOOK_NS  # the last word leaves first
        _LOG.info(event("paired", host=peer.name, address=address))
        return True

    def _bind_control(self, path: Path) -> None:
        before = os.umask(0o177)  # for its owner only
        try:
            self._control.bind(f"ipc://{path}")
        except zmq.ZMQError as error:
            _LOG.warning(event("pair_command_off", path=path, problem=error.strerror))
        finally:
            os.umask(before)


def pairing_address(address: str) -> str:
    """Where a secured link's board takes in new hosts: the port behind the link's own.

    Args:
        address: the link's, `tcp://HOST:PORT`.

    Raises:
        SettingsError: there is no such port.
    """
    port = _port(address)
    if port >= _LAST_PORT:
        raise SettingsError(f"{address} leaves no port for pairing", f"choose one below {_LAST_PORT}")
    return f"{address.rpartition(':')[0]}:{port + 1}"


def _port(address: str) -> int:
    return int(address.rpartition(":")[2])


def _socket(context: "zmq.Context[zmq.Socket[bytes]]", most_bytes: int) -> "zmq.Socket[bytes]":
    sock = context.socket(zmq.ROUTER)
    for option, value in (
        (zmq.MAXMSGSIZE, most_bytes),
        (zmq.SNDHWM, 4),
        (zmq.RCVHWM, 4),
        (zmq.LINGER, _LINGER_MS),
        (zmq.HANDSHAKE_IVL, _HANDSHAKE_MS),
        (zmq.HEARTBEAT_IVL, _HANDSHAKE_MS),
        (zmq.HEARTBEAT_TIMEOUT, _HANDSHAKE_MS),
        (zmq.IPV6, 1),
    ):
        sock.setsockopt(option, value)
    return sock


def _peer_address(part: zmq.Frame) -> str:
    try:
        return plain_address(str(part.get("Peer-Address")))
    except zmq.ZMQError:
        return "unknown"
