"""Finds the saved pairs of a run, and opens their files and those of a scan: only names that are written, and never through a link."""

import os
import re
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Final

from phone_host.output.pair_files import RUN_FILES

_PAIR: Final = re.compile(r"pair-([0-9]{6,9})\Z")
_MOST_PAIRS: Final = 10_000
_FOLDER: Final = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
_FILE: Final = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC

SAVED_FILES: Final = frozenset(file.value for file in RUN_FILES)
"""Names of the files of a saved pair."""

SCAN_FILES: Final = ("model.ply", "trajectory.txt", "report.json", "index.html")
"""Names of a scan's files. They are saved, not shown: the page among them has scripts of its own."""

SAVED_MODEL: Final = r"[0-9A-Za-z][0-9A-Za-z_.-]{0,99}\.(stl|obj|3ds|ply|3mf|glb)"
"""Names of what was saved of a scan for other programs."""


@dataclass(frozen=True, slots=True)
class SavedPair:
    """A saved pair.

    Attributes:
        number: of its folder.
        files: names of its files, sorted.
    """

    number: int
    files: tuple[str, ...]


def saved_pairs(folder: str) -> tuple[SavedPair, ...]:
    """List the saved pairs, the newest 10 000 at most, in order.

    Args:
        folder: where they are; empty: nowhere.
    """
    numbers = sorted(_numbers(Path(folder)) if folder else ())[-_MOST_PAIRS:]
    return tuple(SavedPair(number, _files(Path(folder) / _name(number))) for number in numbers)


def open_saved(folder: str, number: int, name: str) -> BinaryIO:
    """Open a file of a saved pair.

    Args:
        folder: where the pairs are; empty: nowhere.
        number: of the pair.
        name: of the file, one of `SAVED_FILES`.

    Raises:
        FileNotFoundError: there is none, or it is no plain file.
    """
    if not folder or name not in SAVED_FILES:
        raise FileNotFoundError(name)
    return open_plain(Path(folder) / _name(number), name)


def is_scan_file(name: str) -> bool:
    """Return whether a name is one that a scan's folder may hold for whoever asks."""
    return name in SCAN_FILES or re.fullmatch(SAVED_MODEL, name) is not None


def open_plain(folder: Path, name: str) -> BinaryIO:
    """Open a file, never through a link.

    Args:
        folder: where it is.
        name: of the file, without separators.

    Raises:
        FileNotFoundError: there is none, or it is no plain file.
    """
    try:
        opened = os.open(folder, _FOLDER)
        try:
            descriptor = os.open(name, _FILE, dir_fd=opened)
        finally:
            os.close(opened)
    except OSError as error:
        raise FileNotFoundError(name) from error
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise FileNotFoundError(name)
    return os.fdopen(descriptor, "rb")


def _name(number: int) -> str:
    return f"pair-{number:06d}"


def _numbers(folder: Path) -> list[int]:
    try:
        with os.scandir(folder) as entries:
            found = [
                match for entry in entries if (match := _PAIR.match(entry.name)) and entry.is_dir(follow_symlinks=False)
            ]
    except OSError:
        return []
    return [int(match[1]) for match in found if _name(int(match[1])) == match[0]]


def _files(folder: Path) -> tuple[str, ...]:
    try:
        with os.scandir(folder) as entries:
            plain = {entry.name for entry in entries if entry.is_file(follow_symlinks=False)}
    except OSError:
        return ()
    return tuple(sorted(SAVED_FILES & plain))
