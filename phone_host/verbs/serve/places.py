"""Where the page puts what nobody gave a place."""

import os
from pathlib import Path


def data_folder() -> Path:
    """Return where results lie that nobody gave a place (XDG base directory specification)."""
    home = os.environ.get("XDG_DATA_HOME", "")
    base = Path(home) if home.startswith("/") else Path(os.environ.get("HOME", "/")) / ".local" / "share"
    return base / "tandemscan"


def snapshot_folder(out: Path | None) -> Path:
    """Return the folder of the snapshots. No run empties it.

    Args:
        out: folder for the results of runs; None: none.
    """
    return (out or data_folder()) / "snapshots"


def recording_folder(out: Path | None) -> Path:
    """Return the folder of the recordings that are begun on the page.

    Args:
        out: folder for the results of runs; None: none.
    """
    return (out or data_folder()) / "recordings"


def scan_folder(out: Path | None) -> Path:
    """Return the folder of the scans that are made on the page, each in a folder of its own.

    Args:
        out: folder for the results of runs; None: none.
    """
    return (out or data_folder()) / "scans"
