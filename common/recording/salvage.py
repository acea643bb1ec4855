"""Reads an MCAP file record by record and gives everything that is whole, whatever happened to the rest. Pure: bytes in, records out.

A file that was cut, or in which bytes flipped, has no summary that could be trusted: so none is needed. A chunk counts as whole if its
checksum is right. Behind a spoiled record the next one is looked for by its form, not by the length that the spoiled one claims. Bytes that look
like the heads of records and are none are tried until that has cost a few times the file: the time grows with the file's length, whoever made it.
Source: the MCAP specification, version 0, sections Records and Chunk (https://mcap.dev/spec).
"""

import re
import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from common.recording.file_bytes import FileBytes, StoredData, pieces
from common.words import counted

MAGIC: Final = b"\x89MCAP0\r\n"
CHANNELS: Final = "channels"
"""Name of the metadata record in which a recording tells its channels outside of any chunk: chunk 1 may be the spoiled one."""

_HEAD: Final = struct.Struct("<BQ")
_MESSAGE: Final = struct.Struct("<HIQQ")
_CHUNK: Final = struct.Struct("<QQQI")
_SCHEMA, _CHANNEL, _MESSAGE_OPCODE, _CHUNK_OPCODE = 0x03, 0x04, 0x05, 0x06
_ATTACHMENT, _METADATA, _DATA_END = 0x09, 0x0C, 0x0F
_LAST_OPCODE: Final = 0x0F
_IN_CHUNKS: Final = frozenset({_SCHEMA, _CHANNEL, _MESSAGE_OPCODE})
_STARTS: Final = re.compile(b"[\x06\x09\x0c\x0f]")
_LONGEST_NAME: Final = 64
_LONGEST_NAME_BYTES: Final = 4 * _LONGEST_NAME
_LONGEST_TEXT: Final = 1 << 20
"""Longest text in a record outside of metadata, bytes."""

_MOST_INFLATED: Final = 64
"""How many times the file's length its chunks may become when they are decompressed, all together. Raw images of a real scene become 2 to 5 times
as large."""

_ALWAYS_INFLATED_BYTES: Final = 64 << 20
"""As many bytes may always be."""

MOST_TRIED: Final = 4
"""How many times the file's length the bytes of records that turn out to be none may be looked at. Each spoiled record of an honest file costs its
own length once."""

_MOST_TRIED_BYTES: Final = 16 << 20
"""As many may always be."""


_MOST_AT_ONCE_BYTES: Final = 16 << 20
"""Longest chunk that is read at once. Ours have 1 MB, those of other programs up to 4."""

MOST_CHUNK_BYTES: Final = 128 << 20
"""Largest chunk that is decompressed, and largest message: one image of 8K in colour is 100 MB. Usual chunks have 1 to 4 MB."""


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
            ValueError: it cannot be undone.
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
            ValueError: the compression of its chunk cannot be undone.
            DataError: the file became shorter.
        """
        records = self.place.records() if isinstance(self.place, Chunk) else self.place
        return memoryview(bytes(records[self.at : self.at + self.size]))


Record = Message | Attachment | Metadata | Damage
Inflate = Callable[[str, memoryview, int], memoryview]
"""Takes the compression's name, the data and the size wanted; returns the data. Raises ValueError: it cannot."""


class _SpoiledError(ValueError):
    """Raised for a record that is not whole.

    Args:
        words: what is wrong.
        tried_bytes: how many bytes were looked at to find out.
    """

    def __init__(self, words: str, tried_bytes: int = 0) -> None:
        super().__init__(words)
        self.tried_bytes = tried_bytes


def is_mcap(data: StoredData) -> bool:
    """Return whether this is an MCAP file, even one of whose first bytes some are wrong."""
    return sum(one == other for one, other in zip(bytes(data[: len(MAGIC)]), MAGIC, strict=False)) > len(MAGIC) // 2


