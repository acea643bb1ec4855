"""Reads this machine's network for one link, and lets the checks judge. Sends nothing."""

import ipaddress
from contextlib import suppress
from typing import Final

from common.diagnostic import Diagnostic
from common.doctor import machine
from common.doctor.network_checks import check_dialling, check_listening
from common.link.uri import LinkUri, is_this_machine

_EVERYWHERE: Final = "*"


def examine_network(link: LinkUri) -> list[Diagnostic]:
    """Check the way of a tcp link to another machine; nothing is said of other links."""
    host, _, port = link.address.removeprefix("tcp://").rpartition(":")
    if not link.address.startswith("tcp://") or is_this_machine(host.strip("[]")) or ":" in host:
        return []
    if not link.listens:
        address, own = machine.read_way(host)
        return [check_dialling(address, own)] if address else []
    cards = machine.read_cards()
    address = next((card.address for card in cards if card.name == host), host)  # ZeroMQ takes a card's name, too
    if not _is_address(address):
        return []
    return [check_listening(address, int(port), cards, has_device_socket=machine.has_usb_device_socket())]


def _is_address(host: str) -> bool:
    if host == _EVERYWHERE:
        return True
    with suppress(ValueError):
        return ipaddress.ip_address(host).version == 4
    return False
