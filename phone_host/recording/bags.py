"""Bags of ROS 1 and folders of rosbag2 as MCAP files, so that everything that takes a recording takes them.

What is a bag is known by its first bytes, and so is compression, of a whole file as of each message: nothing depends on metadata.yaml. Messages
that a recording may hold are copied as they are; of others only that they are there. ROS 1 and sqlite3 are read with the library rosbags, an extra.
What is missing or spoiled in a part is left out and reported.
"""

import bz2
import sqlite3
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final
from urllib.parse import quote

from common.errors import DataError, UnavailableError
from common.name_order import name_order
from common.program.packages import package_error
from common.recording.inflate import ZSTD, inflate, unzstd, unzstd_pieces
from common.recording.mcap_records import MAGIC, MOST_CHUNK_BYTES, Channel, Damage, Message, Record
from common.recording.mcap_writer import Topic
from common.recording.opened import stored_data
from common.recording.recorded import image_kind
from common.recording.recording_file import RecordingFile, written
from common.recording.ros1 import ROS1
from common.recording.ros_messages import SCHEMAS
from common.recording.salvage import Salvage
from common.unfinished import unfinished
from common.words import counted

_MOST_RATIO: Final = 64
_ALWAYS_BYTES: Final = 64 << 20
"""A compressed file may become so many times its size, and this much more."""

_PIECE_BYTES: Final = 1 << 20
_MOST_STREAMS: Final = 100
"""Writers make one stream of a chunk; the rest behind each is copied to begin the next."""


def most_bytes(size_bytes: int) -> int:
    """Return how large a compressed file of a size may become."""
    return _ALWAYS_BYTES + _MOST_RATIO * size_bytes


def bound_chunks(reader: Any, path: Path) -> None:  # noqa: ANN401 - rosbags' own
    """Replace the ways in which an opened bag of ROS 1 inflates its chunks by bounded ones.

    Args:
        reader: rosbags' reader of the bag, open.
        path: the bag.
    """
    from rosbags.rosbag1.reader import decompressors  # noqa: PLC0415 - an extra

    names = {inflate: name for name, inflate in decompressors.items()}
    left = [most_bytes(path.stat().st_size)]  # what the chunks that were not inflated yet may become, together
    refusal = DataError(f"{path} becomes larger than is believed", "undo its compression: rosbag decompress FILE")
    for place, chunk in reader.chunks.items():
        match names[chunk.decompressor]:
            case "bz2":
                begin: Callable[[], Any] = bz2.BZ2Decompressor
            case "lz4":
                import lz4.frame  # noqa: PLC0415 - rosbags brings it

                begin = lz4.frame.LZ4FrameDecompressor
            case _:
                continue
        reader.chunks[place] = chunk._replace(decompressor=_bounded(begin, left, refusal))


def _bounded(begin: Callable[[], Any], left: list[int], refusal: DataError) -> Callable[[bytes], bytes]:
    """Return what inflates one chunk. What it becomes is taken from what is left once, however often the library asks for it."""
    counted = 0

    def inflate(packed: bytes) -> bytes:
        nonlocal counted
        plain = _inflated(packed, begin, min(left[0] + counted, MOST_CHUNK_BYTES), refusal)
        left[0] -= len(plain) - counted
        counted = len(plain)
        return plain

    return inflate


def _inflated(packed: bytes, begin: Callable[[], Any], limit: int, refusal: DataError) -> bytes:
    """Return what a chunk becomes.

    Raises:
        DataError: the refusal: it becomes more than the limit.
        ValueError, OSError, RuntimeError: it is spoiled, or ends too early.
    """
    pieces, total, streams, decompressor = list[bytes](), 0, 1, begin()
    while True:
        piece = decompressor.decompress(packed, _PIECE_BYTES)
        pieces.append(piece)
        total += len(piece)
        if total > limit or streams > _MOST_STREAMS:
            raise refusal
        packed = b""
        if decompressor.eof:
            packed = decompressor.unused_data or b""
            if not packed:
                return b"".join(pieces)
            streams, decompressor = streams + 1, begin()
        elif decompressor.needs_input:
            raise ValueError("a chunk ends before its compression does")


def require_plain_tables(path: Path) -> None:
    """Refuse a database whose tables compute what they give: a few bytes could become gigabytes.

    Args:
        path: a file of sqlite3.

    Raises:
        DataError: so it is, or the file is spoiled.
    """
    try:
        with closing(sqlite3.connect(f"file:{quote(str(path.absolute()))}?mode=ro", uri=True)) as database:
            tables = database.execute("SELECT name, rootpage FROM sqlite_master WHERE type = 'table'").fetchall()
            for name, root in tables:
                columns = database.execute("SELECT hidden FROM pragma_table_xinfo(?)", (name,)).fetchall()
                if not root or any(hidden for (hidden,) in columns):  # a virtual table has no page of its own
                    raise DataError(f"{path} computes what is in its table {name}", "give the bag as it was recorded")
    except sqlite3.Error as error:
        raise DataError(f"{path} cannot be read ({error})", "mend it first: ros2 bag reindex") from None


