"""Where a board's recording lies: one file that ends when it is full, or a ring of parts, the oldest of which give way.

Each part is a recording of its own, with all that tells whose it is. So whatever moment the board dies at, every part but the last is whole,
and of the last all but a chunk can be read. A ring goes on where it ended: what its name has on the disk counts.
"""

import re
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Final

from common.errors import UnavailableError
from common.recording.opened import SUFFIX
from common.recording.recording_file import RecordingFile

PARTS: Final = 8
"""A full ring always holds seven eighths of its size."""

Begin = Callable[[RecordingFile], None]
"""Writes what stands at the begin of each file."""


def part_path(path: Path, number: int) -> Path:
    """Return where a part of a ring lies.

    Args:
        path: as the user named the recording.
        number: of the part, from 1.
    """
    return path.with_name(f"{path.stem}-{number:06}{SUFFIX}")


def parts_of(path: Path) -> dict[int, Path]:
    """Return the parts of a ring that are on the disk, by number, ascending."""
    form = re.compile(rf"{re.escape(path.stem)}-(\d{{6,9}}){re.escape(SUFFIX)}")
    try:
        found = {int(match[1]): each for each in path.parent.iterdir() if (match := form.fullmatch(each.name))}
    except OSError as error:
        raise UnavailableError(f"{path.parent} cannot be read ({error.strerror})", "name another file") from None
    return dict(sorted(found.items()))


class BoundedFiles:
    """A recording that never takes more than its share of the disk. Used by one thread, but for `size_bytes`.

    Attributes:
        file: what is being written.
        files: how many were begun.
        gave_way: how many parts were deleted.

    Args:
        path: as the user named the recording; of a single file, it must not exist.
        most_bytes: what it may take.
        is_ring: whether old parts give way.
        begin: writes what stands at the begin of each file.

    Raises:
        UnavailableError: the file exists or cannot be made.
        OSError: the disk is full, or gone.
    """

    def __init__(self, path: Path, most_bytes: int, begin: Begin, *, is_ring: bool) -> None:
        self._path, self._most_bytes, self._is_ring, self._begin = path, most_bytes, is_ring, begin
        self.file_bytes = most_bytes // PARTS if is_ring else most_bytes
        self.files = self.gave_way = 0
        self._done_bytes = 0
        self.file = self._opened()

    @property
    def size_bytes(self) -> int:
        """How much was written by this process and is still there, bytes. Safe from any thread."""
        return self._done_bytes + self.file.size_bytes

    def make_room(self, size: int) -> bool:
        """Return whether so many more bytes fit; in a ring, by a new part if need be.

        Raises:
            UnavailableError: the next part cannot be made.
            OSError: the disk is full, or gone.
        """
        if self.file.ended_bytes + size <= self.file_bytes:
            return True
        if not self._is_ring:
            return False
        self.file.close()
        self._done_bytes += self.file.size_bytes
        self.file = self._opened()
        return self.file.ended_bytes + size <= self.file_bytes

    def end_chunk(self) -> None:
        """See RecordingFile."""
        self.file.end_chunk()

    def sync(self) -> None:
        """See RecordingFile."""
        self.file.sync()

    def close(self) -> None:
        """See RecordingFile."""
        self.file.close()

    def abandon(self, cause: str) -> None:  # noqa: ARG002 - the account tells it
        """See RecordingFile."""
        self.file.abandon()

    def _opened(self) -> RecordingFile:
        self.files += 1
        path = self._path
        if self._is_ring:
            parts = parts_of(self._path)
            path = part_path(self._path, max(parts, default=0) + 1)
            self._give_way(parts)
        file = RecordingFile(path)
        self._begin(file)
        return file

    def _give_way(self, parts: dict[int, Path]) -> None:
        """Delete the oldest parts until a new one fits."""
        sizes = {number: _size(path) for number, path in parts.items()}
        taken = sum(sizes.values())
        for number, path in parts.items():
            if taken + self.file_bytes <= self._most_bytes:
                return
            with suppress(FileNotFoundError):
                path.unlink()
            taken -= sizes[number]
            self._done_bytes = max(0, self._done_bytes - sizes[number])
            self.gave_way += 1


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return 0
