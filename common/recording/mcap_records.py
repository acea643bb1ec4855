"""What an MCAP file holds, as values: messages, attachments, metadata, and places where something is missing. Pure."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from common.recording.file_bytes import FileBytes, StoredData
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
