"""A machine's disk, power, USB log, clocks and Bluetooth, judged from readings."""

import pytest

from common.diagnostic import Severity
from common.doctor.machine_checks import (
    Bluetooth,
    Clocks,
    Disk,
    KernelLog,
    LogLine,
    Supply,
    check_bluetooth,
    check_clocks,
    check_disk,
    check_power,
    check_usb_log,
    throttled,
)

OK, WARN, FAIL = Severity.OK, Severity.WARN, Severity.FAIL


def log(*texts: str) -> KernelLog:
    """A kernel log; the last line is 30 s old."""
    return KernelLog(readable=True, lines=tuple(LogLine(30.0 * (len(texts) - i), text) for i, text in enumerate(texts)))


@pytest.mark.parametrize(
    ("disk", "verdict"),
    [
        (Disk("/", 10**9, 1000, counts_files=True, read_only=False), OK),
        (Disk("/", 10**7, 1000, counts_files=True, read_only=False), WARN),
        (Disk("/", 10**9, 0, counts_files=True, read_only=False), WARN),
        (Disk("/", 10**9, 0, counts_files=False, read_only=False), OK),  # btrfs, vfat
        (Disk("/", 10**9, 1000, counts_files=True, read_only=True), WARN),
    ],
)
def test_a_full_or_read_only_disk_warns(disk: Disk, verdict: Severity) -> None:
    """Frames need no disk, so nothing here fails; the finding names what is short."""
    assert check_disk(disk).severity is verdict


@pytest.mark.parametrize(
    ("kernel", "supply", "verdict", "word"),
    [
        (log("usb 1-1: new high-speed USB device number 2"), Supply(), OK, "no under-voltage"),
        (log("hwmon hwmon1: Undervoltage detected!", "x"), Supply(), WARN, "once, 60 s ago"),
        (
            log("Under-voltage detected! (0x00050005)", "Undervoltage detected!"),
            Supply(),
            WARN,
            "twice, the last 30 s",
        ),
        (log("usb usb1-port1: over-current change #3"), Supply(), WARN, "over-current"),
        (log(), throttled(0x50005, "get_throttled"), FAIL, "too low now"),
        (log(), throttled(0x50000, "get_throttled"), WARN, "since the boot"),
        (log(), throttled(0, "get_throttled"), OK, "get_throttled"),
        (KernelLog(readable=False), Supply(), WARN, "may not be read"),
    ],
)
def test_power_is_judged_by_firmware_and_kernel_log(
    kernel: KernelLog, supply: Supply, verdict: Severity, word: str
) -> None:
    """Too low now fails; too low earlier warns with how often and when; what may not be read is reported as such."""
    finding = check_power(kernel, supply)
    assert finding.severity is verdict
    assert word in finding.message


@pytest.mark.parametrize(
    ("text", "verdict"),
    [
        ("usb 1-1: reset high-speed USB device number 3 using musb-hdrc", WARN),
        ("usb 1-1: device descriptor read/64, error -71", WARN),
        ("usb usb1-port1: unable to enumerate USB device", WARN),
        ("uvcvideo 1-1:1.1: Non-zero status (-71) in video completion handler.", WARN),
        ("usb 1-1: USB disconnect, device number 3", OK),
        ("eth0: link up", OK),
    ],
)
def test_usb_trouble_in_the_kernel_log_warns(text: str, verdict: Severity) -> None:
    """Resets and errors warn; unplugging a device is nobody's fault."""
    assert check_usb_log(log(text)).severity is verdict


def test_an_unplugged_device_is_told_beside_errors() -> None:
    """A camera that went away is often the cause of the error, or its end: both are told."""
    away, error = (
        LogLine(9, "usb 1-1: USB disconnect, device number 9"),
        LogLine(8, "usb 1-1: device not accepting address 10, error -71"),
    )
    finding = check_usb_log(KernelLog(readable=True, lines=(away, error)))
    assert finding.severity is WARN
    assert finding.message.endswith("error -71; a device was unplugged once, 9 s ago")


def test_clocks() -> None:
    """A coarse clock fails, a date before that of the program's own files warns, an unsynchronised clock is no fault."""
    good = Clocks(2e9, 1.7e9, synchronised=False, source="tsc", resolution_ns=1)
    assert [item.severity for item in check_clocks(good)] == [OK, OK]
    assert "not synchronised" in check_clocks(good)[1].message
    early = Clocks(3600.0, 1.7e9, synchronised=False, source="dmtimer", resolution_ns=42)
    assert [item.severity for item in check_clocks(early)] == [OK, WARN]
    coarse = Clocks(2e9, 1.7e9, synchronised=True, source="jiffies", resolution_ns=4_000_000)
    assert [item.severity for item in check_clocks(coarse)] == [FAIL, OK]


@pytest.mark.parametrize(
    ("bluetooth", "wanted", "verdict"),
    [
        (Bluetooth(in_python=True, adapters=("hci0",)), True, OK),
        (Bluetooth(in_python=True, adapters=("hci0",), blocked=("hci0",)), True, FAIL),
        (Bluetooth(in_python=True, adapters=()), True, FAIL),
        (Bluetooth(in_python=True, adapters=()), False, OK),
        (Bluetooth(in_python=False, adapters=("hci0",)), True, FAIL),
        (Bluetooth(in_python=False, adapters=("hci0",)), False, OK),
    ],
)
def test_bluetooth_fails_only_where_a_link_asks_for_it(
    bluetooth: Bluetooth, verdict: Severity, *, wanted: bool
) -> None:
    """Python's sockets, an adapter, and whether it is switched on."""
    assert check_bluetooth(bluetooth, wanted=wanted).severity is verdict


def test_a_log_that_may_not_be_read_is_no_all_clear() -> None:
    """Where only root may read the kernel's log, the USB check warns and says how to ask again."""
    finding = check_usb_log(KernelLog(readable=False))
    assert (finding.severity, finding.remedy) == (WARN, "ask again as root: sudo")


@pytest.mark.parametrize(
    ("age_s", "told"), [(119, "119 s ago"), (120, "2 min ago"), (7140, "119 min ago"), (7200, "2 h ago")]
)
def test_the_age_of_trouble_is_told_in_a_unit_that_people_read(age_s: float, told: str) -> None:
    """Seconds below two minutes, minutes below two hours, then hours."""
    trouble = LogLine(age_s, "usb 1-1: device descriptor read/64, error -71")
    assert f"once, {told}" in check_usb_log(KernelLog(readable=True, lines=(trouble,))).message
