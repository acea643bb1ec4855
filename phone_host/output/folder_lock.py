"""Locks what a program writes, so that no second program writes the same.

Rules: the lock is an flock on a hidden file in the folder, or beside the file, that is written. The kernel drops it when the program ends, however
that happens, so no lock is ever stale; the hidden file goes with it, or with the next program's lock. It holds the number of the process, for the
second program's message. One process locks a folder once for the length of a command, and once more within that for each set of results.

Where the file system has no flock (some network and FUSE file systems) the work goes on without a lock, because whoever writes there could write
nothing at all otherwise; a line in the log says so. Two commands of one process are kept apart all the same.

The table of locks belongs to the process, not to an object: flock asks for nothing else.

Signals may raise an error between any two steps. So a lock acquires nothing before `acquire`, each descriptor is noted before it is locked, and whoever
acquires releases in any case: with a context manager, or `release` in a `finally` that begins before `acquire`. Where the signal comes before the first
step of that, the lock is released when its object goes. A hidden file is only removed by whoever has it locked, and only if it still has its name: else it
would be another program's.
"""

import errno
import fcntl
import logging
import os
import stat
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from common.errors import UnavailableError
from common.places import Kind, kind_of, make_folder, resolved
from common.program.logs import event
from common.unfinished import unfinished, weakly

_LOG = logging.getLogger(__name__)

LOCK: Final = ".tandemscan.lock"
"""Name of the lock of a folder in it."""

_FOLDER: Final = os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC
_OPEN: Final = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC
_MOST_DIGITS: Final = 20


class Length(Enum):
    """How long a lock is meant to last."""

    COMMAND = "the whole of a command"
    RESULTS = "one set of results"


@dataclass(slots=True)
class _Held:
    """A lock of this process: the descriptor of the hidden file, -1 for none, and whether it is locked."""

    descriptor: int = -1
    is_locked: bool = False
    lengths: set[Length] = field(default_factory=set)


_Key = tuple[int, int, str]
_HELD: Final[dict[_Key, _Held]] = {}
_TURN: Final = threading.RLock()


