"""Adds texts to a PNG file: what its pixels mean. Pure.

Source: PNG specification (third edition), sections 5.3 (chunks) and 11.3.3.2 (tEXt).
"""

import struct
import zlib
from typing import Final

_BEFORE_CHUNKS: Final = 8  # the signature
_HEADER_END: Final = _BEFORE_CHUNKS + 12 + 13
"""IHDR, always the first chunk: 13 bytes of data; length, kind and CRC take 12."""


def with_text(png: bytes, keyword: str, text: str) -> bytes:
    """Add a tEXt chunk behind the header.

    Args:
        png: a whole PNG file.
        keyword: 1 to 79 letters of Latin-1.
        text: Latin-1, without the character 0.

    Returns:
        The file with the chunk.
    """
    body = b"tEXt" + keyword.encode("latin-1") + b"\0" + text.encode("latin-1")
    chunk = struct.pack(">I", len(body) - 4) + body + struct.pack(">I", zlib.crc32(body))
    return png[:_HEADER_END] + chunk + png[_HEADER_END:]
