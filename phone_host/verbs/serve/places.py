"""Where the page puts what nobody gave a place."""

from pathlib import Path

from phone_host.output.data_folder import data_folder


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
