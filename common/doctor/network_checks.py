"""Judges the way between board and host from readings: does a network card have the address, does a cable carry, in which network is the other side? Pure."""

import ipaddress
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from common.diagnostic import Diagnostic
from common.doctor.finding import fail, ok, warn

CABLE_BOARD: Final = "192.168.7.2"
"""The board's end of its USB cable (deploy/board/usb-gadget, and the BeagleBone's own images)."""

ACCESS_POINT: Final = "10.42.0.1"
"""A board that is its own Wi-Fi: the address that NetworkManager gives to a shared connection."""

_SAME_NETWORK: Final = 24
"""Cable, hotspot and access point are networks of 256 addresses."""


@dataclass(frozen=True, slots=True)
class Card:
    """A network card with an address.

    Attributes:
        name: such as usb0.
        address: IPv4.
        is_up: whether something is at its other end; None: the system does not say.
    """

    name: str
    address: str
    is_up: bool | None


def check_listening(host: str, port: int, cards: Sequence[Card], *, has_device_socket: bool) -> Diagnostic:
    """Judge an address where this side waits: can the other one reach it?

    Args:
        host: the address, or `*` for all.
        port: of the link.
        cards: this machine's, without loopback.
        has_device_socket: whether this machine can be a device on a USB cable.
    """
    there = [card for card in cards if host in {"*", card.address}]
    alive = [card for card in there if card.is_up is not False]
    if alive:
        named = ", ".join(f"tcp://{card.address}:{port} ({card.name})" for card in alive)
        return ok("network", f"the other side reaches it at {named}")
    if there:
        text = f"{', '.join(card.name for card in there)} has its address, but nothing at its other end"
        return warn("network", text, "plug the cable in, or join the Wi-Fi; a phone needs an OTG adapter for the cable")
    if host == "*":
        return warn("network", "no network card has an address", "plug the cable in, or join a network")
    if host != CABLE_BOARD:
        return fail("network", f"no network card has the address {host}", "give an address of this machine, or *")
    if has_device_socket:
        return fail("network", f"no network card has {host}", "sudo systemctl enable --now board-gadget")
    return fail(
        "network",
        f"no network card has {host}: this board has no USB device socket",
        "take the phone's hotspot or the board's own Wi-Fi, with link tcp://*:5555",
    )


def check_dialling(host: str, own: str) -> Diagnostic:
    """Judge an address that this side dials: is this machine in that network?

    Args:
        host: IPv4 address of the other side.
        own: address from which the kernel would go there; empty: there is no way.
    """
    if own and _are_near(host, own):
        return ok("network", f"{host} is in a network of this machine, which is {own} there")
    remedy = {
        CABLE_BOARD: "plug the board's small USB socket in (a phone: by an OTG adapter); there: sudo board-agent doctor",
        ACCESS_POINT: "join the board's Wi-Fi, stay although it has no internet, and switch mobile data off",
    }.get(host, "join the network that the board is in; sudo board-agent doctor there names its addresses")
    if not own:
        return fail("network", f"no network leads to {host}", remedy)
    if host in {CABLE_BOARD, ACCESS_POINT}:
        return fail("network", f"{host} is in no network of this machine ({own} would go elsewhere)", remedy)
    return ok("network", f"{host} is in another network, which {own} may reach through its router")


def _are_near(one: str, other: str) -> bool:
    return ipaddress.ip_address(other) in ipaddress.ip_network(f"{one}/{_SAME_NETWORK}", strict=False)
