"""What announces itself on the network (mDNS): boards, and whatever else is asked for.

This module needs zeroconf, which is optional: `discovery` works without this module.
"""

import ipaddress
import threading
from collections.abc import Sequence
from contextlib import closing

from zeroconf import ServiceBrowser, ServiceStateChange, Zeroconf

from phone_host.discovery.found import LISTEN_S, SERVICE, Announcement, Found


def announced() -> list[Found]:
    """Listen for boards that announce themselves. Return them sorted by name."""
    return [Found(each.name, f"tcp://{each.host}:{each.port}") for each in listen((SERVICE,))]


def listen(services: Sequence[str]) -> list[Announcement]:
    """Listen for services, for some seconds. Return what announces itself, sorted by service and name.

    Args:
        services: their types, such as `_http._tcp.local.`.
    """
    names: set[tuple[str, str]] = set()

    def heard(*, service_type: str, name: str, state_change: ServiceStateChange, **_: object) -> None:
        if state_change is ServiceStateChange.Added:
            names.add((service_type, name))

    try:
        network = Zeroconf()
    except OSError:  # no network at all
        threading.Event().wait(LISTEN_S)
        return []
    with closing(network):
        ServiceBrowser(network, list(services), handlers=[heard])
        threading.Event().wait(LISTEN_S)
        found = []
        for service, name in sorted(names):
            info = network.get_service_info(service, name, timeout=round(LISTEN_S * 1000))
            for address in info.parsed_addresses() if info else ():
                if info is not None and info.port and not _needs_scope(address):
                    host = f"[{address}]" if ":" in address else address
                    found.append(Announcement(service, name.removesuffix(f".{service}"), host, info.port))
                    break
    return found


def _needs_scope(address: str) -> bool:
    """Return whether an address needs the name of a network card, which a link cannot give."""
    read = ipaddress.ip_address(address.partition("%")[0])
    return read.version == 6 and read.is_link_local
