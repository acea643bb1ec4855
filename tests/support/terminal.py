"""A program in a real terminal of a given width: a pseudo terminal and what the program wrote to it."""

import fcntl
import os
import pty
import select
import struct
import subprocess
import termios
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from tests.support.programs import PATIENCE_S

_ROWS: Final = 40


class TerminalProgram:
    """One program whose stdin, stdout and stderr are a terminal.

    Args:
        command: program and arguments.
        columns: width of the terminal, characters.
        folder: the current folder.
        more: environment variables in addition to those of this process.
    """

    def __init__(
        self, command: Sequence[str], columns: int, folder: Path, more: Mapping[str, str] | None = None
    ) -> None:
        self._master, slave = pty.openpty()
        fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", _ROWS, columns, 0, 0))
        unwanted = {"COLUMNS", "LINES"}
        environment = {name: value for name, value in os.environ.items() if name not in unwanted}
        environment |= {"TERM": "xterm-256color", "XDG_CONFIG_HOME": str(folder / "config"), **(more or {})}
        self.process = subprocess.Popen(
            command,
            stdin=slave,
            stdout=slave,
            stderr=slave,
            env=environment,
            cwd=folder,
            start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),  # noqa: PLW1509 - a terminal that can hang up
        )
        os.close(slave)
        self.seen = b""

    def read(self, wait_s: float = 0.05) -> bool:
        """Take what the program has written; return whether it may write more."""
        if not select.select([self._master], [], [], wait_s)[0]:
            return True
        try:
            data = os.read(self._master, 65536)
        except OSError:  # EIO: everybody has closed the other end
            return False
        self.seen += data
        return bool(data)

    def read_until(self, words: bytes) -> None:
        """Read until the program has written this."""
        deadline = time.monotonic() + PATIENCE_S
        while words not in self.seen:
            assert time.monotonic() < deadline, f"not within {PATIENCE_S:.0f} s: {words!r}"
            assert self.read(), self.seen

    def read_all(self) -> int:
        """Read until the program has ended; returns its exit code."""
        deadline = time.monotonic() + PATIENCE_S
        while self.read():
            assert time.monotonic() < deadline, "the program does not end"
        return self.process.wait(PATIENCE_S)

    def hang_up(self) -> int:
        """Close the terminal, as a window that is closed or an ssh that is lost does; return the program's exit code."""
        os.close(self._master)
        self._master = -1
        return self.process.wait(PATIENCE_S)

    def close(self) -> None:
        """End it if it still runs."""
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        if self._master >= 0:
            os.close(self._master)


@contextmanager
def in_terminal(
    command: Sequence[str], columns: int, folder: Path, more: Mapping[str, str] | None = None
) -> Iterator[TerminalProgram]:
    """Run a program in a terminal while the block lasts."""
    running = TerminalProgram(command, columns, folder, more)
    try:
        yield running
    finally:
        running.close()
