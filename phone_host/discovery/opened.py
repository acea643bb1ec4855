"""Opens the links to a board: those that were named, or the one of the board that is found."""

from collections.abc import Sequence

from common.keys import KeyFolder
from common.link.base import Link
from common.link.factory import open_links, parse_link, tell_insecure
from phone_host.discovery.discovery import find_board_and_say


def open_named(named: Sequence[str], keys: KeyFolder, wait_s: float | None) -> tuple[tuple[str, ...], list[Link]]:
    """Open links; look for a board if none is named. What is not protected is told.

    Args:
        named: addresses, the preferred one first; empty: look for a board.
        keys: knows the boards that this machine may talk to.
        wait_s: how long to look for a board, s; None: for ever.

    Raises:
        SettingsError: an address is none.
        UnavailableError: no board is found, or a link cannot be had.
    """
    links = tuple(named) or (find_board_and_say(keys.path, wait_s),)
    uris = [parse_link(uri, listens_by_default=False) for uri in links]
    for uri in uris:
        tell_insecure(uri)
    return links, open_links(uris, keys)
