"""A board-agent process on this machine, for the demo and the delay benchmark."""

import json
import os
import socket
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from common.errors import UnavailableError
from common.link.ipc_folder import runtime_folder
from common.program.commandline import INTERRUPTED
from phone_host.subprocesses.child_process import GOODBYE_S, child_process


@dataclass(frozen=True, slots=True)
class BoardAccount:
    """The board process's final count of its frames: grabbed = sent + all dropped.

    Attributes:
        grabbed: all frames.
        sent: frames given to the link.
        dropped: frames not sent, by reason.
    """

    grabbed: int
    sent: int
    dropped: tuple[tuple[str, int], ...]


class BoardProcess:
    """A running board-agent process."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        self._process = process

    def check(self) -> None:
        """If the process has ended, raise UnavailableError with the last line of its stderr."""
        if self._process.poll() is not None:
            words = self._process.communicate()[1].decode(errors="replace").strip().splitlines()
            raise UnavailableError(
                f"board-agent ended with exit code {self._process.returncode}",
                words[-1] if words else "run it by hand to see why",
            )

    def stop(self) -> BoardAccount:
        """Ask the process to end. Return its account."""
        # Ctrl-C and a closed terminal reach every process of it: then the board has ended by itself and has written its account.
        if self._process.poll() not in {0, INTERRUPTED}:
            self.check()
        self._process.terminate()
        try:
            said = json.loads(self._process.communicate(timeout=GOODBYE_S)[0])
        except (subprocess.TimeoutExpired, ValueError):
            raise UnavailableError(
                "board-agent did not end with its account", "run it by hand with --json to see why"
            ) from None
        return BoardAccount(said["grabbed"], said["sent"], tuple(sorted(said["dropped"].items())))


@contextmanager
def board_process(camera: str, address: str) -> Iterator[BoardProcess]:
    """Run a board-agent process for the length of a block. It always ends with the block."""
    arguments = ["run", "--camera", camera, "--link", address, "--log-level", "warning", "--json"]
    with child_process("board_agent.start", arguments, errors=True) as process:
        yield BoardProcess(process)


@contextmanager
def socket_folder() -> Iterator[Path]:
    """Create a private folder for sockets, for the length of a block.

    Raises:
        UnavailableError: the folder cannot be created.
    """
    parent = runtime_folder(os.environ)
    try:
        folder = tempfile.TemporaryDirectory(prefix="tandemscan-", dir=parent)
    except OSError as error:
        raise UnavailableError(
            f"{parent} cannot be used ({error.strerror})", "make room on the disk, or set TMPDIR to another folder"
        ) from None
    with folder as name:
        yield Path(name)


def free_port() -> int:
    """Return a TCP port of the loopback interface that is free now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
