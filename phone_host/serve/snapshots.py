"""Snapshots: pairs that the user wants to keep, in a folder that no run empties."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Final

from common.errors import DataError, UnavailableError
from phone_host.model import Result
from phone_host.output.axes import Axes
from phone_host.output.listed import ListedFolder
from phone_host.output.pair_files import RUN_FILES, write_pair
from phone_host.serve.shelf import Shelf
from phone_host.web.source import Answer

_WRITERS: Final = 2


def keep_newest(shelf: Shelf, folder: Path, axes: Axes) -> Answer:
    """Save the newest pair as a run does, as pair-NNNNNN with the next number that is free.

    Args:
        shelf: has it.
        folder: for snapshots; created if missing.
        axes: of the points in its cloud.

    Raises:
        DataError: there is no pair.
        UnavailableError: it cannot be written.
    """
    newest = shelf.newest()
    if newest is None:
        raise DataError("there is no pair yet", "run first")
    try:
        saved = _save(newest.newest.result, folder, axes)
    except OSError as error:
        cause = error.strerror or str(error)
        raise UnavailableError(
            f"{folder} cannot be written to ({cause})", "make room, or choose another folder for results"
        ) from None
    return Answer(words=f"saved as {saved}")


def _save(result: Result, folder: Path, axes: Axes) -> Path:
    """Save a pair, whole or not at all; return its folder."""
    with ListedFolder(folder, "(?!)") as listed, ThreadPoolExecutor(_WRITERS) as writers:
        name = f"pair-{_next(folder):06d}"
        with listed.new_folder(name, writers.map) as inner:
            write_pair(inner, result.processed, RUN_FILES, axes, writers.map)
    return folder / name


def _next(folder: Path) -> int:
    taken = [path.name.removeprefix("pair-") for path in folder.glob("pair-*")]
    return 1 + max((int(number) for number in taken if number.isdecimal()), default=-1)
