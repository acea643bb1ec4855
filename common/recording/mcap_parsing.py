"""Reads single records of an MCAP file. Pure: bytes in, values out.

Source: the MCAP specification, version 0, section Records (https://mcap.dev/spec). Records may have more bytes than their kind: later versions add fields.
"""

import struct
import zlib
from dataclasses import dataclass
from typing import Final

from common.recording.file_bytes import StoredData, pieces
from common.recording.mcap_records import Attachment, Metadata

LONGEST_NAME_BYTES: Final = 256
_LONGEST_NAME: Final = 64
_LONGEST_TEXT: Final = 1 << 20
"""Longest text in a record outside of metadata, bytes."""

RECORD_HEAD: Final = struct.Struct("<BQ")
_CHUNK: Final = struct.Struct("<QQQI")
_LENGTH: Final = struct.Struct("<Q")
_SHORT: Final = struct.Struct("<H")
_TWO_SHORTS: Final = struct.Struct("<HH")
_INDEX: Final = struct.Struct("<HI")
WORD: Final = struct.Struct("<I")
"""A checksum, or the length of a text or a block."""


class SpoiledError(ValueError):
    """Raised for a record that is not whole.

    Args:
        words: what is wrong.
        tried_bytes: how many bytes of the file were looked at to find out.
    """

    def __init__(self, words: str, tried_bytes: int = 0) -> None:
        super().__init__(words)
        self.tried_bytes = tried_bytes


@dataclass(frozen=True, slots=True, eq=False)
class ChunkHead:
    """What a chunk says of its records.

    Attributes:
        compression: its name; empty: there is none.
        packed: the records as they stand in the file.
        size: how many bytes they claim to be once the compression is undone.
        checksum: CRC-32 of the records; 0: there is none.
    """

    compression: str
    packed: StoredData
    size: int
    checksum: int


def unpack(form: struct.Struct, data: StoredData, at: int) -> tuple[int, ...]:
    """Read numbers.

    Raises:
        SpoiledError: the data end before them.
    """
    if at + form.size > len(data):
        raise SpoiledError("a record is shorter than its kind")
    return form.unpack(bytes(data[at : at + form.size]))


def crc32(data: StoredData) -> int:
    """Return the CRC-32 of data, which are read piece by piece."""
    if isinstance(data, memoryview):
        return zlib.crc32(data)
    checksum = 0
    for _, piece in pieces(data):
        checksum = zlib.crc32(piece, checksum)
    return checksum


def read_chunk_head(content: StoredData) -> ChunkHead:
    """Read what a chunk says of its records.

    Raises:
        SpoiledError: it contradicts itself.
    """
    _, _, size, checksum = unpack(_CHUNK, content, 0)
    compression, at = _text(content, _CHUNK.size, LONGEST_NAME_BYTES)
    (length,) = unpack(_LENGTH, content, at)
    packed = content[at + _LENGTH.size :]
    if len(packed) != length or (not compression and length != size):
        raise SpoiledError("a chunk contradicts itself")
    return ChunkHead(compression, packed, size, checksum)


def read_schema(content: StoredData) -> tuple[int, str]:
    """Return a schema's number and name.

    Raises:
        SpoiledError: it contradicts itself.
    """
    (number,) = unpack(_SHORT, content, 0)
    name, at = _text(content, _SHORT.size)
    _, at = _text(content, at)
    _require_block(content, at)
    return number, name


def read_channel(content: StoredData) -> tuple[int, int, str, str]:
    """Return a channel's number, the number of its schema, its topic and its encoding.

    Raises:
        SpoiledError: it contradicts itself.
    """
    number, schema = unpack(_TWO_SHORTS, content, 0)
    topic, at = _text(content, _TWO_SHORTS.size)
    encoding, at = _text(content, at)
    _require_block(content, at)
    if not topic:
        raise SpoiledError("a channel has no topic")
    return number, schema, topic, encoding


def require_index(content: StoredData) -> None:
    """Refuse what is no index of a chunk's messages: a chunk would go unnoticed whose kind is wrong.

    Raises:
        SpoiledError: it is none.
    """
    _, length = unpack(_INDEX, content, 0)
    if _INDEX.size + length != len(content):
        raise SpoiledError("an index contradicts itself")


def read_attachment(content: StoredData) -> Attachment:
    """Read a file in the file.

    Raises:
        SpoiledError: it contradicts itself, or its checksum is wrong.
    """
    name, at = _text(content, 16, LONGEST_NAME_BYTES)
    _, at = _text(content, at, LONGEST_NAME_BYTES)
    (length,) = unpack(_LENGTH, content, at)
    data = content[at + _LENGTH.size : at + _LENGTH.size + length]
    (checksum,) = unpack(WORD, content, len(content) - WORD.size)
    if (
        len(data) != length
        or at + _LENGTH.size + length + WORD.size != len(content)
        or not 0 < len(name) <= _LONGEST_NAME
    ):
        raise SpoiledError("an attachment contradicts itself")
    if checksum and crc32(content[: -WORD.size]) != checksum:
        raise SpoiledError(f"the checksum of the attachment {name!r} is wrong", len(content))
    return Attachment(name, data)


def read_metadata(content: StoredData) -> Metadata:
    """Read values by name.

    Raises:
        SpoiledError: they contradict themselves.
    """
    name, at = _text(content, 0, LONGEST_NAME_BYTES)
    (length,) = unpack(WORD, content, at)
    at += WORD.size
    if at + length != len(content) or not 0 < len(name) <= _LONGEST_NAME:
        raise SpoiledError("a metadata record contradicts itself")
    values: dict[str, str] = {}
    try:
        while at < len(content):
            key, at = _text(content, at, len(content))
            values[key], at = _text(content, at, len(content))
    except SpoiledError as spoiled:
        raise SpoiledError(str(spoiled), at) from None
    return Metadata(name, values)


def _text(data: StoredData, at: int, longest: int = _LONGEST_TEXT) -> tuple[str, int]:
    """Return a text, and where what follows begins."""
    (length,) = unpack(WORD, data, at)
    if length > longest or at + WORD.size + length > len(data):
        raise SpoiledError("a record is shorter than its kind" if length <= longest else "a name is too long")
    try:
        return bytes(data[at + WORD.size : at + WORD.size + length]).decode(), at + WORD.size + length
    except UnicodeDecodeError:
        raise SpoiledError("a name is not UTF-8", length) from None


def _require_block(content: StoredData, at: int) -> None:
    """Refuse a record that ends before a block of it which nobody here reads does."""
    (length,) = unpack(WORD, content, at)
    if at + WORD.size + length > len(content):
        raise SpoiledError("a record is shorter than its kind")
