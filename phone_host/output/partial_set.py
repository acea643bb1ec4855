"""Results that are not whole, beside earlier ones that they must not replace: in a visible folder of their own, one for each verb."""

import os
import re
import stat
from contextlib import suppress
from typing import Final

from common.files import sync_folder
from phone_host.output.move_up import STAGED
from phone_host.output.open_folders import FOLDER, entries_of, plain_name, remove_result

REPLACED: Final = ".tandemscan.old"
"""Name of an earlier partial set while a later one takes its place."""


def leave_partial(folder: int, name: str, names: re.Pattern[str]) -> bool:
    """Give the staged results the name of a partial set, in place of one that was left before; return whether that was possible.

    Args:
        folder: descriptor of the folder of results.
        name: of the partial set; a file or link of this name stays, and nothing is done.
        names: pattern of the results' names.

    Raises:
        OSError: as the operating system reports it.
    """
    if name in entries_of(folder) and not _is_folder(name, folder):
        return False
    remove_set(REPLACED, folder, names)
    with suppress(FileNotFoundError):
        os.rename(name, REPLACED, src_dir_fd=folder, dst_dir_fd=folder)
    os.rename(STAGED, name, src_dir_fd=folder, dst_dir_fd=folder)
    sync_folder(folder)
    remove_set(REPLACED, folder, names)
    return True


def remove_set(name: str, folder: int, names: re.Pattern[str]) -> None:
    """Remove a folder with a set of results, if it is there; what others have put into it stays, in `NAME.foreign`.

    Raises:
        OSError: as the operating system reports it.
    """
    if name not in entries_of(folder) or not _is_folder(name, folder):
        return
    inside = os.open(name, FOLDER, dir_fd=folder)
    try:
        for entry in entries_of(inside):
            if names.fullmatch(plain_name(entry)):
                remove_result(entry, inside)
    finally:
        os.close(inside)
    remove_result(name, folder)


def _is_folder(name: str, folder: int) -> bool:
    return stat.S_ISDIR(os.lstat(name, dir_fd=folder).st_mode)
