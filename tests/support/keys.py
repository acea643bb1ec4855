"""Two machines that know each other's keys, as after pairing."""

from pathlib import Path

from common.keys import KeyFolder
from common.peers import Peer


def acquainted(folder: Path, address: str) -> tuple[KeyFolder, KeyFolder]:
    """Make keys of a listener and a dialler that trust each other.

    Args:
        folder: where both folders are made.
        address: where the dialler finds the listener.

    Returns:
        The listener's folder and the dialler's.
    """
    listener, dialler = KeyFolder(folder / "listener-keys"), KeyFolder(folder / "dialler-keys")
    dialler.add(Peer(name="listener", key=listener.own().public, added="2026-01-01T00:00:00+0000", address=address))
    listener.add(Peer(name="dialler", key=dialler.own().public, added="2026-01-01T00:00:00+0000"))
    return listener, dialler
