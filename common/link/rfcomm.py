"""Both sides of an RFCOMM link: a byte stream over the kernel's own Bluetooth sockets, between two paired devices.

The dialling side asks the peer for its channel, connects, and redials for ever. The listening side has one `StreamLink` per dialling device. So a
second host gets an answer (that the board is busy), and a host that went out of reach does not block the next one. What belongs to one adapter may
vanish with it and come back at any time; the listening socket outlives it.
"""

import errno
import logging
import os
import select
import socket
from collections.abc import Callable, Iterator, Sequence
from enum import Enum
from itertools import count
from typing import Final
from urllib.parse import unquote

from common.errors import SettingsError, UnavailableError
from common.frame import Buffer
from common.link.base import Broken, Garbage, Incoming, Packet, SendResult
from common.link.rfcomm_socket import (
    ANYONE,
    DEFAULT_CHANNEL,
    FRAME_BYTES,
    OWN_ADAPTER,
    RfcommLine,
    SocketKind,
    check_adapter,
    is_address,
    new_socket,
    secure,
)
from common.link.sdp import PSM, channel_in, query
from common.link.stream import Opening, StreamLink
from common.link.uri import LinkRequest
from common.program.logs import event
from common.protocol.framing import LinkEnd
from common.protocol.message import Lane

_LOG = logging.getLogger(__name__)

_NOT_PAIRED: Final = {errno.EACCES, errno.EPERM, errno.ECONNABORTED, errno.EINVAL}


class _Progress(Enum):
    IDLE = 0
    ASKING = 1
    ASKED = 2
    DIALLING = 3


class _Dialling:
    """Opens the dialler's line, one step per call: ask the peer for the channel if none was given, then connect.

    Args:
        uri: as the user named it, for messages.
        address: the peer's address.
        channel: the peer's channel; 0: ask for it.
        unpaired: whether a peer that was never paired will do.
    """

    def __init__(self, uri: str, address: str, channel: int, *, unpaired: bool) -> None:
        self._uri, self._address, self._channel = uri, address, channel
        self._unpaired = unpaired
        self._socket: socket.socket | None = None
        self._progress = _Progress.IDLE
        self._published = False
        self._problem = ""

    def __call__(self) -> RfcommLine | Opening:
        """Go as far as possible now."""
        try:
            return self._step()
        except OSError as error:
            self.close()
            failure = _undialled(self._uri, error, published=self._published)
            if error.errno in OWN_ADAPTER:
                raise failure from None
            if failure.problem != self._problem:
                self._problem = failure.problem
                _LOG.warning(event("rfcomm_waiting", problem=failure.problem, remedy=failure.remedy))
            return Opening()

    def close(self) -> None:
        """Release what is half open."""
        if self._socket is not None:
            self._socket.close()
        self._socket, self._progress = None, _Progress.IDLE

    def _step(self) -> RfcommLine | Opening:
        if self._socket is None:
            return self._dial(self._channel) if self._channel else self._ask()
        wanted = select.POLLIN if self._progress is _Progress.ASKED else select.POLLOUT
        poll = select.poll()
        poll.register(self._socket, wanted)
        ready = poll.poll(0)
        if not ready:
            return Opening(self._socket.fileno(), wanted)
        number = self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        if number == errno.ECONNREFUSED and self._progress is _Progress.ASKING:  # it publishes nothing at all
            self.close()
            self._published = False
            return self._dial(DEFAULT_CHANNEL)
        if number:
            raise OSError(number, os.strerror(number))
        if not ready[0][1] & wanted:
            raise ConnectionResetError(errno.ECONNRESET, os.strerror(errno.ECONNRESET))
        return self._go_on(self._socket)

    def _go_on(self, opened: socket.socket) -> RfcommLine | Opening:
        if self._progress is _Progress.ASKING:
            opened.send(query())
            self._progress = _Progress.ASKED
            return Opening(opened.fileno(), select.POLLIN)
        if self._progress is _Progress.ASKED:
            channel = channel_in(opened.recv(65536))
            self.close()
            self._published = channel > 0
            return self._dial(channel or DEFAULT_CHANNEL)
        self._socket, self._progress, self._problem = None, _Progress.IDLE, ""
        return RfcommLine(opened)

    def _ask(self) -> Opening:
        return self._connect(new_socket(SocketKind.L2CAP), PSM, _Progress.ASKING)

    def _dial(self, channel: int) -> Opening:
        dialling = new_socket(SocketKind.RFCOMM)
        secure(dialling, unpaired=self._unpaired)
        return self._connect(dialling, channel, _Progress.DIALLING)

    def _connect(self, dialling: socket.socket, where: int, progress: _Progress) -> Opening:
        self._socket, self._progress = dialling, progress
        number = dialling.connect_ex((self._address, where))
        if number not in {0, errno.EINPROGRESS}:
            raise OSError(number, os.strerror(number))
        return Opening(dialling.fileno(), select.POLLOUT)


