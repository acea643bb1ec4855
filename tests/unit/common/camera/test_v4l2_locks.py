"""A V4L2 camera's locks and identity: conversions, an order that a driver accepts, and what sysfs says."""

import errno
import os
from pathlib import Path
from typing import cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.camera import v4l2_abi as abi
from common.camera.v4l2_controls import Axis, Control, ControlWishes, to_axis, to_locks
from common.camera.v4l2_device import Device, serial_number
from common.camera.v4l2_open_controls import OpenControls
from common.camera.v4l2_stamps import Tally
from common.camera_identity import Lock
from tests.support.samples import control


@given(st.sampled_from(Lock), st.integers(1, 2**31 - 1))
def test_a_lock_is_the_value_of_its_control(lock: Lock, value: int) -> None:
    """An exposure is rounded to the control's 100 us; everything else stays as it is."""
    ((back, held),) = to_locks((to_axis(lock, value),))
    assert back is lock
    assert abs(held - value) <= (100 if lock is Lock.EXPOSURE else 0)


def test_gain_is_no_lock() -> None:
    """In other light than that of the calibration it makes up for the held exposure."""
    assert to_locks(((Axis.GAIN, 3), (Axis.FOCUS, 20), (Axis.EXPOSURE, 156))) == (
        (Lock.EXPOSURE, 15_600),
        (Lock.FOCUS, 20),
    )


def integer(control_id: int, low: int, high: int, step: int = 1, flags: int = 0) -> Control:
    """An integer control."""
    return control(control_id, f"{control_id:x}", abi.CTRL_TYPE_INTEGER, (low, high, step, low), flags=flags)  # fmt: skip


def switch(control_id: int) -> Control:
    """A switch that is on."""
    return control(control_id, f"{control_id:x}", abi.CTRL_TYPE_BOOLEAN, (0, 1, 1, 1))


class Driver:
    """A kernel driver in memory: a focus that is refused while it is automatic, a zoom, a read-only white balance; events it has none.

    It stands for the kernel behind `Device`, which tests/vm has in earnest.
    """

    path = Path("/dev/video9")

    def __init__(self) -> None:
        self.values = {
            abi.CID_FOCUS_AUTOMATIC_CONTINUOUS: 1,
            abi.CID_FOCUS_ABSOLUTE: 45,
            abi.CID_ZOOM_ABSOLUTE: 100,
            abi.CID_WHITE_BALANCE_TEMPERATURE: 4600,
        }
        self.gone = False

    def controls(self) -> tuple[Control, ...]:
        """What it has."""
        return (
            switch(abi.CID_FOCUS_AUTOMATIC_CONTINUOUS),
            integer(abi.CID_FOCUS_ABSOLUTE, 0, 250, 5),
            integer(abi.CID_ZOOM_ABSOLUTE, 100, 500),
            integer(abi.CID_WHITE_BALANCE_TEMPERATURE, 2800, 6500, 1, abi.CTRL_FLAG_READ_ONLY),
        )

    def control(self, control_id: int) -> int:
        """Read a control."""
        if self.gone:
            raise OSError(errno.ENODEV, os.strerror(errno.ENODEV))
        return self.values[control_id]

    def set_control(self, control_id: int, value: int) -> None:
        """Set a control, unless its automatic mode rules it."""
        if self.gone:
            raise OSError(errno.ENODEV, os.strerror(errno.ENODEV))
        if control_id == abi.CID_FOCUS_ABSOLUTE and self.values[abi.CID_FOCUS_AUTOMATIC_CONTINUOUS]:
            raise OSError(errno.EACCES, os.strerror(errno.EACCES))
        self.values[control_id] = value

    def watch_control(self, _: int) -> bool:
        """It reports no changes."""
        return False


def open_controls(wishes: ControlWishes | None = None) -> tuple[Driver, OpenControls, Tally]:
    """The controls of a camera with that driver."""
    driver, tally = Driver(), Tally()
    return driver, OpenControls(cast("Device", driver), wishes or ControlWishes(), tally), tally


def test_what_can_be_locked_is_what_can_be_set_and_read() -> None:
    """The hello names focus and zoom with their present values, not the white balance that is read-only nor the exposure that is missing."""
    _, controls, _ = open_controls()
    assert to_locks(controls.lockable()) == ((Lock.FOCUS, 45), (Lock.ZOOM, 100))
    assert controls.held == ()


def test_a_lock_switches_the_automatic_mode_off_first() -> None:
    """The driver accepts everything, and what it reports afterwards is what is told: a value between two steps is fitted."""
    driver, controls, tally = open_controls()
    controls.hold((to_axis(Lock.FOCUS, 23), to_axis(Lock.ZOOM, 900)))
    assert tally.refused == 0
    assert driver.values[abi.CID_FOCUS_AUTOMATIC_CONTINUOUS] == 0
    assert to_locks(controls.held) == ((Lock.FOCUS, 25), (Lock.ZOOM, 500))


def test_what_the_camera_lacks_is_not_held() -> None:
    """A control that is missing is left out; one that cannot be set is told with the value that it has."""
    _, controls, _ = open_controls()
    controls.hold((to_axis(Lock.EXPOSURE, 10_000), to_axis(Lock.WHITE_BALANCE, 3000), to_axis(Lock.FOCUS, 20)))
    assert to_locks(controls.held) == ((Lock.WHITE_BALANCE, 4600), (Lock.FOCUS, 20))


def test_what_is_held_at_the_start_or_as_found_is_told_too() -> None:
    """A `focus=30` of the address, and the zoom that was found when the automatic modes had settled."""
    wishes = ControlWishes(held=((Axis.FOCUS, 30),))
    _, controls, _ = open_controls(wishes)
    assert to_locks(controls.held) == ((Lock.FOCUS, 30),)
    controls.lock(wishes)
    assert to_locks(controls.held) == ((Lock.WHITE_BALANCE, 4600), (Lock.FOCUS, 30), (Lock.ZOOM, 100))


def test_a_camera_that_is_gone_says_so() -> None:
    """Setting a lock notices it, as every other access does."""
    driver, controls, _ = open_controls()
    driver.gone = True
    with pytest.raises(OSError, match="device"):
        controls.hold((to_axis(Lock.FOCUS, 20),))


def sysfs(folder: Path, device: dict[str, str]) -> Path:
    """A class folder with `video0`, the first interface of a device with these files."""
    port = folder / "devices" / "usb1" / "1-1"
    (port / "1-1:1.0").mkdir(parents=True)
    for name, text in device.items():
        (port / name).write_text(text)
    node = folder / "class" / "video0"
    node.mkdir(parents=True)
    (node / "device").symlink_to(port / "1-1:1.0")
    return folder / "class"


@pytest.mark.parametrize(
    ("device", "serial"),
    [
        ({"idVendor": "046d\n", "serial": "A1B2C3\n"}, "A1B2C3"),
        ({"idVendor": "046d\n"}, ""),
        ({"serial": "of something else\n"}, ""),
        ({"idVendor": "046d\n", "serial": "caf\u00e9 1\n"}, "caf\u00e9 1"),
    ],
)
def test_the_serial_number_is_the_usb_devices(device: dict[str, str], serial: str, tmp_path: Path) -> None:
    """A camera without one, and a device that is not on a USB bus, have none."""
    assert serial_number(Path("/dev/video0"), sysfs(tmp_path, device)) == serial
    assert serial_number(Path("/dev/video1"), tmp_path / "class") == ""
