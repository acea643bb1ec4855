"""Where a printer is, as the user writes it: serial:DEVICE?baud=115200, rfcomm://ADDRESS?channel=1, socket://HOST:PORT. Pure."""

import re
from dataclasses import dataclass
from enum import Enum
from typing import Final

from common.errors import SettingsError

_REMEDY: Final = "give serial:/dev/ttyUSB0?baud=115200, rfcomm://00:11:22:33:44:55 or socket://HOST:PORT"
_BLUETOOTH: Final = re.compile(r"(?:[0-9A-F]{2}:){5}[0-9A-F]{2}", re.IGNORECASE)
_BAUDS: Final = (9600, 19200, 38400, 57600, 115200, 230400, 250000, 460800, 500000, 921600, 1000000)
_USUAL_BAUD: Final = 115200
_MOST_CHANNEL: Final = 30
_MOST_PORT: Final = 65535


class LineKind(Enum):
    """How a printer is reached."""

    SERIAL = "serial"
    RFCOMM = "rfcomm"
    SOCKET = "socket"


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


def read_uri(text: str) -> LineUri:
    """Read where a printer is.

    Args:
        text: what the user wrote.

    Raises:
        SettingsError: it is none.
    """
    scheme, colon, rest = text.strip().partition(":")
    place, _, query = rest.removeprefix("//").partition("?")
    kind = next((each for each in LineKind if each.value == scheme.lower()), None)
    if not colon or kind is None or not place:
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
            if not host or not port.isdecimal() or not 0 < int(port) <= _MOST_PORT or query:
                raise SettingsError(f"--printer {text!r} has no host and port", "give socket://HOST:PORT")
            return LineUri(text, kind, host.strip("[]"), port=int(port))


def _number(text: str, query: str, name: str, usual: int) -> int:
    if not query:
        return usual
    key, _, value = query.partition("=")
    if key != name or not value.isdecimal() or len(value) > 9:
        raise SettingsError(f"--printer {text!r}: {query!r} is no option", f"give ?{name}={usual}")
    return int(value)
