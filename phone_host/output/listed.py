"""Folders of results. The file `.tandemscan` in the folder lists what is ours, and so tells it from everything else.

Rules: a name is listed before anything is made under it, so that a killed run leaves nothing that the next one takes
for foreign. A later run replaces what is listed and what it would write itself, and nothing else. If anything foreign
has such a name, the run ends before it changes anything. Links are never ours. The list is a file of its own and not
part of report.json, because that one is written at the end, which a killed run does not reach.

What an earlier run has left stays until what replaces it is whole on the disk (decision 0088): new results are written
into a hidden folder in this one (`stage`), synced, and moved up at the end (`publish`). The hidden folder gets a second
name once it is whole; if a run is killed while it moves its results up, the next one finishes that.
"""

import errno
import os
import re
import stat
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Final

from common.errors import DataError, UnavailableError
from common.files import read_file, replacing_in, sync_folder
from common.plain_text import writable
from common.temporary import final_name
from common.unfinished import unfinished
from phone_host.output.folder_lock import FolderLock, Length
from phone_host.output.open_folders import FOLDER, entries_of, remove_tree, sync_file, way_to

LIST: Final = ".tandemscan"
STAGED: Final = ".tandemscan.new"
"""Name of the folder for results that are not whole yet."""

_WHOLE: Final = ".tandemscan.whole"
_OWN: Final = (STAGED, _WHOLE)
_LAST: Final = "report.json"
"""What is moved up last: it tells what the other results are."""

_HEAD: Final = "# What tandemscan has written here. A later run replaces this, and nothing else.\n"
_MOST_BYTES: Final = 64 << 20
"""Enough for five million pairs."""

RunAll = Callable[[Callable[[str], None], Iterable[str]], Iterable[None]]


