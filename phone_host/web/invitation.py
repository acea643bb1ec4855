"""Tells a person on the terminal how other devices open the page."""

import io
import ipaddress
import socket
from collections.abc import Iterable
from contextlib import suppress
from typing import Final

from common.doctor.machine import read_cards
from common.errors import UnavailableError
from phone_host.web.settings import Credentials

_ANYWHERE: Final = (("192.0.2.1", socket.AF_INET), ("2001:db8::1", socket.AF_INET6))
"""Addresses for documentation (RFC 5737, 3849): nothing is ever sent there."""


def own_names() -> tuple[str, ...]:
    """Return the names and addresses by which this machine's network knows it, the likeliest first.

    The address of the way out is found by asking the kernel for the route; no packet is sent. A network without a way out, such as a
    board's own, is known by its card alone.
    """
    found: list[str] = []
    for address, family in _ANYWHERE:
        with suppress(OSError), socket.socket(family, socket.SOCK_DGRAM) as asking:
            asking.connect((address, 9))
            found.append(asking.getsockname()[0])
    found += [card.address for card in read_cards()]
    name = socket.gethostname().partition(".")[0].lower()
    with suppress(OSError, UnicodeError):
        found += [str(entry[4][0]) for entry in socket.getaddrinfo(name, None, type=socket.SOCK_STREAM)]
    addresses = [address for address in dict.fromkeys(found) if _is_of_network(address)]
    return (*addresses, *((name, f"{name}.local") if _is_name(name) else ()))


def qr_code(text: str) -> str:
    """Draw a QR code for a terminal, two modules a character, dark on light.

    Raises:
        UnavailableError: the package that draws it is missing.
    """
    try:
        import segno  # noqa: PLC0415 - only pages for other devices need it
    except ModuleNotFoundError as error:
        raise UnavailableError("the QR code needs the package segno", "install it: pip install segno") from error
    drawn = io.StringIO()
    segno.make(text, error="l").terminal(drawn, compact=True, border=2)
    return drawn.getvalue().rstrip("\n")


def invitation(urls: Iterable[str], credentials: Credentials) -> str:
    """Say how other devices open the page: the code to scan, what the browser will ask, and what to compare."""
    first, *others = urls
    again = "" if not others else "\nIf that does not open: " + "  ".join(others)
    new = (
        "\nThe certificate authority is new: a device that trusted an earlier one must trust this one."
        if credentials.is_new_authority
        else ""
    )
    return (
        f"{qr_code(first)}\nScan this with the phone, in the same network: {first}{again}\n"
        "The browser warns once that it does not know who made the certificate: choose Advanced, then Proceed. To be asked "
        "no more, open /api/authority.pem there and install it.\n"
        f"Its fingerprint (SHA-256) must be {credentials.fingerprint}{new}"
    )


def by_cable(port: int) -> str:
    """Say how a phone on a USB cable opens the page of this machine without any certificate."""
    return (
        f"By USB cable instead, with the phone's developer mode on: adb reverse tcp:{port} tcp:{port}, then open the page's "
        "first address (127.0.0.1) on the phone. Again after each time the cable was out."
    )


def _is_of_network(text: str) -> bool:
    address = ipaddress.ip_address(text.partition("%")[0])
    return not address.is_loopback and not address.is_link_local and not address.is_unspecified


def _is_name(name: str) -> bool:
    return name not in {"", "localhost"} and name.replace("-", "").isalnum() and name.isascii()
