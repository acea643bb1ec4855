"""Images that are not what they claim to be, and honest ones that are hard to tell from them; all are at most some hundred kilobytes."""

import struct
import zlib
from collections.abc import Iterator
from functools import cache

import cv2
import numpy as np

from phone_host.model import Image
from tests.support.numbered import draw
from tests.support.pictures import encoded, jpeg, picture

PNG_START = b"\x89PNG\r\n\x1a\n"
_PASSES = ((0, 8, 0, 8), (4, 8, 0, 8), (0, 4, 4, 8), (2, 4, 0, 4), (0, 2, 2, 4), (1, 2, 0, 2), (0, 1, 1, 2))
"""Adam7: first column, step, first row, step of each pass (PNG specification, 8.1)."""


def chunk(kind: bytes, body: bytes) -> bytes:
    """A PNG chunk."""
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def black_png(
    width_px: int, height_px: int, *, bits: int = 8, colour: int = 2, interlaced: bool = False, extra: bytes = b""
) -> bytes:
    """A valid PNG of black pixels, compressed to a thousandth of its unpacked size.

    Args:
        width_px: width, px.
        height_px: height, px.
        bits: per channel.
        colour: 0 grey, 2 colour, 6 colour and alpha.
        interlaced: whether in seven passes.
        extra: chunks before the pixels.
    """
    channels = {0: 1, 2: 3, 6: 4}[colour]
    packer = zlib.compressobj(9)
    passes = _PASSES if interlaced else ((0, 1, 0, 1),)
    packed = []
    for x, step_x, y, step_y in passes:
        columns, rows = -(-(width_px - x) // step_x), -(-(height_px - y) // step_y)
        row = bytes(1 + (columns * channels * bits + 7) // 8)
        packed += [packer.compress(row) for _ in range(rows if columns > 0 else 0)]
    header = struct.pack(">IIBBBBB", width_px, height_px, bits, colour, 0, 0, interlaced)
    pixels = b"".join((*packed, packer.flush()))
    return PNG_START + chunk(b"IHDR", header) + extra + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")


def packed_zeros(megabytes: int) -> bytes:
    """This many megabytes of zeros, compressed a thousandfold."""
    packer = zlib.compressobj(9)
    return b"".join(packer.compress(bytes(2**20)) for _ in range(megabytes)) + packer.flush()


def claiming(content: bytes, width_px: int, height_px: int) -> bytes:
    """A JPEG or PNG whose header claims another size."""
    if content.startswith(PNG_START):
        header = struct.pack(">II", width_px, height_px) + content[24:29]
        return PNG_START + chunk(b"IHDR", header) + content[33:]
    at = next(at for code, at in _markers(content) if 0xC0 <= code <= 0xC2)
    return content[: at + 5] + struct.pack(">HH", height_px, width_px) + content[at + 9 :]


def with_scans(content: bytes, scans: int) -> bytes:
    """A progressive JPEG whose last scan is repeated this many more times."""
    starts = [at for code, at in _markers(content) if code == 0xDA]
    return content[:-2] + content[starts[-1] : -2] * scans + b"\xff\xd9"


def progressive(width_px: int = 64, height_px: int = 48) -> bytes:
    """A progressive JPEG of the usual ten scans."""
    done, data = cv2.imencode(".jpg", picture(width_px, height_px), [cv2.IMWRITE_JPEG_PROGRESSIVE, 1])
    assert done
    return data.tobytes()


def textured(width_px: int = 640, height_px: int = 480) -> Image:
    """An image with texture in every block, (H, W, 3) uint8."""
    noise = np.random.default_rng(7).integers(0, 256, (height_px, width_px, 3), dtype=np.uint8)
    return np.asarray(cv2.GaussianBlur(noise, (0, 0), 1.5), np.uint8)


def textured_jpeg(restart: int = 0) -> bytes:
    """A JPEG of that image, with a restart marker after this many rows of blocks."""
    done, data = cv2.imencode(".jpg", textured(), [cv2.IMWRITE_JPEG_RST_INTERVAL, restart])
    assert done
    return data.tobytes()


def scan_start(content: bytes) -> int:
    """Where a JPEG's compressed data begins."""
    at = next(at for code, at in _markers(content) if code == 0xDA)
    return at + 2 + int.from_bytes(content[at + 2 : at + 4], "big")


def _markers(content: bytes) -> Iterator[tuple[int, int]]:
    """Code and offset of each segment, including those between scans."""
    at = 2
    while at + 4 <= len(content):
        code, length = content[at + 1], int.from_bytes(content[at + 2 : at + 4], "big")
        yield code, at
        at += 2 + length
        while (
            code == 0xDA
            and at < len(content)
            and not (content[at] == 0xFF and content[at + 1] not in {0, *range(0xD0, 0xD8)})
        ):
            at += 1


HUGE_PX = 30_000
LARGE_PX = 16_000


@cache
def jpeg_bomb(size_px: int = HUGE_PX) -> bytes:
    """A small JPEG that claims a huge square."""
    return claiming(jpeg(), size_px, size_px)


@cache
def png_bomb(size_px: int = LARGE_PX) -> bytes:
    """A valid PNG of a large black square."""
    return black_png(size_px, size_px, colour=0)


@cache
def torn_jpeg() -> bytes:
    """A JPEG with its start, its end and nonsense in between."""
    data = bytearray(encoded(".jpg", draw(0)))
    middle = len(data) // 2
    data[middle : middle + 200] = bytes(value ^ 0x5A for value in data[middle : middle + 200])
    return bytes(data).replace(b"\xff\xd9", b"\xfe\xd9")[:-2] + b"\xff\xd9"


SMALL_BOMB = claiming(jpeg(16, 8), 30_000, 30_000)
"""A JPEG of some hundred bytes that claims 2.7 GB of pixels."""
