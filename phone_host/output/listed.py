"""Folders of results. The file `.tandemscan` in the folder lists what is ours, and so tells it from everything else.

Rules: a name is listed before anything is made under it, so that a killed run leaves nothing that the next one takes
for foreign. A later run removes what is listed and what it would write itself, and nothing else. If anything foreign
has such a name, the run ends before it changes anything. Links are never ours. The list is a file of its own and not
part of report.json, because that one is written at the end, which a killed run does not reach.
"""

import errno
import fcntl
import os
import re
import stat
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from common.errors import DataError, UnavailableError
from common.files import read_file, replacing_in, sync_folder
from common.places import make_folder
from common.plain_text import writable
from common.unfinished import unfinished

LIST: Final = ".tandemscan"

_HEAD: Final = "# What tandemscan has written here. A later run replaces this, and nothing else.\n"
_MOST_BYTES: Final = 64 << 20
"""Enough for five million pairs."""

_TEMPORARY: Final = re.compile(r"\.(.+)\.[0-9a-f]{16}\.part")
RunAll = Callable[[Callable[[str], None], Iterable[str]], Iterable[None]]

_FOLDER: Final = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC


class ListedFolder:
    """A folder of results. Results of an earlier run are removed if they have names that this run uses.

    Args:
        path: created if missing.
        names: pattern of the names that are removed if they are ours, and written anew.
        kept: pattern of the names that stay if they are ours, because they are replaced one by one.
        inner: pattern of the files that may lie in folders among `names`.

    Raises:
        UnavailableError: such a name belongs to a foreign file, or to a link.
        OSError: as the operating system reports it.
    """

    def __init__(self, path: Path, names: str, *, kept: str = "(?!)", inner: str = "(?!)") -> None:
        self._path, self._inner = path, re.compile(inner)
        make_folder(path)
        self.descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        self._list = -1
        try:
            self._lock()
            listed = self._listed()
            removed = self._ours(re.compile(names), listed)
            self._ours(re.compile(kept), listed)
            for name in removed:
                self._check_inside(name)
            for name in removed:
                self._remove(name)
            listed -= {plain_name(name) for name in removed}
            self._size_bytes = self._write(listed)
            self._list = os.open(LIST, os.O_WRONLY | os.O_APPEND | os.O_NOFOLLOW | os.O_CLOEXEC, dir_fd=self.descriptor)
        except BaseException:
            self.close()
            raise

    def add(self, *names: str) -> None:
        """List names before they are written.

        Raises:
            OSError: as the operating system reports it; nothing is listed then.
        """
        lines = "".join(f"{name}\n" for name in names).encode()
        if os.write(self._list, lines) < len(lines):
            os.ftruncate(self._list, self._size_bytes)
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        self._size_bytes += len(lines)

    def create(self, name: str) -> int:
        """Create a file that does not exist yet; return its descriptor, for writing.

        Raises:
            OSError: as the operating system reports it.
        """
        self.add(name)
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
        return os.open(name, flags, 0o644, dir_fd=self.descriptor)

    @contextmanager
    def new_folder(self, name: str, run_all: RunAll = map) -> Iterator[Path]:
        """Create a folder that does not exist yet. It appears under its name when the block ends without an error; its files then survive a power cut.

        Args:
            name: name of the folder, in this one.
            run_all: calls a function for each of its files to put them on the disk, possibly in several threads: a disk
                takes several at once in little more time than one.

        Yields:
            Where to write its files, which must match `inner`. The path leads to the open folder, so replacing its name
            has no effect.

        Raises:
            OSError: as the operating system reports it, for example FileExistsError; nothing of the folder is left
                then.
        """
        self.add(name)
        part = f"{name}.part"
        os.mkdir(part, dir_fd=self.descriptor)
        folder = os.open(part, _FOLDER, dir_fd=self.descriptor)
        try:
            with unfinished(lambda: self._remove(part)):
                yield _way_to(folder, self._path / part)
                for _ in run_all(lambda entry: _sync_file(entry, folder), _entries(folder)):
                    pass
                os.fsync(folder)
            os.rename(part, name, src_dir_fd=self.descriptor, dst_dir_fd=self.descriptor)
            sync_folder(self.descriptor)
        except BaseException:
            self._remove(part)
            raise
        finally:
            os.close(folder)

    def write_text(self, name: str, text: str) -> None:
        """Write a listed file, whole or not at all; it survives a power cut.

        Raises:
            OSError: as the operating system reports it.
        """
        with replacing_in(self.descriptor, name) as file:
            file.write(writable(text).encode())

    def sync(self) -> None:
        """Make the list and all names in the folder survive a power cut.

        Raises:
            OSError: the disk fails.
        """
        os.fsync(self._list)
        sync_folder(self.descriptor)

    def close(self) -> None:
        """Close the folder."""
        for descriptor in (self._list, self.descriptor):
            if descriptor >= 0:
                os.close(descriptor)
        self._list = self.descriptor = -1

    def _lock(self) -> None:
        """Keep other runs out until this one has closed the folder. Where the file system has no locks, do nothing."""
        try:
            fcntl.flock(self.descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise UnavailableError(
                f"{self._path} is being written by another run", "wait for its end, or give another folder with --out"
            ) from None
        except OSError:
            return

    def _listed(self) -> set[str]:
        path = self._path / LIST
        try:
            text = read_file(self.descriptor, path, _MOST_BYTES)[0].decode("utf-8", "replace")
        except FileNotFoundError:
            return set()
        except DataError as error:
            raise self._in_the_way(error.problem) from None
        if not text.startswith(_HEAD):
            raise self._in_the_way(f"{path} was not written by this program")
        # If the last line has no end, nothing was made under it yet.
        return set(text.removeprefix(_HEAD).rpartition("\n")[0].splitlines())

    def _write(self, names: set[str]) -> int:
        lines = (_HEAD + "".join(f"{name}\n" for name in sorted(names))).encode()
        with replacing_in(self.descriptor, LIST) as file:
            file.write(lines)
        return len(lines)

    def _ours(self, wanted: re.Pattern[str], listed: set[str]) -> list[str]:
        """Return the names in the folder that match; raise if one of them is not ours."""
        found = [name for name in _entries(self.descriptor) if wanted.fullmatch(plain_name(name))]
        for name in found:
            path, mode = self._path / name, os.lstat(name, dir_fd=self.descriptor).st_mode
            if stat.S_ISLNK(mode):
                raise self._in_the_way(f"{path} is a link")
            if plain_name(name) not in listed or not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
                raise self._in_the_way(f"{path} was not written by an earlier run")
        return found

    def _check_inside(self, name: str) -> None:
        """Refuse a folder of ours that contains something foreign."""
        if not stat.S_ISDIR(os.lstat(name, dir_fd=self.descriptor).st_mode):
            return
        folder = os.open(name, _FOLDER, dir_fd=self.descriptor)
        try:
            for entry in _entries(folder):
                mode = os.lstat(entry, dir_fd=folder).st_mode
                if not (self._inner.fullmatch(plain_name(entry)) and stat.S_ISREG(mode)):
                    raise self._in_the_way(f"{self._path / name / entry} was not written by an earlier run")
        finally:
            os.close(folder)

    def _remove(self, name: str) -> None:
        if not stat.S_ISDIR(os.lstat(name, dir_fd=self.descriptor).st_mode):
            os.unlink(name, dir_fd=self.descriptor)
            return
        folder = os.open(name, _FOLDER, dir_fd=self.descriptor)
        try:
            for entry in _entries(folder):
                if self._inner.fullmatch(plain_name(entry)):
                    os.unlink(entry, dir_fd=folder)
        finally:
            os.close(folder)
        os.rmdir(name, dir_fd=self.descriptor)

    def _in_the_way(self, problem: str) -> UnavailableError:
        return UnavailableError(problem, "move or delete it, or give another folder with --out")


def claim(path: Path, *names: str) -> None:
    """List names in a folder as ours before they are written; they must be free or left by an earlier run.

    Args:
        path: the folder, created if missing.
        names: names of what will be written there.

    Raises:
        UnavailableError: such a name belongs to a foreign file, or to a link.
        OSError: as the operating system reports it.
    """
    folder = ListedFolder(path, "(?!)", kept="|".join(re.escape(name) for name in names))
    try:
        folder.add(*names)
    finally:
        folder.close()


def _way_to(folder: int, path: Path) -> Path:
    """Return a path to an open folder."""
    way = Path(f"/proc/self/fd/{folder}")
    return way if way.exists() else path


def _sync_file(name: str, folder: int) -> None:
    descriptor = os.open(name, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC, dir_fd=folder)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _entries(folder: int) -> list[str]:
    with os.scandir(folder) as entries:
        return sorted(entry.name for entry in entries)


def plain_name(name: str) -> str:
    """Return the name under which something is listed: an unfinished file or folder counts as the finished one."""
    if begun := _TEMPORARY.fullmatch(name):
        return begun.group(1)
    return name.removesuffix(".part")
