"""Which real devices this machine has for a link's two ends, or why it has none."""

import errno
import fcntl
import os
import socket
import struct
from pathlib import Path
from typing import Final

_HCIGETDEVINFO: Final = 0x800448D3
"""_IOR('H', 211, int), include/net/bluetooth/hci_sock.h; struct hci_dev_info: u16 id, name[8], address, u32 flags, ..."""

_DEVICE_INFO_BYTES: Final = 92
_ADDRESS_AT, _FLAGS_AT, _UP = 10, 16, 1
_HCI: Final = 1

GADGET: Final = (Path("/dev/ttyGS0"), Path("/dev/ttyACM0"))
"""The two ends of a cable whose gadget side is on the same machine (dummy_hcd)."""


class MissingError(Exception):
    """Raised when the devices are missing; says why."""


def gadget_uris() -> tuple[str, str]:
    """Link URIs of both ends of a serial gadget.

    Raises:
        MissingError: there is none.
    """
    absent = [str(path) for path in GADGET if not path.exists()]
    if absent:
        raise MissingError(f"no serial gadget with both ends on this machine: {', '.join(absent)} is missing")
    board, host = GADGET
    return f"serial:{board}", f"serial:{host}"


def adapters() -> list[str]:
    """Addresses of the Bluetooth adapters that are up.

    Raises:
        MissingError: Python or the kernel lacks Bluetooth.
    """
    if not hasattr(socket, "AF_BLUETOOTH"):
        raise MissingError("this Python was built without Bluetooth")
    try:
        asking = socket.socket(socket.AF_BLUETOOTH, socket.SOCK_RAW, _HCI)
    except OSError as error:
        raise MissingError(f"no Bluetooth in this kernel: {error.strerror}") from None
    found = []
    with asking:
        for name in sorted(path.name for path in Path("/sys/class/bluetooth").glob("hci*") if ":" not in path.name):
            told = bytearray(struct.pack("H", int(name.removeprefix("hci"))).ljust(_DEVICE_INFO_BYTES, b"\0"))
            try:
                fcntl.ioctl(asking, _HCIGETDEVINFO, told)
            except OSError as error:
                if error.errno == errno.ENODEV:
                    continue
                raise
            (flags,) = struct.unpack_from("I", told, _FLAGS_AT)
            if flags & _UP:
                found.append(":".join(f"{byte:02X}" for byte in reversed(told[_ADDRESS_AT : _ADDRESS_AT + 6])))
    return found


def rfcomm_uri() -> str:
    """Link URI of a free channel on the first of two adapters; the second dials.

    Raises:
        MissingError: there are fewer than two.
    """
    there = adapters()
    if len(there) < 2:
        raise MissingError(f"two Bluetooth adapters are needed, {len(there)} of this machine's are up")
    for channel in range(30, 1, -1):
        with socket.socket(socket.AF_BLUETOOTH, socket.SOCK_STREAM, socket.BTPROTO_RFCOMM) as probe:
            try:
                probe.bind((there[0], channel))
            except OSError as error:
                if error.errno == errno.EADDRINUSE:
                    continue
                raise MissingError(f"no channel of {there[0]}: {os.strerror(error.errno or 0)}") from None
        return f"rfcomm://{there[0]}/{channel}?unpaired=1"
    raise MissingError(f"all channels of {there[0]} are taken")
