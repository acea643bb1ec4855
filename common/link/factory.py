"""Opens the link that a URI names, with or without keys. The registry of transports: each is imported only when needed.

Other packages register links as entry points of the group `tandemscan.links`; the name is the URI's scheme in lower case. The entry point is
a callable that takes one LinkRequest (its `uri` holds the address without options, who listens, and the options), opens the link and
returns a `common.link.base.Link`. It raises a SettingsError for an unusable address or option, and an UnavailableError for a device or port that
cannot be had. Who may connect is its own concern: our keys guard tcp only.
"""

import logging
from collections.abc import Sequence
from typing import Final

from common.errors import MissingDeviceError, SettingsError, TandemError, UnavailableError
from common.keys import KeyFolder
from common.link.base import Link, TakesNewHosts
from common.link.uri import LINKS, LinkRequest, LinkUri, is_this_machine, needs_keys, parse_link
from common.program.extensions import make_registered, named
from common.program.logs import event
from common.program.packages import package_error

__all__ = ["LinkUri", "is_this_machine", "needs_keys", "open_link", "open_links", "parse_link", "tell_insecure"]

_LOG = logging.getLogger(__name__)

_TRANSPORTS: Final = {
    "tcp": "common.link.zeromq_opener:open_zeromq",
    "ipc": "common.link.zeromq_opener:open_zeromq",
    "serial": "common.link.serial:open_serial",
    "rfcomm": "common.link.rfcomm:open_rfcomm",
}


def open_link(uri: LinkUri, keys: KeyFolder | None = None, *, board: bool = False, waits: bool = False) -> Link:
    """Open a link: with keys if tcp leaves this machine, or if the peer at an address is known.

    Args:
        uri: what to open.
        keys: this machine's key and the keys it trusts; None if only open links are possible.
        board: whether this side is the board, which accepts no images over tcp and ipc.
        waits: whether to wait for a missing device.

    Returns:
        The open link. A dialled peer may still be absent.

    Raises:
        SettingsError: the address makes no sense, or needs keys and there is no key folder.
        UnavailableError: the port or path is taken, the device is missing, or the peer is not known.
        DataError: the key files are bad.
    """
    request = LinkRequest(uri=uri, keys=keys, board=board, waits=waits)
    if uri.extension:
        extension: Link = make_registered(LINKS, uri.extension, Link, request)
        return extension
    scheme = uri.address.partition(":")[0]
    try:
        opener = named(_TRANSPORTS[scheme])
    except ImportError as error:
        raise package_error(error, uri.address) or error from None
    link: Link = opener(request)
    return link


def tell_insecure(uri: LinkUri) -> None:
    """Log, at a program's start, that a link is open because its owner asked for it."""
    if uri.insecure:
        _LOG.warning(event("link_insecure", address=uri.address, meaning="no keys: whoever reaches it sees the camera"))


def open_links(uris: Sequence[LinkUri], keys: KeyFolder | None = None, *, board: bool = False) -> list[Link]:
    """Open the links of one side. If one of several lacks its device, it waits for the device as long as another link is there.

    Args:
        uris: what to open.
        keys: as for `open_link`.
        board: as for `open_link`. A board whose tcp links need keys also lets in new hosts that prove a code.

    Returns:
        The open links, in that order.

    Raises:
        SettingsError: an address makes no sense, or a link uses the port on which another link lets in new hosts.
        UnavailableError: a port or path is taken, or every device is missing.
        DataError: the key files are bad.
    """
    if board:
        _check_doors(uris)
    links: list[Link] = []
    missing: list[UnavailableError] = []
    try:
        for uri in uris:
            try:
                links.append(open_link(uri, keys, board=board))
            except MissingDeviceError as error:
                missing.append(error)
                links.append(open_link(uri, keys, board=board, waits=True))
        if len(missing) == len(uris):
            raise missing[0]
        if board and keys is not None:
            _open_door(uris, links, keys)
        for one in missing:
            _LOG.warning(event("link_missing", problem=one.problem, remedy=one.remedy))
    except TandemError:
        for link in links:
            link.close()
        raise
    return links


def _has_door(uri: LinkUri) -> bool:
    return uri.listens and needs_keys(uri)


def _check_doors(uris: Sequence[LinkUri]) -> None:
    """Refuse a tcp link on the port right after a secured link's port: that one is for pairing."""
    places = {
        uri.address: uri.address.removeprefix("tcp://").rpartition(":") for uri in uris if "tcp://" in uri.address
    }
    for secured in (uri.address for uri in uris if _has_door(uri)):
        for other in (uri.address for uri in uris if uri.listens and uri.address in places):
            (host, _, port), (other_host, _, other_port) = places[secured], places[other]
            if int(other_port) == int(port) + 1 and (host == other_host or "*" in {host, other_host}):
                raise SettingsError(
                    f"{other} uses the port on which {secured} takes in new hosts",
                    f"choose another than the one behind it, for example {int(port) + 2}",
                )


def _open_door(uris: Sequence[LinkUri], links: Sequence[Link], keys: KeyFolder) -> None:
    """Have the first secured link let in new hosts for all of them."""
    if not any(_has_door(uri) for uri in uris):
        return
    pairs = zip(uris, links, strict=True)
    secured = [link for uri, link in pairs if _has_door(uri) and isinstance(link, TakesNewHosts)]
    secured[0].open_door([link.endpoint for link in secured], keys)
