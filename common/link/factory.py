"""Link URI to link, open or with keys. Transports are imported only when they are asked for."""

import ipaddress
import logging
from collections.abc import Sequence
from dataclasses import dataclass
from urllib.parse import parse_qsl, unquote, urlsplit

from common.errors import MissingDeviceError, SettingsError, TandemError, UnavailableError
from common.keys import KeyFolder, Peer, peer_at
from common.link.base import Link
from common.program.logs import event

_LOG = logging.getLogger(__name__)

_MAX_BAUD = 20_000_000
"""The fastest adapters reach 12 Mbaud."""

_MAX_CHANNEL = 30
"""RFCOMM has channels 1 to 30."""

_MORE_OPTIONS = {
    "serial": ", and baud=N",
    "rfcomm": ", and unpaired=1",
    "tcp": ", and insecure=1",
    "ipc": ", and owner=USER",
}

_EXAMPLES = "give tcp://HOST:PORT, ipc://PATH, serial:DEVICE or rfcomm://DEVICE"


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkUri:
    """A link as the user named it.

    Attributes:
        address: what the transport takes, without options.
        listens: whether this side waits to be dialled.
        baud: speed of a serial port that has one; None: the usual.
        unpaired: whether Bluetooth devices will do that were never paired with.
        insecure: whether a tcp link is to be open to everybody on every network.
        owner: user whose an ipc link's other end may be, beside this one and root; empty for nobody.
    """

    address: str
    listens: bool
    baud: int | None = None
    unpaired: bool = False
    insecure: bool = False
    owner: str = ""


def parse_link(uri: str, *, listens_by_default: bool) -> LinkUri:
    """Read a link URI.

    Args:
        uri: `tcp://HOST:PORT`, `ipc://PATH`, `serial:DEVICE` or `rfcomm://DEVICE[/CHANNEL]`, with `?bind=1` or `?connect=1` to swap who
            listens; a serial port also takes `baud=N`, a Bluetooth device `unpaired=1`, tcp `insecure=1`: no keys, whoever reaches the
            address sees the camera; ipc `owner=USER`: that user's end is trusted as one's own is.
        listens_by_default: true on the board, which binds; false on the host, which connects.

    Returns:
        The link that is meant.

    Raises:
        SettingsError: the URI makes no sense.
    """
    address, _, query = uri.partition("?")
    is_serial = address.startswith("serial:")
    scheme, found, rest = address.partition(":" if is_serial else "://")
    if not found or scheme not in {"tcp", "ipc", "serial", "rfcomm"} or not rest:
        raise SettingsError(f"link {uri!r} is of no known kind", _EXAMPLES)
    if scheme == "tcp":
        _check_port(uri, address)
    if scheme == "rfcomm":
        _check_channel(uri, rest)
    if scheme == "ipc" and rest.startswith(
        "@"
    ):  # Linux's abstract names have no owner and no mode: whoever knows one connects
        raise SettingsError(f"link {uri!r} names no path", "give one, for example ipc://$XDG_RUNTIME_DIR/board")
    options = dict(parse_qsl(query, keep_blank_values=True))
    baud = _baud(uri, options.pop("baud")) if is_serial and "baud" in options else None
    unpaired = scheme == "rfcomm" and options.get("unpaired") == "1"
    if unpaired:
        del options["unpaired"]
    insecure = scheme == "tcp" and options.get("insecure") == "1" and bool(options.pop("insecure"))
    owner = options.pop("owner") if scheme == "ipc" and options.get("owner") else ""
    unknown = set(options) - {"bind", "connect"}
    if unknown or set(options.values()) - {"1"} or len(options) > 1:
        raise SettingsError(
            f"link {uri!r} has options {query!r}",
            "?bind=1 and ?connect=1 are the only ones, one at a time" + _MORE_OPTIONS.get(scheme, ""),
        )
    return LinkUri(
        address=address,
        listens=listens_by_default if not options else "bind" in options,
        baud=baud,
        unpaired=unpaired,
        insecure=insecure,
        owner=owner,
    )


def open_link(uri: LinkUri, keys: KeyFolder | None = None, *, board: bool = False, waits: bool = False) -> Link:
    """Open the link: with keys where tcp leaves this machine, or where the peer at an address is known.

    Args:
        uri: what to open.
        keys: this machine's key and those that it trusts; None where only open links can be had.
        board: whether this side is the board, which over tcp and ipc takes no images.
        waits: whether a device that is missing is waited for.

    Returns:
        The open link; a dialled peer may still be absent.

    Raises:
        SettingsError: the address makes no sense, or needs keys and there is no folder of them.
        UnavailableError: the port or path is taken, the device is missing, or the peer is not known.
        DataError: the files of keys are bad.
    """
    if uri.address.startswith("serial:"):
        return _open_serial(uri, waits=waits)
    if uri.address.startswith("rfcomm:"):
        return _open_rfcomm(uri, waits=waits)
    from common.link.zeromq import ZeroMqDialer, ZeroMqListener  # noqa: PLC0415 - only the transport that is used is loaded

    if not uri.listens and "//*:" in uri.address:
        raise SettingsError(
            f"link {uri.address!r} names no host to connect to", "give its name or address in place of *"
        )
    if uri.listens:
        secured = _keys(uri, keys) if needs_keys(uri) else None
        return ZeroMqListener(uri.address, secured, owner=uri.owner, board=board)
    return ZeroMqDialer(uri.address, keys, _peer(uri, keys), owner=uri.owner, board=board)


