"""Where results and notes lie that nobody gave a place."""

import os
from pathlib import Path


def data_folder() -> Path:
    """Return where results lie that nobody gave a place (XDG base directory specification)."""
    home = os.environ.get("XDG_DATA_HOME", "")
    base = Path(home) if home.startswith("/") else Path(os.environ.get("HOME", "/")) / ".local" / "share"
    return base / "tandemscan"
