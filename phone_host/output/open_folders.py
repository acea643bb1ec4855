"""What is done in a folder that is open, by its descriptor, so that nobody can put another one under its path meanwhile."""

import errno
import os
import re
import shutil
import stat
from pathlib import Path
from typing import Final

from common.temporary import final_name
from phone_host.output.pair_files import PAIR_NAMES

FOLDER: Final = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
"""How a folder in another one is opened."""

INNER: Final = re.compile(PAIR_NAMES)
"""What may lie in folders among the results, whichever verb wrote them: any verb finishes what another one has begun."""


def way_to(folder: int, path: Path) -> Path:
    """Return a path to an open folder.

    Args:
        folder: its descriptor.
        path: the path where the system has none by descriptors.
    """
    way = Path(f"/proc/self/fd/{folder}")
    return way if way.exists() else path


def sync_file(name: str, folder: int) -> None:
    """Make a file or folder in a folder survive a power cut.

    Raises:
        OSError: the disk fails.
    """
    descriptor = os.open(name, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC, dir_fd=folder)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def entries_of(folder: int) -> list[str]:
    """Return the names in a folder, sorted.

    Raises:
        OSError: as the operating system reports it.
    """
    with os.scandir(folder) as entries:
        return sorted(entry.name for entry in entries)


def remove_tree(name: str, folder: int) -> None:
    """Remove a folder with all that is in it; do nothing if it is not there. No link is followed.

    Raises:
        OSError: as the operating system reports it.
    """
    if name in entries_of(folder):
        shutil.rmtree(name, dir_fd=folder)


def plain_name(name: str) -> str:
    """Return the name under which something is listed: an unfinished file or folder counts as the finished one."""
    final = final_name(name)
    return final if final != name else name.removesuffix(".part")


def remove_result(name: str, folder: int) -> None:
    """Remove a file, or a folder of results; do nothing if it is gone. What others have put into that folder stays, in `NAME.foreign`.

    Raises:
        OSError: as the operating system reports it.
    """
    try:
        if not stat.S_ISDIR(os.lstat(name, dir_fd=folder).st_mode):
            os.unlink(name, dir_fd=folder)
            return
    except FileNotFoundError:
        return
    inside = os.open(name, FOLDER, dir_fd=folder)
    try:
        for entry in entries_of(inside):
            if INNER.fullmatch(plain_name(entry)) and not stat.S_ISDIR(os.lstat(entry, dir_fd=inside).st_mode):
                os.unlink(entry, dir_fd=inside)
    finally:
        os.close(inside)
    try:
        os.rmdir(name, dir_fd=folder)
    except OSError as error:
        if error.errno not in {errno.ENOTEMPTY, errno.EEXIST}:
            raise
        os.rename(name, _free_name(f"{name}.foreign", folder), src_dir_fd=folder, dst_dir_fd=folder)


def _free_name(name: str, folder: int) -> str:
    """Return the name, or the first of `name-2`, `name-3` ... that nothing has."""
    taken, number, free = set(entries_of(folder)), 1, name
    while free in taken:
        number += 1
        free = f"{name}-{number}"
    return free
