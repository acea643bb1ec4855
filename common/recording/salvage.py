"""Reads an MCAP file record by record and gives everything that is whole, whatever happened to the rest. Pure: bytes in, records out.

A file that was cut, or in which bytes flipped, has no summary that could be trusted: so none is needed. A chunk counts as whole if its
checksum is right. Behind a spoiled record the next one is looked for by its form, not by the length that the spoiled one claims. Bytes that look
like the heads of records and are none are tried until that has cost a few times the file: the time grows with the file's length, whoever made it.
What a record claims is not counted, only what it has cost: a wrong size costs its own record alone.
Source: the MCAP specification, version 0, sections Records and Chunk (https://mcap.dev/spec).
"""

import re
import struct
from collections.abc import Iterator, Mapping
from typing import Final

from common.recording.file_bytes import StoredData, pieces
from common.recording.mcap_records import (
    CHANNELS,
    MAGIC,
    MOST_CHUNK_BYTES,
    RECORD_HEAD,
    WORD,
    Channel,
    Chunk,
    ChunkHead,
    Damage,
    Inflate,
    InflateError,
    Message,
    Record,
    SpoiledError,
    StoredMessage,
    crc32,
    read_attachment,
    read_channel,
    read_chunk_head,
    read_metadata,
    read_schema,
    require_index,
    unpack,
)

_MESSAGE: Final = struct.Struct("<HIQQ")
_HEADER, _SCHEMA, _CHANNEL, _MESSAGE_OPCODE, _CHUNK_OPCODE, _INDEX = 0x01, 0x03, 0x04, 0x05, 0x06, 0x07
_ATTACHMENT, _METADATA, _DATA_END = 0x09, 0x0C, 0x0F
_IN_CHUNKS: Final = frozenset({_SCHEMA, _CHANNEL, _MESSAGE_OPCODE})
_OF_DATA: Final = _IN_CHUNKS | {_HEADER, _CHUNK_OPCODE, _INDEX, _ATTACHMENT, _METADATA, _DATA_END}
"""What may stand before the summary. Any other kind there is a chunk or an attachment of which a bit is wrong."""

_STARTS: Final = re.compile(b"[\x06\x09\x0c\x0f]")

_MOST_INFLATED: Final = 64
"""How many times the file's length its chunks may become when they are decompressed, all together. Raw images of a real scene become 2 to 5 times
as large. As much may be decompressed in vain."""

_ALWAYS_INFLATED_BYTES: Final = 64 << 20
"""As many bytes may always be."""

MOST_TRIED: Final = 4
"""How many times the file's length the bytes of records that turn out to be none may be looked at. Each spoiled record of an honest file costs its
own length once."""

_MOST_TRIED_BYTES: Final = 16 << 20
"""As many may always be."""

_MOST_AT_ONCE_BYTES: Final = 16 << 20
"""Longest chunk that is read at once. Ours have 1 MB, those of other programs up to 4."""


def is_mcap(data: StoredData) -> bool:
    """Return whether this is an MCAP file, even one of whose first bytes some are wrong."""
    return sum(one == other for one, other in zip(bytes(data[: len(MAGIC)]), MAGIC, strict=False)) > len(MAGIC) // 2


