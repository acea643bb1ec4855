"""Which printers are among the services that announce themselves in a network. Pure."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from phone_host.discovery.found import Announcement
from phone_host.printers.printer_uri import ServerKind

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
