"""Keeps the page's secrets in a folder: files for their owner only (0600 in a folder of 0700), which appear whole."""

import datetime as dt
import secrets
import stat
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from common.errors import DataError, UnavailableError
from common.files import opened_folder, read_file, replacing_in
from phone_host.web.settings import Credentials

MOST_BYTES: Final = 1 << 16
_TOKEN: Final = "page-token"  # noqa: S105 - the name of a file
_TOKEN_BYTES: Final = 24


def new_token() -> str:
    """Return a secret for a URL."""
    return secrets.token_urlsafe(_TOKEN_BYTES)


def kept_token(folder: Path) -> str:
    """Return the token of the first URL; made if there is none. It lasts, so that phones and bookmarks need it once.

    Args:
        folder: where it is kept; created with mode 0700.

    Raises:
        DataError: the file is not what we wrote, or others may read it.
        UnavailableError: the folder cannot be used.
    """
    try:
        with opened_folder(folder, make=True) as opened:
            found = read_secret(opened, folder / _TOKEN)
            token = new_token() if found is None else found.decode("ascii", "replace").strip()
            if found is None:
                write_secret(opened, _TOKEN, f"{token}\n".encode())
    except OSError as error:
        raise unusable(folder, error) from error
    if len(token) < _TOKEN_BYTES or not token.isascii() or not token.replace("-", "").replace("_", "").isalnum():
        raise DataError(f"{folder / _TOKEN} is not a token", "remove it: the next start makes a new one")
    return token


def kept_credentials(folder: Path, names: Iterable[str], now: dt.datetime) -> Credentials:
    """Return what https needs for these names; made if it is missing or does not fit.

    Args:
        folder: where it is kept; created with mode 0700.
        names: names and addresses of this machine; those of loopback are added.
        now: now, with its time zone.

    Raises:
        DataError: a file is not what we wrote, or others may read a key.
        UnavailableError: the folder cannot be used, or a package is missing.
    """
    try:
        from phone_host.web.credentials import kept  # noqa: PLC0415 - only https needs cryptography
    except ModuleNotFoundError as error:
        raise UnavailableError(
            f"https needs the package {error.name}", f"install it: pip install {error.name}"
        ) from error
    return kept(folder, names, now)


def read_secret(opened: int, path: Path) -> bytes | None:
    """Read a file that its owner alone may read.

    Returns:
        Its content; None: there is none.

    Raises:
        DataError: others may read it, or it is no plain file.
        OSError: as the operating system raises it.
    """
    try:
        content, status = read_file(opened, path, MOST_BYTES)
    except FileNotFoundError:
        return None
    if status.st_mode & 0o077:
        mode = f"mode {stat.S_IMODE(status.st_mode):04o}"
        raise DataError(f"{path} can be read by other users ({mode})", f"chmod 600 {path}")
    return content


def write_secret(opened: int, name: str, content: bytes) -> None:
    """Write a file that its owner alone may read.

    Raises:
        OSError: as the operating system raises it.
    """
    with replacing_in(opened, name, mode=0o600) as file:
        file.write(content)


def unusable(folder: Path, error: OSError) -> UnavailableError:
    """Say that a folder cannot be used."""
    return UnavailableError(
        f"{folder} cannot be used ({error.strerror})", "make it readable and writable for you alone"
    )