class RfcommDialler(StreamLink):
    """The dialling side; it redials for ever.

    Args:
        uri: as the user named it, for messages.
        device: address or name of the peer.
        channel: the peer's channel; 0: ask for it.
        unpaired: whether a peer that was never paired will do.
        waits: whether to wait for a missing adapter.

    Raises:
        UnavailableError: this machine has no working Bluetooth (MissingDeviceError if it lacks only the adapter), or no device has that name.
    """

    def __init__(self, uri: str, device: str, channel: int, *, unpaired: bool, waits: bool = False) -> None:
        if not waits:
            check_adapter(uri)
        address = device if is_address(device) else _address_of(device)
        self._dialling = _Dialling(uri, address, channel, unpaired=unpaired)
        super().__init__("rfcomm", LinkEnd.DIALLER, self._dialling, FRAME_BYTES, waits=waits)

    def close(self) -> None:
        """Give accepted packets half a second to leave, say goodbye, hang up."""
        super().close()
        self._dialling.close()


def _address_of(name: str) -> str:
    from common.link.bluez import address_of  # noqa: PLC0415 - brings asyncio, for names only

    return address_of(name)


def _undialled(uri: str, error: OSError, *, published: bool) -> UnavailableError:
    """Turn the failure of a call into a one-line error with its remedy.

    Args:
        uri: as the user named it.
        error: the kernel's error.
        published: whether the peer has just named the channel, so that the service exists.
    """
    problem = f"{uri} cannot be reached ({error.strerror})"
    if error.errno in OWN_ADAPTER:
        return UnavailableError(problem, "switch Bluetooth on: bluetoothctl power on")
    # If a connection exists already when encryption fails, as after asking for the channel, it is reported as refused (rfcomm/core.c).
    if error.errno in _NOT_PAIRED or (error.errno == errno.ECONNREFUSED and published):
        return UnavailableError(problem, "pair the two devices with bluetoothctl")
    if error.errno == errno.ECONNREFUSED:
        return UnavailableError(problem, "start board-agent there with --link rfcomm://*, and pair the two devices")
    return UnavailableError(problem, "switch it on and bring it into reach")


_NEVER: Final = 2**63 - 1
_ANY_ADAPTER: Final = "00:00:00:00:00:00"
_BACKLOG: Final = 4
_MOST_HOSTS: Final = 7
"""A piconet has seven places."""


class RfcommListener:
    """The side that waits for devices to dial.

    Args:
        uri: as the user named it, for messages.
        adapter: address of one of this machine's adapters, or ANYONE.
        channel: channel to listen on; 0: the default.
        unpaired: whether devices that were never paired may dial.
        waits: whether to wait for a missing adapter. A listener on all adapters hears one as soon as it comes.

    Raises:
        UnavailableError: this machine has no Bluetooth (MissingDeviceError if it lacks only the adapter), or the channel is taken.
    """

    kind: Final = "rfcomm"
    self_paced: Final = True

    def __init__(self, uri: str, adapter: str, channel: int, *, unpaired: bool, waits: bool = False) -> None:
        self.dialled: dict[Lane, bytes] = {}
        self._streams: dict[bytes, StreamLink] = {}
        self._numbers = count()
        self._listening = new_socket(SocketKind.RFCOMM)
        try:
            if not waits:
                check_adapter(uri)
            secure(self._listening, unpaired=unpaired)
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
        """One epoll descriptor for everything."""
        return (self._epoll,)

    @property
    def due_ns(self) -> int:
        """When `receive` must be called next even if nothing is readable, by this machine's steady clock, ns."""
        return min((stream.due_ns for stream in self._streams.values()), default=_NEVER)

    def ready(self, connection: bytes) -> bool:
        """Whether to send a frame now: it would be accepted, or the connection is gone and `send` will say so."""
        stream, name = self._find(connection)
        return stream is None or stream.ready(name)

    def receive(self) -> Iterator[Incoming]:
        """Return all packets that have arrived; accept devices that dial, forget those that have gone."""
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
        """Send a packet, without waiting."""
        stream, name = self._find(connection)
        return SendResult.UNREACHABLE if stream is None else stream.send(name, header, payload)

    def close(self) -> None:
        """Give accepted packets half a second to leave, say goodbye, hang up."""
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
            except OSError:  # nobody, or already gone
                return
            if len(self._streams) >= _MOST_HOSTS:
                accepted.close()
                continue
            accepted.settimeout(0)
            stream = StreamLink(self.kind, LinkEnd.LISTENER, _once(RfcommLine(accepted)), FRAME_BYTES)
            self._streams[b"%d/" % next(self._numbers)] = stream
            self._epoll.register(stream.pollables[0].fileno(), select.EPOLLIN)

    def _forget(self, prefix: bytes) -> None:
        stream = self._streams.pop(prefix)
        self._epoll.unregister(stream.pollables[0].fileno())
        stream.close()


def _once(line: RfcommLine) -> Callable[[], RfcommLine]:
    """A line that is there now and cannot be reopened."""
    lines = [line]

    def opened() -> RfcommLine:
        if not lines:
            raise UnavailableError("the device has gone", "wait until it connects again")
        return lines.pop()

    return opened


def open_rfcomm(request: LinkRequest) -> RfcommDialler | RfcommListener:
    """Open a Bluetooth link.

    Args:
        request: what to open; the address is `rfcomm://DEVICE[/CHANNEL]`.

    Raises:
        SettingsError: no device to dial was given, or the listening address is not an adapter's.
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
