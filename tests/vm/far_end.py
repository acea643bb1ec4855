"""Runs in the guest: joins a line's host end to stdin and stdout, and reopens it whenever it is lost. Standard library only.

The last form dials as a host does, with the product's own code: it finds the board by its name, asks it for the channel, and has the connection encrypted.

far_end.py tty /dev/ttyACM0
far_end.py rfcomm OWN_ADDRESS BOARD_ADDRESS CHANNEL
far_end.py dial rfcomm://NAME
"""

import os
import select
import socket
import sys
import time
import tty
from typing import Any

_RETRY_S = 0.1
_CONNECT_S = 10.0  # the kernel itself waits up to 40 s for an answer that an adapter switched off meanwhile never gave


def open_line() -> int:
    """Open the line; return its descriptor, non-blocking."""
    if sys.argv[1] == "tty":
        descriptor = os.open(sys.argv[2], os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(descriptor)
        return descriptor
    if sys.argv[1] == "dial":
        return dialled(sys.argv[2])
    own, board, channel = sys.argv[2:]
    with socket.socket(socket.AF_BLUETOOTH, socket.SOCK_STREAM, socket.BTPROTO_RFCOMM) as dialling:
        dialling.bind((own, 0))
        dialling.settimeout(_CONNECT_S)
        dialling.connect((board, int(channel)))
        dialling.settimeout(0)
        return dialling.detach()


def dialled(uri: str) -> int:
    """Open the line as a host's link does."""
    sys.path.insert(0, "/usr/lib/tandemscan")  # only the guest has it
    from common.errors import UnavailableError  # noqa: PLC0415 - from there
    from common.link.factory import open_link, parse_link  # noqa: PLC0415
    from common.link.stream import Opening  # noqa: PLC0415

    try:
        link: Any = open_link(parse_link(uri, listens_by_default=False))
    except UnavailableError as error:
        print(error, file=sys.stderr)
        raise OSError from None
    while isinstance(line := link.open_line(), Opening):
        time.sleep(_RETRY_S)
    return int(line.connected.detach())


def join(line: int) -> bool:
    """Carry bytes both ways until the line is lost; return whether stdin has ended."""
    waiting = b""
    while True:
        readers = [line] if waiting else [line, 0]
        readable, writable, _ = select.select(readers, [line] if waiting else [], [])
        if 0 in readable:
            waiting = os.read(0, 4096)
            if not waiting:
                return True
        if line in readable:
            data = os.read(line, 65536)
            if not data:
                return False
            while data:
                data = data[os.write(1, data) :]
        if line in writable:
            waiting = waiting[os.write(line, waiting) :]


def main() -> None:
    """Carry on until stdin ends."""
    while True:
        try:
            line = open_line()
        except OSError:
            time.sleep(_RETRY_S)
            if select.select([0], [], [], 0)[0] and not os.read(
                0, 65536
            ):  # what nobody could take is lost, as on a pulled cable
                return
            continue
        try:
            if join(line):
                return
        except OSError as error:
            print(f"line lost: {error}", file=sys.stderr)
        finally:
            os.close(line)


if __name__ == "__main__":
    main()
