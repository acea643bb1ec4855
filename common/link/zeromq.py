"""ZeroMQ over tcp:// and ipc://, open or with CURVE. One side binds a ROUTER, the other dials one DEALER per lane.

Frames and control thus travel on separate TCP connections, and a clock echo never waits behind image bytes. Socket options are set before
anything is accepted. A high-water mark does not bound the age of frames; credit does (session). So the marks here are only a safety limit.
"""

import os
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final

import zmq

from common import now
from common.errors import UnavailableError
from common.frame import Buffer
from common.keys import KeyFolder, OwnKey
from common.link.base import Broken, Garbage, Incoming, Packet, SendResult
from common.link.waiter import Inbox
from common.link.zeromq_address import (
    check_folder,
    check_peer,
    check_socket,
    explained,
    free_path,
    let_in,
    plain_endpoint,
    trusted_users,
)
from common.link.zeromq_socket import Dialled, bind_gated
from common.peers import Peer
from common.protocol.message import Lane
from common.protocol.wire import MAX_HEADER_BYTES, MAX_PAYLOAD_BYTES

if TYPE_CHECKING:
    from common.link.curve import Guard
    from common.link.enrolment_door import Door

_SOCKET_BUFFER_BYTES: Final = 256 * 1024
"""At most about five 50 KB JPEGs in the kernel, so that a frame is not handed over long before it can leave."""

_QUEUE_PACKETS: Final = 32
"""Packets in ZeroMQ's own queue per connection. A sound host's credit keeps it at a wave of echoes and a few frames. Each time that half of the
queue's length has passed, ZeroMQ wakes the sender, so a short queue costs a wake-up every few frames."""

_LINGER_MS: Final = 500
_GONE_S: Final = 30
_PROBE_S: Final = 5
"""TCP probes a silent machine at this interval and gives it up after _GONE_S. The session notices earlier. ZeroMQ's heartbeat is not used: it
counts only whole packets, one of which may take seconds, and with a full queue it ends the process (libzmq issues 3937, 4767: an assertion)."""

_SET_UP_MS: Final = 3000
_RECONNECT_MS: Final = 50
_RECONNECT_MAX_MS: Final = 400
"""A peer that comes back is met within this time, well below the second allowed for recovery."""

_NEVER: Final = 2**63 - 1

_COPY_BELOW_BYTES: Final = 256 * 1024
"""Below this, one memcpy into ZeroMQ's message is cheaper than pyzmq's bookkeeping for a borrowed buffer (bench_link shows it)."""

# As plain integers: pyzmq's flags are enums, whose operators cost more than the call that takes them.
_NOW: Final = int(zmq.DONTWAIT)
_NOW_AND_MORE: Final = int(zmq.DONTWAIT | zmq.SNDMORE)


def _most_bytes(*, board: bool) -> int:
    """Longest part accepted. Nobody sends images to a board, so it need only keep a few KB for a peer that floods it."""
    return MAX_HEADER_BYTES if board else max(MAX_PAYLOAD_BYTES, MAX_HEADER_BYTES)


