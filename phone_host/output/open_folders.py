"""What is done in a folder that is open, by its descriptor, so that nobody can put another one under its path meanwhile."""

import os
import shutil
from pathlib import Path
from typing import Final

FOLDER: Final = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
"""How a folder in another one is opened."""


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

    Args:
        name: its name there.
        folder: descriptor of the folder.

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

    Args:
        folder: its descriptor.

    Raises:
        OSError: as the operating system reports it.
    """
    with os.scandir(folder) as entries:
        return sorted(entry.name for entry in entries)


def remove_tree(name: str, folder: int) -> None:
    """Remove a folder with all that is in it; do nothing if it is not there. No link is followed.

    Args:
        name: its name in another one.
        folder: descriptor of that one.

    Raises:
        OSError: as the operating system reports it.
    """
    if name in entries_of(folder):
        shutil.rmtree(name, dir_fd=folder)