class Salvage:
    """Reads a file.

    Attributes:
        is_complete: whether the file was ended in order; known once all was read.
        tried_bytes: how many bytes were looked at in all records that are none.
        inflated_bytes: how many bytes chunks became that were decompressed.

    Args:
        data: the whole file.
        inflate: for chunks that are compressed.
    """

    def __init__(self, data: StoredData, inflate: Inflate) -> None:
        self._data, self._inflate = data, inflate
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, Channel] = {}
        self._latest: dict[Chunk, memoryview] = {}
        self.is_complete = False
        self.tried_bytes = self.inflated_bytes = 0

    def records(self) -> Iterator[Record]:
        """Return all records that are whole, in the order of the file, and each place where something is missing."""
        at = len(MAGIC)
        while at < len(self._data):
            try:
                opcode, content = self._record(at)
                found = list(self._top(opcode, content))
            except _SpoiledError as spoiled:
                self.tried_bytes += spoiled.tried_bytes
                behind = self._next_start(at + 1)
                yield Damage(at, behind - at, str(spoiled))
                at = behind
                continue
            yield from found
            at += _HEAD.size + len(content)
            if opcode == _DATA_END:
                self.is_complete = True
                return

    def _record(self, at: int) -> tuple[int, StoredData]:
        """Return the opcode and content of the record at a place."""
        if at + _HEAD.size > len(self._data):
            raise _SpoiledError("the file ends in the middle of a record")
        opcode, length = _HEAD.unpack(bytes(self._data[at : at + _HEAD.size]))
        if not 0 < opcode <= _LAST_OPCODE:
            raise _SpoiledError("no record begins here")
        content = self._data[at + _HEAD.size : at + _HEAD.size + length]
        if len(content) < length:
            raise _SpoiledError("the file ends in the middle of a record")
        return opcode, content

    def _top(self, opcode: int, content: StoredData) -> Iterator[Record]:
        """Take in a record outside of chunks."""
        match opcode:
            case 0x06:
                yield from self._chunk(content)
            case 0x09:
                yield _attachment(content)
            case 0x0C:
                metadata = _metadata(content)
                if metadata.name == CHANNELS:
                    self._tell_channels(metadata.values)
                yield metadata
            case _:
                yield from self._inner(opcode, content, content, 0)

    def _chunk(self, content: StoredData) -> Iterator[Record]:
        _, _, size, checksum = _unpacked(_CHUNK, content, 0)
        compression, at = _text(content, _CHUNK.size, _LONGEST_NAME_BYTES)
        (length,) = _unpacked(_LENGTH, content, at)
        packed = content[at + _LENGTH.size :]
        if len(packed) != length or (not compression and length != size):
            raise _SpoiledError("a chunk contradicts itself")
        chunk = Chunk(self._latest, self._inflate, compression, packed, size) if compression else None
        if chunk is not None:
            self.inflated_bytes += size
            if self.inflated_bytes > _MOST_INFLATED * len(self._data) + _ALWAYS_INFLATED_BYTES:
                raise _SpoiledError("the chunks become larger than is believed: undo their compression first")
        try:
            records = chunk.records() if chunk is not None else _in_memory(packed)
        except ValueError as error:
            raise _SpoiledError(str(error), max(size, length)) from error
        if len(records) != size or (checksum and _crc32(records) != checksum):
            raise _SpoiledError("the checksum of a chunk is wrong", max(size, length))
        place = chunk if chunk is not None else packed
        at = 0
        try:
            while at < size:
                opcode, inner = _unpacked(_HEAD, records, at)
                at += _HEAD.size
                taken = records[at : at + inner]
                if len(taken) != inner or opcode not in _IN_CHUNKS:
                    raise _SpoiledError("a chunk contradicts itself")
                yield from self._inner(opcode, taken, place, at)
                at += inner
        except _SpoiledError as spoiled:
            raise _SpoiledError(str(spoiled), size) from None

    def _inner(self, opcode: int, content: StoredData, place: Chunk | StoredData, begin: int) -> Iterator[Message]:
        """Take in a record that may stand in a chunk. It can be had again there, from where it begins."""
        if opcode == _SCHEMA:
            (number,) = _unpacked(_SHORT, content, 0)
            self._schemas[number] = _text(content, _SHORT.size)[0]
        elif opcode == _CHANNEL:
            number, schema = _unpacked(_TWO_SHORTS, content, 0)
            topic, at = _text(content, _TWO_SHORTS.size)
            self._channels[number] = Channel(topic, self._schemas.get(schema, ""), _text(content, at)[0])
        elif opcode == _MESSAGE_OPCODE:
            number, sequence, log_ns, publish_ns = _unpacked(_MESSAGE, content, 0)
            if len(content) > MOST_CHUNK_BYTES:
                raise _SpoiledError("a message is larger than is believed")
            body = content[_MESSAGE.size :]
            data = body if isinstance(body, memoryview) else memoryview(bytes(body))
            where = None if isinstance(place, memoryview) else StoredMessage(place, begin + _MESSAGE.size, len(data))
            yield Message(self._channels.get(number), number, sequence, log_ns, publish_ns, data, where)

    def _tell_channels(self, values: Mapping[str, str]) -> None:
        for number, told in values.items():
            topic, _, rest = told.partition(" ")
            kind, _, encoding = rest.partition(" ")
            if number.isdecimal():
                self._channels.setdefault(int(number), Channel(topic, kind, encoding))

    def _next_start(self, at: int) -> int:
        """Return where the next record that is whole by its form begins; the file's end, if there is none."""
        most = MOST_TRIED * len(self._data) + _MOST_TRIED_BYTES
        for begin, piece in pieces(self._data, at):
            for found in _STARTS.finditer(piece):
                if self._may_start(begin + found.start()):
                    return begin + found.start()
                if self.tried_bytes > most:
                    return len(self._data)
        return len(self._data)

    def _may_start(self, at: int) -> bool:
        try:
            opcode, content = self._record(at)
            if opcode == _CHUNK_OPCODE:
                next(self._chunk(content), None)
            elif opcode == _ATTACHMENT:
                _attachment(content)
            elif opcode == _METADATA:
                _metadata(content)
            else:
                return len(content) == _SUM.size
        except _SpoiledError as spoiled:
            self.tried_bytes += spoiled.tried_bytes
            return False
        return True


