"""A recording on disk that is being written: safe against a crash at any moment. Used by one thread."""

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, Final

from common.appearing import new_file
from common.errors import SettingsError, UnavailableError
from common.frame import Buffer
from common.recording.layout import topics
from common.recording.mcap_writer import McapWriter, Topic
from common.recording.opened import SUFFIX, is_recording
from common.versions import PACKAGE_VERSION

_MOST_PARTS: Final = 1024
"""What writev takes at once on Linux and Android (IOV_MAX, limits.h)."""


class DeletedRecordingError(OSError):
    """Raised when a file was deleted while it was written: the system would go on taking what nobody can ever read. The user's fault."""


class RecordingFile:
    """A recording that is being written.

    Attributes:
        path: the file.

    Args:
        path: the file; it must not exist.
        channels: its topics.
        descriptor: of the empty file, open for writing, where somebody has made it; it may still have another name.

    Raises:
        UnavailableError: the file exists or cannot be made.
    """

    def __init__(self, path: Path, channels: tuple[Topic, ...] | None = None, descriptor: int | None = None) -> None:
        self.path = path
        try:
            self._file: BinaryIO = (
                path.open("xb", buffering=0) if descriptor is None else os.fdopen(descriptor, "wb", 0)
            )
        except FileExistsError:
            raise _taken(path) from None
        except OSError as error:
            raise UnavailableError(f"{path} cannot be written ({error.strerror})", "name another file") from None
        self._is_dirty = True
        self._size_bytes = 0
        self._waiting: list[Buffer] = []  # images go to the system as they are, a chunk in one call
        self._writer = McapWriter(self._waiting.append, f"tandemscan {PACKAGE_VERSION}", channels or topics())

    @property
    def size_bytes(self) -> int:
        """How long the file is, bytes; what has not filled its chunk does not count. Safe from any thread."""
        return self._size_bytes

    @property
    def left_bytes(self) -> int | None:
        """Room that is left on its disk, bytes; None: not known. Safe from any thread."""
        try:
            disk = os.statvfs(self.path.parent)
        except OSError:
            return None
        return disk.f_bavail * disk.f_frsize

    @property
    def ended_bytes(self) -> int:
        """How long the file would be if it were ended now, at most, bytes."""
        return self._writer.ended_size

    def tell(self, name: str, values: dict[str, str]) -> None:
        """Add values by name.

        Raises:
            OSError: the disk is full, or gone.
        """
        self._writer.tell(name, values)
        self._is_dirty = True

    def attach(self, name: str, kind: str, data: bytes, at_ns: int) -> None:
        """Add a file; see McapWriter.

        Raises:
            OSError: the disk is full, or gone.
        """
        self._writer.attach(name, kind, data, at_ns)
        self._is_dirty = True

    def add(self, topic: str, *parts: Buffer, sequence: int, log_ns: int, publish_ns: int) -> None:
        """Add a message; see McapWriter. A chunk that is full goes to the operating system at once.

        Raises:
            OSError: the disk is full, or gone.
        """
        before = self._writer.size
        self._writer.add(topic, *parts, sequence=sequence, log_ns=log_ns, publish_ns=publish_ns)
        self._is_dirty = True
        if self._writer.size != before:
            self._hand_over()

    def end_chunk(self) -> None:
        """Hand what came until now to the operating system: a crash of this program loses none of it.

        Raises:
            OSError: the disk is full, or gone.
        """
        self._writer.end_chunk()
        self._hand_over()

    def sync(self) -> None:
        """Bring onto the disk what came until now. May take long.

        Raises:
            OSError: the disk is full, or gone; or the file was deleted.
        """
        if not self._is_dirty:
            return
        self.end_chunk()
        self._bring_down()
        self._is_dirty = False

    def _bring_down(self) -> None:
        number = self._file.fileno()
        os.fsync(number)
        if not os.fstat(number).st_nlink:
            raise DeletedRecordingError(errno.ENOENT, "its file was deleted")

    def _hand_over(self) -> None:
        """Give the operating system what waits. A disk that is nearly full takes a part of it, then fails."""
        parts = self._waiting[:]
        self._waiting.clear()
        while parts:
            taken = os.writev(self._file.fileno(), parts[:_MOST_PARTS])
            self._size_bytes += taken
            parts = _behind(parts, taken)

    def abandon(self) -> None:
        """Leave the file as it is. Whatever is whole in it can be read."""
        with suppress(OSError):
            self._file.close()

    def close(self) -> None:
        """End the file in order.

        Raises:
            OSError: the disk is full, or gone, and what was written until then can be read; or the file was deleted.
        """
        try:
            self._writer.finish()
            self._hand_over()
            self._bring_down()
        finally:
            self.abandon()


def require_new(path: Path, option: str) -> None:
    """Refuse at once, before anything long, what cannot become a recording.

    Raises:
        SettingsError: its name is none of a recording, by which it would be known later.
        UnavailableError: it exists.
    """
    if not is_recording(path.name):
        raise SettingsError(f"{option} {path} does not end in {SUFFIX}", "give FILE.mcap")
    if path.exists():
        raise _taken(path)


def _taken(path: Path) -> UnavailableError:
    return UnavailableError(f"{path} exists already", "name another file, or delete it")


def _behind(parts: list[Buffer], size: int) -> list[Buffer]:
    """Return what is left of pieces behind so many bytes."""
    for place, part in enumerate(parts):
        if size < len(part):
            return [memoryview(part)[size:], *parts[place + 1 :]]
        size -= len(part)
    return []


@contextmanager
def written(path: Path, channels: tuple[Topic, ...] | None = None) -> Iterator[RecordingFile]:
    """Write a recording while the block runs, and end it in order. It appears whole or not at all.

    Args:
        path: the file; it must not exist.
        channels: its topics.

    Raises:
        UnavailableError: it exists, or cannot be written; nothing of it is left then.
    """
    try:
        with new_file(path) as descriptor:
            file = RecordingFile(path, channels, os.dup(descriptor))
            try:
                yield file
                file.close()
            finally:
                file.abandon()
    except FileExistsError:
        raise _taken(path) from None
    except OSError as error:
        raise UnavailableError(
            f"{path} cannot be written ({error.strerror})", "make room, or name another disk"
        ) from None
