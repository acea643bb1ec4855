"""Serial lines: USB gadget (ttyGS, ttyACM), adapters and real UARTs, pseudo terminals. pyserial opens the port and sets its speed."""

import errno
import fcntl
import grp
import os
import select
import sys
import termios
from contextlib import suppress
from pathlib import Path
from typing import Final

import serial

from common.errors import MissingDeviceError, TakenError, UnavailableError
from common.link.stream import StreamLink
from common.link.uri import LinkRequest
from common.protocol.framing import LinkEnd

DEFAULT_BAUD: Final = 115200
"""For real UARTs; USB and pseudo terminals have no speed to set."""

_GONE: Final = {errno.ENOENT, errno.ENODEV, errno.ENXIO, errno.EIO}
_TAKEN: Final = {errno.EBUSY, errno.EAGAIN, errno.EWOULDBLOCK}

_QUIET_MS: Final = 5
"""So long nothing comes when a driver has handed on all that it holds."""

_DISCARDED_BYTES: Final = 64 * 1024
_MOST_DISCARDED: Final = 1000
"""Reads; each gives 4 KB at most where a tty holds no more. A peer that talks for ever is not listened to for ever."""


class SerialLine:
    """An opened serial port in raw mode, for this process alone.

    Args:
        path: the device.
        baud: speed, for ports that have one.

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
        """Whether the driver holds nothing more, as far as it says (an adapter may still do)."""
        with suppress(OSError):
            waiting: bytes = fcntl.ioctl(self._fd, termios.TIOCOUTQ, bytes(4))
            return not any(waiting)
        return True

    def discard_output(self) -> None:
        """Throw away what the driver has not sent yet."""
        with suppress(termios.error):
            termios.tcflush(self._fd, termios.TCOFLUSH)

    def close(self) -> None:
        """Close; what has not left is thrown away, because a UART's close may wait for it for half a minute.

        So is what has come and was not read: a gadget's port that is closed while it holds the host back never hears it again (Linux 6.1,
        drivers/usb/gadget/function/u_serial.c: only reading lets it take more, and there is nothing left to be read).
        """
        if not self.is_drained():
            self.discard_output()
        self._discard_input()
        with suppress(OSError, termios.error):
            self._port.close()

    def _discard_input(self) -> None:
        """Read until nothing more comes: to throw away what is there (tcflush) would let in as much again."""
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
        waits: whether a device that cannot be had now is waited for.

    Raises:
        UnavailableError: the device cannot be had; MissingDeviceError where it is not there.
    """

    def __init__(self, path: str, baud: int, *, listens: bool, waits: bool = False) -> None:
        side = LinkEnd.LISTENER if listens else LinkEnd.DIALLER
        super().__init__("serial", side, lambda: SerialLine(path, baud), waits=waits)


def open_serial(request: LinkRequest) -> SerialLink:
    """Open a serial link.

    Args:
        request: what to open; the address is `serial:DEVICE`.

    Raises:
        UnavailableError: the device cannot be had; MissingDeviceError where it is not there.
    """
    uri = request.uri
    path = uri.address.removeprefix("serial:")
    return SerialLink(path, uri.baud or DEFAULT_BAUD, listens=uri.listens, waits=request.waits)


def _make_raw(descriptor: int) -> None:
    """Set what pyserial leaves: no break handling, and a read that tells "nothing there" (EAGAIN) from "line lost" (b"").

    With VMIN 0 and VTIME 0 a read returns 0 bytes in both cases (termios(3), non-canonical mode).
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
    """Put what is wrong with a port into one line with the remedy."""
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
    with suppress(OSError, KeyError):
        return grp.getgrgid(Path(path).stat().st_gid).gr_name
    return "dialout"


def _others(path: str) -> str:
    """The serial ports that are there, as a hint."""
    if sys.platform != "linux":  # list_ports raises ImportError on systems that it does not know, Android among them
        return ""
    from serial.tools import list_ports  # noqa: PLC0415 - ImportError where its platform is unknown

    ports = sorted(port.device for port in list_ports.comports() if port.device != path and "ttyS" not in port.device)
    return f" (there: {', '.join(ports)})" if ports else ""
