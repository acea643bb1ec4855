"""The results folder of `stereo`: one pair's files in it, or a folder for each of several pairs.

What an earlier run left there stays until all of what replaces it is whole (decision 0088). Where there is nothing to replace, the folders of
several pairs appear one by one.
"""

import errno
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from common.places import nearest
from phone_host.output.listed import ListedFolder, RunAll
from phone_host.output.pair_files import STEREO_NAMES

NAMES: Final = rf"{STEREO_NAMES}|pair-[0-9]{{6,}}"
"""The names that `stereo` writes into its folder: of the only pair, or a folder for each of several."""


class StereoResults:
    """A results folder.

    Args:
        path: created with the first pair.
        is_one: whether they are of one pair, which goes into the folder itself.
    """

    def __init__(self, path: Path, *, is_one: bool) -> None:
        self._path, self._is_one = path, is_one
        self._own: ListedFolder | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._own is not None:
            self._own.close()

    def open(self) -> None:
        """Open the folder, unless that was done.

        Raises:
            UnavailableError: something there was not written by this program.
            OSError: as the operating system reports it.
        """
        if self._own is None:
            self._own = ListedFolder(self._path, NAMES, command="stereo")
            self._own.open()
            if self._is_one or self._own.earlier:
                self._own.stage()

    def publish(self) -> None:
        """Let the results, which are whole, take the place of an earlier run's.

        Raises:
            OSError: as the operating system reports it.
        """
        assert self._own is not None
        self._own.publish()

    def publish_partial(self) -> Path | None:
        """Let results that are not whole take their places where they replace nothing; else leave them in a folder beside the earlier ones.

        Returns:
            That folder; None: they replaced nothing.

        Raises:
            OSError: as the operating system reports it.
        """
        assert self._own is not None
        if self._own.earlier:
            return self._own.keep_staged()
        self._own.publish()
        return None

    @contextmanager
    def folder_of(self, name: str, files: Sequence[str], run_all: RunAll) -> Iterator[Path]:
        """Give a pair a place for its files. The folder is open.

        Args:
            name: of its own folder, which appears when the block ends; empty: its files go into the results folder, where
                they appear when they are published. If the block fails, nothing of them stays.
            files: names of its files.
            run_all: see `ListedFolder.new_folder`.

        Yields:
            Where to write them.

        Raises:
            OSError: as the operating system reports it.
        """
        assert self._own is not None
        if name:
            with self._own.new_folder(name, run_all) as folder:
                yield folder
            self._own.spare_staged()
        else:
            self._own.add(*files)
            yield self._own.place

    def write_text(self, name: str, text: str) -> None:
        """Write a file of all pairs together.

        Raises:
            OSError: as the operating system reports it.
        """
        assert self._own is not None
        self._own.add(name)
        self._own.write_text(name, text)


def require_writable(path: Path) -> None:
    """Check before the work that a folder can be made or written to.

    Args:
        path: the folder; it need not exist.

    Raises:
        OSError: it cannot.
    """
    there, _ = nearest(path)
    if not os.access(there, os.W_OK | os.X_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(there))
