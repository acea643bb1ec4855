"""Bounds what the library rosbags takes for a bag that may come from anybody: what it inflates, and what a database computes."""

import bz2
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

from common.errors import DataError
from common.recording.mcap_records import MOST_CHUNK_BYTES

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
