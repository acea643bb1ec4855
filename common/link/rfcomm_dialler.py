"""The dialling side of an RFCOMM link: it asks the peer for its channel, connects, and redials for ever."""

import errno
import logging
import os
import select
import socket
from enum import Enum
from typing import Final

from common.errors import UnavailableError
from common.link.rfcomm_socket import (
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
from common.program.logs import event
from common.protocol.framing import LinkEnd

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
