"""Where the page puts what nobody gave a place."""

import time
from pathlib import Path

from common.errors import UnavailableError
from common.places import make_folder
from phone_host.output.data_folder import data_folder


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
