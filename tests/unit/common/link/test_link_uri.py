"""Link URIs: what they mean, and which are refused."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import SettingsError, UnavailableError
from common.keys import KeyFolder
from common.link.factory import LinkUri, needs_keys, open_link, open_links, parse_link
from common.link.zeromq_address import plain_endpoint
from common.peers import Peer


@given(
    port=st.integers(1, 65535),
    host=st.sampled_from(["127.0.0.1", "board.local", "[::1]", "*"]),
    listens=st.booleans(),
)
@settings(deadline=None)
def test_tcp_addresses(port: int, host: str, *, listens: bool) -> None:
    """Every port on every kind of host is taken as written. Without an option the role's default decides who listens."""
    address = f"tcp://{host}:{port}"
    assert parse_link(address, listens_by_default=listens) == LinkUri(address=address, listens=listens)
    assert parse_link(f"{address}?bind=1", listens_by_default=listens) == LinkUri(address=address, listens=True)
    assert parse_link(f"{address}?connect=1", listens_by_default=listens) == LinkUri(address=address, listens=False)


def test_ipc_addresses() -> None:
    """The path of an ipc link is everything up to the options."""
    assert parse_link("ipc:///tmp/a b", listens_by_default=True) == LinkUri(address="ipc:///tmp/a b", listens=True)
    assert parse_link("ipc://x?connect=1", listens_by_default=True) == LinkUri(address="ipc://x", listens=False)


def test_serial_ports() -> None:
    """A serial port is named by its path; its speed and which side acts as listener are options."""
    assert parse_link("serial:/dev/ttyGS0", listens_by_default=True) == LinkUri(
        address="serial:/dev/ttyGS0", listens=True
    )
    fast = parse_link("serial:/dev/ttyUSB0?baud=3000000&bind=1", listens_by_default=False)
    assert fast == LinkUri(address="serial:/dev/ttyUSB0", listens=True, baud=3_000_000)


def test_bluetooth_devices() -> None:
    """A Bluetooth device is named by address or name, with or without a channel; an option decides whether strangers are accepted."""
    for address in ("rfcomm://*", "rfcomm://*/1", "rfcomm://AA:BB:CC:DD:EE:FF/30", "rfcomm://my%20board"):
        assert parse_link(address, listens_by_default=True) == LinkUri(address=address, listens=True)
        assert parse_link(f"{address}?connect=1&unpaired=1", listens_by_default=True) == LinkUri(
            address=address, listens=False, unpaired=True
        )


@pytest.mark.parametrize(
    "uri",
    [
        "rfcomm:",
        "rfcomm://",
        "rfcomm:///1",
        "rfcomm://*/",
        "rfcomm://*/0",
        "rfcomm://*/31",
        "rfcomm://*/one",
        "rfcomm://AA:BB:CC:DD:EE:FF/1/2",
        "rfcomm://*?unpaired=0",
        "rfcomm://*?baud=9600",
        "tcp://host:5555?unpaired=1",
        "",
        "tcp",
        "tcp:",
        "tcp://",
        "tcp://host",
        "tcp://:5555",
        "tcp://host:",
        "tcp://host:0",
        "tcp://host:65536",
        "tcp://host:-1",
        "tcp://host:http",
        "tcp://[::1:5555",
        "ipc://",
        "ipc://?bind=1",
        "udp://host:5555",
        "TCP://host:5555",
        "tcp//host:5555",
        "tcp://host:5555?bind=0",
        "tcp://host:5555?bind",
        "tcp://host:5555?bind=1&connect=1",
        "tcp://host:5555?bond=1",
        "tcp://host:5555?insecure=0",
        "tcp://host:5555?insecure",
        "ipc://x?insecure=1",
        "serial:/dev/ttyS1?insecure=1",
        "ipc://x?timeout=3",
        "ipc://x?baud=9600",
        "serial:",
        "serial:?bind=1",
        "serial:/dev/ttyS1?baud=fast",
        "serial:/dev/ttyS1?baud=0",
        "serial:/dev/ttyS1?baud=-9600",
        "serial:/dev/ttyS1?baud=99999999999",
        "serial:/dev/ttyS1?speed=9600",
    ],
)
def test_bad_uris_are_named(uri: str) -> None:
    """What is no link URI is refused in one line that shows it and a remedy."""
    with pytest.raises(SettingsError) as caught:
        parse_link(uri, listens_by_default=True)
    assert repr(uri) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("address", ["tcp://*:5555", "tcp://127.0.0.1:5555/x", "ipc://" + "x" * 200])
def test_addresses_that_cannot_be_dialled_are_refused(address: str) -> None:
    """An address without a host, or one that the transport cannot take, is the user's mistake and reported at once."""
    with pytest.raises(SettingsError):
        open_link(LinkUri(address=address, listens=False))


