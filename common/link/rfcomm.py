"""Bluetooth RFCOMM links by the kernel's own sockets: a byte stream between two paired devices, for each of several hosts if need be.

The listener has one `StreamLink` for each device that dials, so a second host is answered (and told that the board is busy), and a host
that went out of reach does not keep the next one out. What belongs to one adapter may vanish with it and come back at any time; the listening
socket outlives it.
"""

import errno
import logging
import os
import select
import socket
import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import count
from pathlib import Path
from typing import Final
from urllib.parse import unquote

from common.errors import MissingDeviceError, SettingsError, UnavailableError
from common.frame import Buffer
from common.link.base import Broken, Garbage, Incoming, Packet, SendResult
from common.link.sdp import PSM, channel_in, query
from common.link.stream import Opening, StreamLink
from common.link.uri import LinkRequest
from common.program.logs import event
from common.protocol.framing import LinkEnd
from common.protocol.message import Lane

_LOG = logging.getLogger(__name__)

ANYONE: Final = "*"
DEFAULT_CHANNEL: Final = 1
"""Where a listener is that could not publish its channel."""

FRAME_BYTES: Final = 1008
"""Linux's RFCOMM fills frames of at most 1013 - 5 bytes (net/bluetooth/rfcomm.h, core.c); what a socket's peer has agreed to cannot be asked for.
Whole, halved and in thirds such frames also fill the radio's packets (3-DH5, 3-DH3, 2-DH3)."""

_NEVER: Final = 2**63 - 1
_ANY_ADAPTER: Final = "00:00:00:00:00:00"
_ADAPTERS: Final = Path("/sys/class/bluetooth")
_SOL_BLUETOOTH, _BT_SECURITY = 274, 4
_LEVEL_LOW, _LEVEL_MEDIUM = 1, 2
"""include/net/bluetooth/bluetooth.h: low asks for nothing; medium for encryption, which takes pairing."""

_BACKLOG: Final = 4
_MOST_HOSTS: Final = 7
"""A piconet has seven seats."""

_NO_BLUETOOTH: Final = {errno.EAFNOSUPPORT, errno.EPROTONOSUPPORT, errno.ESOCKTNOSUPPORT}
_OWN_ADAPTER: Final = {errno.EHOSTUNREACH, errno.ENETDOWN, errno.ENODEV}
_NOT_PAIRED: Final = {errno.EACCES, errno.EPERM, errno.ECONNABORTED, errno.EINVAL}


class _Protocol(Enum):
    """Type and protocol of a socket; numbers of the kernel, as a Python without Bluetooth has no names for them."""

    L2CAP = (socket.SOCK_SEQPACKET, 0)
    RFCOMM = (socket.SOCK_STREAM, 3)


@dataclass(frozen=True, slots=True)
class _RfcommLine:
    """A connected socket."""

    connected: socket.socket

    def fileno(self) -> int:
        return self.connected.fileno()

    def is_drained(self) -> bool:
        """The kernel sends what was written before it closes."""
        return True

    def discard_output(self) -> None:
        """It cannot be taken back."""

    def close(self) -> None:
        self.connected.close()


class _Stage(Enum):
    IDLE = 0
    ASKING = 1
    ASKED = 2
    DIALLING = 3


