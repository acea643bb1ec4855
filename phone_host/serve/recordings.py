"""Recordings that are begun and ended on the page, beside whatever run goes on."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from common.errors import SettingsError, UnavailableError
from common.places import make_folder
from common.recording.opened import SUFFIX
from phone_host.run.host import Host
from phone_host.web.source import Answer


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
        try:
            make_folder(folder)
        except OSError as error:
            cause = error.strerror or str(error)
            raise UnavailableError(f"{folder} cannot be made ({cause})", "make room, or choose another out") from None
        with self._changing:
            path = _free(folder)
            host.recording.begin(path)
        return Answer(words=f"recording to {path}")

    def end(self) -> Answer:
        """End the recording that goes on."""
        host = self._host
        account = None if host is None or host.recording is None else host.recording.end(host.cameras_text())
        return Answer(words="nothing is recorded" if account is None else account.words)


def _free(folder: Path) -> Path:
    """Return a name that is free: date and time of this place, with a number behind it if need be."""
    stem = time.strftime("%Y-%m-%d-%H%M%S")
    path, number = folder / f"{stem}{SUFFIX}", 2
    while path.exists():
        path, number = folder / f"{stem}-{number}{SUFFIX}", number + 1
    return path
