"""Files in folders that others may write to as well: links, pipes and folders may lie under the names that we use.

Rules: a folder is opened once. What lies in it is reached by its plain name there (`dir_fd`), never by a path. A name that is a link is not
followed, nothing waits for the other end of a pipe, and nothing is read beyond a limit. A new file begins under a random name that nobody
else has (O_EXCL) and takes its place once it is whole. Root acts in another user's folder with that user's rights, so the kernel refuses
whatever that user could not do himself. This holds however links and folders are replaced meanwhile.

The effective user applies to the whole process: glibc changes it in all threads. So only one block at a time has other rights (`_TURN`), for
milliseconds. Meanwhile other threads of a root process must not open root's files; ours (ZeroMQ's, D-Bus's) open none. Rights per thread
(setfsuid) would need ctypes, and would keep root's groups.
"""

import errno
import os
import pwd
import stat
import threading
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, Final

from common.errors import DataError, UnavailableError
from common.groups import group_of_one
from common.temporary import open_temporary, remove_left_behind
from common.unfinished import unfinished

_TURN: Final = threading.RLock()

_PASSED: Final = getattr(os, "O_PATH", 0) | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
_FOLDER: Final = os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC
_READ: Final = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC
_NEW: Final = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC

_MOST_LINKS: Final = 40
"""The kernel's own limit (path_resolution(7))."""

_PIECE_BYTES: Final = 1 << 20


@contextmanager
def opened_folder(path: Path, *, make: bool = False) -> Iterator[int]:
    """Open a folder for the duration of a block.

    Root follows the path step by step. From the first folder or link that belongs to another user, it continues with that user's rights until
    the block ends, because that user could have put anything behind it.

    Args:
        path: the folder.
        make: whether to create it (mode 0700) and its missing parents.

    Yields:
        Its descriptor.

    Raises:
        OSError: as the operating system raises it.
        UnavailableError: root's path leads through a folder in which anybody may replace what others have put there.
    """
    with ExitStack() as stack:
        stack.enter_context(_TURN)
        if os.geteuid() != 0:
            if make:
                path.mkdir(mode=0o700, parents=True, exist_ok=True)
            folder = os.open(path, _FOLDER)
            stack.callback(os.close, folder)
        else:
            folder = _walk(path, stack, make=make)
        yield folder


def become_owner(path: Path) -> None:
    """Take on, for good, the rights that `opened_folder` gives root in a folder. Does nothing in root's own folder, or if we are not root.

    Raises:
        OSError: as the operating system raises it.
        UnavailableError: as in `opened_folder`.
    """
    with opened_folder(path):
        uid, gid = os.geteuid(), os.getegid()
    if os.geteuid() == 0 and uid != 0:
        os.setgroups([])
        os.setresgid(gid, gid, gid)
        os.setresuid(uid, uid, uid)


def read_file(folder: int, path: Path, most_bytes: int) -> tuple[bytes, os.stat_result]:
    """Read a small file.

    Args:
        folder: descriptor of the folder that contains it.
        path: the file; gives its name, and is used in messages.
        most_bytes: nothing is read from a longer file.

    Returns:
        Its content and its status.

    Raises:
        DataError: it is not a plain file (but a link or a pipe, say), or it is too long.
        OSError: as the operating system raises it; FileNotFoundError if it does not exist.
    """
    try:
        descriptor = os.open(path.name, _READ, dir_fd=folder)
    except OSError as error:
        if error.errno in {errno.ELOOP, errno.ENXIO, errno.EMLINK}:  # a link (EMLINK on BSD); a socket
            raise _no_file(path) from None
        raise
    status = os.fstat(descriptor)
    if not stat.S_ISREG(status.st_mode):
        os.close(descriptor)
        raise _no_file(path)
    with os.fdopen(descriptor, "rb") as file:
        content = _up_to(file, min(status.st_size, most_bytes), most_bytes)
    if len(content) > most_bytes:
        raise DataError(f"{path} is longer than {most_bytes} bytes", "move it away: this program did not write it")
    return content, status


