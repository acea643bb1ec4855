"""Image files whose metadata say how they are to be turned, put together by hand so that no reader of the product is involved."""

import struct
import zlib

from phone_host.model import Image
from tests.support.pictures import encoded

SUFFIXES = (".jpg", ".png", ".tiff", ".webp")
"""The kinds of files that can say it."""


def exif(orientation: int, order: str = "<") -> bytes:
    """EXIF metadata with two entries: the camera's maker (a text) and the orientation."""
    entries = struct.pack(f"{order}HHI4s", 271, 2, 4, b"abc\0")
    entries += struct.pack(f"{order}HHIHH", 274, 3, 1, orientation, 0)
    start = {"<": b"II*\0", ">": b"MM\0*"}[order]
    return start + struct.pack(f"{order}IH", 8, 2) + entries + struct.pack(f"{order}I", 0)


def oriented(suffix: str, image: Image, orientation: int, order: str = "<") -> bytes:
    """A file that holds these pixels in this order and has the orientation in its metadata."""
    content = encoded(suffix, image)
    metadata = exif(orientation, order)
    match suffix:
        case ".jpg":
            segment = b"Exif\0\0" + metadata
            return content[:2] + b"\xff\xe1" + struct.pack(">H", 2 + len(segment)) + segment + content[2:]
        case ".png":
            chunk = b"eXIf" + metadata
            at = 33  # behind IHDR
            return (
                content[:at]
                + struct.pack(">I", len(metadata))
                + chunk
                + struct.pack(">I", zlib.crc32(chunk))
                + content[at:]
            )
        case ".tiff":
            return _with_entry(content, orientation)
        case ".webp":
            return _extended_webp(content, image, metadata)
    raise AssertionError(suffix)


def _with_entry(tiff: bytes, orientation: int) -> bytes:
    """The TIFF with its first directory moved to the end, where there is room for one more entry."""
    assert tiff[:4] == b"II*\0"
    (at,) = struct.unpack_from("<I", tiff, 4)
    (count,) = struct.unpack_from("<H", tiff, at)
    entries = [tiff[at + 2 + 12 * i : at + 14 + 12 * i] for i in range(count)]
    entries = [entry for entry in entries if struct.unpack_from("<H", entry)[0] != 274]
    entries.append(struct.pack("<HHIHH", 274, 3, 1, orientation, 0))
    entries.sort(key=lambda entry: struct.unpack_from("<H", entry)[0])
    body = tiff + b"\0" * (len(tiff) % 2)
    directory = struct.pack("<H", len(entries)) + b"".join(entries) + struct.pack("<I", 0)
    return body[:4] + struct.pack("<I", len(body)) + body[8:] + directory


def _extended_webp(webp: bytes, image: Image, metadata: bytes) -> bytes:
    """The WebP in an extended file with EXIF behind its image (RFC 9649, 2.7)."""
    height_px, width_px = image.shape[:2]
    header = struct.pack("<B3x", 0x08) + (width_px - 1).to_bytes(3, "little") + (height_px - 1).to_bytes(3, "little")
    chunks = [
        (b"VP8X", header),
        (webp[12:16], webp[20 : 20 + struct.unpack_from("<I", webp, 16)[0]]),
        (b"EXIF", metadata),
    ]
    body = b"".join(kind + struct.pack("<I", len(data)) + data + b"\0" * (len(data) % 2) for kind, data in chunks)
    return b"RIFF" + struct.pack("<I", 4 + len(body)) + b"WEBP" + body
