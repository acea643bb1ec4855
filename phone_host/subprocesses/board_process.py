"""A board-agent process on this machine, for the demo and the delay benchmark."""

import json
import os
import socket
import stat
import subprocess
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from common.errors import UnavailableError
from common.link.zeromq_address import owner_of
from common.program.commandline import INTERRUPTED
from phone_host.subprocesses.child_process import GOODBYE_S, child_process


def runtime_folder(environment: Mapping[str, str]) -> Path:
    """A folder for sockets that belongs to this user alone: $XDG_RUNTIME_DIR, else one in the folder of temporary files.

    Args:
        environment: environment of the process.

    Raises:
        UnavailableError: there is none, and somebody else's folder lies where it would be made.
    """
    given = Path(environment.get("XDG_RUNTIME_DIR", ""))
    with suppress(OSError):
        if given.is_absolute() and _is_own(given.stat()):
            return given
    named = Path(environment.get("TMPDIR", ""))
    temporary = named if named.is_absolute() and named.is_dir() else Path(tempfile.gettempdir())
    folder = temporary / f"tandemscan-{os.geteuid()}"
    try:
        with suppress(FileExistsError):
            folder.mkdir(mode=0o700)
        if _is_own(folder.lstat()):
            return folder
    except OSError as error:
        raise UnavailableError(f"{folder} cannot be made ({error.strerror})", "set XDG_RUNTIME_DIR or TMPDIR") from None
    raise UnavailableError(
        f"{folder} is not a folder of this user's alone (it belongs to {owner_of(str(folder))})",
        "remove it, or set XDG_RUNTIME_DIR to a folder of your own with mode 0700",
    )


def _is_own(status: os.stat_result) -> bool:
    return stat.S_ISDIR(status.st_mode) and status.st_uid == os.geteuid() and not status.st_mode & 0o077


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
