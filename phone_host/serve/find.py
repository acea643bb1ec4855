"""Looks for boards and for this machine's cameras."""

from common.camera.v4l2_device import Device, capture_nodes
from common.errors import TandemError
from common.keys import KeyFolder
from common.link.factory import needs_keys, parse_link
from common.peers import Peer, peer_at
from phone_host.camera.uris import SCHEME
from phone_host.discovery.discovery import list_boards
from phone_host.discovery.found import Found
from phone_host.web.source import Choice


def find_boards(keys: KeyFolder) -> tuple[Choice, ...]:
    """Look for boards, for some seconds.

    Args:
        keys: knows those that this machine may talk to.
    """
    peers = keys.peers()
    return tuple(board_choice(found, peers) for found in list_boards(keys.path))


def board_choice(found: Found, peers: tuple[Peer, ...]) -> Choice:
    """Return a board as a choice.

    Args:
        found: the board.
        peers: the boards that this machine knows.
    """
    peer = peer_at(peers, found.link)
    name = found.name or (found.link if peer is None else peer.name)
    return Choice(uri=found.link, name=name, note="needs the code that it shows" if stranger(found.link, peers) else "")


def stranger(links: str, peers: tuple[Peer, ...]) -> str:
    """Return the first board that has to be enrolled before this machine may talk to it; empty: there is none.

    Args:
        links: addresses, with spaces between.
        peers: the boards that this machine knows.

    Raises:
        SettingsError: an address is none.
    """
    for link in links.split():
        if needs_keys(parse_link(link, listens_by_default=False)) and peer_at(peers, link) is None:
            return link
    return ""


def browser_choice(words: str) -> Choice:
    """Return the camera of whichever browser gives it as a choice.

    Args:
        words: what is known of it; empty: none gives it yet.
    """
    name = words[:1].upper() + words[1:]
    note = "" if words else "start it on this page, here or on the phone"
    return Choice(uri=SCHEME, name=name or "A browser's camera", note=note)


def find_cameras() -> tuple[Choice, ...]:
    """Return this machine's cameras."""
    found = []
    for path in capture_nodes():
        try:
            with Device(path) as device:
                found.append(Choice(uri=f"v4l2:{path}", name=device.identity.card))
        except (TandemError, OSError) as error:
            found.append(Choice(uri=f"v4l2:{path}", name=path.name, note=f"cannot be opened ({error})"))
    return tuple(found)
