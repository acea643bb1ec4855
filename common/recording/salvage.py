"""Reads an MCAP file record by record and gives everything that is whole, whatever happened to the rest. Pure: bytes in, records out.

A file that was cut, or in which bytes flipped, has no summary that could be trusted: so none is needed. A chunk counts as whole if its
checksum is right. Behind a spoiled record the next one is looked for by its form, not by the length that the spoiled one claims.
Source: the MCAP specification, version 0, sections Records and Chunk (https://mcap.dev/spec).
"""

import re
import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

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
_STARTS: Final = re.compile(b"[\x06\x09\x0c\x0f]")
_LONGEST_NAME: Final = 64


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
        data: its bytes: a view of the file.
    """

    channel: Channel | None
    number: int
    sequence: int
    log_ns: int
    publish_ns: int
    data: memoryview


@dataclass(frozen=True, slots=True, eq=False)
class Attachment:
    """A file in the file.

    Attributes:
        name: its name.
        data: its content: a view of the file.
    """

    name: str
    data: memoryview


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


Record = Message | Attachment | Metadata | Damage
Inflate = Callable[[str, memoryview, int], memoryview]
"""Takes the compression's name, the data and the size wanted; returns the data. Raises ValueError: it cannot."""


class _SpoiledError(ValueError):
    """Raised for a record that is not whole."""


def is_mcap(data: memoryview) -> bool:
    """Return whether this is an MCAP file, even one of whose first bytes some are wrong."""
    return sum(one == other for one, other in zip(data[: len(MAGIC)], MAGIC, strict=False)) > len(MAGIC) // 2


class Salvage:
    """Reads a file.

    Attributes:
        is_complete: whether the file was ended in order; known once all was read.

    Args:
        data: the whole file.
        inflate: for chunks that are compressed.
    """

    def __init__(self, data: memoryview, inflate: Inflate) -> None:
        self._data, self._inflate = data, inflate
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, Channel] = {}
        self.is_complete = False

    def records(self) -> Iterator[Record]:
        """Return all records that are whole, in the order of the file, and each place where something is missing."""
        at = len(MAGIC)
        while at < len(self._data):
            try:
                opcode, content = self._record(at)
                found = list(self._top(opcode, content))
            except _SpoiledError as spoiled:
                behind = self._next_start(at + 1)
                yield Damage(at, behind - at, str(spoiled))
                at = behind
                continue
            yield from found
            at += _HEAD.size + len(content)
            if opcode == _DATA_END:
                self.is_complete = True
                return

    def _record(self, at: int) -> tuple[int, memoryview]:
        """Return the opcode and content of the record at a place."""
        if at + _HEAD.size > len(self._data):
            raise _SpoiledError("the file ends in the middle of a record")
        opcode, length = _HEAD.unpack_from(self._data, at)
        if not 0 < opcode <= _LAST_OPCODE:
            raise _SpoiledError("no record begins here")
        content = self._data[at + _HEAD.size : at + _HEAD.size + length]
        if len(content) < length:
            raise _SpoiledError("the file ends in the middle of a record")
        return opcode, content

    def _top(self, opcode: int, content: memoryview) -> Iterator[Record]:
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
                yield from self._inner(opcode, content)

    def _chunk(self, content: memoryview) -> Iterator[Record]:
        _, _, size, checksum = _unpacked(_CHUNK, content, 0)
        compression, at = _text(content, _CHUNK.size)
        (length,) = _unpacked(_LENGTH, content, at)
        packed = content[at + _LENGTH.size :]
        if len(packed) != length:
            raise _SpoiledError("a chunk contradicts itself")
        try:
            records = self._inflate(compression, packed, size) if compression else packed
        except ValueError as error:
            raise _SpoiledError(str(error)) from error
        if len(records) != size or (checksum and zlib.crc32(records) != checksum):
            raise _SpoiledError("the checksum of a chunk is wrong")
        at = 0
        while at < len(records):
            opcode, inner = _unpacked(_HEAD, records, at)
            taken = records[at + _HEAD.size : at + _HEAD.size + inner]
            if len(taken) != inner:
                raise _SpoiledError("a chunk contradicts itself")
            yield from self._inner(opcode, taken)
            at += _HEAD.size + inner

    def _inner(self, opcode: int, content: memoryview) -> Iterator[Message]:
        if opcode == _SCHEMA:
            (number,) = _unpacked(_SHORT, content, 0)
            self._schemas[number] = _text(content, _SHORT.size)[0]
        elif opcode == _CHANNEL:
            number, schema = _unpacked(_TWO_SHORTS, content, 0)
            topic, at = _text(content, _TWO_SHORTS.size)
            self._channels[number] = Channel(topic, self._schemas.get(schema, ""), _text(content, at)[0])
        elif opcode == _MESSAGE_OPCODE:
            number, sequence, log_ns, publish_ns = _unpacked(_MESSAGE, content, 0)
            data = content[_MESSAGE.size :]
            yield Message(self._channels.get(number), number, sequence, log_ns, publish_ns, data)

    def _tell_channels(self, values: Mapping[str, str]) -> None:
        for number, told in values.items():
            topic, _, rest = told.partition(" ")
            kind, _, encoding = rest.partition(" ")
            if number.isdecimal():
                self._channels.setdefault(int(number), Channel(topic, kind, encoding))

    def _next_start(self, at: int) -> int:
        """Return where the next record that is whole by its form begins; the file's end, if there is none."""
        for found in _STARTS.finditer(self._data, at):
            if self._may_start(found.start()):
                return found.start()
        return len(self._data)

    def _may_start(self, at: int) -> bool:
        try:
            opcode, content = self._record(at)
            if opcode == _CHUNK_OPCODE:
                _text(content, _CHUNK.size)
                next(self._chunk(content), None)
            elif opcode == _ATTACHMENT:
                _attachment(content)
            elif opcode == _METADATA:
                _metadata(content)
            else:
                return len(content) == _SUM.size
        except _SpoiledError:
            return False
        return True


