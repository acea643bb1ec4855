"""The host's udev rule for one board on a USB cable, made from what the kernel knows of the board plugged in now.

The rule gives names (/dev/tandemscan-board, tandemscan0) to the device with a given vendor, product and serial number.
It authenticates nobody: any device can claim these three. They come from the device, so the rule accepts only a plain
set of characters.
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from common.errors import DataError, MissingDeviceError, SettingsError, UnavailableError
from common.files import opened_folder, replacing_in

RULES: Final = Path("/etc/udev/rules.d/70-tandemscan.rules")

_OURS: Final = "tandemscan"
"""The manufacturer's name of the board's gadget (deploy/board/usb-gadget)."""

_ID: Final = re.compile(r"[0-9a-f]{4}")
_SERIAL: Final = re.compile(r"[0-9A-Za-z._:-]{1,126}")
"""A USB string descriptor holds at most 126 characters. `*?[|"\\` and blanks have a meaning for udev (udev(7))."""


@dataclass(frozen=True, slots=True, kw_only=True)
class UsbBoard:
    """A board on a USB cable.

    Attributes:
        device: name of its serial port, for example ttyACM0.
        vendor: four hexadecimal digits.
        product: four hexadecimal digits.
        serial: its serial number.
        manufacturer: its manufacturer's name.
    """

    device: str
    vendor: str
    product: str
    serial: str
    manufacturer: str


def find_usb_board(port: Path | None, sysfs: Path = Path("/sys")) -> UsbBoard:
    """Find the board that is plugged in.

    Args:
        port: its serial port; None: the only device with our manufacturer's name.
        sysfs: where the kernel lists its devices.

    Raises:
        MissingDeviceError: there is no board, or no USB device behind this port.
        SettingsError: there are several boards to choose from.
        DataError: its ids or serial number cannot be used in a rule.
    """
    if port is not None:
        found = _usb_device(sysfs / "class" / "tty" / port.resolve().name)
        if found is None:
            raise MissingDeviceError(
                f"{port} is not the port of a USB device", "plug the board in; ls /dev/serial/by-id shows what is there"
            )
        return _checked(found)
    ports = sorted((sysfs / "class" / "tty").glob("tty*"))
    ours = [board for board in map(_usb_device, ports) if board is not None and board.manufacturer == _OURS]
    if not ours:
        raise MissingDeviceError(
            "no board is on a USB cable",
            "plug it in (board-gadget.service runs there), or name its port: --link serial:/dev/ttyACM0",
        )
    if len({(board.vendor, board.product, board.serial) for board in ours}) > 1:
        listed = ", ".join(f"/dev/{board.device}" for board in ours)
        raise SettingsError(
            f"{len(ours)} boards are on USB cables ({listed})", f"choose one: --link serial:/dev/{ours[0].device}"
        )
    return _checked(ours[0])


def rule_text(board: UsbBoard) -> str:
    """Return the text of the rule."""
    known = (("idVendor", board.vendor), ("idProduct", board.product), ("serial", board.serial))
    own, above = (", ".join(f'{key}{{{name}}}=="{value}"' for name, value in known) for key in ("ATTR", "ATTRS"))
    return f"""# Written by `phone-host pair --udev` for the board on one USB cable; it gives names to its serial port and its network card.
# It authenticates nobody: any device can claim these numbers. Another board: plug it in and run the command again.
SUBSYSTEM=="usb", ENV{{DEVTYPE}}=="usb_device", {own}, ENV{{ID_MM_DEVICE_IGNORE}}="1"
SUBSYSTEM=="tty", SUBSYSTEMS=="usb", {above}, SYMLINK+="tandemscan-board", TAG+="uaccess"
SUBSYSTEM=="net", ACTION=="add", SUBSYSTEMS=="usb", {above}, NAME="tandemscan0"
"""


def write_rule(board: UsbBoard, rules: Path = RULES) -> None:
    """Write the rule atomically. It replaces an earlier one.

    Raises:
        UnavailableError: the file cannot be written.
    """
    try:
        with opened_folder(rules.parent) as folder, replacing_in(folder, rules.name, mode=0o644) as file:
            file.write(rule_text(board).encode())
    except PermissionError:
        raise UnavailableError(
            f"{rules} can only be written by root", "run it with sudo: sudo phone-host pair --udev"
        ) from None
    except OSError as error:
        raise UnavailableError(f"{rules} cannot be written ({error.strerror})", "install udev, and make room") from None


def _usb_device(port: Path) -> UsbBoard | None:
    """Return the USB device of a port; None if the port has none."""
    for folder in (port / "device").resolve().parents:
        if (folder / "idVendor").is_file():
            return UsbBoard(
                device=port.name,
                vendor=_attribute(folder / "idVendor"),
                product=_attribute(folder / "idProduct"),
                serial=_attribute(folder / "serial"),
                manufacturer=_attribute(folder / "manufacturer"),
            )
    return None


def _attribute(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:  # a device without a serial number has none
        return ""


def _checked(board: UsbBoard) -> UsbBoard:
    if not (_ID.fullmatch(board.vendor) and _ID.fullmatch(board.product) and _SERIAL.fullmatch(board.serial)):
        raise DataError(
            f"/dev/{board.device} has the serial number {board.serial!r:.60}, which a udev rule cannot hold",
            "update the board's package, or name the device in a rule by hand",
        )
    return board
