"""Folders of results. The file `.tandemscan` in the folder lists what is ours, and so tells it from everything else.

Rules: a name is listed before anything is made under it, so that a killed run leaves nothing that the next one takes
for foreign. A later run replaces what is listed and what it would write itself, and nothing else. If anything foreign
has such a name, the run ends before it changes anything. Links are never ours. The list is a file of its own and not
part of report.json, because that one is written at the end, which a killed run does not reach.

What an earlier run has left stays until what replaces it is whole on the disk (decision 0088): new results are written
into a hidden folder in this one (`stage`), and moved up at the end (`publish`, `move_up.py`). A set that is not whole replaces nothing: it is left in a
folder of its own beside the earlier results (`keep_staged`). What a killed program has staged stays until the next one stages.

Signals may raise an error between any two steps. So nothing is acquired before `open`, and `close` releases whatever was acquired by then: call it in
any case, or use the folder as a context manager.
"""

import errno
import os
import re
import stat
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from common.errors import DataError, UnavailableError
from common.files import read_file, replacing_in, sync_folder
from common.plain_text import writable
from common.unfinished import unfinished, weakly
from phone_host.output.folder_lock import FolderLock, Length
from phone_host.output.move_up import (
    REPLACED,
    STAGED,
    WHOLE,
    begin_move,
    finish_move,
    keep_under,
    leave_partial,
    remove_set,
)
from phone_host.output.open_folders import (
    FOLDER,
    INNER,
    entries_of,
    plain_name,
    remove_result,
    remove_tree,
    sync_file,
    way_to,
)
from phone_host.output.report_owner import names_of_other_report

LIST: Final = ".tandemscan"
_OWN: Final = (STAGED, WHOLE, REPLACED)
_NOTHING: Final = "(?!)"
_HEAD: Final = "# What tandemscan has written here. A later run replaces this, and nothing else.\n"
_MOST_BYTES: Final = 64 << 20
"""Enough for five million pairs."""

RunAll = Callable[[Callable[[str], None], Iterable[str]], Iterable[None]]


