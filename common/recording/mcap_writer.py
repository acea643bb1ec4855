"""Writes an MCAP file: records in, bytes out. Pure.

Chunks are not compressed: their images are. Each has its checksum, so a reader knows which are whole. What tells a channel stands before its
first message and, for the case that this chunk is lost, in a metadata record before all; a channel without messages is not told otherwise.
Our own, because the library mcap needs two compressors in C that a phone would have to build, and the board has no package of it (decision 0064).
Source: the MCAP specification, version 0, section Records (https://mcap.dev/spec).
"""

import struct
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from common.frame import Buffer
from common.recording.mcap_records import CHANNELS, MAGIC

CHUNK_BYTES: Final = 256 * 1024
"""A crash loses one chunk at most; larger ones cost more per frame, smaller ones more overhead."""

MOST_TOPICS: Final = 65_535
"""Channels are numbered with 16 bits."""

_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _MESSAGE_INDEX, _CHUNK_INDEX = range(3, 9)
_HEADER, _FOOTER = 1, 2
_ATTACHMENT, _ATTACHMENT_INDEX, _STATISTICS, _METADATA, _METADATA_INDEX, _SUMMARY_OFFSET, _DATA_END = range(9, 16)
_HEAD: Final = struct.Struct("<BQ")
_MESSAGE_HEAD: Final = struct.Struct("<BQHIQQ")
_INDEX_ENTRY: Final = struct.Struct("<QQ")
_END_BYTES: Final = 600
"""Heads of the last chunk and of its index, end of data, statistics, offsets of the summary's groups, footer and magic."""

_CHANNEL_BYTES: Final = 35
"""What each channel adds to those: 15 in the chunk's indexes, 10 in the chunk's entry, 10 in the statistics."""


@dataclass(frozen=True, slots=True)
class Topic:
    """A channel to be written.

    Attributes:
        name: such as /left/image/compressed.
        encoding: of its messages: cdr, json or another.
        kind: name of its message; empty: it has no schema.
        schema_encoding: such as ros2msg.
        schema: the message's definition.
    """

    name: str
    encoding: str
    kind: str = ""
    schema_encoding: str = ""
    schema: bytes = b""


@dataclass(slots=True)
class _Chunk:
    """The chunk that is being filled: its records, how long they are, their checksum, and where each channel's messages lie."""

    parts: list[Buffer]
    size: int
    checksum: int
    start_ns: int
    end_ns: int
    index: dict[int, list[tuple[int, int]]]

    def add(self, part: Buffer) -> None:
        self.parts.append(part)
        self.size += len(part)
        self.checksum = zlib.crc32(part, self.checksum)


