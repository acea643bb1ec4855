"""A line to a printer as bytes: a serial port, Bluetooth's RFCOMM, or a TCP port behind which a serial port is."""

import os
import select
import socket
import time
from contextlib import suppress
from typing import Final, Protocol

import serial

from common.android import is_android
from common.errors import MissingDeviceError, TakenError, UnavailableError
from phone_host.printers.printer_uri import LineKind, LineUri

WRITE_S: Final = 5.0
"""Of a connection that is made, and of bytes that do not move."""

_AT_ONCE: Final = 4096
GOODBYE_S: Final = 0.5
"""Until a peer has closed its end of a connection, too."""

_RFCOMM: Final = 3
_BAD_NEWS: Final = {13: "you may not use it", 16: "another program has it"}


class PrinterGoneError(UnavailableError):
    """Raised when a printer vanished in the middle of something."""


class Line(Protocol):
    """Bytes to and from a printer."""

    def read(self, wait_s: float) -> bytes:
        """Return what came; empty: nothing within the time.

        Raises:
            PrinterGoneError: the printer is gone.
        """

    def write(self, data: bytes) -> None:
        """Send bytes.

        Raises:
            PrinterGoneError: the printer is gone.
        """

    def offer(self, data: bytes, wait_s: float) -> bool:
        """Send the last bytes, as many as the machine takes within the time; return whether it took all. It never raises."""

    def close(self) -> None:
        """Close it. May be called again. What was sent still goes out."""


def open_line(uri: LineUri) -> Line:
    """Open the line to a printer.

    Raises:
        UnavailableError: it cannot be had.
    """
    require_allowed(uri)
    if uri.kind is LineKind.SERIAL:
        return _SerialLine(uri)
    return _SocketLine(uri)


def require_allowed(uri: LineUri, *, on_android: bool | None = None) -> None:
    """Refuse a line that this machine never gives to a program.

    Args:
        uri: where the printer is.
        on_android: whether the machine runs Android; None: whether this one does.

    Raises:
        UnavailableError: it does not.
    """
    if uri.kind is not LineKind.SOCKET and (is_android() if on_android is None else on_android):
        raise UnavailableError(
            f"{uri.text}: Android lets no program in Termux use USB or Bluetooth",
            "take a printer in the network (octoprint://, moonraker://, prusalink://), or socket://HOST:PORT of an app or of ser2net"
            " that has the port",
        )


class _SerialLine:
    def __init__(self, uri: LineUri) -> None:
        self._name = uri.text
        try:
            self._port = serial.Serial(uri.place, uri.baud, timeout=0, write_timeout=WRITE_S, exclusive=True)
        except serial.SerialException as error:
            raise _unavailable(uri, error.errno) from None
        except (OSError, ValueError) as error:
            raise UnavailableError(f"{uri.text} cannot be opened ({error})", "see phone-host print --help") from None

    def read(self, wait_s: float) -> bytes:
        try:
            ready, _, _ = select.select([self._port], [], [], max(wait_s, 0))
            return self._read() if ready else b""
        except (OSError, ValueError) as error:  # pyserial's errors are of OSError
            raise _gone(self._name) from error

    def _read(self) -> bytes:
        data = os.read(self._port.fileno(), _AT_ONCE)
        if not data:
            raise OSError("end of file")
        return data

    def write(self, data: bytes) -> None:
        try:
            self._port.write(data)
        except (OSError, ValueError) as error:
            raise _gone(self._name) from error

    def offer(self, data: bytes, wait_s: float) -> bool:
        """See Line."""
        try:
            return _offered(self._port.fileno(), data, wait_s)
        except (OSError, ValueError):
            return False

    def close(self) -> None:
        with suppress(OSError):
            self._port.close()


class _SocketLine:
    def __init__(self, uri: LineUri) -> None:
        self._name = uri.text
        try:
            self._socket = _connected(uri)
        except OSError as error:
            raise _unavailable(uri, error.errno, error.strerror or str(error)) from None
        except UnicodeError:  # what no name in a network can be, such as `..`
            raise _unavailable(uri, None, "it is no name of a host") from None

    def read(self, wait_s: float) -> bytes:
        try:
            ready, _, _ = select.select([self._socket], [], [], max(wait_s, 0))
            data = self._socket.recv(_AT_ONCE) if ready else b""
        except (OSError, ValueError) as error:
            raise _gone(self._name) from error
        if ready and not data:
            raise _gone(self._name)
        return data

    def write(self, data: bytes) -> None:
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise _gone(self._name) from error

    def offer(self, data: bytes, wait_s: float) -> bool:
        """See Line."""
        try:
            self._socket.setblocking(False)  # noqa: FBT003 - the standard library's own signature
            return _offered(self._socket.fileno(), data, wait_s)
        except (OSError, ValueError):
            return False

    def close(self) -> None:
        # Answers that nobody has read would make the kernel reset the connection, and drop what is still on its way to the printer.
        with suppress(OSError, ValueError):
            self._socket.setblocking(False)  # noqa: FBT003
            self._socket.shutdown(socket.SHUT_WR)
            end_s = time.monotonic() + GOODBYE_S
            while (left_s := end_s - time.monotonic()) > 0 and select.select([self._socket], [], [], left_s)[0]:
                if not self._socket.recv(_AT_ONCE):
                    break
        self._socket.close()


def _offered(descriptor: int, data: bytes, wait_s: float) -> bool:
    """Write to a descriptor that does not block until all is taken or the time is up; return whether all is taken.

    Raises:
        OSError: the printer is gone.
    """
    end_s = time.monotonic() + wait_s
    while data:
        try:
            data = data[os.write(descriptor, data) :]
        except BlockingIOError:
            left_s = end_s - time.monotonic()
            if left_s <= 0 or not select.select([], [descriptor], [], left_s)[1]:
                return False
    return True


def _connected(uri: LineUri) -> socket.socket:
    if uri.kind is LineKind.SOCKET:
        connected = socket.create_connection((uri.place, uri.port), WRITE_S)
        connected.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return connected
    family = getattr(socket, "AF_BLUETOOTH", None)
    if family is None:
        raise OSError(97, "this Python knows no Bluetooth")
    made = socket.socket(family, socket.SOCK_STREAM, _RFCOMM)
    made.settimeout(WRITE_S)
    try:
        made.connect((uri.place, uri.port))
    except OSError:
        made.close()
        raise
    return made


def _unavailable(uri: LineUri, number: int | None, words: str = "") -> UnavailableError:
    if uri.kind is LineKind.SERIAL and number in {2, 6, 19}:
        return MissingDeviceError(
            f"there is no printer at {uri.place}", "plug it in and switch it on; `ls /dev/serial/by-id` tells its name"
        )
    if uri.kind is LineKind.SERIAL and number is None:
        return UnavailableError(f"{uri.place} is no serial port", "`ls /dev/serial/by-id` tells the printer's name")
    if uri.kind is LineKind.SERIAL and number in {11, 16}:
        return TakenError(f"another program has {uri.place}", "end it: OctoPrint, Pronterface, ModemManager")
    if number == 13:
        return UnavailableError(f"you may not use {uri.place}", "sudo usermod -aG dialout $USER, then log in again")
    cause = words or _BAD_NEWS.get(number or 0, os.strerror(number) if number else "no reason given")
    return UnavailableError(
        f"no printer answers at {uri.text} ({cause})", "see whether it is on, and whether its address is right"
    )


def _gone(name: str) -> PrinterGoneError:
    return PrinterGoneError(
        f"the printer at {name} is gone: it cannot be cooled from here",
        "go and look: heaters may be on; switch it off if its display does not say that they are cold",
    )