class _Dialling:
    """Opens the dialler's line, a step at each call: ask the peer for the channel if none was given, connect.

    Args:
        uri: as the user named it, for messages.
        address: the peer's.
        channel: 0: to be asked for.
        unpaired: whether a peer will do that was never paired with.
    """

    def __init__(self, uri: str, address: str, channel: int, *, unpaired: bool) -> None:
        self._uri, self._address, self._channel = uri, address, channel
        self._unpaired = unpaired
        self._socket: socket.socket | None = None
        self._stage = _Stage.IDLE
        self._published = False
        self._problem = ""

    def __call__(self) -> _RfcommLine | Opening:
        """Go on as far as it goes now."""
        try:
            return self._step()
        except OSError as error:
            self.close()
            failure = _undialled(self._uri, error, published=self._published)
            if error.errno in _OWN_ADAPTER:
                raise failure from None
            if failure.problem != self._problem:
                self._problem = failure.problem
                _LOG.warning(event("rfcomm_waiting", problem=failure.problem, remedy=failure.remedy))
            return Opening()

    def close(self) -> None:
        """Let go of what is half open."""
        if self._socket is not None:
            self._socket.close()
        self._socket, self._stage = None, _Stage.IDLE

    def _step(self) -> _RfcommLine | Opening:
        if self._socket is None:
            return self._dial(self._channel) if self._channel else self._ask()
        wanted = select.POLLIN if self._stage is _Stage.ASKED else select.POLLOUT
        poll = select.poll()
        poll.register(self._socket, wanted)
        ready = poll.poll(0)
        if not ready:
            return Opening(self._socket.fileno(), wanted)
        number = self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        if number == errno.ECONNREFUSED and self._stage is _Stage.ASKING:  # it publishes nothing at all
            self.close()
            self._published = False
            return self._dial(DEFAULT_CHANNEL)
        if number:
            raise OSError(number, os.strerror(number))
        if not ready[0][1] & wanted:
            raise ConnectionResetError(errno.ECONNRESET, os.strerror(errno.ECONNRESET))
        return self._go_on(self._socket)

    def _go_on(self, opened: socket.socket) -> _RfcommLine | Opening:
        if self._stage is _Stage.ASKING:
            opened.send(query())
            self._stage = _Stage.ASKED
            return Opening(opened.fileno(), select.POLLIN)
        if self._stage is _Stage.ASKED:
            channel = channel_in(opened.recv(65536))
            self.close()
            self._published = channel > 0
            return self._dial(channel or DEFAULT_CHANNEL)
        self._socket, self._stage, self._problem = None, _Stage.IDLE, ""
        return _RfcommLine(opened)

    def _ask(self) -> Opening:
        return self._connect(_new_socket(_Protocol.L2CAP), PSM, _Stage.ASKING)

    def _dial(self, channel: int) -> Opening:
        dialling = _new_socket(_Protocol.RFCOMM)
        _secure(dialling, unpaired=self._unpaired)
        return self._connect(dialling, channel, _Stage.DIALLING)

    def _connect(self, dialling: socket.socket, where: int, stage: _Stage) -> Opening:
        self._socket, self._stage = dialling, stage
        number = dialling.connect_ex((self._address, where))
        if number not in {0, errno.EINPROGRESS}:
            raise OSError(number, os.strerror(number))
        return Opening(dialling.fileno(), select.POLLOUT)


class RfcommDialler(StreamLink):
    """The side that dials; it dials again for ever.

    Args:
        uri: as the user named it, for messages.
        device: address or name of the peer.
        channel: 0: to be asked for.
        unpaired: whether a peer will do that was never paired with.
        waits: whether an adapter that is missing is waited for.

    Raises:
        UnavailableError: this machine has no working Bluetooth (MissingDeviceError where it lacks only the adapter), or nobody is known by that name.
    """

    def __init__(self, uri: str, device: str, channel: int, *, unpaired: bool, waits: bool = False) -> None:
        if not waits:
            _check_adapter(uri)
        address = device if is_address(device) else _address_of(device)
        self._dialling = _Dialling(uri, address, channel, unpaired=unpaired)
        super().__init__("rfcomm", LinkEnd.DIALLER, self._dialling, FRAME_BYTES, waits=waits)

    def close(self) -> None:
        """Give what was handed over half a second to leave, say goodbye, hang up."""
        super().close()
        self._dialling.close()