class ListedFolder:
    """A folder of results. New results go into the folder itself, or after `stage` into a hidden one until `publish`.

    Attributes:
        earlier: names of the results that an earlier run has left, and that `publish` or `remove_earlier` removes.

    Args:
        path: created if missing.
        names: pattern of the names that are removed if they are ours, and written anew.
        kept: pattern of the names that stay if they are ours, because they are replaced one by one.
        inner: pattern of the files that may lie in folders among `names`.

    Raises:
        UnavailableError: such a name belongs to a foreign file, or to a link; or another program writes there.
        OSError: as the operating system reports it.
    """

    def __init__(self, path: Path, names: str, *, kept: str = "(?!)", inner: str = "(?!)") -> None:
        self._path, self._inner = path, re.compile(inner)
        self._lock = FolderLock(path, length=Length.RESULTS)
        self.descriptor = self._list = self._into = -1
        self._ending = ExitStack()
        try:
            self.descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
            self._into = self.descriptor
            listed = self._listed()
            self._check_own(listed)
            ours = self._ours(re.compile(names), listed)
            self._ours(re.compile(kept), listed)
            for name in ours:
                self._check_inside(name)
            if _WHOLE in entries_of(self.descriptor):  # a run was killed while it moved its results up
                self._move_up(ours)
                ours = self._ours(re.compile(names), listed)
            self._clear(listed)
            self.earlier = [name for name in ours if name == plain_name(name)]
            there = set(entries_of(self.descriptor))
            listed = {name for name in listed if name in there or not re.fullmatch(names, name)}
            self._names = {*listed, *_OWN}
            self._size_bytes = self._write()
            self._list = os.open(LIST, os.O_WRONLY | os.O_APPEND | os.O_NOFOLLOW | os.O_CLOEXEC, dir_fd=self.descriptor)
        except BaseException:
            self.close()
            raise

    @property
    def is_staged(self) -> bool:
        """Whether new results go into the hidden folder."""
        return self._into != self.descriptor

    @property
    def place(self) -> Path:
        """Where new results go. The path leads to the open folder, so replacing its name has no effect."""
        return way_to(self._into, self._path / STAGED) if self.is_staged else self._path

    def stage(self) -> None:
        """Let new results go into the hidden folder from now on.

        Raises:
            OSError: as the operating system reports it.
        """
        os.mkdir(STAGED, dir_fd=self.descriptor)
        self._into = os.open(STAGED, FOLDER, dir_fd=self.descriptor)
        self._ending.enter_context(unfinished(self.discard))

    def publish(self) -> None:
        """Let the new results, which are whole, take the place of the earlier ones.

        Raises:
            OSError: as the operating system reports it; if the new ones are on the disk by then, the next run moves them up.
        """
        if self.is_staged:
            for name in entries_of(self._into):
                sync_file(name, self._into)
            os.fsync(self._into)
            self._ending.close()
            os.rename(STAGED, _WHOLE, src_dir_fd=self.descriptor, dst_dir_fd=self.descriptor)
            sync_folder(self.descriptor)
            os.close(self._into)
            self._into = self.descriptor
            self._move_up(self.earlier)
        else:
            self.remove_earlier()

    def publish_alone(self, name: str) -> bool:
        """Move one new result up, where nothing is replaced, and leave the others; return whether it was there.

        Args:
            name: of a file that is whole.
        """
        if not self.is_staged or self.earlier or name not in entries_of(self._into):
            return False
        with suppress(OSError):
            os.rename(name, name, src_dir_fd=self._into, dst_dir_fd=self.descriptor)
            return True
        return False

    def remove_earlier(self) -> None:
        """Remove the results of an earlier run.

        Raises:
            OSError: as the operating system reports it.
        """
        while self.earlier:
            self._remove(self.earlier[-1])
            self.earlier.pop()

    def discard(self) -> None:
        """Remove the new results, unless they were published. May be called again."""
        with suppress(OSError):
            remove_tree(STAGED, self.descriptor)

    def spare_staged(self) -> None:
        """Leave the new results in the hidden folder if the process has to end at once: what is in it is of use."""
        self._ending.close()

    def keep_staged(self) -> None:
        """Leave the new results in the hidden folder: the next run removes them."""
        self._ending.close()
        if self.is_staged:
            os.close(self._into)
            self._into = self.descriptor

    def add(self, *names: str) -> None:
        """List names before they are written.

        Raises:
            OSError: as the operating system reports it; nothing is listed then.
        """
        lines = "".join(f"{name}\n" for name in names if name not in self._names).encode()
        if os.write(self._list, lines) < len(lines):
            os.ftruncate(self._list, self._size_bytes)
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        self._size_bytes += len(lines)
        self._names.update(names)

    def create(self, name: str) -> int:
        """Create a file that does not exist yet; return its descriptor, for writing.

        Raises:
            OSError: as the operating system reports it.
        """
        self.add(name)
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
        return os.open(name, flags, 0o644, dir_fd=self._into)

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
        part, into = f"{name}.part", self._into
        os.mkdir(part, dir_fd=into)
        folder = os.open(part, FOLDER, dir_fd=into)
        try:
            with unfinished(lambda: self._remove(part, into)):
                yield way_to(folder, self.place / part)
                for _ in run_all(lambda entry: sync_file(entry, folder), entries_of(folder)):
                    pass
                os.fsync(folder)
            os.rename(part, name, src_dir_fd=into, dst_dir_fd=into)
            sync_folder(into)
        except BaseException:
            self._remove(part, into)
            raise
        finally:
            os.close(folder)

    def write_text(self, name: str, text: str) -> None:
        """Write a listed file, whole or not at all; it survives a power cut.

        Raises:
            OSError: as the operating system reports it.
        """
        with replacing_in(self._into, name) as file:
            file.write(writable(text).encode())

    def sync(self) -> None:
        """Make the list and all names in the folder survive a power cut.

        Raises:
            OSError: the disk fails.
        """
        os.fsync(self._list)
        sync_folder(self._into)

    def close(self) -> None:
        """Close the folder. New results that were not published are removed, and what is not whole with them."""
        try:
            if self.is_staged:
                os.close(self._into)
                self._into = self.descriptor
                self.discard()
            self._ending.close()
            for descriptor in (self._list, self.descriptor):
                if descriptor >= 0:
                    os.close(descriptor)
        finally:  # whatever a signal raises in between
            self._list = self.descriptor = self._into = -1
            self._lock.release()

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

    def _write(self) -> int:
        """Write the list, unless it says that already: a full disk does not matter then. Return its length, bytes."""
        lines = (_HEAD + "".join(f"{name}\n" for name in sorted(self._names))).encode()
        with suppress(OSError, DataError):
            if read_file(self.descriptor, self._path / LIST, len(lines))[0] == lines:
                return len(lines)
        with replacing_in(self.descriptor, LIST) as file:
            file.write(lines)
        return len(lines)

    def _check_own(self, listed: set[str]) -> None:
        """Refuse a hidden folder that is not ours."""
        for name in _OWN:
            with suppress(FileNotFoundError):
                mode = os.lstat(name, dir_fd=self.descriptor).st_mode
                if name not in listed or not stat.S_ISDIR(mode):
                    raise self._in_the_way(f"{self._path / name} was not written by an earlier run")

    def _ours(self, wanted: re.Pattern[str], listed: set[str]) -> list[str]:
        """Return the names in the folder that match; raise if one of them is not ours."""
        found = [name for name in entries_of(self.descriptor) if wanted.fullmatch(plain_name(name))]
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
        folder = os.open(name, FOLDER, dir_fd=self.descriptor)
        try:
            for entry in entries_of(folder):
                mode = os.lstat(entry, dir_fd=folder).st_mode
                if not (self._inner.fullmatch(plain_name(entry)) and stat.S_ISREG(mode)):
                    raise self._in_the_way(f"{self._path / name / entry} was not written by an earlier run")
        finally:
            os.close(folder)

    def _clear(self, listed: set[str]) -> None:
        """Remove what killed runs have begun."""
        remove_tree(STAGED, self.descriptor)
        for name in entries_of(self.descriptor):
            if plain_name(name) == name or plain_name(name) not in listed:
                continue
            mode = os.lstat(name, dir_fd=self.descriptor).st_mode
            if stat.S_ISREG(mode) or stat.S_ISDIR(mode):
                with suppress(OSError):  # a folder of another verb's, whose files are not known here
                    self._remove(name)

    def _move_up(self, earlier: Iterable[str]) -> None:
        """Move whole results up, over the earlier ones; then remove those that nothing replaces."""
        whole = os.open(_WHOLE, FOLDER, dir_fd=self.descriptor)
        try:
            moved = sorted(entries_of(whole), key=lambda name: (name == _LAST, name))
            for name in moved:
                with suppress(FileNotFoundError):
                    if stat.S_ISDIR(os.lstat(name, dir_fd=self.descriptor).st_mode):
                        self._remove(name)
                os.replace(name, name, src_dir_fd=whole, dst_dir_fd=self.descriptor)
        finally:
            os.close(whole)
        for name in set(earlier).difference(moved):
            self._remove(name)
        os.rmdir(_WHOLE, dir_fd=self.descriptor)
        sync_folder(self.descriptor)
        self.earlier = []

    def _remove(self, name: str, parent: int | None = None) -> None:
        within = self.descriptor if parent is None else parent
        if not stat.S_ISDIR(os.lstat(name, dir_fd=within).st_mode):
            os.unlink(name, dir_fd=within)
            return
        folder = os.open(name, FOLDER, dir_fd=within)
        try:
            for entry in entries_of(folder):
                if self._inner.fullmatch(plain_name(entry)):
                    os.unlink(entry, dir_fd=folder)
        finally:
            os.close(folder)
        os.rmdir(name, dir_fd=within)

    def _in_the_way(self, problem: str) -> UnavailableError:
        return UnavailableError(problem, "move or delete it, or give another folder with --out")


def plain_name(name: str) -> str:
    """Return the name under which something is listed: an unfinished file or folder counts as the finished one."""
    final = final_name(name)
    return final if final != name else name.removesuffix(".part")
