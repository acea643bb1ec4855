"""The listening side of an RFCOMM link, for several hosts if need be.

It has one `StreamLink` per dialling device. So a second host gets an answer (that the board is busy), and a host that went out of reach does not
block the next one. What belongs to one adapter may vanish with it and come back at any time; the listening socket outlives it.
"""

import errno
import select
from collections.abc import Callable, Iterator, Sequence
from itertools import count
from typing import Final

from common.errors import UnavailableError
from common.frame import Buffer
from common.link.base import Broken, Garbage, Incoming, Packet, SendResult
from common.link.rfcomm_socket import (
    ANYONE,
    DEFAULT_CHANNEL,
    FRAME_BYTES,
    RfcommLine,
    SocketKind,
    check_adapter,
    new_socket,
    secure,
)
from common.link.stream import StreamLink
from common.protocol.framing import LinkEnd
from common.protocol.message import Lane

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
