"""What is saved from the page, in folders that no run empties: recordings beside whatever run goes on, and pairs that the user wants to keep."""

import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from common.errors import DataError, SettingsError, UnavailableError
from common.places import make_folder
from common.recording.opened import SUFFIX
from phone_host.model import Result
from phone_host.output.axes import Axes
from phone_host.output.data_folder import data_folder
from phone_host.output.listed import ListedFolder
from phone_host.output.pair_files import RUN_FILES, write_pair
from phone_host.run.host import Host
from phone_host.serve.shelf import Shelf
from phone_host.web.source import Answer

_WRITERS: Final = 2


def page_folder(out: str | Path | None, kind: str) -> Path:
    """Return the folder of what is made on the page; no run empties it.

    Args:
        out: folder for the results of runs; None or empty: none.
        kind: snapshots, recordings, or scans, which lie in a folder of their own each.
    """
    return (Path(out) if out else data_folder()) / kind


def new_place(folder: Path, suffix: str = "") -> Path:
    """Return a path in a folder that is free: date and time of this place, with a number behind it if need be.

    Args:
        folder: created if missing.
        suffix: of the name.

    Raises:
        UnavailableError: the folder cannot be made.
    """
    try:
        make_folder(folder)
    except OSError as error:
        cause = error.strerror or str(error)
        raise UnavailableError(f"{folder} cannot be made ({cause})", "make room, or choose another out") from None
    stem = time.strftime("%Y-%m-%d-%H%M%S")
    path, number = folder / f"{stem}{suffix}", 2
    while path.exists():
        path, number = folder / f"{stem}-{number}{suffix}", number + 1
    return path


class Recordings:
    """Begins and ends recordings. Any thread may use it."""

    def __init__(self) -> None:
        self._host: Host | None = None
        self._changing = threading.Lock()

    @contextmanager
    def beside(self, host: Host) -> Iterator[None]:
        """While the block runs, its run can be recorded.

        Args:
            host: the run; it ends a recording that goes on at its own end.
        """
        self.watch(host)
        try:
            yield
        finally:
            self._host = None

    def watch(self, host: Host) -> None:
        """From now on this run can be recorded."""
        self._host = host

    def begin(self, folder: Path) -> Answer:
        """Begin a recording, in a file that is named by the time.

        Args:
            folder: of recordings; created if missing.

        Raises:
            SettingsError: no run is active, or it cannot be recorded, or is already.
            UnavailableError: the file cannot be made.
        """
        host = self._host
        if host is None:
            raise SettingsError("no run is active", "start it first")
        if host.recording is None:
            raise SettingsError("this run plays a recording", "record while cameras are live")
        with self._changing:
            path = new_place(folder, SUFFIX)
            host.recording.begin(path)
        return Answer(words=f"recording to {path}")

    def end(self) -> Answer:
        """End the recording that goes on."""
        host = self._host
        account = None if host is None or host.recording is None else host.recording.end(host.cameras_text())
        return Answer(words="nothing is recorded" if account is None else account.words)


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