def _configure(sock: zmq.Socket[bytes], most_bytes: int) -> None:
    for option, value in (
        (zmq.MAXMSGSIZE, most_bytes),
        (zmq.LINGER, _LINGER_MS),
        (zmq.IMMEDIATE, 1),
        (zmq.SNDHWM, _QUEUE_PACKETS),
        (zmq.RCVHWM, _QUEUE_PACKETS),
        (zmq.SNDBUF, _SOCKET_BUFFER_BYTES),
        (zmq.RCVBUF, _SOCKET_BUFFER_BYTES),
        (zmq.TCP_KEEPALIVE, 1),
        (zmq.TCP_KEEPALIVE_IDLE, _PROBE_S),
        (zmq.TCP_KEEPALIVE_INTVL, _PROBE_S),
        (zmq.TCP_KEEPALIVE_CNT, _GONE_S // _PROBE_S - 1),
        (zmq.TCP_MAXRT, 1000 * _GONE_S),
        (zmq.HANDSHAKE_IVL, _SET_UP_MS),
        (zmq.CONNECT_TIMEOUT, _SET_UP_MS),
        (zmq.RECONNECT_IVL, _RECONNECT_MS),
        (zmq.RECONNECT_IVL_MAX, _RECONNECT_MAX_MS),
        (zmq.IPV6, 1),
    ):
        sock.setsockopt(option, value)


def _send(inbox: Inbox, connection: bytes, header: bytes, payload: Buffer) -> SendResult:
    """Send a packet; on a listening socket, to the connection with this name."""
    sock, inbox.may_have = inbox.socket, True
    try:
        if connection:
            sock.send(connection, _NOW_AND_MORE)
        if not len(payload):
            sock.send(header, _NOW)
            # ZeroMQ's own thread writes to the socket. If both threads share a core, or a board has only one, that thread (and the echo) would wait
            # until this one sleeps. A yield shortens the echo's round trip by a third and makes both directions more alike (bench_clock).
            os.sched_yield()
            return SendResult.SENT
        sock.send(header, _NOW_AND_MORE)
        sock.send(payload, _NOW, copy=len(payload) < _COPY_BELOW_BYTES)
    except zmq.Again:
        return SendResult.FULL
    except zmq.ZMQError as error:
        if error.errno == zmq.EHOSTUNREACH:
            return SendResult.UNREACHABLE
        raise
    return SendResult.SENT


def _complete(sock: zmq.Socket[bytes], connection: bytes, header: zmq.Frame) -> Incoming:
    if not header.more:
        return Packet(connection, header.bytes, b"")
    payload = sock.recv(_NOW, copy=False)
    if not payload.more:
        return Packet(connection, header.bytes, payload.buffer)
    while sock.recv(_NOW, copy=False).more:
        pass
    return Garbage(connection)


class _AlwaysReady:
    """ZeroMQ works in its own thread: it needs no timed calls, and shows that it is full only when a send is tried."""

    self_paced: Final = False

    def ready(self, connection: bytes) -> bool:  # noqa: ARG002 - the contract of `Link`
        """Whether a frame would be accepted now, as far as can be known without trying."""
        return True


class ZeroMqListener(_AlwaysReady):
    """The side that binds.

    Attributes:
        router: its socket.
        due_ns: when `receive` must be called even if nothing is readable.

    Args:
        address: `tcp://HOST:PORT` (`*` for every interface) or `ipc://PATH`.
        keys: holds this side's key and those that may connect; None: anybody may.
        owner: user who, besides this user and root, may own an ipc path's folder; empty for nobody.
        board: whether this side is the board, which accepts short messages only.

    Raises:
        SettingsError: the address makes no sense.
        UnavailableError: the port or path is taken, others could replace the path, or the key folder cannot be used.
        DataError: the key files are bad.
    """

    def __init__(self, address: str, keys: KeyFolder | None = None, *, owner: str = "", board: bool = False) -> None:
        own = keys.own() if keys else None
        self.kind, _, path = address.partition("://")
        self.dialled: dict[Lane, bytes] = {}
        if self.kind == "ipc":
            check_folder(path, trusted_users(owner))
            free_path(path)
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self.router = self._context.socket(zmq.ROUTER)
        _configure(self.router, _most_bytes(board=board))
        self._guard = _guarded(self._context, self.router, keys, own) if keys and own else None
        self.router.setsockopt(zmq.ROUTER_MANDATORY, 1)  # report a vanished host instead of swallowing its frames
        before = os.umask(0o177)  # an ipc path is for its owner only
        try:
            self._gate = bind_gated(self.router, address)
        except zmq.ZMQError as error:
            self._context.destroy(linger=0)
            raise explained(address, error, "stop what listens there, or choose another with --link") from None
        finally:
            os.umask(before)
        if self.kind == "ipc" and owner:
            try:
                let_in(path, owner)
            except UnavailableError:
                self._context.destroy(linger=0)
                raise
        self.endpoint = plain_endpoint(self.router.getsockopt_string(zmq.LAST_ENDPOINT))
        self._inbox = Inbox(self.router)
        self._door: Door | None = None
        self.due_ns = _NEVER

    def open_door(self, links: Sequence[str], keys: KeyFolder) -> None:
        """Let in new hosts by a code, for all secured links of this board.

        Raises:
            SettingsError: a link has no port after its own.
            DataError: the key files are bad.
            UnavailableError: they cannot be used.
        """
        from common.link.enrolment_door import Door  # noqa: PLC0415 - as in _guarded

        assert self._guard is not None, "an open link has no door"
        self._door = Door(self._context, links, keys, self._guard)
        self._note_due()

    @property
    def pollables(self) -> Sequence[Any]:
        """The main socket, the gate, and the sockets of the guard and the door."""
        gates = (self._gate,) if self._gate else ()
        guard = (self._guard.inbox,) if self._guard else ()
        return (self._inbox, *gates, *guard, *(self._door.pollables if self._door else ()))

    def _note_due(self) -> None:
        gate_ns = self._gate.due_ns if self._gate else _NEVER
        self.due_ns = min(gate_ns, self._door.due_ns) if self._door else gate_ns

    def receive(self) -> Iterator[Incoming]:
        """Return all packets that have arrived; let in peers whose keys are known."""
        if self._gate:
            self._gate.watch()
        if self._guard:
            self._guard.answer()
        if self._door:
            self._door.answer()
        self._note_due()
        inbox, sock = self._inbox, self.router
        while inbox.may_have and inbox.invites():
            try:
                connection = sock.recv(_NOW)
            except zmq.Again:
                continue  # its descriptor was readable for something else
            header = sock.recv(_NOW, copy=False)
            packet = _complete(sock, connection, header)
            if self._guard is None or self._guard.knows(header):  # its peer may have been forgotten in the meantime
                yield packet

    def send(self, connection: bytes, header: bytes, payload: Buffer) -> SendResult:
        """Send a packet over one connection."""
        return _send(self._inbox, connection, header, payload)

    def close(self) -> None:
        """Let accepted packets leave, then close."""
        if self._door:
            self._door.close()
        if self._gate:
            self._gate.close()
        self._context.destroy(linger=_LINGER_MS)


class ZeroMqDialer(_AlwaysReady):
    """The side that connects, with one socket per lane. ZeroMQ redials by itself whenever a connection breaks.

    Attributes:
        due_ns: when `receive` must be called even if nothing is readable: to redial.

    Args:
        address: `tcp://HOST:PORT` or `ipc://PATH`.
        keys: holds this side's key; None on an open link.
        peer: the peer that must answer; None on an open link.
        owner: user who, besides this user and root, may listen at an ipc path; empty for nobody.
        board: whether this side is the board, which accepts short messages only.

    Raises:
        SettingsError: the address makes no sense.
        UnavailableError: the key folder cannot be used, or an ipc path belongs to another user.
        DataError: the key files are bad.
    """

    def __init__(
        self,
        address: str,
        keys: KeyFolder | None = None,
        peer: Peer | None = None,
        *,
        owner: str = "",
        board: bool = False,
    ) -> None:
        own = keys.own() if keys and peer else None
        self.kind, _, self._path = address.partition("://")
        self._trusted = trusted_users(owner) if self.kind == "ipc" else frozenset[int]()
        if self._trusted:
            check_socket(self._path, self._trusted)
        self.dialled = {lane: lane.name.encode() for lane in Lane}
        self._context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        self.connections: dict[bytes, Dialled] = {}
        self.due_ns = _NEVER
        for lane in (Lane.FRAMES, Lane.CONTROL):
            sock = self._context.socket(zmq.DEALER)
            _configure(sock, _most_bytes(board=board))
            if own and peer:
                from common.link.curve import secure_dialler  # noqa: PLC0415 - as in _guarded

                secure_dialler(sock, own, peer)
            try:
                connection = Dialled(sock, address, peer.name if peer else "", lane.name)
            except zmq.ZMQError as error:
                self._context.destroy(linger=0)
                raise explained(address, error, "give --link tcp://HOST:PORT or ipc://PATH") from None
            self.connections[self.dialled[lane]] = connection
        self._lanes = tuple(self.connections.items())

    @property
    def pollables(self) -> Sequence[Any]:
        """Both sockets and their monitors' descriptors. Only `receive` calls a monitor, so no other call consumes its news."""
        return tuple(item for known in self.connections.values() for item in (known.inbox, known.news))

    def receive(self) -> Iterator[Incoming]:
        """Return all packets that have arrived, frames first, then the broken connections: a peer's last words precede its end.

        Raises:
            UnavailableError: the peer refuses us, requires keys, or belongs to another user; it will be redialled later.
        """
        if self.due_ns != _NEVER:
            self._redial()
        broken: list[Broken] = []
        refused: list[UnavailableError] = []
        going_on = True
        while going_on:
            going_on = False
            for connection, known in self._lanes:  # one packet of each in turn
                inbox = known.inbox
                if inbox.may_have and inbox.invites():
                    going_on = True
                    try:
                        header = inbox.socket.recv(_NOW, copy=False)
                    except zmq.Again:
                        continue  # its descriptor was readable for something else
                    packet = _complete(inbox.socket, connection, header)
                    if self._trusted:
                        self._check(known, header)
                    yield packet
            if not going_on:
                going_on = self._hear_news(broken, refused)
        if refused:  # raised once no news is left, because a monitor does not wake anyone twice
            self._note_due()
            raise refused[-1]
        yield from broken

    def _hear_news(self, broken: list[Broken], refused: list[UnavailableError]) -> bool:
        """Note what the monitors say, one event of each; return whether there was any."""
        heard = False
        for connection, known in self._lanes:
            if known.news.may_have and known.news.has_news():
                heard = known.inbox.may_have = True  # its last words may have come since it was asked
                try:
                    if known.broke(now.monotonic_ns()):
                        broken.append(Broken(connection))
                except UnavailableError as error:
                    refused.append(error)
        return heard

    def _check(self, known: Dialled, header: zmq.Frame) -> None:
        """Hang up on a peer that belongs to a user who is not trusted."""
        try:
            check_peer(self._path, header, self._trusted)
        except UnavailableError:
            known.hang_up(now.monotonic_ns())
            self._note_due()
            raise

    def _redial(self) -> None:
        """Dial again what is due."""
        now_ns = now.monotonic_ns()
        for _, known in self._lanes:
            if now_ns >= known.due_ns:
                known.redial()
        self._note_due()

    def _note_due(self) -> None:
        self.due_ns = min(known.due_ns for _, known in self._lanes)

    def send(self, connection: bytes, header: bytes, payload: Buffer) -> SendResult:
        """Send a packet. Before the peer is there, the result is FULL (ZMQ_IMMEDIATE)."""
        return _send(self.connections[connection].inbox, b"", header, payload)

    def close(self) -> None:
        """Let accepted packets leave, then close."""
        for known in self.connections.values():
            known.inbox.socket.disable_monitor()
        self._context.destroy(linger=_LINGER_MS)


def _guarded(
    context: "zmq.Context[zmq.Socket[bytes]]", sock: "zmq.Socket[bytes]", keys: KeyFolder, own: OwnKey
) -> "Guard":
    """Make a socket that is not bound yet accept known keys only."""
    from common.link.curve import Guard, secure_listener  # noqa: PLC0415 - an open link does not pay for keys: half a second of a board's start

    secure_listener(sock, own)
    return Guard(context, keys)
