"""Boards that announce themselves on the network (mDNS).

This module needs zeroconf, which is optional: `discovery` works without this module.
"""

import ipaddress
import threading
from contextlib import closing

from zeroconf import ServiceBrowser, ServiceStateChange, Zeroconf

from phone_host.boards.found import LISTEN_S, SERVICE, Found


def announced() -> list[Found]:
    """Listen for boards that announce themselves. Return them sorted by name."""
    names: set[str] = set()

    def heard(*, name: str, state_change: ServiceStateChange, **_: object) -> None:
        if state_change is ServiceStateChange.Added:
            names.add(name)

    try:
        network = Zeroconf()
    except OSError:  # no network at all
        threading.Event().wait(LISTEN_S)
        return []
    with closing(network):
        ServiceBrowser(network, SERVICE, handlers=[heard])
        threading.Event().wait(LISTEN_S)
        found = []
        for name in sorted(names):
            info = network.get_service_info(SERVICE, name, timeout=round(LISTEN_S * 1000))
            for address in info.parsed_addresses() if info else ():
                if info is not None and info.port and not _needs_scope(address):
                    host = f"[{address}]" if ":" in address else address
                    found.append(Found(name.removesuffix(f".{SERVICE}"), f"tcp://{host}:{info.port}"))
                    break
    return found


def _needs_scope(address: str) -> bool:
    """Return whether an address needs the name of a network card, which a link cannot give."""
    read = ipaddress.ip_address(address.partition("%")[0])
    return read.version == 6 and read.is_link_local
