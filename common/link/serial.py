"""Serial lines: USB gadget (ttyGS, ttyACM), adapters, real UARTs and pseudo terminals. pyserial opens the port and sets its speed."""

import errno
import fcntl
import os
import select
import sys
import termios
from contextlib import suppress
from pathlib import Path
from typing import Final

import serial

from common.errors import MissingDeviceError, TakenError, UnavailableError
from common.groups import group_name
from common.link.stream import StreamLink
from common.link.uri import LinkRequest
from common.protocol.framing import LinkEnd

DEFAULT_BAUD: Final = 115200
"""For real UARTs; USB and pseudo terminals have no speed to set."""

_GONE: Final = {errno.ENOENT, errno.ENODEV, errno.ENXIO, errno.EIO}
_TAKEN: Final = {errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK}

_QUIET_MS: Final = 5
"""When nothing comes for this long, a driver has passed on everything that it holds."""

_DISCARDED_BYTES: Final = 64 * 1024
_MOST_DISCARDED: Final = 1000
"""Reads; each returns at most 4 KB unless a tty holds more. A peer that never stops talking is not listened to for ever."""


class SerialLine:
    """A serial port opened in raw mode, exclusively for this process.

    Raises:
        UnavailableError: it cannot be had now.
    """

    def __init__(self, path: str, baud: int) -> None:
        self._port = serial.Serial(baudrate=baud, timeout=0, write_timeout=0, exclusive=True)
        self._port.port = path
        try:
            self._port.open()
            _make_raw(self._port.fileno())
        except (OSError, termios.error, ValueError) as error:
            self._port.close()
            raise _explained(path, error) from None
        self._fd: int = self._port.fileno()

    def fileno(self) -> int:
        """The descriptor."""
        return self._fd

    def is_drained(self) -> bool:
        """Whether the driver holds nothing more, as far as it says (an adapter still may)."""
        with suppress(OSError):
            waiting: bytes = fcntl.ioctl(self._fd, termios.TIOCOUTQ, bytes(4))
            return not any(waiting)
        return True

    def discard_output(self) -> None:
        """Discard what the driver has not sent yet."""
        with suppress(termios.error):
            termios.tcflush(self._fd, termios.TCOFLUSH)

    def close(self) -> None:
        """Close the port. Unsent bytes are discarded, because a UART's close may wait half a minute for them.

        Unread bytes are read and discarded too. A gadget's port that is closed while it holds the host back never receives from it again (Linux 6.1,
        drivers/usb/gadget/function/u_serial.c: only reading makes it accept more, and then there is nothing left to read).
        """
        if not self.is_drained():
            self.discard_output()
        self._discard_input()
        with suppress(OSError, termios.error):
            self._port.close()

    def _discard_input(self) -> None:
        """Read until nothing more comes. Flushing (tcflush) would only make room for as much again."""
        poll = select.poll()
        poll.register(self._fd, select.POLLIN)
        with suppress(OSError):
            for _ in range(_MOST_DISCARDED):
                if not poll.poll(_QUIET_MS) or not os.read(self._fd, _DISCARDED_BYTES):
                    return


class SerialLink(StreamLink):
    """A link over a serial line. Both sides open their end of it; the host plays the dialler.

    Args:
        path: the device.
        baud: speed, for ports that have one.
        listens: whether this side plays the listener.
        waits: whether to wait for a device that cannot be had now.

    Raises:
        UnavailableError: the device cannot be had; MissingDeviceError if it does not exist.
    """

    def __init__(self, path: str, baud: int, *, listens: bool, waits: bool = False) -> None:
        side = LinkEnd.LISTENER if listens else LinkEnd.DIALLER
        super().__init__("serial", side, lambda: SerialLine(path, baud), waits=waits)


def open_serial(request: LinkRequest) -> SerialLink:
    """Open a serial link.

    Args:
        request: what to open; the address is `serial:DEVICE`.

    Raises:
        UnavailableError: the device cannot be had; MissingDeviceError if it does not exist.
    """
    uri = request.uri
    path = uri.address.removeprefix("serial:")
    return SerialLink(path, uri.baud or DEFAULT_BAUD, listens=uri.listens, waits=request.waits)


def _make_raw(descriptor: int) -> None:
    """Set what pyserial leaves: no break handling, and reads that distinguish "nothing there" (EAGAIN) from "line lost" (b"").

    With VMIN 0 and VTIME 0, a read returns 0 bytes in both cases (termios(3), non-canonical mode).
    """
    attributes = termios.tcgetattr(descriptor)
    input_off = termios.BRKINT | termios.PARMRK | termios.ISTRIP | termios.INLCR | termios.IGNCR | termios.ICRNL
    attributes[0] &= ~(input_off | termios.IXON | termios.IXOFF | termios.IXANY)
    attributes[0] |= termios.IGNBRK
    attributes[1] &= ~termios.OPOST
    attributes[3] &= ~(termios.ECHO | termios.ECHONL | termios.ICANON | termios.ISIG | termios.IEXTEN)
    attributes[6][termios.VMIN], attributes[6][termios.VTIME] = 1, 0
    termios.tcsetattr(descriptor, termios.TCSANOW, attributes)
    fcntl.ioctl(descriptor, termios.TIOCEXCL)


def _explained(path: str, error: Exception) -> UnavailableError:
    """Turn a problem with a port into a one-line error with its remedy."""
    number = getattr(error, "errno", None)
    problem = f"serial:{path} cannot be opened ({os.strerror(number) if number else error})"
    if number in _TAKEN:
        return TakenError(f"serial:{path} is taken", "stop what uses it (a getty, a terminal, ModemManager)")
    if number in {errno.EACCES, errno.EPERM}:
        group = _group(path)
        return UnavailableError(problem, f"sudo usermod -aG {group} $USER, then log in again")
    if number in _GONE:
        return MissingDeviceError(problem, f"plug the cable in, or choose another port with --link{_others(path)}")
    return UnavailableError(problem, "give the path of a serial port, for example serial:/dev/ttyACM0")


def _group(path: str) -> str:
    """The group that may use a port: dialout on Debian, uucp elsewhere."""
    with suppress(OSError):
        return group_name(Path(path).stat().st_gid) or "dialout"
    return "dialout"


def _others(path: str) -> str:
    """The serial ports that exist, as a hint."""
    if sys.platform != "linux":  # list_ports raises ImportError on systems that it does not know, Android among them
        return ""
    from serial.tools import list_ports  # noqa: PLC0415 - ImportError where its platform is unknown

    ports = sorted(port.device for port in list_ports.comports() if port.device != path and "ttyS" not in port.device)
    return f" (there: {', '.join(ports)})" if ports else ""