_LENGTH: Final = struct.Struct("<Q")
_SHORT: Final = struct.Struct("<H")
_TWO_SHORTS: Final = struct.Struct("<HH")
_SUM: Final = struct.Struct("<I")


def _unpacked(form: struct.Struct, data: memoryview, at: int) -> tuple[int, ...]:
    if at + form.size > len(data):
        raise _SpoiledError("a record is shorter than its kind")
    return form.unpack_from(data, at)


def _text(data: memoryview, at: int) -> tuple[str, int]:
    """Return a text, and where what follows begins."""
    (length,) = _unpacked(_SUM, data, at)
    raw = bytes(data[at + _SUM.size : at + _SUM.size + length])
    if len(raw) < length:
        raise _SpoiledError("a record is shorter than its kind")
    try:
        return raw.decode(), at + _SUM.size + length
    except UnicodeDecodeError:
        raise _SpoiledError("a name is not UTF-8") from None


def _attachment(content: memoryview) -> Attachment:
    name, at = _text(content, 16)
    _, at = _text(content, at)
    (length,) = _unpacked(_LENGTH, content, at)
    data = content[at + _LENGTH.size : at + _LENGTH.size + length]
    (checksum,) = _unpacked(_SUM, content, len(content) - _SUM.size)
    if (
        len(data) != length
        or at + _LENGTH.size + length + _SUM.size != len(content)
        or not 0 < len(name) <= _LONGEST_NAME
    ):
        raise _SpoiledError("an attachment contradicts itself")
    if checksum and zlib.crc32(content[: -_SUM.size]) != checksum:
        raise _SpoiledError(f"the checksum of the attachment {name!r} is wrong")
    return Attachment(name, data)


def _metadata(content: memoryview) -> Metadata:
    name, at = _text(content, 0)
    (length,) = _unpacked(_SUM, content, at)
    at += _SUM.size
    if at + length != len(content) or not 0 < len(name) <= _LONGEST_NAME:
        raise _SpoiledError("a metadata record contradicts itself")
    values: dict[str, str] = {}
    while at < len(content):
        key, at = _text(content, at)
        values[key], at = _text(content, at)
    return Metadata(name, values)
