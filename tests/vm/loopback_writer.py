"""Runs in the guest: writes JPEGs to v4l2loopback's device (start and end marker, no image between), ten a second, until it is ended.

loopback_writer.py DEVICE WIDTH HEIGHT
"""

import fcntl
import struct
import sys
import time
from pathlib import Path

_S_FMT = 3 << 30 | 208 << 16 | ord("V") << 8 | 5  # VIDIOC_S_FMT with its struct of 208 bytes (64 bit)
_OUTPUT, _FIELD_NONE, _MJPG = 2, 1, int.from_bytes(b"MJPG", "little")
_JPEG = b"\xff\xd8" + bytes(8000) + b"\xff\xd9"


def main() -> None:
    """Set the format, then write for ever."""
    width_px, height_px = int(sys.argv[2]), int(sys.argv[3])
    pixels = struct.pack("<6I", width_px, height_px, _MJPG, _FIELD_NONE, 0, 4 * width_px * height_px)
    with Path(sys.argv[1]).open("wb", buffering=0) as device:
        fcntl.ioctl(device, _S_FMT, bytearray((struct.pack("<2I", _OUTPUT, 0) + pixels).ljust(208, b"\0")))
        while True:
            device.write(_JPEG)
            time.sleep(0.1)


if __name__ == "__main__":
    main()