class ListedFolder:
    """A folder of results. New results go into the folder itself, or after `stage` into a hidden one until `publish`. A context manager.

    Attributes:
        earlier: names of the results that an earlier run has left, and that `publish` or `remove_earlier` removes.
        renamed: another verb's report and page, each with the name that it gets when this verb's takes its place.

    Args:
        path: created if missing.
        names: pattern of the names that are removed if they are ours, and written anew.
        kept: pattern of the names that stay if they are ours, because they are replaced one by one.
        command: the verb whose report is among `names`: that of another verb is not replaced but stays under another name. Empty: it has none.
    """

    def __init__(self, path: Path, names: str, *, kept: str = _NOTHING, command: str = "") -> None:
        self._path, self._pattern, self._kept, self._command = path, re.compile(names), re.compile(kept), command
        self._lock = FolderLock(path, length=Length.RESULTS)
        self.descriptor = self._list = self._into = -1
        self._ending = ExitStack()
        self.renamed: dict[str, str] = {}
        self.earlier: list[str] = []

    def open(self) -> None:
        """Lock and open the folder, and finish what killed programs have left to do in it.

        Raises:
            UnavailableError: such a name belongs to a foreign file, or to a link; or another program writes there.
            OSError: as the operating system reports it.
        """
        self._lock.acquire()
        self._into = self.descriptor = os.open(self._path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        listed = self._listed()
        self._check_own(listed)
        if WHOLE in entries_of(self.descriptor):  # a program was killed while it moved its results up
            finish_move(self.descriptor, listed)
        self.renamed = names_of_other_report(way_to(self.descriptor, self._path), self._command)
        ours = self._ours(self._pattern, listed)
        self._ours(self._kept, listed)
        self._ours(_any_of((*self.renamed, *self.renamed.values())), listed)
        for name in ours:
            self._check_inside(name)
        self._clear(listed)
        self.earlier = [name for name in ours if name == plain_name(name) and name not in self.renamed]
        there = set(entries_of(self.descriptor))
        listed = {name for name in listed if name in there or not self._pattern.fullmatch(name)}
        self._names = {*listed, *_OWN, *self.renamed.values(), *filter(None, [self._partial])}
        self._size_bytes = self._write()
        self._list = os.open(LIST, os.O_WRONLY | os.O_APPEND | os.O_NOFOLLOW | os.O_CLOEXEC, dir_fd=self.descriptor)

    def __enter__(self) -> Self:
        try:
            self.open()
            return self  # noqa: TRY300 - a signal may come before this line, too
        except BaseException:
            self.close()
            raise

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def is_staged(self) -> bool:
        """Whether new results go into the hidden folder."""
        return self._into != self.descriptor

    @property
    def place(self) -> Path:
        """Where new results go. The path leads to the open folder, so replacing its name has no effect."""
        return way_to(self._into, self._path / STAGED) if self.is_staged else self._path

    def stage(self) -> None:
        """Let new results go into the hidden folder from now on. What a killed program has left there goes.

        Raises:
            OSError: as the operating system reports it.
        """
        for name in (STAGED, REPLACED):
            remove_tree(name, self.descriptor)
        os.mkdir(STAGED, dir_fd=self.descriptor)
        self._into = os.open(STAGED, FOLDER, dir_fd=self.descriptor)
        self._ending.enter_context(unfinished(weakly(self.discard)))

    def publish(self) -> None:
        """Let the new results, which are whole, take the place of the earlier ones, and of partial ones of this verb.

        Raises:
            OSError: as the operating system reports it; if the new ones are on the disk by then, the next run moves them up.
        """
        if self.is_staged:
            begin_move(self.descriptor, self._into, {*self.earlier, *self.renamed}, self.renamed)
            self._end_staging()
            finish_move(self.descriptor, self._names)
            self.earlier = []
        else:
            self.remove_earlier()
            self._rename_others()
            self.discard()  # what a killed program has staged
        if self._partial:
            remove_set(self._partial, self.descriptor, self._pattern)

    def keep_staged(self) -> Path:
        """Leave the new results, which are not whole, beside the earlier ones, in a folder that says so; return where.

        It takes the place of one of this verb that was left before. Without a verb they stay in the hidden folder until the next run.

        Raises:
            OSError: as the operating system reports it; they are in the hidden folder then.
        """
        if not self.is_staged:
            return self._path
        self._end_staging()
        is_named = bool(self._partial) and leave_partial(self.descriptor, self._partial, self._pattern)
        return self._path / (self._partial if is_named else STAGED)

    def publish_alone(self, name: str) -> bool:
        """Move one new result up, where nothing is replaced, and leave the others; return whether it was there."""
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
            remove_result(self.earlier[-1], self.descriptor)
            self.earlier.pop()

    def discard(self) -> None:
        """Remove the new results, unless they were published. May be called again."""
        with suppress(OSError):
            remove_tree(STAGED, self.descriptor)

    def spare_staged(self) -> None:
        """Leave the new results in the hidden folder if the process has to end at once: what is in it is of use."""
        self._ending.close()

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
            Where to write its files, which are those of a pair (`PAIR_NAMES`). The path leads to the open folder, so replacing its name
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
            with unfinished(lambda: remove_result(part, into)):
                yield way_to(folder, self.place / part)
                for _ in run_all(lambda entry: sync_file(entry, folder), entries_of(folder)):
                    pass
                os.fsync(folder)
            os.rename(part, name, src_dir_fd=into, dst_dir_fd=into)
            sync_folder(into)
        except BaseException:
            remove_result(part, into)
            raise
        finally:
            os.close(folder)

    def write_text(self, name: str, text: str) -> None:
        """Write a listed file, whole or not at all; it survives a power cut. Another verb's report of that name stays under its other name.

        Raises:
            OSError: as the operating system reports it.
        """
        if not self.is_staged and name in self.renamed:
            keep_under(name, self.renamed.pop(name), self.descriptor)
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
        """Close the folder. New results that were not published are removed, and what is not whole with them. May be called again."""
        try:
            if self.is_staged:
                self.discard()
            self._end_staging()
        finally:  # whatever a signal raises in between
            ours, self._list, self.descriptor, self._into = (self._list, self.descriptor), -1, -1, -1
            for descriptor in ours:
                if descriptor >= 0:
                    os.close(descriptor)
            self._lock.release()

    @property
    def _partial(self) -> str:
        """Name of the folder for results of this verb that are not whole; empty: it has none."""
        return f"partial-{self._command}" if self._command else ""

    def _end_staging(self) -> None:
        """Let what is written from now on go into the folder itself; what was staged stays where it is."""
        self._ending.close()
        into, self._into = self._into, self.descriptor
        if into != self.descriptor:
            os.close(into)

    def _rename_others(self) -> None:
        """Give another verb's report and page their other names."""
        while self.renamed:
            name, other = self.renamed.popitem()
            keep_under(name, other, self.descriptor)
            with suppress(FileNotFoundError):
                os.unlink(name, dir_fd=self.descriptor)

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
                if not (INNER.fullmatch(plain_name(entry)) and stat.S_ISREG(mode)):
                    raise self._in_the_way(f"{self._path / name / entry} was not written by an earlier run")
        finally:
            os.close(folder)

    def _clear(self, listed: set[str]) -> None:
        """Remove what killed runs have half written. What is whole in their hidden folder stays until the next `stage`."""
        for name in entries_of(self.descriptor):
            if plain_name(name) == name or plain_name(name) not in listed:
                continue
            mode = os.lstat(name, dir_fd=self.descriptor).st_mode
            if stat.S_ISREG(mode) or stat.S_ISDIR(mode):
                remove_result(name, self.descriptor)

    def _in_the_way(self, problem: str) -> UnavailableError:
        return UnavailableError(problem, "move or delete it, or give another folder with --out")


def _any_of(names: Iterable[str]) -> re.Pattern[str]:
    return re.compile("|".join(map(re.escape, names)) or _NOTHING)
