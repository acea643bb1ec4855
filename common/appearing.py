"""New files and folders that appear under their names whole or not at all, and never in place of something else."""

import errno
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from common.files import sync_folder
from common.temporary import open_temporary, remove_left_behind, remove_temporary
from common.unfinished import unfinished

_FOLDER: Final = os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC
_NEW: Final = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
_NO_LINKS: Final = frozenset({errno.EPERM, errno.ENOTSUP, errno.ENOSYS, errno.EACCES, errno.EMLINK})
"""What file systems without hard links say (FAT, some FUSE ones, Android's shared storage)."""


@contextmanager
def new_file(path: Path) -> Iterator[int]:
    """Open a new file, which appears under its name when the block ends without an error.

    Args:
        path: the file; it must not exist.

    Yields:
        A descriptor for writing, which the block need not close.

    Raises:
        FileExistsError: it exists.
        OSError: as the operating system reports it; nothing of it is left then.
    """
    with _appearing(path, lambda folder, name: os.open(name, _NEW, 0o666, dir_fd=folder)) as (_, descriptor):
        yield descriptor


@contextmanager
def new_folder(path: Path) -> Iterator[Path]:
    """Create a folder, which appears under its name when the block ends without an error.

    Args:
        path: the folder; it must not exist.

    Yields:
        The path of the folder until then.

    Raises:
        FileExistsError: it exists.
        OSError: as the operating system reports it; nothing of it is left then.
    """

    def create(folder: int, name: str) -> int:
        os.mkdir(name, dir_fd=folder)
        return os.open(name, _FOLDER | os.O_NOFOLLOW, dir_fd=folder)

    with _appearing(path, create) as (temporary, _):
        yield path.with_name(temporary)


@contextmanager
def _appearing(path: Path, create: Callable[[int, str], int]) -> Iterator[tuple[str, int]]:
    folder = os.open(path.parent, _FOLDER)
    try:
        _require_free(folder, path)
        remove_left_behind(folder, path.name)
        temporary, descriptor = open_temporary(folder, path.name, lambda name: create(folder, name))
        try:
            with unfinished(lambda: remove_temporary(folder, temporary)):
                yield temporary, descriptor
                _give_name(folder, temporary, path)
            sync_folder(folder)
        except BaseException:
            remove_temporary(folder, temporary)
            raise
        finally:
            os.close(descriptor)
    finally:
        os.close(folder)


def _require_free(folder: int, path: Path) -> None:
    with suppress(FileNotFoundError):
        os.lstat(path.name, dir_fd=folder)
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))


def _give_name(folder: int, temporary: str, path: Path) -> None:
    """Rename to the final name. Where something has it by now, it stays: links never replace, and a folder replaces only an empty one."""
    try:
        os.link(temporary, path.name, src_dir_fd=folder, dst_dir_fd=folder, follow_symlinks=False)
        os.unlink(temporary, dir_fd=folder)
    except OSError as error:
        if error.errno not in _NO_LINKS:
            raise
        _require_free(folder, path)
        os.rename(temporary, path.name, src_dir_fd=folder, dst_dir_fd=folder)