class FolderLock:
    """A lock on a folder, or on one name in it. A context manager.

    Args:
        path: the folder; it and its missing parents are created, and removed again if they are empty in the end.
        file: name of a file in it, if only that is to be locked; the folder must exist then. Empty: the whole folder.
        length: how long it is meant to last.
        option: with which the user gives another place.
    """

    _folder = -1
    _held: _Held | None = None

    def __init__(self, path: Path, file: str = "", *, length: Length = Length.COMMAND, option: str = "--out") -> None:
        self._name = f".{file}.lock" if file else LOCK
        self._path, self._length, self._option = path / file if file else path, length, option
        self._place, self._is_whole = path, not file
        self._made: list[Path] = []
        self._ending = ExitStack()
        self._key: _Key = 0, 0, ""

    def acquire(self) -> None:
        """Keep others from writing there from now on. Call `release` also if this fails.

        Raises:
            UnavailableError: another program writes there, or a foreign file has the lock's name.
            OSError: as the operating system reports it.
        """
        if self._is_whole:
            self._made = _missing(self._place)
            make_folder(self._place)
        self._folder = os.open(self._place, _FOLDER)
        status = os.fstat(self._folder)
        self._key = status.st_dev, status.st_ino, self._name
        with _TURN:
            self._take()
        self._ending.enter_context(unfinished(weakly(self._unlink)))

    def __enter__(self) -> Self:
        try:
            self.acquire()
            return self  # noqa: TRY300 - a signal may come before this line, too
        except BaseException:
            self.release()
            raise

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()

    def __del__(self) -> None:
        """Release a lock that nobody holds any more: a signal came before the first step of `release`. What a signal raises here is lost, so it does little."""
        if self._held is not None or self._folder >= 0:
            self.release()

    def release(self) -> None:
        """Let others write there. May be called again.

        Ctrl-C and SIGTERM may raise an error between any two steps; what matters most comes first: that this process may lock it again.
        """
        try:
            if self._held is not None:
                self._let_go(self._held)
            self._ending.close()
        finally:
            folder, self._folder = self._folder, -1
            if folder >= 0:
                os.close(folder)
            self._remove_made()

    def _let_go(self, held: _Held) -> None:
        with _TURN:
            held.lengths.discard(self._length)
            if not held.lengths:
                if _HELD.get(self._key) is held:
                    del _HELD[self._key]
                self._unlink()  # while it is locked: whoever locks it next looks whether it still has its name
                self._close(held)
            self._held = None

    def _take(self) -> None:
        held = _HELD.get(self._key)
        if held is not None:
            if self._length in held.lengths or self._length is Length.COMMAND:
                raise self._refusal(str(os.getpid()))
            self._held = held
        else:
            self._held = held = _Held()
            self._lock(held)
            _HELD[self._key] = held
        held.lengths.add(self._length)

    def _lock(self, held: _Held) -> None:
        """Lock the hidden file; where the file system has no locks, go on without."""
        while True:
            held.descriptor = self._opened()
            try:
                fcntl.flock(held.descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                number = os.pread(held.descriptor, _MOST_DIGITS, 0).decode("ascii", "replace").strip()
                raise self._refusal(number) from None
            except OSError as error:
                self._close(held)
                with suppress(OSError):
                    os.unlink(self._name, dir_fd=self._folder)
                _LOG.warning(event("not_locked", folder=self._path, cause=error.strerror))
                return
            if self._is_named(held.descriptor):
                held.is_locked = True
                with suppress(OSError):  # a full disk: the lock counts, the number is only told
                    os.ftruncate(held.descriptor, 0)
                    os.pwrite(held.descriptor, f"{os.getpid()}\n".encode(), 0)
                return
            self._close(held)  # its program has just ended

    @staticmethod
    def _close(held: _Held) -> None:
        descriptor, held.descriptor = held.descriptor, -1
        if descriptor >= 0:
            os.close(descriptor)

    def _opened(self) -> int:
        try:
            descriptor = os.open(self._name, _OPEN, 0o644, dir_fd=self._folder)
        except OSError as error:
            if error.errno in {errno.ELOOP, errno.EMLINK, errno.EISDIR, errno.ENXIO}:
                raise self._in_the_way() from None
            if error.errno != errno.EACCES:
                raise
            # Another user's, who writes there or was killed; it can be locked all the same.
            descriptor = os.open(self._name, _OPEN & ~(os.O_RDWR | os.O_CREAT), dir_fd=self._folder)
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            os.close(descriptor)
            raise self._in_the_way()
        return descriptor

    def _is_named(self, descriptor: int) -> bool:
        try:
            named = os.stat(self._name, dir_fd=self._folder, follow_symlinks=False)
        except FileNotFoundError:
            return False
        return named.st_ino == os.fstat(descriptor).st_ino

    def _unlink(self) -> None:
        """Remove the hidden file if this process has it locked under its name."""
        held = self._held
        with suppress(OSError):
            if held is not None and held.is_locked and self._is_named(held.descriptor):
                os.unlink(self._name, dir_fd=self._folder)

    def _remove_made(self) -> None:
        with suppress(OSError):  # it holds results
            for folder in self._made:
                folder.rmdir()

    def _refusal(self, process: str) -> UnavailableError:
        who = f"process {process}" if process.isdecimal() else "another program"
        return UnavailableError(
            f"{self._path} is being written by {who}", f"wait for its end, or give another {self._option}"
        )

    def _in_the_way(self) -> UnavailableError:
        return UnavailableError(
            f"{self._path.parent if self._name != LOCK else self._path}/{self._name} is not a file of this program",
            f"move or delete it, or give another {self._option}",
        )


def _missing(path: Path) -> list[Path]:
    """Return the folders that have to be made for a path, the innermost first."""
    missing = []
    while kind_of(path) is Kind.MISSING and path != path.parent:
        missing.append(path)
        path = path.parent
    return missing


_COMMANDS: Final[list[tuple[ExitStack, set[Path]]]] = []


@contextmanager
def command_locks() -> Iterator[None]:
    """Release what `lock_for_command` locks when the block, which is one command, ends."""
    with ExitStack() as locks:
        command = locks, set[Path]()
        _COMMANDS.append(command)
        try:
            yield
        finally:
            _COMMANDS.remove(command)


def lock_for_command(folder: Path, file: str = "", option: str = "--out") -> None:
    """Lock a folder, or one file in it, until the command ends that runs now. The page and other programs lock each set of results instead.

    Args:
        folder: the folder; created if missing, unless only a file in it is locked.
        file: name of the file; empty: the whole folder.
        option: with which the user gives another place.

    Raises:
        UnavailableError: another program writes there, or a foreign file has the lock's name.
        OSError: as the operating system reports it.
    """
    place = resolved(folder / file)
    if _COMMANDS and place not in _COMMANDS[-1][1]:
        locks, places = _COMMANDS[-1]
        lock = FolderLock(folder, file, option=option)
        locks.callback(lock.release)
        lock.acquire()
        places.add(place)
