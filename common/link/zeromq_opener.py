"""Opens ZeroMQ links: with keys if tcp leaves this machine, or if the peer at an address is known."""

from common.errors import SettingsError, UnavailableError
from common.keys import KeyFolder
from common.link.uri import LinkRequest, LinkUri, needs_keys
from common.link.zeromq import ZeroMqDialer, ZeroMqListener
from common.peers import Peer, peer_at


def open_zeromq(request: LinkRequest) -> ZeroMqListener | ZeroMqDialer:
    """Open a tcp or ipc link.

    Raises:
        SettingsError: the address makes no sense, or needs keys and there is no key folder.
        UnavailableError: the port or path is taken, or the peer is not known.
        DataError: the key files are bad.
    """
    uri, keys = request.uri, request.keys
    if not uri.listens and "//*:" in uri.address:
        raise SettingsError(
            f"link {uri.address!r} names no host to connect to", "give its name or address in place of *"
        )
    if uri.listens:
        secured = _keys(uri, keys) if needs_keys(uri) else None
        return ZeroMqListener(uri.address, secured, owner=uri.owner, board=request.board)
    return ZeroMqDialer(uri.address, keys, _peer(uri, keys), owner=uri.owner, board=request.board)


def _keys(uri: LinkUri, keys: KeyFolder | None) -> KeyFolder:
    if keys is None:
        raise SettingsError(
            f"{uri.address} leads to another machine and needs keys",
            "name a folder of keys, or add ?insecure=1 to do without",
        )
    return keys


def _peer(uri: LinkUri, keys: KeyFolder | None) -> Peer | None:
    """The peer that must answer at an address; None on an open link. A loopback address may lead to a known board (a forwarded port)."""
    if uri.insecure or not uri.address.startswith("tcp://"):
        return None
    if not needs_keys(uri):
        return next((peer for peer in keys.peers() if peer.address == uri.address), None) if keys else None
    peers = _keys(uri, keys).peers()
    if found := peer_at(peers, uri.address):
        return found
    known = f" (known: {', '.join(f'{peer.name} at {peer.address}' for peer in peers)})" if peers else ""
    raise UnavailableError(
        f"no known board is at {uri.address}{known}", f"pair with it: phone-host pair --link {uri.address}"
    )
