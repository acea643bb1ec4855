"""Link URIs as the user gives them, parsed and checked without opening anything."""

import ipaddress
from typing import Final
from urllib.parse import parse_qsl, urlsplit

from common.errors import SettingsError
from common.keys import KeyFolder
from common.program.extensions import registered_names
from common.value import value

LINKS: Final = "tandemscan.links"
"""Entry point group of other packages' links; see `factory`."""

OWN_SCHEMES: Final = frozenset({"tcp", "ipc", "serial", "rfcomm"})

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


@value(kw_only=True)
class LinkUri:
    """A link as the user named it.

    Attributes:
        address: the address that the transport takes, without options.
        listens: whether this side waits to be dialled.
        baud: speed of a serial port that has one; None: the default.
        unpaired: whether Bluetooth devices that were never paired may connect.
        insecure: whether a tcp link is open to everybody on every network.
        owner: user who, besides this user and root, may be at an ipc link's other end; empty for nobody.
        extension: name under which an installed package registers this kind of link; empty for our own links.
        options: for an extension: the query without `bind` and `connect`.
    """

    address: str
    listens: bool
    baud: int | None = None
    unpaired: bool = False
    insecure: bool = False
    owner: str = ""
    extension: str = ""
    options: tuple[tuple[str, str], ...] = ()


@value(kw_only=True)
class LinkRequest:
    """A request to open a link: everything that a transport is told.

    Attributes:
        uri: what to open.
        keys: this machine's key and the keys it trusts; None if only open links are possible.
        board: whether this side is the board, which accepts no images over tcp and ipc.
        waits: whether to wait for a missing device.
    """

    uri: LinkUri
    keys: KeyFolder | None = None
    board: bool = False
    waits: bool = False


def parse_link(uri: str, *, listens_by_default: bool) -> LinkUri:
    """Parse a link URI.

    Args:
        uri: `tcp://HOST:PORT`, `ipc://PATH`, `serial:DEVICE` or `rfcomm://DEVICE[/CHANNEL]`. `?bind=1` or `?connect=1` swaps who listens.
            A serial port also takes `baud=N`, a Bluetooth device `unpaired=1`. tcp takes `insecure=1`: no keys, so whoever reaches the
            address sees the camera. ipc takes `owner=USER`: that user's end is trusted like one's own.
        listens_by_default: true on the board, which binds; false on the host, which connects.

    Raises:
        SettingsError: the URI makes no sense.
    """
    address, _, query = uri.partition("?")
    is_serial = address.startswith("serial:")
    scheme, found, rest = address.partition(":" if is_serial else "://")
    if scheme not in OWN_SCHEMES and (extension := _extension(uri, listens_by_default=listens_by_default)):
        return extension
    if not found or scheme not in OWN_SCHEMES or not rest:
        raise SettingsError(f"link {uri!r} is of an unknown kind", _EXAMPLES)
    if scheme == "tcp":
        _check_port(uri, address)
    if scheme == "rfcomm":
        _check_channel(uri, rest)
    if scheme == "ipc" and rest.startswith(
        "@"
    ):  # Linux's abstract names have no owner and no mode: whoever knows one can connect
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


def needs_keys(uri: LinkUri) -> bool:
    """Whether a link is for known keys only: tcp that other machines can reach, unless it is marked insecure."""
    if not uri.address.startswith("tcp://") or uri.insecure:
        return False
    return not is_this_machine(uri.address.removeprefix("tcp://").rpartition(":")[0].strip("[]"))


def is_this_machine(host: str) -> bool:
    """Whether a host of an address, without brackets, can only be this machine: localhost, or a loopback address."""
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:  # a name, an interface, *
        return False


def _extension(uri: str, *, listens_by_default: bool) -> LinkUri | None:
    """Parse a URI whose scheme an installed package registers; None if there is no such package."""
    address, _, query = uri.partition("?")
    scheme, found, rest = address.partition(":")
    if not found or not rest.strip("/") or scheme not in registered_names(LINKS):
        return None
    options = dict(parse_qsl(query, keep_blank_values=True))
    sides = {side: options.pop(side) for side in ("bind", "connect") if side in options}
    if len(sides) > 1 or set(sides.values()) - {"1"}:
        raise SettingsError(f"link {uri!r} has options {query!r}", "give ?bind=1 or ?connect=1")
    listens = "bind" in sides if sides else listens_by_default
    return LinkUri(address=address, listens=listens, extension=scheme, options=tuple(options.items()))


def _check_port(uri: str, address: str) -> None:
    try:
        port = urlsplit(address.replace("*", "0.0.0.0")).port  # noqa: S104 - only to parse it
    except ValueError:
        port = 0
    if port is None:
        raise SettingsError(f"link {uri!r} names no port", "give one, for example tcp://127.0.0.1:5555")
    if not port:
        raise SettingsError(
            f"link {uri!r} has the port {address.rpartition(':')[2]!r}",
            "give 1 to 65535, for example tcp://127.0.0.1:5555",
        )
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
