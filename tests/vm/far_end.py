"""Runs in the guest: joins a line's host end with stdin and stdout, and opens it again whenever it was lost. Standard library only.

far_end.py tty /dev/ttyACM0
far_end.py rfcomm OWN_ADDRESS BOARD_ADDRESS CHANNEL
"""

import os
import select
import socket
import sys
import time
import tty

_RETRY_S = 0.1


def open_line() -> int:
    """Open the line; gives its descriptor, non-blocking."""
    if sys.argv[1] == "tty":
        descriptor = os.open(sys.argv[2], os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(descriptor)
        return descriptor
    own, board, channel = sys.argv[2:]
    with socket.socket(socket.AF_BLUETOOTH, socket.SOCK_STREAM, socket.BTPROTO_RFCOMM) as dialling:
        dialling.bind((own, 0))
        dialling.connect((board, int(channel)))
        dialling.settimeout(0)
        return dialling.detach()


def join(line: int) -> bool:
    """Carry bytes both ways until the line is lost; gives whether stdin has ended."""
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
    """Go on until stdin ends."""
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
