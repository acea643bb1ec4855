"""Addresses of the host's cameras as the user gives them: a browser's, and an MJPEG server's, `http://USER:PASSWORD@HOST:8080/video?latency_ms=120`. Pure, and light: imports no camera.

Our own options are removed from the query. The rest belongs to the server.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction
from typing import Final
from urllib.parse import parse_qsl, unquote, urlencode, urlsplit

from common.camera.options import EXAMPLE as COMMON_EXAMPLE
from common.camera.options import OptionReader, milliseconds, rate, without_options
from common.errors import SettingsError
from common.orientation import ORIENTING, Orientation, orientation_of

HTTP_EXAMPLE: Final = "http://PHONE:8080/video[?latency_ms=120&latency_uncertainty_ms=20]"

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
        uri: see HTTP_EXAMPLE.

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
            f"camera {_hidden(uri)!r} is not a valid address", f"give {without_options(HTTP_EXAMPLE)}"
        ) from None
    secure = parts.scheme.lower() == "https"
    # Blanks and control characters would end the request line early.
    target = parts.path or "/"
    if not host or port == 0 or re.search(r"[^\x21-\x7e]", host + target + parts.query):
        raise SettingsError(f"camera {_hidden(uri)!r} is not a valid address", f"give {without_options(HTTP_EXAMPLE)}")
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


_MOST_PX: Final = 16_384
"""As on a board's wire; the protocol itself is not imported for `--help`."""

SCHEME: Final = "browser:"
BROWSER_EXAMPLE: Final = "browser:[?w=640&h=480&fps=30&encoding=luma|jpeg&quality=0.9]"

_HELP: Final = {
    "w": "the width in px, such as w=640, and with it h=480",
    "h": "the height in px, such as h=480, and with it w=640",
    "fps": "frames per second, such as fps=30",
    "encoding": "encoding=luma or encoding=jpeg; without it the browser takes the cheaper one",
    "quality": "the JPEG quality from 0.1 to 1, such as quality=0.9",
}


class Encoding(Enum):
    """How a browser sends its images: as JPEG, or the luma plane alone."""

    JPEG = "jpeg"
    LUMA = "luma"


@dataclass(frozen=True, slots=True, kw_only=True)
class BrowserSettings:
    """What a browser's camera is asked for.

    Attributes:
        size_px: width and height, px; None: the browser chooses.
        fps: frames per second; None: the browser chooses.
        encoding: of the images; None: the browser takes the cheaper one.
        quality: of JPEG images, 0.1 to 1; None: the browser chooses.
        clock: name of the stamps' clock.
    """

    size_px: tuple[int, int] | None = None
    fps: Fraction | None = None
    encoding: Encoding | None = None
    quality: float | None = None
    clock: str = "host"


def is_browser(uri: str) -> bool:
    """Return whether a camera URI means a browser's camera."""
    return uri.startswith(SCHEME)


def browser_settings(uri: str, clock: str) -> BrowserSettings:
    """Parse a camera URI.

    Args:
        uri: see BROWSER_EXAMPLE, without `rotate` and `flip`.
        clock: name of the stamps' clock.

    Raises:
        SettingsError: an option is unknown or makes no sense.
    """
    path, _, query = uri.removeprefix(SCHEME).partition("?")
    if path:
        raise SettingsError(
            f"camera {uri!r} names a browser", f"give {BROWSER_EXAMPLE}: whichever browser opens the page"
        )
    reader = OptionReader(uri, _options(uri, query), _HELP)
    width, height = (reader.read(name, _side, None) for name in ("w", "h"))
    if (width is None) != (height is None):
        raise SettingsError(f"camera {uri!r} has half a size", "give both w= and h=, or neither")
    return BrowserSettings(
        size_px=None if width is None or height is None else (width, height),
        fps=reader.read("fps", rate, None),
        encoding=reader.read("encoding", Encoding, None),
        quality=reader.read("quality", _quality, None),
        clock=clock,
    )


def _options(uri: str, query: str) -> Mapping[str, str]:
    """Split the options.

    Raises:
        SettingsError: one of them has no value, or stands there twice.
    """
    found: dict[str, str] = {}
    for item in query.split("&") if query else ():
        name, equals, value = item.partition("=")
        if not equals or name in found:
            raise SettingsError(f"camera {uri!r} has an option {item!r} that says nothing", f"give {BROWSER_EXAMPLE}")
        found[name] = value
    return found


def _side(text: str) -> int:
    if not (text.isascii() and text.isdecimal() and len(text) <= 5 and 16 <= int(text) <= _MOST_PX):
        raise ValueError(text)
    return int(text)


def _quality(text: str) -> float:
    value = float(text) if len(text) <= 12 else 0.0
    if not 0.1 <= value <= 1:  # NaN neither
        raise ValueError(text)
    return value


EXAMPLE: Final = f"{COMMON_EXAMPLE} or {HTTP_EXAMPLE} or {BROWSER_EXAMPLE}"