class RfcommListener:
    """The side that waits for devices to dial.

    Args:
        uri: as the user named it, for messages.
        adapter: address of one of this machine's adapters, or ANYONE.
        channel: 0: the default.
        unpaired: whether devices may dial that were never paired with.
        waits: whether an adapter that is missing is waited for: who listens everywhere hears it when it comes.

    Raises:
        UnavailableError: this machine has no Bluetooth (MissingDeviceError where it lacks only the adapter), or the channel is taken.
    """

    kind: Final = "rfcomm"
    self_paced: Final = True

    def __init__(self, uri: str, adapter: str, channel: int, *, unpaired: bool, waits: bool = False) -> None:
        self.dialled: dict[Lane, bytes] = {}
        self._streams: dict[bytes, StreamLink] = {}
        self._numbers = count()
        self._listening = _new_socket(_Protocol.RFCOMM)
        try:
            if not waits:
                _check_adapter(uri)
            _secure(self._listening, unpaired=unpaired)
            self._listening.bind((_ANY_ADAPTER if adapter == ANYONE else adapter, channel or DEFAULT_CHANNEL))
            self._listening.listen(_BACKLOG)
        except OSError as error:
            self._listening.close()
            if error.errno == errno.EADDRINUSE:
                raise UnavailableError(f"{uri} is taken", "stop what listens there, or give another channel") from None
            raise UnavailableError(
                f"{uri} cannot be opened ({error.strerror})", "rfcomm://*/1 listens everywhere"
            ) from None
        except UnavailableError:
            self._listening.close()
            raise
        self._epoll = select.epoll()
        self._epoll.register(self._listening.fileno(), select.EPOLLIN)
        from common.link.bluez import PublishedRecord  # noqa: PLC0415 - brings asyncio, for listeners only

        self._record = PublishedRecord(channel or DEFAULT_CHANNEL)

    @property
    def pollables(self) -> Sequence[select.epoll]:
        """One epoll descriptor over all."""
        return (self._epoll,)

    @property
    def due_ns(self) -> int:
        """When `receive` wants to be called next even if nothing is readable, by this machine's steady clock, ns."""
        return min((stream.due_ns for stream in self._streams.values()), default=_NEVER)

    def ready(self, connection: bytes) -> bool:
        """Whether a frame would be taken now, or is to be tried because the connection is gone."""
        stream, name = self._find(connection)
        return stream is None or stream.ready(name)

    def receive(self) -> Iterator[Incoming]:
        """Give all packets that have come in; take in who dials, forget who has gone."""
        self._accept()
        for prefix, stream in list(self._streams.items()):
            for incoming in stream.receive():
                match incoming:
                    case Packet(connection, header, payload):
                        yield Packet(prefix + connection, header, payload)
                    case Broken(connection):
                        yield Broken(prefix + connection)
                    case Garbage(connection):
                        yield Garbage(prefix + connection)
            if not stream.is_open:
                self._forget(prefix)

    def send(self, connection: bytes, header: bytes, payload: Buffer) -> SendResult:
        """Hand a packet over, without waiting."""
        stream, name = self._find(connection)
        return SendResult.UNREACHABLE if stream is None else stream.send(name, header, payload)

    def close(self) -> None:
        """Give what was handed over half a second to leave, say goodbye, hang up."""
        self._record.close()
        self._listening.close()
        for prefix in list(self._streams):
            self._forget(prefix)
        self._epoll.close()

    def _find(self, connection: bytes) -> tuple[StreamLink | None, bytes]:
        prefix, slash, name = connection.partition(b"/")
        return self._streams.get(prefix + slash), name

    def _accept(self) -> None:
        while True:
            try:
                accepted, _ = self._listening.accept()
            except OSError:  # nobody, or gone already
                return
            if len(self._streams) >= _MOST_HOSTS:
                accepted.close()
                continue
            accepted.settimeout(0)
            stream = StreamLink(self.kind, LinkEnd.LISTENER, _once(_RfcommLine(accepted)), FRAME_BYTES)
            self._streams[b"%d/" % next(self._numbers)] = stream
            self._epoll.register(stream.pollables[0].fileno(), select.EPOLLIN)

    def _forget(self, prefix: bytes) -> None:
        stream = self._streams.pop(prefix)
        self._epoll.unregister(stream.pollables[0].fileno())
        stream.close()


