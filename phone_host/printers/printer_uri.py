"""Where a printer is, as the user writes it: a line (serial:DEVICE), a server (octoprint://HOST:PORT), or a file (file:OUT.gcode); and which are among the services that announce themselves in a network. Pure."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from typing import Final, assert_never

from common.errors import SettingsError
from phone_host.discovery.found import Announcement

_REMEDY: Final = (
    "give octoprint://HOST, moonraker://HOST, prusalink://HOST, serial:/dev/ttyUSB0?baud=115200, rfcomm://00:11:22:33:44:55,"
    " socket://HOST:PORT or file:OUT.gcode"
)
_BLUETOOTH: Final = re.compile(r"(?:[0-9A-F]{2}:){5}[0-9A-F]{2}", re.IGNORECASE)
_HOST: Final = re.compile(r"[A-Za-z0-9._-]+|\[[0-9A-Fa-f:.]+\]")
_BAUDS: Final = (9600, 19200, 38400, 57600, 115200, 230400, 250000, 460800, 500000, 921600, 1000000)
_USUAL_BAUD: Final = 115200
_MOST_CHANNEL: Final = 30
_MOST_PORT: Final = 65535
_TLS_PORT: Final = 443


class LineKind(Enum):
    """How a printer on a line is reached."""

    SERIAL = "serial"
    RFCOMM = "rfcomm"
    SOCKET = "socket"


class ServerKind(Enum):
    """Which server stands before the printer."""

    OCTOPRINT = "octoprint"
    MOONRAKER = "moonraker"
    PRUSALINK = "prusalink"

    @property
    def title(self) -> str:
        """Its name for people."""
        return {"octoprint": "OctoPrint", "moonraker": "Moonraker", "prusalink": "PrusaLink"}[self.value]

    @property
    def port(self) -> int:
        """Its usual port: OctoPi and PrusaLink serve at that of the web, Moonraker at its own."""
        return 7125 if self is ServerKind.MOONRAKER else 80


@dataclass(frozen=True, slots=True)
class LineUri:
    """A printer that takes G-code line by line.

    Attributes:
        text: as the user wrote it.
        kind: how it is reached.
        place: device, Bluetooth address or host.
        baud: of a serial port, bits per second.
        port: of TCP, or RFCOMM's channel.
    """

    text: str
    kind: LineKind
    place: str
    baud: int = _USUAL_BAUD
    port: int = 0


@dataclass(frozen=True, slots=True)
class ServerUri:
    """A printer behind a server that takes whole files.

    Attributes:
        text: as the user wrote it.
        kind: which server.
        host: its name or address, without brackets.
        port: of TCP.
        is_secure: whether it speaks https.
    """

    text: str
    kind: ServerKind
    host: str
    port: int
    is_secure: bool = False


@dataclass(frozen=True, slots=True)
class FileUri:
    """No printer, but a file for one."""

    text: str
    path: str


PrinterUri = LineUri | ServerUri | FileUri


def read_uri(text: str) -> PrinterUri:
    """Read where a printer is.

    Raises:
        SettingsError: it is none.
    """
    scheme, colon, rest = text.strip().partition(":")
    place, _, query = rest.removeprefix("//").partition("?")
    if not colon or not place:
        raise SettingsError(f"--printer {text!r} names no printer", _REMEDY)
    if scheme.lower() == "file":
        return FileUri(text, rest.removeprefix("//"))
    if server := next((each for each in ServerKind if each.value == scheme.lower()), None):
        return _server(text, server, place, query)
    kind = next((each for each in LineKind if each.value == scheme.lower()), None)
    if kind is None:
        raise SettingsError(f"--printer {text!r} names no printer", _REMEDY)
    match kind:
        case LineKind.SERIAL:
            baud = _number(text, query, "baud", _USUAL_BAUD)
            if baud not in _BAUDS:
                raise SettingsError(f"--printer {text!r}: baud is {baud}", f"give one of {', '.join(map(str, _BAUDS))}")
            return LineUri(text, kind, place if place.startswith("/") else f"/dev/{place}", baud)
        case LineKind.RFCOMM:
            channel = _number(text, query, "channel", 1)
            if not _BLUETOOTH.fullmatch(place) or not 1 <= channel <= _MOST_CHANNEL:
                raise SettingsError(
                    f"--printer {text!r} is no Bluetooth address", "give rfcomm://00:11:22:33:44:55?channel=1"
                )
            return LineUri(text, kind, place.upper(), port=channel)
        case LineKind.SOCKET:
            host, _, port = place.rpartition(":")
            if not _HOST.fullmatch(host) or not _is_port(port) or query:
                raise SettingsError(f"--printer {text!r} has no host and port", "give socket://HOST:PORT")
            return LineUri(text, kind, host.strip("[]"), port=int(port))
        case _:
            assert_never(kind)


def _server(text: str, kind: ServerKind, place: str, query: str) -> ServerUri:
    example = f"{kind.value}://HOST:{kind.port}"
    if "@" in place:
        shown = f"{kind.value}://…@{place.rpartition('@')[2]}"
        raise SettingsError(
            f"--printer {shown} holds a name or key", "write the key into the settings file, table [printers]"
        )
    place = place.rstrip("/")
    is_secure = bool(_number(text, query, "tls", 0))
    host, colon, port = place.rpartition(":") if not place.endswith("]") and ":" in place else (place, "", "")
    if not _HOST.fullmatch(host) or (colon and not _is_port(port)):
        raise SettingsError(f"--printer {text!r} has no host", f"give {example}; ?tls=1 if it speaks https")
    usual = _TLS_PORT if is_secure else kind.port
    return ServerUri(text, kind, host.strip("[]"), int(port) if colon else usual, is_secure)


def _is_port(text: str) -> bool:
    return text.isascii() and text.isdecimal() and len(text) <= 5 and 0 < int(text) <= _MOST_PORT


def _number(text: str, query: str, name: str, usual: int) -> int:
    if not query:
        return usual
    key, _, value = query.partition("=")
    if key != name or not (value.isascii() and value.isdecimal()) or len(value) > 9:
        raise SettingsError(f"--printer {text!r}: {query!r} is no option", f"give ?{name}={usual}")
    return int(value)


_KINDS: Final = {
    "_octoprint._tcp.local.": ServerKind.OCTOPRINT,
    "_moonraker._tcp.local.": ServerKind.MOONRAKER,
    "_prusalink._tcp.local.": ServerKind.PRUSALINK,
}
_WEB: Final = "_http._tcp.local."
"""Some announce themselves only as a web page; then the name tells."""

SERVICES: Final = (*_KINDS, _WEB)


@dataclass(frozen=True, slots=True, order=True)
class FoundPrinter:
    """A printer that announces itself."""

    uri: str
    name: str


def printers_of(announcements: Iterable[Announcement]) -> list[FoundPrinter]:
    """Return the printers, sorted by address, each once.

    Args:
        announcements: what was heard; it may come from anybody.
    """
    found: dict[str, FoundPrinter] = {}
    for each in announcements:
        kind = _KINDS.get(each.service) or next((kind for kind in ServerKind if kind.value in each.name.lower()), None)
        if kind is not None:
            uri = f"{kind.value}://{each.host}:{each.port}"
            name = "".join(character if character.isprintable() else " " for character in each.name)[:60]
            found.setdefault(uri, FoundPrinter(uri, name))
    return sorted(found.values())
