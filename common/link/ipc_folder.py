"""The default folder for sockets. Separate from `ipc` because `tempfile` is slow to load and no board needs it."""

import os
import stat
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from common.errors import UnavailableError
from common.link.ipc import owner_of


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
