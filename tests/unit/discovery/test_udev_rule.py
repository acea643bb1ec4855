"""The host's udev rule, from a file tree like the kernel's."""

import os
import re
import stat
from pathlib import Path

import pytest

from common.errors import DataError, MissingDeviceError, SettingsError, UnavailableError
from phone_host.discovery.udev_rule import find_usb_board, rule_text, write_rule


def plug(sysfs: Path, port: str, serial: str, manufacturer: str = "tandemscan", product: str = "0104") -> None:
    """A USB device with a serial port, as Documentation/ABI/stable/sysfs-bus-usb has it."""
    device = sysfs / "devices" / "pci0000:00" / "usb1" / port.replace("ttyACM", "1-")
    interface = device / "1-1:1.0"
    (interface / "tty" / port).mkdir(parents=True)
    values = {"idVendor": "1d6b", "idProduct": product, "serial": serial, "manufacturer": manufacturer}
    for name, value in values.items():
        (device / name).write_text(f"{value}\n")
    (interface / "tty" / port / "device").symlink_to("../..")
    (sysfs / "class" / "tty").mkdir(parents=True, exist_ok=True)
    (sysfs / "class" / "tty" / port).symlink_to(interface / "tty" / port)


@pytest.fixture
def sysfs(tmp_path: Path) -> Path:
    """A machine with a port that belongs to no USB device, and another maker's modem."""
    sysfs = tmp_path / "sys"
    (sysfs / "devices" / "platform" / "serial8250" / "tty" / "ttyS0").mkdir(parents=True)
    (sysfs / "class" / "tty").mkdir(parents=True)
    (sysfs / "class" / "tty" / "ttyS0").symlink_to(sysfs / "devices" / "platform" / "serial8250" / "tty" / "ttyS0")
    plug(sysfs, "ttyACM0", "8649", "Modems Inc", "0001")
    return sysfs


def test_the_only_board_is_found_and_named_by_its_three_numbers(sysfs: Path) -> None:
    """The rule has vendor, product and serial number in each of its lines, and nothing of other devices."""
    plug(sysfs, "ttyACM3", "0a1b2c3d4e5f")
    board = find_usb_board(None, sysfs)
    assert (board.device, board.vendor, board.product, board.serial) == ("ttyACM3", "1d6b", "0104", "0a1b2c3d4e5f")
    rules = [line for line in rule_text(board).splitlines() if not line.startswith("#")]
    assert len(rules) == 3
    for rule in rules:
        matched = re.findall(r'ATTRS?\{(\w+)\}=="([^"]*)"', rule)
        assert matched == [("idVendor", "1d6b"), ("idProduct", "0104"), ("serial", "0a1b2c3d4e5f")]
    assert "authenticates nobody" in rule_text(board)


def test_a_port_chooses_one_of_several(sysfs: Path) -> None:
    """Two boards give one line that names both and the option. With a port, even another maker's, the port's device is taken."""
    plug(sysfs, "ttyACM3", "aaa")
    plug(sysfs, "ttyACM4", "bbb")
    with pytest.raises(SettingsError, match=r"ttyACM3.*ttyACM4.*--link serial:"):
        find_usb_board(None, sysfs)
    assert find_usb_board(Path("/dev/ttyACM4"), sysfs).serial == "bbb"
    assert find_usb_board(Path("/dev/ttyACM0"), sysfs).serial == "8649"


@pytest.mark.parametrize("port", [None, Path("/dev/ttyACM9"), Path("/dev/ttyS0")])
def test_without_a_board_there_is_one_line(sysfs: Path, port: Path | None) -> None:
    """No board, a missing port and a port of no USB device: each error names it and the remedy."""
    with pytest.raises(MissingDeviceError, match="plug") as caught:
        find_usb_board(port, sysfs)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "serial",
    [
        "",
        "*",
        "a|b",
        "[0-9]",
        'x", RUN+="/bin/sh -c id',
        'x"\nRUN+="/bin/id',
        "a b",
        "x" * 127,
        "\u00e9",
        "%k",
        "$env{x}",
    ],
)
def test_a_serial_number_that_says_more_is_refused(sysfs: Path, serial: str) -> None:
    """A device whose serial number would act as a pattern or another rule gets no rule."""
    plug(sysfs, "ttyACM3", serial)
    with pytest.raises(DataError, match="ttyACM3"):
        find_usb_board(None, sysfs)


def test_the_rule_is_written_whole_for_all_to_read(sysfs: Path, tmp_path: Path) -> None:
    """The new rule replaces an earlier one. A link in its place is replaced, and its target is not touched."""
    plug(sysfs, "ttyACM3", "aaa")
    (tmp_path / "precious").write_text("precious")
    (tmp_path / "rules.d").mkdir()
    rules = tmp_path / "rules.d" / "70-tandemscan.rules"
    rules.symlink_to(tmp_path / "precious")
    for _ in range(2):
        write_rule(find_usb_board(None, sysfs), rules)
        assert rules.read_text() == rule_text(find_usb_board(None, sysfs))
        assert stat.S_IMODE(rules.lstat().st_mode) & 0o444 == 0o444
    assert (tmp_path / "precious").read_text() == "precious"
    assert [path.name for path in rules.parent.iterdir()] == [rules.name]
    with pytest.raises(UnavailableError, match="nowhere"):
        write_rule(find_usb_board(None, sysfs), tmp_path / "nowhere" / "x.rules")


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become somebody else")
def test_who_is_not_root_is_told_so(sysfs: Path) -> None:
    """The line names the file and sudo."""
    plug(sysfs, "ttyACM3", "aaa")
    board = find_usb_board(None, sysfs)
    os.seteuid(65534)
    try:
        with pytest.raises(UnavailableError, match=r"by root.*sudo"):
            write_rule(board, Path("/etc/70-tandemscan.rules"))
    finally:
        os.seteuid(0)
