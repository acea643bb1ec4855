"""Images of a few bytes that ask for gigabytes."""

import struct
import zlib
from functools import cache
from typing import Final

from tests.support.numbered import draw
from tests.support.pictures import encoded

HUGE_PX: Final = 30_000
LARGE_PX: Final = 16_000


@cache
def jpeg_bomb(size_px: int = HUGE_PX) -> bytes:
    """A small JPEG whose frame header (SOF0, ITU-T T.81 B.2.2) claims a huge square."""
    data = bytearray(encoded(".jpg", draw(0)))
    at = data.index(b"\xff\xc0") + 5
    data[at : at + 4] = struct.pack(">HH", size_px, size_px)
    return bytes(data)


@cache
def png_bomb(size_px: int = LARGE_PX) -> bytes:
    """A sound PNG of a large black square: as good as nothing when compressed (PNG 1.2, 11.2)."""
    packer, row = zlib.compressobj(9), bytes(1 + size_px)
    body = b"".join(packer.compress(row) for _ in range(size_px)) + packer.flush()
    header = struct.pack(">IIBBBBB", size_px, size_px, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        _chunk(*part) for part in ((b"IHDR", header), (b"IDAT", body), (b"IEND", b""))
    )


@cache
def torn_jpeg() -> bytes:
    """A JPEG with its start, its end and nonsense between."""
    data = bytearray(encoded(".jpg", draw(0)))
    middle = len(data) // 2
    data[middle : middle + 200] = bytes(value ^ 0x5A for value in data[middle : middle + 200])
    return bytes(data).replace(b"\xff\xd9", b"\xfe\xd9")[:-2] + b"\xff\xd9"


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
