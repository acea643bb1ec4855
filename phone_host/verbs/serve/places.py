"""Where the page puts what nobody gave a place."""

from pathlib import Path

from phone_host.output.data_folder import data_folder


def page_folder(out: str | Path | None, kind: str) -> Path:
    """Return the folder of what is made on the page; no run empties it.

    Args:
        out: folder for the results of runs; None or empty: none.
        kind: snapshots, recordings, or scans, which lie in a folder of their own each.
    """
    return (Path(out) if out else data_folder()) / kind
