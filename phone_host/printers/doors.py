"""The doors to printers by their addresses, and the keys of those that want one. The only place that knows all of them."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final, assert_never

from common.byte_order_mark import without_mark
from common.errors import SettingsError, UnavailableError
from phone_host.output.atomic import write_bytes
from phone_host.printers.door import Ended, Job, Phase, PrinterDoor, Progress, Wishes
from phone_host.printers.gcode import passed_note
from phone_host.printers.moonraker import Moonraker
from phone_host.printers.octoprint import OctoPrint
from phone_host.printers.printer_uri import FileUri, LineUri, PrinterUri, ServerKind, ServerUri, read_uri
from phone_host.printers.prusalink import PrusaLink
from phone_host.printers.sending import LineDoor
from phone_host.printers.server_door import ServerDoor, ServerPatience

_MOST_KEY: Final = 200
_BUSY_KEY: Final = "max_busy_minutes"
_BUSY_MIN: Final = 60.0
_MAX_BUSY_MIN: Final = 100_000
_HOT = "its G-code leaves heaters on: the printer stays hot at the end"


class FileDoor:
    """A file for a printer: what `--printer file:OUT.gcode` means. See PrinterDoor.

    Args:
        path: of the file; there must be none yet.
    """

    leaving_s = 0.0

    def __init__(self, path: Path) -> None:
        self._path = path

    def require_ready(self) -> None:
        """See PrinterDoor."""
        if self._path.exists():
            raise SettingsError(f"{self._path} exists", "give a new name, or remove it")
        if not self._path.parent.is_dir():
            raise SettingsError(f"{self._path.parent} is no folder", "make it, or give another name")

    def send(self, job: Job, wishes: Wishes, tell: Callable[[Progress], None]) -> Ended:
        """See PrinterDoor."""
        del wishes
        self.require_ready()
        tell(Progress(phase=Phase.SENDING))
        try:
            write_bytes(self._path, without_mark(job.gcode.read_bytes()))
        except OSError as error:
            raise UnavailableError(
                f"{self._path} cannot be written ({error.strerror})", "make room on the disk, or give another name"
            ) from None
        notes = (_HOT,) * job.facts.leaves_hot + passed_note(job.facts.host_commands, "whoever prints the file")
        return Ended(phase=Phase.DONE, share=1.0, notes=notes)


def door_to(
    uri: PrinterUri, key: str = "", max_busy_s: float = 3600.0, patience: ServerPatience | None = None
) -> PrinterDoor:
    """Return the door to a printer. Nothing is opened yet.

    Args:
        uri: where it is.
        key: of its server; empty: none.
        max_busy_s: the longest time that a printer on a line may take for one line of the print, s.
        patience: how long a server is waited for; None: as long as usual.
    """
    match uri:
        case LineUri():
            return LineDoor(uri, max_busy_s)
        case FileUri():
            return FileDoor(Path(uri.path))
        case ServerUri():
            match uri.kind:
                case ServerKind.OCTOPRINT:
                    return ServerDoor(OctoPrint(uri, key), patience)
                case ServerKind.MOONRAKER:
                    return ServerDoor(Moonraker(uri, key), patience)
                case ServerKind.PRUSALINK:
                    return ServerDoor(PrusaLink(uri, key), patience)
                case _:
                    assert_never(uri.kind)
        case _:
            assert_never(uri)


def configured_door(uri: PrinterUri, table: object, file: Path) -> PrinterDoor:
    """Return the door to a printer, with what the settings file says of it. Nothing is opened yet.

    Raises:
        SettingsError: see `key_of`; or the longest time for a line is no number of minutes.
    """
    key = key_of(uri, table, file)
    minutes = table.get(_BUSY_KEY, _BUSY_MIN) if isinstance(table, Mapping) else _BUSY_MIN
    if type(minutes) not in {int, float} or not 0 < minutes <= _MAX_BUSY_MIN:
        raise SettingsError(
            f"{_BUSY_KEY} in [printers] of {file} is {minutes!r}", f"give minutes, above 0 and up to {_MAX_BUSY_MIN}"
        )
    return door_to(uri, key, minutes * 60.0)


def key_of(uri: PrinterUri, table: object, file: Path | None) -> str:
    """Return the key that the settings file has for a printer; empty: it has none.

    Raises:
        SettingsError: the table is none, or holds what is no address or no key. No key is shown.
    """
    if not isinstance(table, Mapping):
        raise SettingsError(
            f"printers in {file} is no table", 'write [printers], and below it "octoprint://HOST" = "KEY"'
        )
    found = ""
    for name, value in table.items():
        if name == _BUSY_KEY:
            continue
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
