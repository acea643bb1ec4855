"""Temporary names beside a final one, and what programs that were killed have left under them.

Rules: a temporary name is `.NAME.<16 hexadecimal digits>.part`. Whoever writes under it locks the file or folder (flock) as long as it is written, and the kernel
drops the lock when the program ends, however that happens. So a temporary that nobody has locked was left behind, and the next writer of NAME
removes it. Where the file system has no locks nobody can tell, and it stays.
"""

import fcntl
import os
import stat
from collections.abc import Callable
from contextlib import suppress
from typing import Final

_LOOK: Final = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_NOCTTY | os.O_CLOEXEC
_SUFFIX: Final = ".part"
_DIGITS: Final = 16


def open_temporary(folder: int, name: str, create: Callable[[str], int]) -> tuple[str, int]:
    """Create something under a new temporary name, and lock it.

    Args:
        folder: descriptor of the folder.
        name: the final name in it.
        create: creates it under the name that it is given; returns an open descriptor.

    Returns:
        The temporary name and the descriptor, which holds the lock until it is closed.

    Raises:
        OSError: as the operating system reports it.
    """
    while True:
        temporary = f".{name}.{os.urandom(_DIGITS // 2).hex()}{_SUFFIX}"
        descriptor = create(temporary)
        with suppress(OSError):  # no locks here, or another writer just looks whether somebody writes it
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        try:
            status = os.stat(temporary, dir_fd=folder, follow_symlinks=False)
        except FileNotFoundError:  # it was taken for left behind before it was locked
            os.close(descriptor)
            continue
        if status.st_ino == os.fstat(descriptor).st_ino:
            return temporary, descriptor
        os.close(descriptor)


def final_name(entry: str) -> str:
    """Return the final name of a temporary one; any other name is returned as it is."""
    digits = entry[-len(_SUFFIX) - _DIGITS : -len(_SUFFIX)]
    head = entry[: -len(_SUFFIX) - _DIGITS]
    is_temporary = (
        entry.endswith(_SUFFIX)
        and len(digits) == _DIGITS
        and set(digits) <= set("0123456789abcdef")
        and head.startswith(".")
        and head.endswith(".")
        and len(head) > 2
    )
    return head[1:-1] if is_temporary else entry


def remove_left_behind(folder: int, name: str) -> None:
    """Remove the temporaries of a name whose writers have ended without removing them.

    Args:
        folder: descriptor of the folder.
        name: the final name in it.
    """
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in [each.name for each in entries if each.name.startswith(f".{name}.")]:
            if final_name(entry) == name:
                _remove_if_left(folder, entry)


def remove_temporary(folder: int, entry: str) -> None:
    """Remove a file, or a folder with all that is in it; do nothing if it is gone. No link is followed.

    Args:
        folder: descriptor of the folder that holds it.
        entry: its name there.
    """
    with suppress(OSError):
        if stat.S_ISDIR(os.lstat(entry, dir_fd=folder).st_mode):
            import shutil  # noqa: PLC0415 - compression libraries that a start does not need

            shutil.rmtree(entry, dir_fd=folder)
        else:
            os.unlink(entry, dir_fd=folder)


def _remove_if_left(folder: int, entry: str) -> None:
    with suppress(OSError):  # it is locked, another user's, or gone by now
        descriptor = os.open(entry, _LOOK, dir_fd=folder)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            remove_temporary(folder, entry)
        finally:
            os.close(descriptor)
