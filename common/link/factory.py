"""Link URI to link. Transports are imported only when they are asked for."""

from dataclasses import dataclass
from urllib.parse import parse_qsl, urlsplit

from common.errors import SettingsError
from common.link.base import Link

_EXAMPLES = "give tcp://HOST:PORT or ipc://PATH"


@dataclass(frozen=True, slots=True)
class LinkUri:
    """A link as the user named it.

    Attributes:
        address: what the transport takes, without options.
        listens: whether this side waits to be dialled.
    """

    address: str
    listens: bool


def parse_link(uri: str, *, listens_by_default: bool) -> LinkUri:
    """Read a link URI.

    Args:
        uri: `tcp://HOST:PORT` or `ipc://PATH`, with `?bind=1` or `?connect=1` to swap who listens.
        listens_by_default: true on the board, which binds; false on the host, which connects.

    Returns:
        The link that is meant.

    Raises:
        SettingsError: the URI makes no sense.
    """
    address, _, query = uri.partition("?")
    scheme, found, rest = address.partition("://")
    if not found or scheme not in {"tcp", "ipc"} or not rest:
        raise SettingsError(f"link {uri!r} is of no known kind", _EXAMPLES)
    if scheme == "tcp":
        _check_port(uri, address)
    options = dict(parse_qsl(query, keep_blank_values=True))
    unknown = set(options) - {"bind", "connect"}
    if unknown or set(options.values()) - {"1"} or len(options) > 1:
        raise SettingsError(
            f"link {uri!r} has options {query!r}", "?bind=1 and ?connect=1 are the only ones, one at a time"
        )
    return LinkUri(address, listens_by_default if not options else "bind" in options)


def open_link(uri: LinkUri) -> Link:
    """Open the link.

    Args:
        uri: what to open.

    Returns:
        The open link; a dialled peer may still be absent.

    Raises:
        SettingsError: the address makes no sense.
        UnavailableError: the port or path is taken.
    """
    from common.link.zeromq import ZeroMqDialer, ZeroMqListener  # noqa: PLC0415 - only the transport that is used is loaded

    if not uri.listens and "//*:" in uri.address:
        raise SettingsError(
            f"link {uri.address!r} names no host to connect to", "give its name or address in place of *"
        )
    return ZeroMqListener(uri.address) if uri.listens else ZeroMqDialer(uri.address)


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
