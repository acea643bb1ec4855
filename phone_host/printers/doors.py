"""The doors to printers by their addresses, and the keys of those that want one. The only place that knows all of them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final, assert_never

from common.errors import SettingsError
from phone_host.printers.door import PrinterDoor
from phone_host.printers.file_door import FileDoor
from phone_host.printers.moonraker import Moonraker
from phone_host.printers.octoprint import OctoPrint
from phone_host.printers.printer_uri import FileUri, LineUri, PrinterUri, ServerKind, ServerUri, read_uri
from phone_host.printers.prusalink import PrusaLink
from phone_host.printers.sending import LineDoor
from phone_host.printers.server_door import ServerDoor

_MOST_KEY: Final = 200


def door_to(uri: PrinterUri, key: str = "") -> PrinterDoor:
    """Return the door to a printer. Nothing is opened yet.

    Args:
        uri: where it is.
        key: of its server; empty: none.
    """
    match uri:
        case LineUri():
            return LineDoor(uri)
        case FileUri():
            return FileDoor(Path(uri.path))
        case ServerUri():
            match uri.kind:
                case ServerKind.OCTOPRINT:
                    return ServerDoor(OctoPrint(uri, key))
                case ServerKind.MOONRAKER:
                    return ServerDoor(Moonraker(uri, key))
                case ServerKind.PRUSALINK:
                    return ServerDoor(PrusaLink(uri, key))
                case _:
                    assert_never(uri.kind)
        case _:
            assert_never(uri)


def key_of(uri: PrinterUri, table: object, file: Path | None) -> str:
    """Return the key that the settings file has for a printer; empty: it has none.

    Args:
        uri: where the printer is.
        table: [printers] of the settings file: keys by address.
        file: its name, for messages.

    Raises:
        SettingsError: the table is none, or holds what is no address or no key. No key is shown.
    """
    if not isinstance(table, Mapping):
        raise SettingsError(
            f"printers in {file} is no table", 'write [printers], and below it "octoprint://HOST" = "KEY"'
        )
    found = ""
    for name, value in table.items():
        try:
            there = read_uri(str(name))
        except SettingsError:
            there = None
        if not isinstance(there, ServerUri):
            raise SettingsError(
                f"{str(name)!r} in [printers] of {file} is no printer's server", 'write "octoprint://HOST" = "KEY"'
            )
        is_key = isinstance(value, str) and 0 < len(value) <= _MOST_KEY and value.isascii() and value.isprintable()
        if not is_key:
            raise SettingsError(f"the key of {name} in [printers] of {file} is none", "write it as a text, in quotes")
        if isinstance(uri, ServerUri) and _place(there) == _place(uri):
            found = value
    return found


def _place(uri: ServerUri) -> tuple[ServerKind, str, int]:
    return uri.kind, uri.host.lower(), uri.port
