"""Judges a phone as a host: what Android keeps from Termux, and what stands in for it. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass

from common.diagnostic import Diagnostic
from common.doctor.finding import fail, ok
from common.doctor.network_checks import CABLE_BOARD, Card

_CABLE = CABLE_BOARD.rpartition(".")[0] + "."


@dataclass(frozen=True, slots=True, kw_only=True)
class Phone:
    """What a phone says of itself; an empty text where it does not.

    Attributes:
        model: maker and name.
        android: version.
        termux: version of the app, with the shop that it came from.
        processor: architecture.
    """

    model: str
    android: str
    termux: str
    processor: str


def check_phone(phone: Phone) -> Diagnostic:
    """Name the phone: whoever reads a pasted report wants to know."""
    android = f"Android {phone.android or '(of a version that it does not say)'}"
    termux = f"Termux {phone.termux}" if phone.termux else "not in Termux"
    return ok("phone", f"{phone.model or 'unnamed'}, {android}, {termux}, {phone.processor}")


def check_camera(uri: str = "") -> Diagnostic:
    """Say which camera there is instead of the kernel's, which Android shows to no app."""
    stead = "the page's browser is the camera, or an MJPEG app (--camera http:)"
    if uri:
        return fail("camera", f"{uri}: Android shows no camera to Termux", stead)
    return ok("camera", f"Android shows none to Termux: {stead}")


def check_usb(cards: Sequence[Card], serial_links: Sequence[str]) -> Diagnostic:
    """Say what a USB cable can carry, and whether one does."""
    if serial_links:
        problem = f"{serial_links[0]}: Android gives no app a serial port (without root)"
        return fail("usb", problem, f"use the cable as a network: --link tcp://{CABLE_BOARD}:5555")
    cable = [card for card in cards if card.address.startswith(_CABLE)]
    if cable:
        return ok("usb", f"Ethernet over USB: {cable[0].name} is {cable[0].address}, on the board's cable")
    return ok("usb", f"means Ethernet over USB here (tcp://{CABLE_BOARD}:5555); no board is on a cable now")


def check_bluetooth(links: Sequence[str]) -> Diagnostic:
    """Say that Bluetooth needs another host."""
    problem = "Android gives Termux no Bluetooth: that needs a laptop as the host"
    if not links:
        return ok("bluetooth", f"{problem}; no link asks for it")
    return fail(
        "bluetooth", f"{links[0]}: {problem}", "use the USB cable, the phone's hotspot or the board's own Wi-Fi"
    )