_LENGTH: Final = struct.Struct("<Q")
_SHORT: Final = struct.Struct("<H")
_TWO_SHORTS: Final = struct.Struct("<HH")
_SUM: Final = struct.Struct("<I")


def _unpacked(form: struct.Struct, data: StoredData, at: int) -> tuple[int, ...]:
    if at + form.size > len(data):
        raise _SpoiledError("a record is shorter than its kind")
    return form.unpack(bytes(data[at : at + form.size]))


def _in_memory(packed: StoredData) -> StoredData:
    """Return the records of a chunk: in memory, as it is faster, unless they are so many that they are better read one by one."""
    if isinstance(packed, memoryview) or len(packed) > _MOST_AT_ONCE_BYTES:
        return packed
    return memoryview(bytes(packed))


def _crc32(data: StoredData) -> int:
    if isinstance(data, memoryview):
        return zlib.crc32(data)
    checksum = 0
    for _, piece in pieces(data):
        checksum = zlib.crc32(piece, checksum)
    return checksum


def _text(data: StoredData, at: int, longest: int = _LONGEST_TEXT) -> tuple[str, int]:
    """Return a text, and where what follows begins."""
    (length,) = _unpacked(_SUM, data, at)
    if length > longest or at + _SUM.size + length > len(data):
        raise _SpoiledError("a record is shorter than its kind" if length <= longest else "a name is too long")
    try:
        return bytes(data[at + _SUM.size : at + _SUM.size + length]).decode(), at + _SUM.size + length
    except UnicodeDecodeError:
        raise _SpoiledError("a name is not UTF-8", length) from None


def _attachment(content: StoredData) -> Attachment:
    name, at = _text(content, 16, _LONGEST_NAME_BYTES)
    _, at = _text(content, at, _LONGEST_NAME_BYTES)
    (length,) = _unpacked(_LENGTH, content, at)
    data = content[at + _LENGTH.size : at + _LENGTH.size + length]
    (checksum,) = _unpacked(_SUM, content, len(content) - _SUM.size)
    if (
        len(data) != length
        or at + _LENGTH.size + length + _SUM.size != len(content)
        or not 0 < len(name) <= _LONGEST_NAME
    ):
        raise _SpoiledError("an attachment contradicts itself")
    if checksum and _crc32(content[: -_SUM.size]) != checksum:
        raise _SpoiledError(f"the checksum of the attachment {name!r} is wrong", len(content))
    return Attachment(name, data)


def _metadata(content: StoredData) -> Metadata:
    name, at = _text(content, 0, _LONGEST_NAME_BYTES)
    (length,) = _unpacked(_SUM, content, at)
    at += _SUM.size
    if at + length != len(content) or not 0 < len(name) <= _LONGEST_NAME:
        raise _SpoiledError("a metadata record contradicts itself")
    values: dict[str, str] = {}
    try:
        while at < len(content):
            key, at = _text(content, at, len(content))
            values[key], at = _text(content, at, len(content))
    except _SpoiledError as spoiled:
        raise _SpoiledError(str(spoiled), at) from None
    return Metadata(name, values)
