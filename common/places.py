"""Looks at what a path names, wherever it leads: it may be too long, lead in a circle or through a folder that nobody may search.

Rule: whoever asks what a path is asks here. pathlib's own questions raise errors for such paths, or answer "no", by version of Python.
"""

import errno
import os
import stat
from contextlib import suppress
from enum import Enum
from pathlib import Path
from typing import Final


class Kind(Enum):
    """What lies under a path; the value is its name in a sentence."""

    MISSING = "missing"
    FILE = "a file"
    FOLDER = "a folder"
    DEVICE = "a device"
    PIPE = "a pipe"
    SOCKET = "a socket"


_KINDS: Final = {
    stat.S_IFREG: Kind.FILE,
    stat.S_IFDIR: Kind.FOLDER,
    stat.S_IFCHR: Kind.DEVICE,
    stat.S_IFBLK: Kind.DEVICE,
    stat.S_IFIFO: Kind.PIPE,
    stat.S_IFSOCK: Kind.SOCKET,
}


def kind_of(path: str | Path) -> Kind:
    """Return what lies under a path. Links are followed; one that leads nowhere is missing.

    Args:
        path: any text; "" is the current folder.

    Raises:
        OSError: that cannot be told: the path is too long, leads in a circle, or through a folder that may not be searched.
    """
    try:
        return _KINDS.get(stat.S_IFMT(Path(path).stat().st_mode), Kind.DEVICE)
    except (FileNotFoundError, NotADirectoryError):
        return Kind.MISSING
    except ValueError:  # a NUL character, or letters that no file name can have
        raise OSError(errno.EINVAL, "it is no file name", str(path)) from None


def nearest(path: Path) -> tuple[Path, Kind]:
    """Return a path, or the nearest of its parents that exists, and what that is.

    Raises:
        OSError: see `kind_of`; or nothing of such a long name can be made there.
    """
    there, kind = path, kind_of(path)
    longest = 0
    while kind is Kind.MISSING and there != there.parent:
        longest = max(longest, len(os.fsencode(there.name)))
        there = there.parent
        kind = kind_of(there)
    if longest > os.pathconf(there, "PC_NAME_MAX"):
        raise OSError(errno.ENAMETOOLONG, os.strerror(errno.ENAMETOOLONG), str(path))
    return there, kind


def resolved(path: Path) -> Path:
    """Return the absolute path without links, as far as it can be followed; links that lead in a circle stay."""
    with suppress(RecursionError, OSError):  # thousands of links, one leading to the next; the current folder is gone
        return Path(os.path.realpath(path))
    return path


def make_folder(path: Path) -> None:
    """Create a folder and its missing parents, however many; do nothing if it exists.

    Raises:
        OSError: as the operating system reports it.
    """
    missing = []
    there = path
    # pathlib makes parents by recursion, which ends at a thousand.
    while kind_of(there) is Kind.MISSING:
        missing.append(there)
        if there == there.parent:
            break
        there = there.parent
    for folder in reversed(missing):
        with suppress(FileExistsError):
            folder.mkdir()
    if kind_of(path) is not Kind.FOLDER:
        raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(path))