def open_rfcomm(request: LinkRequest) -> RfcommDialler | RfcommListener:
    """Open a Bluetooth link.

    Args:
        request: what to open; the address is `rfcomm://DEVICE[/CHANNEL]`.

    Raises:
        SettingsError: there is no device to dial, or something to listen on that is no adapter's address.
        UnavailableError: Bluetooth or the adapter cannot be had.
    """
    uri = request.uri
    device, _, number = uri.address.removeprefix("rfcomm://").partition("/")
    device, channel = unquote(device), int(number or 0)
    if not uri.listens:
        if device == ANYONE:
            raise SettingsError(f"link {uri.address!r} names no device to connect to", "give its name or address")
        return RfcommDialler(uri.address, device, channel, unpaired=uri.unpaired, waits=request.waits)
    if device != ANYONE and not is_address(device):
        raise SettingsError(f"link {uri.address!r} cannot be listened on", "give rfcomm://* or an adapter's address")
    return RfcommListener(uri.address, device, channel, unpaired=uri.unpaired, waits=request.waits)


def _address_of(name: str) -> str:
    from common.link.bluez import address_of  # noqa: PLC0415 - brings asyncio, for names only

    return address_of(name)


def is_address(text: str) -> bool:
    """Whether this is six pairs of hexadecimal digits with colons."""
    parts = text.split(":")
    return len(parts) == 6 and all(len(part) == 2 and set(part) <= set("0123456789abcdefABCDEF") for part in parts)


def _once(line: _RfcommLine) -> Callable[[], _RfcommLine]:
    """A line that is there now and cannot be opened again."""
    lines = [line]

    def opened() -> _RfcommLine:
        if not lines:
            raise UnavailableError("the device has gone", "wait until it dials again")
        return lines.pop()

    return opened


def _new_socket(protocol: _Protocol) -> socket.socket:
    """Make a non-blocking socket.

    Raises:
        UnavailableError: Python or the system has none.
    """
    if not hasattr(socket, "AF_BLUETOOTH"):
        raise UnavailableError(
            "this Python was built without Bluetooth",
            "use the system's own, or build one with libbluetooth-dev installed",
        )
    try:
        made = socket.socket(socket.AF_BLUETOOTH, *protocol.value)
    except OSError as error:
        remedy = "use a kernel with CONFIG_BT_RFCOMM" if error.errno in _NO_BLUETOOTH else "run as a user who may"
        raise UnavailableError(f"Bluetooth cannot be used ({error.strerror})", remedy) from None
    made.settimeout(0)
    return made


def _secure(made: socket.socket, *, unpaired: bool) -> None:
    made.setsockopt(_SOL_BLUETOOTH, _BT_SECURITY, struct.pack("BB", _LEVEL_LOW if unpaired else _LEVEL_MEDIUM, 0))


def _check_adapter(uri: str) -> None:
    """See that this machine has an adapter at all; one that is switched off is found out by dialling."""
    _new_socket(_Protocol.RFCOMM).close()  # Python and kernel first
    if not any(_ADAPTERS.glob("hci*")):
        raise MissingDeviceError(
            f"{uri} needs a Bluetooth adapter", "plug one in; bluetoothctl list shows what is there"
        )


def _undialled(uri: str, error: OSError, *, published: bool) -> UnavailableError:
    """Put what became of a call into one line with the remedy.

    Args:
        uri: as the user named it.
        error: what the kernel says.
        published: whether the peer has just named the channel, so that the service is there.
    """
    problem = f"{uri} cannot be reached ({error.strerror})"
    if error.errno in _OWN_ADAPTER:
        return UnavailableError(problem, "switch Bluetooth on: bluetoothctl power on")
    # A connection that is there already when encryption fails, as it is after asking for the channel, is told as refused (rfcomm/core.c).
    if error.errno in _NOT_PAIRED or (error.errno == errno.ECONNREFUSED and published):
        return UnavailableError(problem, "pair the two devices with bluetoothctl")
    if error.errno == errno.ECONNREFUSED:
        return UnavailableError(problem, "start board-agent there with --link rfcomm://*, and pair the two devices")
    return UnavailableError(problem, "is it switched on and in reach?")