class McapWriter:
    """Writes one file from its first to its last byte.

    Attributes:
        size: how many bytes were written; the chunk that is being filled does not count.
        ended_size: how long the file would be if it were ended now, at most.

    Args:
        write: takes the bytes, in their order.
        library: the program that writes, for people.
        topics: all channels.
    """

    def __init__(self, write: Callable[[Buffer], object], library: str, topics: tuple[Topic, ...]) -> None:
        self._write = write
        self.size = 0
        self._groups: dict[int, bytearray] = {}  # of the summary, by opcode; it grows with the file: 100 bytes a chunk
        self._summary_size = 0
        self._counts: dict[int, int] = {}
        self._chunks = self._attachments = self._metadata = 0
        self._start_ns = self._end_ns = 0
        self._topics = {topic.name: (number, topic) for number, topic in enumerate(topics, start=1)}
        self._kinds: dict[str, int] = {}
        self._put(MAGIC)
        self._put(_record(_HEADER, _text("ros2") + _text(library)))
        told = {str(number): f"{t.name} {t.kind} {t.encoding}" for number, t in enumerate(topics, start=1)}
        self.tell(CHANNELS, told)
        self._chunk = _empty()

    @property
    def ended_size(self) -> int:
        """See the class."""
        chunk = self._chunk
        entries = sum(map(len, chunk.index.values())) * _INDEX_ENTRY.size
        return self.size + chunk.size + entries + self._summary_size + _END_BYTES + _CHANNEL_BYTES * len(self._topics)

    def tell(self, name: str, values: Mapping[str, str]) -> None:
        """Write values by name, outside of chunks."""
        record = _record(_METADATA, _text(name) + _texts(values))
        self._summed(_METADATA_INDEX, struct.pack("<QQ", self.size, len(record)) + _text(name))
        self._metadata += 1
        self._put(record)

    def attach(self, name: str, kind: str, data: bytes, at_ns: int) -> None:
        """Write a file into the file.

        Args:
            name: its name.
            kind: its media type.
            data: its content.
            at_ns: when, ns since 1970.
        """
        content = struct.pack("<QQ", at_ns, at_ns) + _text(name) + _text(kind) + struct.pack("<Q", len(data)) + data
        record = _record(_ATTACHMENT, content + struct.pack("<I", zlib.crc32(content)))
        index = struct.pack("<QQQQQ", self.size, len(record), at_ns, at_ns, len(data)) + _text(name) + _text(kind)
        self._summed(_ATTACHMENT_INDEX, index)
        self._attachments += 1
        self._put(record)

    def add(self, topic: str, *parts: Buffer, sequence: int, log_ns: int, publish_ns: int) -> None:
        """Write a message.

        Args:
            topic: name of its channel.
            parts: the message, in pieces; they must not change until their chunk is written.
            sequence: its number in its stream; of larger ones the lowest 32 bits are kept.
            log_ns: when it was received, ns since 1970.
            publish_ns: when it was sent, ns since 1970.
        """
        number, told = self._topics[topic]
        chunk = self._chunk
        if number not in self._counts:
            self._introduce(number, told)
        chunk.index.setdefault(number, []).append((log_ns, chunk.size))
        length = _MESSAGE_HEAD.size - _HEAD.size + sum(map(len, parts))
        chunk.add(_MESSAGE_HEAD.pack(_MESSAGE, length, number, sequence & 0xFFFF_FFFF, log_ns, publish_ns))
        for part in parts:
            chunk.add(part)
        chunk.start_ns, chunk.end_ns = min(chunk.start_ns, log_ns), max(chunk.end_ns, log_ns)
        self._counts[number] += 1
        if chunk.size >= CHUNK_BYTES:
            self.end_chunk()

    def end_chunk(self) -> None:
        """Write what waits for its chunk to be full."""
        chunk = self._chunk
        if not chunk.index:
            return
        start, self._chunk = self.size, _empty()
        length = 8 + 8 + 8 + 4 + 4 + 8 + chunk.size
        self._put(_HEAD.pack(_CHUNK, length))
        self._put(struct.pack("<QQQIIQ", chunk.start_ns, chunk.end_ns, chunk.size, chunk.checksum, 0, chunk.size))
        for part in chunk.parts:
            self._put(part)
        places = b""
        indexed = self.size
        for number, entries in chunk.index.items():
            places += struct.pack("<HQ", number, self.size)
            listed = b"".join(_INDEX_ENTRY.pack(*entry) for entry in entries)
            self._put(_record(_MESSAGE_INDEX, struct.pack("<HI", number, len(listed)) + listed))
        index = struct.pack("<QQQQ", chunk.start_ns, chunk.end_ns, start, _HEAD.size + length)
        index += struct.pack("<I", len(places)) + places + struct.pack("<Q", self.size - indexed)
        self._summed(_CHUNK_INDEX, index + _text("") + struct.pack("<QQ", chunk.size, chunk.size))
        self._start_ns = min(self._start_ns, chunk.start_ns) if self._chunks else chunk.start_ns
        self._end_ns = max(self._end_ns, chunk.end_ns)
        self._chunks += 1

    def finish(self) -> None:
        """Write the last chunk and the summary. Nothing may follow."""
        self.end_chunk()
        self._put(_record(_DATA_END, struct.pack("<I", 0)))
        counts = b"".join(struct.pack("<HQ", *item) for item in self._counts.items())
        totals = struct.pack(
            "<QHIIIIQQI",
            sum(self._counts.values()),
            len(self._kinds),
            len(self._counts),
            self._attachments,
            self._metadata,
            self._chunks,
            self._start_ns,
            self._end_ns,
            len(counts),
        )
        self._summed(_STATISTICS, totals + counts)
        start, at, summary, offsets = self.size, self.size, b"", b""
        for opcode, group in sorted(self._groups.items()):
            offsets += _record(_SUMMARY_OFFSET, struct.pack("<BQQ", opcode, at, len(group)))
            summary += group
            at += len(group)
        footer = struct.pack("<BQQQ", _FOOTER, 20, start, at)
        checksum = zlib.crc32(footer, zlib.crc32(summary + offsets))
        self._put(summary + offsets + footer + struct.pack("<I", checksum) + MAGIC)

    def _introduce(self, number: int, topic: Topic) -> None:
        """Write what a channel is, before its first message."""
        self._counts[number] = 0
        if topic.kind and topic.kind not in self._kinds:
            self._kinds[topic.kind] = len(self._kinds) + 1
            self._chunk.add(self._summed(_SCHEMA, _schema(self._kinds[topic.kind], topic)))
        self._chunk.add(self._summed(_CHANNEL, _channel(number, self._kinds.get(topic.kind, 0), topic)))

    def _summed(self, opcode: int, content: bytes) -> bytes:
        """Make a record that the summary repeats."""
        record = _record(opcode, content)
        self._groups.setdefault(opcode, bytearray()).extend(record)
        self._summary_size += len(record)
        return record

    def _put(self, data: Buffer) -> None:
        self._write(data)
        self.size += len(data)


def _empty() -> _Chunk:
    return _Chunk(parts=[], size=0, checksum=0, start_ns=2**63, end_ns=0, index={})


def _record(opcode: int, content: bytes) -> bytes:
    return _HEAD.pack(opcode, len(content)) + content


def _text(value: str) -> bytes:
    data = value.encode()
    return struct.pack("<I", len(data)) + data


def _texts(values: Mapping[str, str]) -> bytes:
    data = b"".join(_text(key) + _text(value) for key, value in values.items())
    return struct.pack("<I", len(data)) + data


def _schema(number: int, topic: Topic) -> bytes:
    data = struct.pack("<I", len(topic.schema)) + topic.schema
    return struct.pack("<H", number) + _text(topic.kind) + _text(topic.schema_encoding) + data


def _channel(number: int, schema: int, topic: Topic) -> bytes:
    return struct.pack("<HH", number, schema) + _text(topic.name) + _text(topic.encoding) + _texts({})