@pytest.mark.parametrize(
    ("uri", "asks"),
    [
        ("tcp://*:5555", True),
        ("tcp://0.0.0.0:5555", True),
        ("tcp://192.168.7.2:5555", True),
        ("tcp://eth0:5555", True),
        ("tcp://board.local:5555", True),
        ("tcp://[fe80::1]:5555", True),
        ("tcp://localhost.example.org:5555", True),
        ("tcp://127.0.0.1;192.168.1.9:5555", True),
        ("tcp://127.0.0.1:5555", False),
        ("tcp://127.9.9.9:5555", False),
        ("tcp://localhost:5555", False),
        ("tcp://[::1]:5555", False),
        ("tcp://*:5555?insecure=1", False),
        ("ipc:///tmp/x", False),
        ("serial:/dev/ttyGS0", False),
    ],
)
def test_what_other_machines_can_reach_asks_for_keys(uri: str, *, asks: bool) -> None:
    """Beyond loopback tcp is for known keys only, unless the URI says insecure; what only this machine can reach is open."""
    assert needs_keys(parse_link(uri, listens_by_default=True)) is asks


@pytest.mark.parametrize(
    "links",
    [
        ("tcp://*:5555", "tcp://*:5556"),
        ("tcp://192.0.2.1:5555", "tcp://*:5556"),
        ("tcp://*:5555", "tcp://127.0.0.1:5556"),
        ("tcp://*:5555", "tcp://*:5556?insecure=1"),
        ("tcp://*:5556", "ipc:///tmp/x", "tcp://*:5555"),
    ],
)
def test_a_link_on_anothers_door_is_refused(links: tuple[str, ...], tmp_path: Path) -> None:
    """A board's link on the door's port of a secured one, at the same address, is the user's mistake: nothing is opened."""
    with pytest.raises(SettingsError) as caught:
        open_links([parse_link(uri, listens_by_default=True) for uri in links], KeyFolder(tmp_path / "k"), board=True)
    assert "takes in new hosts" in str(caught.value)
    assert not (tmp_path / "k").exists()


@pytest.mark.parametrize("listens", [True, False])
def test_without_keys_nothing_beyond_this_machine_is_opened(listens: bool) -> None:  # noqa: FBT001 - one of two values
    """A caller that forgets the keys cannot open a link to other machines: it is refused, and insecure=1 is named."""
    with pytest.raises(SettingsError, match="insecure=1"):
        open_link(LinkUri(address="tcp://192.0.2.1:5555", listens=listens))


def test_an_unknown_board_is_named_with_the_command_that_helps(tmp_path: Path) -> None:
    """Dialling a board that is no peer gives an error that says how to pair; with several peers it lists them."""
    keys = KeyFolder(tmp_path)
    with pytest.raises(UnavailableError, match=r"phone-host pair --link tcp://192\.0\.2\.1:5555"):
        open_link(LinkUri(address="tcp://192.0.2.1:5555", listens=False), keys)
    keys.add(Peer(name="bone", key="a" * 40, added="", address="tcp://192.0.2.2:5555"))
    keys.add(Peer(name="pi", key="b" * 40, added="", address="tcp://192.0.2.3:5555"))
    with pytest.raises(UnavailableError, match=r"bone at tcp://192\.0\.2\.2:5555, pi at"):
        open_link(LinkUri(address="tcp://192.0.2.1:5555", listens=False), keys)


@pytest.mark.parametrize("host", ["192.0.2.1", "no-such-host.invalid"])
def test_an_address_of_another_machine_cannot_be_listened_on(host: str) -> None:
    """Listening on an address that this machine does not have gives one message with the remedy (192.0.2.0/24 is nobody's, RFC 5737)."""
    uri = parse_link(f"tcp://{host}:5555?insecure=1", listens_by_default=True)
    with pytest.raises(UnavailableError, match=r" \([A-Za-z ]+\): give an address of this machine, or \* for all$"):
        open_link(uri)


@pytest.mark.parametrize(
    ("bound", "plain"),
    [
        ("tcp://[::ffff:192.168.7.2]:5555", "tcp://192.168.7.2:5555"),
        ("tcp://[::]:5555", "tcp://[::]:5555"),
        ("tcp://0.0.0.0:5555", "tcp://0.0.0.0:5555"),
        ("tcp://[fe80::1]:5555", "tcp://[fe80::1]:5555"),
    ],
)
def test_what_zeromq_has_bound_can_be_bound_by_others(bound: str, plain: str) -> None:
    """An IPv4 address on a dual-stack socket is given as IPv4, because the door behind it has an IPv4-only socket."""
    assert plain_endpoint(bound) == plain
