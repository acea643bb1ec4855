"""The address of an MJPEG server as the user gives it: `http://USER:PASSWORD@HOST:8080/video?latency_ms=120`.

Our own options are removed from the query. The rest belongs to the server.
"""

import re
from dataclasses import dataclass
from typing import Final
from urllib.parse import parse_qsl, unquote, urlencode, urlsplit

from common.camera.options import milliseconds, without_options
from common.errors import SettingsError
from common.orientation import ORIENTING, Orientation, orientation_of

EXAMPLE: Final = "http://PHONE:8080/video[?latency_ms=120&latency_uncertainty_ms=20]"

_LONGEST_MS: Final = 10_000
_OURS: Final = ("latency_ms", "latency_uncertainty_ms", "verify")


@dataclass(frozen=True, slots=True, kw_only=True)
class HttpSettings:
    """The server and what is known of its latency.

    Attributes:
        secure: whether to use https.
        host: name or address.
        port: TCP port.
        target: path and query as sent to the server.
        user: user for basic authentication; empty: none.
        password: password for basic authentication.
        latency_ns: from exposure mid-point to the arrival of an image's first byte; None: not calibrated, taken as 0.
        latency_uncertainty_ns: uncertainty of the latency; None: not stated.
        verify: whether to check the certificate of an https server.
        clock: name of the stamps' clock.
    """

    secure: bool
    host: str
    port: int
    target: str
    user: str = ""
    password: str = ""
    latency_ns: int | None = None
    latency_uncertainty_ns: int | None = None
    verify: bool = True
    clock: str = "host"

    @property
    def shown(self) -> str:
        """The address for logs and errors, without user and password."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{'https' if self.secure else 'http'}://{host}:{self.port}{self.target}"


def without_password(uri: str) -> str:
    """Return a camera URI for logs and files. The URI of a server loses its user and password."""
    if not is_http(uri):
        return uri
    scheme, _, rest = uri.partition("://")
    authority, slash, target = rest.partition("/")
    return f"{scheme}://{authority.rpartition('@')[2]}{slash}{target}"


def is_http(uri: str) -> bool:
    """Return whether a camera URI names a server."""
    return uri.lower().startswith(("http://", "https://"))


def without_orientation(uri: str) -> tuple[str, Orientation]:
    """Take the options `rotate` and `flip` off the address of a server.

    Args:
        uri: see EXAMPLE.

    Returns:
        The rest of the address, unchanged, and how the camera is mounted.

    Raises:
        SettingsError: an option has a value that is not allowed.
    """
    address, mark, query = uri.partition("?")
    items = [(item.partition("="), item) for item in query.split("&")]
    ours = {name: value for (name, _, value), _ in items if name in ORIENTING}
    if not ours:
        return uri, Orientation()
    others = "&".join(item for (name, _, _), item in items if name not in ORIENTING)
    return (f"{address}{mark}{others}" if others else address), orientation_of(ours, _hidden(uri))


def http_settings(uri: str, clock: str) -> HttpSettings:
    """Parse the address of a server.

    Raises:
        SettingsError: the address or an option is invalid.
    """
    try:
        parts = urlsplit(uri)
        port, host = parts.port, parts.hostname
        user, password = unquote(parts.username or ""), unquote(parts.password or "")
    except ValueError:
        raise SettingsError(
            f"camera {_hidden(uri)!r} is not a valid address", f"give {without_options(EXAMPLE)}"
        ) from None
    secure = parts.scheme.lower() == "https"
    # Blanks and control characters would end the request line early.
    target = parts.path or "/"
    if not host or port == 0 or re.search(r"[^\x21-\x7e]", host + target + parts.query):
        raise SettingsError(f"camera {_hidden(uri)!r} is not a valid address", f"give {without_options(EXAMPLE)}")
    ours, theirs = _split(parts.query)
    if "latency_uncertainty_ms" in ours and "latency_ms" not in ours:
        raise SettingsError(
            f"camera {_hidden(uri)!r} has latency_uncertainty_ms but no latency_ms",
            "give both, or neither and measure with phone-host calibrate-time",
        )
    return HttpSettings(
        secure=secure,
        host=host,
        port=port or (443 if secure else 80),
        target=target + (f"?{theirs}" if theirs else ""),
        user=user,
        password=password,
        latency_ns=_time(uri, ours, "latency_ms"),
        latency_uncertainty_ns=_time(uri, ours, "latency_uncertainty_ms"),
        verify=_truth(uri, ours.get("verify", "1")),
        clock=clock,
    )


def _split(query: str) -> tuple[dict[str, str], str]:
    """Split a query into our options and the server's query, which stays unchanged if it has none of ours."""
    items = parse_qsl(query, keep_blank_values=True, max_num_fields=100) if query.count("&") < 100 else []
    ours = {name: value for name, value in items if name in _OURS}
    return ours, urlencode([item for item in items if item[0] not in _OURS]) if ours else query


def _time(uri: str, options: dict[str, str], name: str) -> int | None:
    if name not in options:
        return None
    try:
        return milliseconds(options[name], _LONGEST_MS)
    except (ValueError, ZeroDivisionError):
        raise SettingsError(
            f"camera {_hidden(uri)!r} has {name}={options[name]}", f"give ms from 0 to {_LONGEST_MS}"
        ) from None


def _truth(uri: str, text: str) -> bool:
    if text not in {"0", "1"}:
        raise SettingsError(f"camera {_hidden(uri)!r} has verify={text}", "give verify=0 to accept any certificate")
    return text == "1"


def _hidden(uri: str) -> str:
    """Return the address with its password hidden."""
    return re.sub(r"(//[^/@]*?:)[^/@]*@", r"\1…@", uri)