def tell_insecure(uri: LinkUri) -> None:
    """Say in the log, at a program's start, that a link is open because its owner wants so."""
    if uri.insecure:
        _LOG.warning(event("link_insecure", address=uri.address, meaning="no keys: whoever reaches it sees the camera"))


def needs_keys(uri: LinkUri) -> bool:
    """Whether a link is for known keys only: tcp that other machines can reach, unless it is said to be insecure."""
    if not uri.address.startswith("tcp://") or uri.insecure:
        return False
    host = uri.address.removeprefix("tcp://").rpartition(":")[0].strip("[]")
    try:
        return not (host == "localhost" or ipaddress.ip_address(host).is_loopback)
    except ValueError:  # a name, an interface, *
        return True


def _keys(uri: LinkUri, keys: KeyFolder | None) -> KeyFolder:
    if keys is None:
        raise SettingsError(f"{uri.address} leaves this machine", "name a folder of keys, or add ?insecure=1")
    return keys


def _peer(uri: LinkUri, keys: KeyFolder | None) -> Peer | None:
    """Who must answer at an address; None on an open link. A loopback address may lead to a known board (a forwarded port)."""
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


def open_links(uris: Sequence[LinkUri], keys: KeyFolder | None = None, *, board: bool = False) -> list[Link]:
    """Open the links of one side. Of several, one whose device is missing is waited for as long as another is there.

    Args:
        uris: what to open.
        keys: as for `open_link`.
        board: as for `open_link`; a board whose tcp links need keys also takes in new hosts that prove a code.

    Returns:
        The open links, in that order.

    Raises:
        SettingsError: an address makes no sense, or a link lies on the port on which another one's new hosts are taken in.
        UnavailableError: a port or path is taken, or every device is missing.
        DataError: the files of keys are bad.
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
    """Refuse a tcp link on the port behind a secured one's own."""
    places = {
        uri.address: uri.address.removeprefix("tcp://").rpartition(":") for uri in uris if "tcp://" in uri.address
    }
    for secured in (uri.address for uri in uris if _has_door(uri)):
        for other in (uri.address for uri in uris if uri.listens and uri.address in places):
            (host, _, port), (other_host, _, other_port) = places[secured], places[other]
            if int(other_port) == int(port) + 1 and (host == other_host or "*" in {host, other_host}):
                raise SettingsError(
                    f"{other} lies on the port on which {secured} takes in new hosts",
                    f"choose another than the one behind it, for example {int(port) + 2}",
                )


def _open_door(uris: Sequence[LinkUri], links: Sequence[Link], keys: KeyFolder) -> None:
    """Have the first secured link take in new hosts for all of them."""
    if not any(_has_door(uri) for uri in uris):
        return
    from common.link.zeromq import ZeroMqListener  # noqa: PLC0415 - only where it is used already

    pairs = zip(uris, links, strict=True)
    secured = [link for uri, link in pairs if _has_door(uri) and isinstance(link, ZeroMqListener)]
    secured[0].open_door([link.endpoint for link in secured], keys)


def _check_port(uri: str, address: str) -> None:
    try:
        port = urlsplit(address.replace("*", "0.0.0.0")).port  # noqa: S104 - only to parse it
    except ValueError:
        port = None
    if port is None or not 1 <= port <= 65535:
        raise SettingsError(f"link {uri!r} names no port", "give one, for example tcp://127.0.0.1:5555")
    if address.startswith("tcp://:"):
        raise SettingsError(
            f"link {uri!r} names no host", "give its name or address, or * to listen on every interface"
        )


def _check_channel(uri: str, rest: str) -> None:
    device, slash, channel = rest.partition("/")
    if not device:
        raise SettingsError(f"link {uri!r} names no device", "give its address or name, or * to listen")
    if slash and not (channel.isascii() and channel.isdigit() and 1 <= int(channel) <= _MAX_CHANNEL):
        raise SettingsError(f"link {uri!r} has the channel {channel!r}", f"leave it out, or give 1 to {_MAX_CHANNEL}")


def _baud(uri: str, text: str) -> int:
    if not text.isascii() or not text.isdigit() or not 0 < int(text) <= _MAX_BAUD:
        raise SettingsError(f"link {uri!r} has a baud rate of {text!r}", "give a number, for example ?baud=115200")
    return int(text)


def _open_serial(uri: LinkUri, *, waits: bool) -> Link:
    try:
        from common.link.serial import DEFAULT_BAUD, SerialLink  # noqa: PLC0415 - only the transport that is used is loaded
    except ImportError as error:
        raise UnavailableError(
            f"{uri.address} cannot be opened ({error})", "install pyserial (apt: python3-serial)"
        ) from None
    return SerialLink(uri.address.removeprefix("serial:"), uri.baud or DEFAULT_BAUD, listens=uri.listens, waits=waits)


def _open_rfcomm(uri: LinkUri, *, waits: bool) -> Link:
    from common.link.rfcomm import ANYONE, RfcommDialler, RfcommListener, is_address  # noqa: PLC0415 - as above

    device, _, number = uri.address.removeprefix("rfcomm://").partition("/")
    device, channel = unquote(device), int(number or 0)
    if not uri.listens:
        if device == ANYONE:
            raise SettingsError(f"link {uri.address!r} names no device to connect to", "give its name or address")
        return RfcommDialler(uri.address, device, channel, unpaired=uri.unpaired, waits=waits)
    if device != ANYONE and not is_address(device):
        raise SettingsError(f"link {uri.address!r} cannot be listened on", "give rfcomm://* or an adapter's address")
    return RfcommListener(uri.address, device, channel, unpaired=uri.unpaired, waits=waits)
