"""Moves whole results up from a hidden folder, so that a process that is killed between any two steps leaves something that any command finishes.

Rules: the hidden folder holds the whole set and a plan, which says what becomes of the earlier results. Both are on the disk before the folder gets
the name that makes them count (`begin_move`). From then on nothing else is needed: `finish_move` may be ended at any step, and be called again
by a program of another verb. It reads only names in this folder from the plan. Its steps take no room on the disk.
"""

import os
import re
import stat
from collections.abc import Collection, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Final

from common.errors import DataError
from common.files import read_file, replacing_in, sync_folder
from phone_host.output.json_text import json_text, json_value
from phone_host.output.open_folders import FOLDER, entries_of, plain_name, remove_result, sync_file

STAGED: Final = ".tandemscan.new"
"""Name of the folder for results that are not whole yet."""

WHOLE: Final = ".tandemscan.whole"
"""Name of the folder for results that are whole, and not all moved up yet."""

REPLACED: Final = ".tandemscan.old"
"""Name of an earlier partial set while a later one takes its place."""

_PLAN: Final = ".plan.json"
_REMOVE, _RENAME = "remove", "rename"
_MAX_PLAN_BYTES: Final = 256 << 20
"""Enough for five million pairs."""

_LAST: Final = "report.json"
"""What is moved up last: it tells what the other results are."""


def begin_move(folder: int, staged: int, remove: Collection[str], rename: Mapping[str, str]) -> None:
    """Put the staged results on the disk and make them count: `finish_move` goes on from here, now or after a kill.

    Args:
        folder: descriptor of the folder of results.
        staged: descriptor of the hidden folder in it.
        remove: names of earlier results, which go unless a new one has the same name.
        rename: names of another command's results, each with the name under which it stays.

    Raises:
        OSError: as the operating system reports it; the earlier results are there as before.
    """
    new = entries_of(staged)
    for name in new:
        sync_file(name, staged)
    with replacing_in(staged, _PLAN) as file:
        file.write(json_text({_REMOVE: sorted(set(remove).difference(new)), _RENAME: dict(rename)}).encode())
    os.rename(STAGED, WHOLE, src_dir_fd=folder, dst_dir_fd=folder)
    sync_folder(folder)


def finish_move(folder: int, listed: Collection[str]) -> None:
    """Move whole results up, over the earlier ones; then remove those that nothing replaces.

    Args:
        folder: descriptor of the folder of results.
        listed: names that are ours; the plan removes and renames no other.

    Raises:
        OSError: as the operating system reports it; the next call goes on.
    """
    whole = os.open(WHOLE, FOLDER, dir_fd=folder)
    try:
        remove, rename = _plan(whole, listed)
        new = [name for name in entries_of(whole) if name != _PLAN]
        for name, other in rename.items():
            if name in new or name in remove:  # else what lies under the name is new already
                keep_under(name, other, folder)
        for name in sorted(new, key=lambda name: (name == _LAST, name)):
            _make_place(name, whole, folder)
            os.replace(name, name, src_dir_fd=whole, dst_dir_fd=folder)
        for name in remove:
            remove_result(name, folder)
        sync_folder(folder)
        with suppress(FileNotFoundError):
            os.unlink(_PLAN, dir_fd=whole)
    finally:
        os.close(whole)
    os.rmdir(WHOLE, dir_fd=folder)
    sync_folder(folder)


def keep_under(name: str, other: str, folder: int) -> None:
    """Give a file another name; the first one stays, too, until something replaces it. Do nothing if there is no such file.

    Where the file system has no hard links, the file is renamed.

    Args:
        name: its name.
        other: the other name, under which an earlier file is replaced.
        folder: descriptor of the folder.

    Raises:
        OSError: as the operating system reports it.
    """
    with suppress(FileNotFoundError):
        status = os.lstat(name, dir_fd=folder)
        if not stat.S_ISREG(status.st_mode):
            return
        with suppress(FileNotFoundError):
            if os.path.samestat(status, os.lstat(other, dir_fd=folder)):
                return
        temporary = f".{other}.{os.urandom(8).hex()}.part"
        try:
            os.link(name, temporary, src_dir_fd=folder, dst_dir_fd=folder, follow_symlinks=False)
        except FileNotFoundError:
            raise
        except OSError:
            os.replace(name, other, src_dir_fd=folder, dst_dir_fd=folder)
        else:
            os.replace(temporary, other, src_dir_fd=folder, dst_dir_fd=folder)


def _plan(whole: int, listed: Collection[str]) -> tuple[list[str], dict[str, str]]:
    """Read what becomes of the earlier results; a plan that is gone was carried out."""
    try:
        plan = json_value(read_file(whole, Path(_PLAN), _MAX_PLAN_BYTES)[0])
    except (FileNotFoundError, DataError, ValueError):
        return [], {}
    if not isinstance(plan, dict):
        return [], {}
    remove, rename = plan.get(_REMOVE), plan.get(_RENAME)
    ours = {name for name in listed if "/" not in name and "\0" not in name and name not in {"", ".", ".."}}
    removed = [name for name in remove if isinstance(name, str) and name in ours] if isinstance(remove, list) else []
    pairs = rename.items() if isinstance(rename, dict) else ()
    return removed, {name: other for name, other in pairs if isinstance(other, str) and {name, other} <= ours}


def _make_place(name: str, whole: int, folder: int) -> None:
    """Remove what a renaming would not replace: a folder, or a file where a folder comes."""
    with suppress(FileNotFoundError):
        is_folder = stat.S_ISDIR(os.lstat(name, dir_fd=folder).st_mode)
        if is_folder or stat.S_ISDIR(os.lstat(name, dir_fd=whole).st_mode):
            remove_result(name, folder)


def leave_partial(folder: int, name: str, names: re.Pattern[str]) -> bool:
    """Give staged results that are not whole the name of a partial set, visible and one for each verb, in place of one that was left before; return whether that was possible.

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