class Salvage:
    """Reads a file.

    Attributes:
        is_complete: whether the file was ended in order; known once all was read.
        tried_bytes: how many bytes of the file were looked at in all records that are none.
        inflated_bytes: how many bytes chunks became that were decompressed and are whole.
        wasted_bytes: how many bytes chunks became, at most, that were decompressed and are not.
    """

    def __init__(self, data: StoredData, inflate: Inflate) -> None:
        self._data, self._inflate = data, inflate
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, Channel] = {}
        self._latest: dict[Chunk, memoryview] = {}
        self._most_inflated_bytes = _MOST_INFLATED * len(data) + _ALWAYS_INFLATED_BYTES
        self.is_complete = False
        self.tried_bytes = self.inflated_bytes = self.wasted_bytes = 0

    def records(self) -> Iterator[Record]:
        """Return all records that are whole, in the order of the file, and each place where something is missing."""
        at = len(MAGIC)
        while at < len(self._data):
            try:
                opcode, content = self._record(at)
                found = list(self._top(opcode, content))
            except SpoiledError as spoiled:
                self.tried_bytes += spoiled.tried_bytes
                behind = self._next_start(at + 1)
                yield Damage(at, behind - at, str(spoiled))
                at = behind
                continue
            yield from found
            at += RECORD_HEAD.size + len(content)
            if opcode == _DATA_END:
                self.is_complete = True
                return

    def _record(self, at: int) -> tuple[int, StoredData]:
        """Return the opcode and content of the record at a place."""
        if at + RECORD_HEAD.size > len(self._data):
            raise SpoiledError("the file ends in the middle of a record")
        opcode, length = RECORD_HEAD.unpack(bytes(self._data[at : at + RECORD_HEAD.size]))
        if opcode not in _OF_DATA or (opcode == _HEADER and at != len(MAGIC)):
            raise SpoiledError("no record begins here")
        content = self._data[at + RECORD_HEAD.size : at + RECORD_HEAD.size + length]
        if len(content) < length:
            raise SpoiledError("the file ends in the middle of a record")
        return opcode, content

    def _top(self, opcode: int, content: StoredData) -> Iterator[Record]:
        """Take in a record outside of chunks."""
        match opcode:
            case 0x06:
                head = read_chunk_head(content)
                yield from self._chunk(head)
                self.inflated_bytes += head.size if head.compression else 0
            case 0x07:
                require_index(content)
            case 0x09:
                yield read_attachment(content)
            case 0x0C:
                metadata = read_metadata(content)
                if metadata.name == CHANNELS:
                    self._tell_channels(metadata.values)
                yield metadata
            case 0x0F if len(content) < WORD.size:
                raise SpoiledError("a record is shorter than its kind")
            case _:
                yield from self._inner(opcode, content, content, 0)

    def _chunk(self, head: ChunkHead) -> Iterator[Record]:
        """Return the messages of a chunk."""
        place: Chunk | StoredData
        if head.compression:
            chunk = Chunk(self._latest, self._inflate, head.compression, head.packed, head.size)
            records, place = self._inflated(chunk, head), chunk
        else:
            records = _in_memory(head.packed)
            place = head.packed
        at = 0
        try:
            if head.checksum and crc32(records) != head.checksum:
                raise SpoiledError("the checksum of a chunk is wrong")
            while at < head.size:
                opcode, inner = unpack(RECORD_HEAD, records, at)
                at += RECORD_HEAD.size
                taken = records[at : at + inner]
                if len(taken) != inner or opcode not in _IN_CHUNKS:
                    raise SpoiledError("a chunk contradicts itself")
                yield from self._inner(opcode, taken, place, at)
                at += inner
        except SpoiledError as spoiled:
            self.wasted_bytes += head.size if head.compression else 0
            raise SpoiledError(str(spoiled), len(head.packed)) from None

    def _inflated(self, chunk: Chunk, head: ChunkHead) -> StoredData:
        """Undo a chunk's compression, if it and those before it become no more than is believed."""
        if self.inflated_bytes + min(head.size, MOST_CHUNK_BYTES) > self._most_inflated_bytes:
            raise SpoiledError("the chunks become larger than is believed: undo their compression first")
        try:
            return chunk.records()
        except InflateError as error:
            self.wasted_bytes += error.inflated_bytes
            raise SpoiledError(str(error), len(head.packed)) from error

    def _inner(self, opcode: int, content: StoredData, place: Chunk | StoredData, begin: int) -> Iterator[Message]:
        """Take in a record that may stand in a chunk. It can be had again there, from where it begins."""
        if opcode == _SCHEMA:
            number, name = read_schema(content)
            self._schemas[number] = name
        elif opcode == _CHANNEL:
            number, schema, topic, encoding = read_channel(content)
            self._channels[number] = Channel(topic, self._schemas.get(schema, ""), encoding)
        elif opcode == _MESSAGE_OPCODE:
            number, sequence, log_ns, publish_ns = unpack(_MESSAGE, content, 0)
            if len(content) > MOST_CHUNK_BYTES:
                raise SpoiledError("a message is larger than is believed")
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
                if self.tried_bytes > most or self.wasted_bytes > self._most_inflated_bytes:
                    return len(self._data)
        return len(self._data)

    def _may_start(self, at: int) -> bool:
        try:
            opcode, content = self._record(at)
            if opcode == _CHUNK_OPCODE:
                next(self._chunk(read_chunk_head(content)), None)
            elif opcode == _ATTACHMENT:
                read_attachment(content)
            elif opcode == _METADATA:
                read_metadata(content)
            else:
                return len(content) == WORD.size
        except SpoiledError as spoiled:
            self.tried_bytes += spoiled.tried_bytes
            return False
        return True


def _in_memory(packed: StoredData) -> StoredData:
    """Return the records of a chunk: in memory, as it is faster, unless they are so many that they are better read one by one."""
    if isinstance(packed, memoryview) or len(packed) > _MOST_AT_ONCE_BYTES:
        return packed
    return memoryview(bytes(packed))
