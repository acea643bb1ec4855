"""The records of an MCAP file, parsed, and what they hold: messages, attachments, metadata, and places where something is missing. Pure.

Source: the MCAP specification, version 0, section Records (https://mcap.dev/spec). Records may have more bytes than their kind: later versions add fields.
"""

import struct
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from common.recording.file_bytes import FileBytes, StoredData, pieces
from common.words import counted

MAGIC: Final = b"\x89MCAP0\r\n"
CHANNELS: Final = "channels"
"""Name of the metadata record in which a recording tells its channels outside of any chunk: chunk 1 may be the spoiled one."""

MOST_CHUNK_BYTES: Final = 128 << 20
"""Largest chunk that is decompressed, and largest message: one image of 8K in colour is 100 MB. Usual chunks have 1 to 4 MB."""


class InflateError(ValueError):
    """Raised for a chunk whose compression cannot be undone. The file's fault.

    Args:
        words: what is wrong.
        inflated_bytes: how many bytes it became until that was known, at most.
    """

    def __init__(self, words: str, inflated_bytes: int = 0) -> None:
        super().__init__(words)
        self.inflated_bytes = inflated_bytes


@dataclass(frozen=True, slots=True)
class Channel:
    """What the messages of a channel are.

    Attributes:
        topic: such as /left/image/compressed.
        kind: name of the message, such as sensor_msgs/msg/CompressedImage; empty: it has no schema.
        encoding: cdr, json or another.
    """

    topic: str
    kind: str
    encoding: str


@dataclass(frozen=True, slots=True, eq=False)
class Message:
    """A message.

    Attributes:
        channel: what it is; None: the record that said so is lost.
        number: of its channel, as it stands in the file.
        sequence: as its writer counted.
        log_ns: when it was received.
        publish_ns: when it was sent.
        data: its bytes: a view of its chunk, which stays in memory as long as this view.
        stored: where its bytes can be had again; None: the whole file is in memory.
    """

    channel: Channel | None
    number: int
    sequence: int
    log_ns: int
    publish_ns: int
    data: memoryview
    stored: "StoredMessage | None" = None


@dataclass(frozen=True, slots=True, eq=False)
class Attachment:
    """A file in the file.

    Attributes:
        name: its name.
        data: its content: a part of the file.
    """

    name: str
    data: StoredData


@dataclass(frozen=True, slots=True)
class Metadata:
    """Values by name.

    Attributes:
        name: of the whole.
        values: the values.
    """

    name: str
    values: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class Damage:
    """A place where something is missing.

    Attributes:
        at: where, bytes from the file's begin.
        lost: how many bytes were passed over.
        words: what is wrong there.
    """

    at: int
    lost: int
    words: str

    @property
    def text(self) -> str:
        """For people: what is wrong, and where, if it is at one place."""
        return f"at byte {self.at}: {self.words}; {counted(self.lost, 'byte')} passed over" if self.lost else self.words


class Chunk:
    """A chunk that is compressed.

    Args:
        latest: the chunk whose compression was undone last, of all chunks of a file, and what it became.
        inflate: undoes the compression.
        compression: its name.
        packed: the bytes in the file.
        size: how many bytes they are once the compression is undone.
    """

    def __init__(
        self, latest: "dict[Chunk, memoryview]", inflate: "Inflate", compression: str, packed: StoredData, size: int
    ) -> None:
        self._latest, self._inflate = latest, inflate
        self._compression, self._packed, self._size = compression, packed, size

    def records(self) -> memoryview:
        """Undo the compression.

        Raises:
            InflateError: it cannot be undone.
        """
        records = self._latest.get(self)
        if records is None:
            self._latest.clear()  # first: so that no two are held
            records = self._inflate(self._compression, memoryview(bytes(self._packed)), self._size)
            self._latest[self] = records
        return records


@dataclass(frozen=True, slots=True, eq=False)
class StoredMessage:
    """Where a message stands.

    Attributes:
        place: the compressed chunk in which it is, or a part of the file.
        at: where its bytes begin in the chunk's records, or in the part.
        size: how many they are.
    """

    place: Chunk | FileBytes
    at: int
    size: int

    def read(self) -> memoryview:
        """Return its bytes.

        Raises:
            InflateError: the compression of its chunk cannot be undone.
            DataError: the file became shorter.
        """
        records = self.place.records() if isinstance(self.place, Chunk) else self.place
        return memoryview(bytes(records[self.at : self.at + self.size]))


Record = Message | Attachment | Metadata | Damage
Inflate = Callable[[str, memoryview, int], memoryview]
"""Takes the compression's name, the data and the size wanted; returns the data. Raises InflateError: it cannot."""


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

    Args:
        form: of the numbers.
        data: where they stand.
        at: where they begin.

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
