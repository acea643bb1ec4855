"""The doctor's verdicts about the way between board and host, and about a phone as the host."""

import sys

import pytest

from common.diagnostic import Severity
from common.doctor import machine
from common.doctor.network_checks import ACCESS_POINT, CABLE_BOARD, Card, check_dialling, check_listening
from common.doctor.network_probe import examine_network
from common.groups import group_name, group_of_one
from common.link.uri import parse_link
from phone_host.doctor.host_checks import Phone, check_bluetooth, check_camera, check_phone, check_usb

OK, WARN, FAIL = Severity.OK, Severity.WARN, Severity.FAIL
CABLE = Card("usb0", CABLE_BOARD, is_up=True)
PULLED = Card("usb0", CABLE_BOARD, is_up=False)
WIFI = Card("wlan0", "192.168.43.17", is_up=None)


@pytest.mark.parametrize(
    ("host", "cards", "socket", "verdict", "word"),
    [
        (CABLE_BOARD, (CABLE, WIFI), True, OK, "tcp://192.168.7.2:5555 (usb0)"),
        ("*", (PULLED, WIFI), True, OK, "tcp://192.168.43.17:5555 (wlan0)"),
        ("*", (CABLE, WIFI), True, OK, "192.168.7.2:5555 (usb0), tcp://192.168.43.17"),
        (CABLE_BOARD, (PULLED, WIFI), True, WARN, "OTG"),
        ("*", (), True, WARN, "join a network"),
        (CABLE_BOARD, (WIFI,), True, FAIL, "enable --now board-gadget"),
        (CABLE_BOARD, (WIFI,), False, FAIL, "hotspot"),
        ("10.1.2.3", (WIFI,), True, FAIL, "or *"),
    ],
)
def test_where_the_other_side_may_come(
    host: str, cards: tuple[Card, ...], *, socket: bool, verdict: Severity, word: str
) -> None:
    """Addresses of living cards are named to dial; a dead or missing one has the remedy of its way."""
    finding = check_listening(host, 5555, cards, has_device_socket=socket)
    assert finding.severity is verdict
    assert word in finding.message + finding.remedy


@pytest.mark.parametrize(
    ("host", "own", "verdict", "word"),
    [
        (CABLE_BOARD, "192.168.7.1", OK, "192.168.7.1"),
        (CABLE_BOARD, "100.64.0.9", FAIL, "OTG"),
        (CABLE_BOARD, "", FAIL, "OTG"),
        (ACCESS_POINT, "10.42.0.77", OK, "10.42.0.77"),
        (ACCESS_POINT, "100.64.0.9", FAIL, "mobile data"),
        ("192.168.43.17", "192.168.43.1", OK, "in a network"),
        ("192.168.43.17", "", FAIL, "names its addresses"),
        ("10.9.8.7", "192.168.1.4", OK, "router"),
    ],
)
def test_where_this_side_goes(host: str, own: str, verdict: Severity, word: str) -> None:
    """The cable and the board's Wi-Fi must be networks of this machine; others may lie behind a router."""
    finding = check_dialling(host, own)
    assert finding.severity is verdict
    assert word in finding.message + finding.remedy


def test_only_tcp_to_other_machines_is_looked_at() -> None:
    """Loopback, IPv6, other kinds of link and names that nobody knows get no finding; `*` gets one, and so does an address."""
    silent = ("tcp://127.0.0.1:5555", "ipc:///x", "tcp://[2001:db8::1]:5555", "serial:/dev/x", "tcp://nocard9:5555")
    for uri in silent:
        assert examine_network(parse_link(uri, listens_by_default=True)) == []
    for uri in ("tcp://*:5555", "tcp://192.0.2.77:5555"):
        assert [item.code for item in examine_network(parse_link(uri, listens_by_default=True))] == ["network"]
    assert len(examine_network(parse_link("tcp://192.0.2.77:5555", listens_by_default=False))) == 1


def test_every_card_with_an_address_is_read() -> None:
    """What the doctor reads is what the kernel would go by, loopback aside."""
    addresses = {card.address for card in machine.read_cards()}
    assert machine.read_way("127.0.0.1") == ("127.0.0.1", "127.0.0.1")
    assert not any(address.startswith("127.") for address in addresses)
    own = machine.read_way("192.0.2.77")[1]
    assert not own or own in addresses


def test_a_phone_is_told_what_android_keeps_from_it() -> None:
    """USB is Ethernet, Bluetooth is a laptop's, the camera is the browser's; links that cannot be fail with another way."""
    named = check_phone(Phone(model="Acme One", android="15", termux="0.119 F_DROID", processor="aarch64")).message
    assert named == "Acme One, Android 15, Termux 0.119 F_DROID, aarch64"
    assert "not in Termux" in check_phone(Phone(model="", android="", termux="", processor="armv8l")).message
    assert "browser" in check_camera().message
    assert check_camera("v4l2:auto").severity is FAIL
    assert "Ethernet over USB" in check_usb((), ()).message
    assert "usb0 is 192.168.7.1" in check_usb((Card("usb0", "192.168.7.1", is_up=None),), ()).message
    assert check_usb((), ("serial:/dev/ttyACM0",)).severity is FAIL
    assert (check_bluetooth(()).severity, check_bluetooth(("rfcomm://x",)).severity) == (OK, FAIL)
    assert "needs a laptop" in check_bluetooth(()).message


def test_groups_without_names(monkeypatch: pytest.MonkeyPatch) -> None:
    """A number without a name has none, and so has every group where Python lacks the module."""
    assert (group_name(0), group_name(4_000_000_000)) == ("root", "")
    monkeypatch.setitem(sys.modules, "grp", None)
    assert (group_name(0), group_of_one(0)) == ("", "")
