"""The kernel's Bluetooth sockets: made, secured, and what this machine needs for them."""

import errno
import socket
import struct
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Final

from common.errors import MissingDeviceError, UnavailableError

ANYONE: Final = "*"
DEFAULT_CHANNEL: Final = 1
"""The channel of a listener that could not publish its channel."""

FRAME_BYTES: Final = 1008
"""Linux's RFCOMM fills frames of at most 1013 - 5 bytes (net/bluetooth/rfcomm.h, core.c); the size agreed with a socket's peer cannot be queried.
Whole, halved and in thirds, such frames also fill the radio's packets (3-DH5, 3-DH3, 2-DH3)."""

_ADAPTERS: Final = Path("/sys/class/bluetooth")
_SOL_BLUETOOTH, _BT_SECURITY = 274, 4
_LEVEL_LOW, _LEVEL_MEDIUM = 1, 2
"""include/net/bluetooth/bluetooth.h: low requires nothing; medium requires encryption, which takes pairing."""

_NO_BLUETOOTH: Final = {errno.EAFNOSUPPORT, errno.EPROTONOSUPPORT, errno.ESOCKTNOSUPPORT}
OWN_ADAPTER: Final = {errno.EHOSTUNREACH, errno.ENETDOWN, errno.ENODEV}
"""The kernel's errors when this machine's own adapter is off or gone."""


class SocketKind(Enum):
    """Type and protocol of a socket, as kernel numbers: a Python without Bluetooth has no names for them."""

    L2CAP = (socket.SOCK_SEQPACKET, 0)
    RFCOMM = (socket.SOCK_STREAM, 3)


@dataclass(frozen=True, slots=True)
class RfcommLine:
    """A connected socket, in the form that a `StreamLink` takes.

    Attributes:
        connected: the socket, non-blocking.
    """

    connected: socket.socket

    def fileno(self) -> int:
        """The socket's descriptor."""
        return self.connected.fileno()

    def is_drained(self) -> bool:
        """Always true: the kernel sends what was written before it closes."""
        return True

    def discard_output(self) -> None:
        """Do nothing: written bytes cannot be taken back."""

    def close(self) -> None:
        """Hang up."""
        self.connected.close()


def new_socket(kind: SocketKind) -> socket.socket:
    """Make a non-blocking socket.

    Raises:
        UnavailableError: Python or the system does not support it.
    """
    if not hasattr(socket, "AF_BLUETOOTH"):
        raise UnavailableError(
            "this Python was built without Bluetooth",
            "use the system's own, or build one with libbluetooth-dev installed",
        )
    try:
        made = socket.socket(socket.AF_BLUETOOTH, *kind.value)
    except OSError as error:
        remedy = "use a kernel with CONFIG_BT_RFCOMM" if error.errno in _NO_BLUETOOTH else "run as a user who may"
        raise UnavailableError(f"Bluetooth cannot be used ({error.strerror})", remedy) from None
    made.settimeout(0)
    return made


def secure(made: socket.socket, *, unpaired: bool) -> None:
    """Set what a connection requires: nothing, or the encryption that comes with pairing.

    Args:
        made: a socket that is neither connected nor listening yet.
        unpaired: whether nothing is required.

    Raises:
        OSError: the kernel refuses.
    """
    made.setsockopt(_SOL_BLUETOOTH, _BT_SECURITY, struct.pack("BB", _LEVEL_LOW if unpaired else _LEVEL_MEDIUM, 0))


def check_adapter(uri: str) -> None:
    """Check that this machine has an adapter at all. One that is switched off shows only when dialling.

    Raises:
        UnavailableError: Python or the kernel lacks Bluetooth (MissingDeviceError if only the adapter is missing).
    """
    new_socket(SocketKind.RFCOMM).close()  # Python and kernel first
    if not any(_ADAPTERS.glob("hci*")):
        raise MissingDeviceError(
            f"{uri} needs a Bluetooth adapter", "plug one in; bluetoothctl list shows what is there"
        )


def is_address(text: str) -> bool:
    """Whether this is six pairs of hexadecimal digits with colons."""
    parts = text.split(":")
    return len(parts) == 6 and all(len(part) == 2 and set(part) <= set("0123456789abcdefABCDEF") for part in parts)