_ROS1_BAG: Final = b"#ROSBAG V2.0\n"
_SQLITE: Final = b"SQLite format 3\0"
_METADATA: Final = "metadata.yaml"
_HEAD_BYTES: Final = 16
_SUFFIXES: Final = frozenset({".db3", ".mcap", ".zstd"})
_MOST_TOPICS: Final = 4096


def is_bag(path: Path) -> bool:
    """Return whether a path is a bag: a folder with files of rosbag2, one of those, or a file of ROS 1."""
    if path.is_dir():
        return bool(_parts(path))
    return path.is_file() and _head(path).startswith((_ROS1_BAG, _SQLITE, ZSTD))


@dataclass(frozen=True, slots=True)
class RecordingSource:
    """What is read as a recording.

    Attributes:
        path: an MCAP file, or a folder of images.
        damages: where something was missing in the bag of which the file is a copy.
    """

    path: Path
    damages: tuple[Damage, ...] = ()


@contextmanager
def as_recording(path: Path) -> Iterator[RecordingSource]:
    """Give a bag as an MCAP file while the block runs; any other path as it is.

    Raises:
        DataError: it cannot be read, or is not believed.
        UnavailableError: there is no room for the copy.
    """
    if not is_bag(path):
        yield RecordingSource(path)
        return
    try:
        folder = TemporaryDirectory(prefix="tandemscan-bag-")
    except OSError as error:
        raise UnavailableError(f"{path} cannot be copied ({error.strerror})", "make room in TMPDIR") from None
    with folder as name, unfinished(folder.cleanup):
        copy = Path(name) / "bag.mcap"
        try:
            damages = _copy(path, copy, Path(name) / "parts")
        except ImportError as error:
            raise package_error(error, str(path)) or error from None
        try:
            yield RecordingSource(copy, tuple(damages))
        except DataError as error:
            error.problem = error.problem.replace(str(copy), str(path))  # the copy's name means nothing to a user
            raise


def _copy(path: Path, copy: Path, folder: Path) -> list[Damage]:
    """Write the messages of all parts of a bag into one file, and return what is missing in them.

    Args:
        path: the bag.
        copy: the new file.
        folder: for parts whose compression is undone; it must not exist.
    """
    damages: list[Damage] = []
    folder.mkdir()
    parts = [_plain(part, folder, damages) for part in (_parts(path) if path.is_dir() else [path])]
    channels: dict[Channel, Topic] = {}
    for part in parts:
        for channel in _channels(part, path):
            channels[channel] = Topic(channel.topic, channel.encoding, channel.kind, f"{channel.encoding}msg")
    if len(channels) > _MOST_TOPICS:
        raise DataError(f"{path} has {len(channels)} topics: more than is believed", "give a bag with fewer")
    lost: Counter[str] = Counter()
    left = most_bytes(sum(part.stat().st_size for part in parts))  # an index may name one message a million times
    with written(copy, tuple(channels.values())) as file:
        for part in parts:
            for number, record in enumerate(_records(part, path)):
                match record:
                    case Damage():
                        damages.append(replace(record, words=f"{record.words} ({part.name})"))
                    case Message():
                        left -= len(record.data)
                        if left < 0:
                            raise DataError(f"{path} becomes larger than is believed", "copy it again")
                        lost += _add(file, record, number)
                    case _:
                        pass
    damages += [Damage(0, 0, f"{counted(count, 'message')} {words}") for words, count in lost.items()]
    return damages


def _add(file: RecordingFile, message: Message, number: int) -> Counter[str]:
    """Copy a message, and return why it cannot be copied."""
    channel, data = message.channel, bytes(message.data)
    if channel is None:
        return Counter(["of an unknown topic"])
    if channel.kind not in SCHEMAS and not image_kind(channel):
        data = b""
    elif data.startswith(ZSTD):
        try:
            data = unzstd(data)
        except ValueError as error:
            return Counter([f"of {channel.topic} cannot be decompressed ({error})"])
    file.add(channel.topic, data, sequence=number & 0xFFFFFFFF, log_ns=message.log_ns, publish_ns=message.publish_ns)
    return Counter()


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(_HEAD_BYTES)
    except OSError as error:
        raise DataError(f"{path} cannot be read ({error.strerror})", "name a recording, FILE.mcap, or a bag") from None


