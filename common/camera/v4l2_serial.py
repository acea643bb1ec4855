"""Reads a USB camera's serial number from sysfs. V4L2 itself does not tell it."""

from pathlib import Path
from typing import Final

_CLASS: Final = Path("/sys/class/video4linux")
_MOST_BYTES: Final = 1024
"""A USB string has at most 126 letters (USB 2.0, 9.6.7)."""


def serial_number(node: Path, folder: Path = _CLASS) -> str:
    """Return the serial number of the USB device behind a video node; empty if it has none, or is no USB device.

    Many cameras have none, and some models have the same in every camera.

    Args:
        node: the node or a link to it.
        folder: the class folder of video devices in sysfs; `NAME/device` in it is the USB interface, whose parent is the device.
    """
    try:
        device = (folder / node.resolve().name / "device").resolve().parent
        if not (device / "idVendor").exists():
            return ""
        with (device / "serial").open("rb") as file:
            return file.read(_MOST_BYTES).decode("utf-8", "replace").strip()
    except OSError:
        return ""