def read_whole(path: Path, most_bytes: int) -> bytes:
    """Read a file that somebody names, wherever that name leads.

    Args:
        path: the file; links are followed.
        most_bytes: nothing is read from a longer file.

    Raises:
        DataError: it is not a plain file (a pipe or a device might never end), or it is too long.
        OSError: as the operating system raises it.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with os.fdopen(descriptor, "rb") as file:
        status = os.fstat(descriptor)
        if not stat.S_ISREG(status.st_mode):
            raise DataError(f"{path} is not a plain file", "give a file")
        content = b"" if status.st_size > most_bytes else _up_to(file, status.st_size, most_bytes)
    if status.st_size > most_bytes or len(content) > most_bytes:
        size = max(status.st_size, len(content))
        raise DataError(f"{path} has {size} bytes, {most_bytes} are the most", "give another file")
    return content


def read_input(path: Path, most_bytes: int, remedy: str) -> bytes:
    """Read a whole input file, up to a limit; what the system refuses is a DataError with this remedy."""
    try:
        return read_whole(path, most_bytes)
    except OSError as error:
        raise DataError(f"{path} cannot be read ({error.strerror or error})", remedy) from error


def _up_to(file: BinaryIO, expected_bytes: int, most_bytes: int) -> bytes:
    """Read a file up to one byte beyond the limit. Memory is taken for what is there, not for what the limit allows."""
    content = file.read(expected_bytes + 1)
    while (
        expected_bytes < len(content) <= most_bytes
    ):  # it grew meanwhile, or is one of the kernel's, which state no size
        piece = file.read(min(_PIECE_BYTES, most_bytes + 1 - len(content)))
        if not piece:
            break
        content += piece
    return content


@contextmanager
def replacing_in(folder: int, name: str, *, mode: int = 0o666, durable: bool = True) -> Iterator[BinaryIO]:
    """Open a new file that takes its place in a folder if the block succeeds. A link of that name is replaced, not followed.

    Args:
        folder: descriptor of the folder.
        name: the file's name in it.
        mode: permissions, which the process's umask narrows.
        durable: whether the file must survive a later power cut; costs some ms on a disk.

    Yields:
        The file, open for binary writing.

    Raises:
        OSError: as the operating system raises it; nothing remains of the partial file.
    """
    if durable:  # the others are many, or lie in a folder that is removed as a whole
        remove_left_behind(folder, name)
    temporary, descriptor = open_temporary(folder, name, lambda new: os.open(new, _NEW, mode, dir_fd=folder))
    try:
        with unfinished(lambda: os.unlink(temporary, dir_fd=folder)):
            # Closed before the rename: a full disk may show only when the last buffer is flushed.
            with os.fdopen(descriptor, "wb") as file:
                yield file
                if durable:
                    file.flush()
                    os.fsync(descriptor)
            os.replace(temporary, name, src_dir_fd=folder, dst_dir_fd=folder)
        if durable:
            sync_folder(folder)
    except BaseException:
        with suppress(FileNotFoundError):
            os.unlink(temporary, dir_fd=folder)
        raise


def sync_folder(folder: int) -> None:
    """Make the names in a folder survive a power cut, if the file system can.

    Raises:
        OSError: the disk fails.
    """
    try:
        os.fsync(folder)
    except OSError as error:
        if error.errno not in {errno.EINVAL, errno.ENOTSUP}:  # some FUSE file systems do not support it
            raise


def _no_file(path: Path) -> DataError:
    return DataError(
        f"{path} is not a plain file but a link, a pipe or a folder", "find out who put it there, then remove it"
    )


def _walk(path: Path, stack: ExitStack, *, make: bool) -> int:
    """Go to a folder from the root, as `opened_folder` describes."""
    parts = deque(path.absolute().parts[1:])
    here = root = _kept(os.open("/", _PASSED), stack)
    links = 0
    while parts:
        part = parts.popleft()
        try:
            status = os.stat(part, dir_fd=here, follow_symlinks=False)
        except FileNotFoundError:
            if not make:
                raise
            with suppress(FileExistsError):
                os.mkdir(part, 0o755 if parts else 0o700, dir_fd=here)
            status = os.stat(part, dir_fd=here, follow_symlinks=False)
        if not stat.S_ISLNK(status.st_mode):
            here = _kept(os.open(part, _PASSED, dir_fd=here), stack)
            _go_on_as(os.fstat(here), path, stack)
            continue
        links += 1
        if links > _MOST_LINKS:
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))
        _go_on_as(status, path, stack)
        target = Path(os.readlink(part, dir_fd=here))
        here = root if target.is_absolute() else here
        parts.extendleft(reversed(target.parts[1:] if target.is_absolute() else target.parts))
    return _kept(os.open(".", _FOLDER, dir_fd=here), stack)


def _kept(descriptor: int, stack: ExitStack) -> int:
    stack.callback(os.close, descriptor)
    return descriptor


def _go_on_as(status: os.stat_result, path: Path, stack: ExitStack) -> None:
    """As root, take on the rights of the owner of this step of the path."""
    if os.geteuid() != 0:
        return
    if status.st_uid != 0:
        stack.enter_context(_rights_of(status))
    elif stat.S_ISDIR(status.st_mode) and is_open_to_others(status):
        raise UnavailableError(
            f"{path} is in a folder of root that others may write to", "run chmod go-w on the folder"
        )


def is_open_to_others(status: os.stat_result) -> bool:
    """Whether anyone but a folder's owner may replace what lies in it: they may write to it and it is not sticky.

    Root's group counts as root. A group that is the owner's alone (by its name, as Debian makes one for each user) counts as the owner.
    """
    if status.st_mode & stat.S_ISVTX:
        return False
    if status.st_mode & stat.S_IWOTH:
        return True
    return bool(status.st_mode & stat.S_IWGRP) and status.st_gid != 0 and not _is_own_group(status)


def _is_own_group(status: os.stat_result) -> bool:
    try:
        user = pwd.getpwuid(status.st_uid)
    except KeyError:
        return False
    return user.pw_gid == status.st_gid and group_of_one(status.st_gid) == user.pw_name


@contextmanager
def _rights_of(status: os.stat_result) -> Iterator[None]:
    """Act as another user for the duration of a block; only root can."""
    gid, groups = os.getegid(), os.getgroups()
    try:
        own_gid = pwd.getpwuid(status.st_uid).pw_gid
    except KeyError:  # a number without a name
        own_gid = status.st_gid
    try:
        os.setgroups([])
        os.setegid(own_gid)
        os.seteuid(status.st_uid)
        yield
    finally:
        os.seteuid(0)
        os.setegid(gid)
        os.setgroups(groups)