def _parts(folder: Path) -> list[Path]:
    """Return the files of a rosbag2 folder, in their order; none: it is none."""
    try:
        found = [path for path in folder.iterdir() if path.suffix in _SUFFIXES and path.is_file()]
    except OSError as error:
        raise DataError(f"{folder} cannot be read ({error.strerror})", "check its permissions") from None
    names = {path.name for path in found}
    if not (folder / _METADATA).is_file() and not any(".db3" in name for name in names):
        return []
    # whoever runs unzstd has a part with and without its compression
    return sorted((path for path in found if path.suffix != ".zstd" or path.stem not in names), key=name_order)


def _plain(path: Path, folder: Path, damages: list[Damage]) -> Path:
    """Return a file without compression: itself, or a copy of what can be decompressed.

    Args:
        path: the file.
        folder: for the copy.
        damages: takes what cannot be decompressed, where the copy is an MCAP file: of that the rest can be read.

    Raises:
        DataError: it cannot be decompressed, or becomes larger than is believed.
    """
    if not _head(path).startswith(ZSTD):
        return path
    out = folder / path.with_suffix("").name
    most, size = most_bytes(path.stat().st_size), 0
    with path.open("rb") as packed, out.open("wb") as plain:
        try:
            for piece in unzstd_pieces(packed):
                size += len(piece)
                if size > most:
                    raise DataError(f"{path} becomes larger than is believed", "undo its compression: unzstd FILE")
                plain.write(piece)
        except OSError as error:
            raise UnavailableError(f"{path} cannot be decompressed ({error.strerror})", "make room in TMPDIR") from None
        except ValueError as error:
            plain.flush()
            if not _head(out).startswith(MAGIC):
                raise DataError(f"{path} cannot be decompressed ({error})", "copy it again") from error
            damages.append(Damage(0, 0, f"{error}, behind {counted(size, 'byte')} ({path.name})"))
    return out


def _channels(part: Path, bag: Path) -> list[Channel]:
    if _head(part).startswith(MAGIC):
        records = Salvage(stored_data(part), inflate).records()
        return list({each.channel: None for each in records if isinstance(each, Message) and each.channel is not None})
    with _opened(part, bag) as reader:
        return [_channel(connection, part) for connection in reader.connections]


def _records(part: Path, bag: Path) -> Iterator[Record]:
    """Return the messages of a file in their order, and where something is missing."""
    if _head(part).startswith(MAGIC):
        salvage = Salvage(stored_data(part), inflate)
        yield from salvage.records()
        if not salvage.is_complete:
            yield Damage(0, 0, "it was not ended in order")
        return
    with _opened(part, bag) as reader:
        channels = {connection.id: _channel(connection, part) for connection in reader.connections}
        messages = iter(reader.messages(reader.connections))
        while True:
            try:
                connection, log_ns, data = next(messages)
            except StopIteration:
                return
            except DataError:
                raise
            except Exception as error:
                raise _broken(bag, error) from error
            yield Message(channels[connection.id], connection.id, 0, log_ns, log_ns, memoryview(data))


def _channel(connection: Any, part: Path) -> Channel:  # noqa: ANN401 - rosbags' own
    encoding = ROS1 if _head(part).startswith(_ROS1_BAG) else "cdr"
    return Channel(connection.topic, connection.msgtype, encoding)


@contextmanager
def _opened(part: Path, bag: Path) -> Iterator[Any]:
    """Open a file with rosbags.

    Raises:
        ImportError: rosbags is not installed.
        DataError: the file is broken, or not believed.
    """
    is_ros1 = _head(part).startswith(_ROS1_BAG)
    if is_ros1:
        import rosbags.rosbag1  # noqa: PLC0415 - an extra

        reader: Any = rosbags.rosbag1.Reader(part)
    elif not _head(part).startswith(_SQLITE):
        raise DataError(f"{bag} is no bag, or broken ({part.name})", "give a .bag, a rosbag2 folder, or FILE.mcap")
    elif part.suffix != ".db3":
        raise DataError(f"{bag} is a file of sqlite3 without the ending .db3 ({part.name})", "give it that ending")
    else:
        import rosbags.rosbag2  # noqa: PLC0415 - an extra

        require_plain_tables(part)
        reader = rosbags.rosbag2.Reader(part)
    try:
        reader.open()
    except Exception as error:
        raise _broken(bag, error) from error
    try:
        if is_ros1:
            bound_chunks(reader, part)
        yield reader
    finally:
        reader.close()


def _broken(bag: Path, error: Exception) -> DataError:
    words = " ".join(str(error).split())[:200]
    return DataError(f"{bag} cannot be read ({words})", "mend it first: rosbag reindex, or ros2 bag reindex")
