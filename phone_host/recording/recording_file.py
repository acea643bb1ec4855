"""Writes a recording: an MCAP file with ROS 2 messages, safe against a crash at any moment.

Chunks are small, and each is flushed when it is whole; `sync` brings it onto the disk. What tells the channels stands outside of chunks, too.
Used by one thread. Source: the MCAP specification, version 0.
"""

import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO, Final

from mcap.writer import CompressionType, Writer

from common.errors import UnavailableError
from common.versions import PACKAGE_VERSION
from phone_host.recording.ros_messages import SCHEMAS
from phone_host.recording.salvage import CHANNELS

_CHUNK_BYTES: Final = 256 * 1024
"""A crash loses one chunk at most; larger ones cost more per frame, smaller ones more overhead."""

JSON: Final = "json"
_CDR: Final = "cdr"


class RecordingFile:
    """A recording that is being written.

    Attributes:
        path: the file.

    Args:
        path: the file; it must not exist.
        topics: kind of message by topic: a name of `SCHEMAS`, or JSON.
        metadata: values by name, by the name of the whole.

    Raises:
        UnavailableError: the file exists or cannot be made.
    """

    def __init__(self, path: Path, topics: Mapping[str, str], metadata: Mapping[str, Mapping[str, str]]) -> None:
        self.path = path
        try:
            self._file: BinaryIO = path.open("xb", buffering=2 * _CHUNK_BYTES)
        except FileExistsError:
            raise UnavailableError(f"{path} exists already", "name another file, or delete it") from None
        except OSError as error:
            raise UnavailableError(f"{path} cannot be written ({error.strerror})", "name another file") from error
        self._writer = Writer(self._file, chunk_size=_CHUNK_BYTES, compression=CompressionType.NONE)
        self._writer.start(profile="ros2", library=f"tandemscan {PACKAGE_VERSION}")
        for name, values in metadata.items():
            self._writer.add_metadata(name, dict(values))
        self._channels: dict[str, int] = {}
        schemas: dict[str, int] = {}
        told = {}
        for topic, kind in topics.items():
            if kind != JSON and kind not in schemas:
                schemas[kind] = self._writer.register_schema(kind, "ros2msg", SCHEMAS[kind].encode())
            encoding = JSON if kind == JSON else _CDR
            number = self._writer.register_channel(topic, encoding, schemas.get(kind, 0))
            self._channels[topic] = number
            told[str(number)] = f"{topic} {'' if kind == JSON else kind} {encoding}"
        self._writer.add_metadata(CHANNELS, told)
        self._file.flush()

    def attach(self, name: str, kind: str, data: bytes, log_ns: int) -> None:
        """Add a file.

        Args:
            name: its name.
            kind: its media type.
            data: its content.
            log_ns: when, ns since 1970.
        """
        self._writer.add_attachment(log_ns, log_ns, name, kind, data)
        self._file.flush()

    def add(self, topic: str, data: bytes, *, sequence: int, log_ns: int, publish_ns: int) -> None:
        """Add a message.

        Args:
            topic: one of those that were named at the start.
            data: the message.
            sequence: its number in its stream.
            log_ns: when it was received, ns since 1970.
            publish_ns: when it was sent, ns since 1970.

        Raises:
            OSError: the disk is full, or gone.
        """
        before = self._file.tell()
        self._writer.add_message(self._channels[topic], log_ns, data, publish_ns, sequence & 0xFFFF_FFFF)
        if self._file.tell() != before:  # a chunk is whole
            self._file.flush()

    @property
    def size_bytes(self) -> int:
        """How long the file is; what has not filled its chunk does not count."""
        return self._file.tell()

    def sync(self) -> None:
        """Bring onto the disk what was written. May take long."""
        self._file.flush()
        os.fsync(self._file.fileno())

    def abandon(self) -> None:
        """Leave the file as it is. Whatever is whole in it can be read."""
        with suppress(OSError):
            self._file.close()

    def close(self) -> None:
        """End the file in order.

        Raises:
            OSError: the disk is full, or gone; what was written until then can be read.
        """
        try:
            self._writer.finish()
            self.sync()
        finally:
            self._file.close()
