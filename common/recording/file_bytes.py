"""The bytes of a file that stay on the disk until they are read.

A file is never mapped: a program that touches a map of a file that another one has made shorter ends by SIGBUS, whatever it checked before (mmap(2)).
"""

import os
import weakref
from collections.abc import Iterator
from pathlib import Path
from typing import Final, Self

from common.errors import DataError

PIECE_BYTES: Final = 1 << 20
"""As much is read at once of what may be long."""

_AHEAD_BYTES: Final = 16 << 10
"""As much is read at once of what is short: it costs hardly more than a few bytes, and what stands behind them is there, too."""


class _OpenFile:
    def __init__(self, path: Path) -> None:
        self.path = path
        self.descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        weakref.finalize(self, os.close, self.descriptor)
        self.size = os.fstat(self.descriptor).st_size
        self._ahead = (0, b"")

    def read(self, at: int, size: int) -> bytes:
        """Return bytes; a few of them come from what was read ahead."""
        if size >= _AHEAD_BYTES:
            return self._read(at, size, size)
        start, ahead = self._ahead  # one look: another thread may replace it
        if not start <= at <= at + size <= start + len(ahead):
            start, ahead = at, self._read(at, _AHEAD_BYTES, size)
            self._ahead = (start, ahead)
        return ahead[at - start : at - start + size]

    def _read(self, at: int, most: int, least: int) -> bytes:
        """Return at least so many bytes, or the error; what stands behind them only if it is there."""
        parts: list[bytes] = []
        read = 0
        while read < least:
            try:
                part = os.pread(self.descriptor, most - read, at + read)
            except OSError as error:
                raise DataError(
                    f"{self.path} cannot be read ({error.strerror})", "name a recording, FILE.mcap"
                ) from None
            if not part:
                raise DataError(
                    f"{self.path} became shorter while it was read",
                    "copy it first, and read the copy while nobody writes it",
                )
            parts.append(part)
            read += len(part)
        return parts[0] if len(parts) == 1 else b"".join(parts)


class FileBytes:
    """A part of a file: `bytes(part)` reads it, a slice of it is a part, too.

    Args:
        file: the file.
        at: where the part begins, bytes from the file's begin.
        size: how many bytes it has.
    """

    __slots__ = ("_at", "_file", "_size")

    def __init__(self, file: _OpenFile, at: int, size: int) -> None:
        self._file, self._at, self._size = file, at, size

    @classmethod
    def whole(cls, path: Path) -> Self:
        """Open a file, which is closed when nobody has a part of it any more.

        Raises:
            OSError: it cannot be opened.
        """
        file = _OpenFile(path)
        return cls(file, 0, file.size)

    def __len__(self) -> int:
        return self._size

    def __getitem__(self, part: slice) -> "FileBytes":
        start, stop, _ = part.indices(self._size)
        return FileBytes(self._file, self._at + start, max(0, stop - start))

    def __bytes__(self) -> bytes:
        """Read them.

        Raises:
            DataError: the file became shorter, or its disk fails.
        """
        return self._file.read(self._at, self._size)


StoredData = memoryview | FileBytes
"""Bytes in memory or in a file: `bytes` gives them, slices are of the same kind."""


def pieces(data: StoredData, at: int = 0) -> Iterator[tuple[int, bytes]]:
    """Return data piece by piece, each with its place.

    Raises:
        DataError: as `FileBytes` says.
    """
    for start in range(at, len(data), PIECE_BYTES):
        yield start, bytes(data[start : start + PIECE_BYTES])
