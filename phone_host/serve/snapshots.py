"""Snapshots: pairs that the user wants to keep, in a folder that no run empties."""

import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Final

from common.errors import UnavailableError
from phone_host.model import Result
from phone_host.output.axes import Axes
from phone_host.output.listed import ListedFolder
from phone_host.output.pair_files import RUN_FILES, write_pair

FOLDER: Final = "snapshots"
_WRITERS: Final = 2


class Snapshots:
    """Saves pairs as a run does, each as pair-NNNNNN with the next number that is free.

    Args:
        folder: created with the first of them.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._lock = threading.Lock()

    def save(self, result: Result, axes: Axes = Axes.CAMERA) -> Path:
        """Save a pair, whole or not at all; return its folder.

        Args:
            result: the pair.
            axes: of the points in its cloud.

        Raises:
            UnavailableError: it cannot be written.
        """
        with self._lock:
            try:
                listed = ListedFolder(self.folder, "(?!)")
                try:
                    name = f"pair-{_next(self.folder):06d}"
                    with (
                        ThreadPoolExecutor(_WRITERS) as writers,
                        listed.new_folder(name, writers.map) as folder,
                    ):
                        write_pair(folder, result.processed, RUN_FILES, axes, writers.map)
                finally:
                    listed.close()
            except OSError as error:
                cause = error.strerror or str(error)
                raise UnavailableError(
                    f"{self.folder} cannot be written to ({cause})", "make room, or name another --out"
                ) from None
        return self.folder / name


def _next(folder: Path) -> int:
    taken = [path.name.removeprefix("pair-") for path in folder.glob("pair-*")]
    return 1 + max((int(number) for number in taken if number.isdecimal()), default=-1)
