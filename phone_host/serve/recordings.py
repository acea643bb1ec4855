"""Recordings that are begun and ended on the page, beside whatever run goes on."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from common.errors import SettingsError
from common.recording.opened import SUFFIX
from phone_host.run.host import Host
from phone_host.serve.places import new_place
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
        with self._changing:
            path = new_place(folder, SUFFIX)
            host.recording.begin(path)
        return Answer(words=f"recording to {path}")

    def end(self) -> Answer:
        """End the recording that goes on."""
        host = self._host
        account = None if host is None or host.recording is None else host.recording.end(host.cameras_text())
        return Answer(words="nothing is recorded" if account is None else account.words)
