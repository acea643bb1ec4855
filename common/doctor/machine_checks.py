"""Judges a machine's disk, power, USB trouble, clocks and Bluetooth from readings. Pure."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from common.diagnostic import Diagnostic
from common.doctor.finding import fail, ok, warn
from common.words import times

LOG_UNREADABLE: Final = "the kernel's log may not be read"
_MB: Final = 1_000_000

_LITTLE_BYTES: Final = 50 * _MB
"""A day's journal of a board in trouble, or ten saved pairs with their point clouds."""

_COARSE_NS: Final = 100_000
"""A clock with longer steps than this (jiffies: 1 to 10 ms) cannot tell which frames belong together."""

_UNDER_VOLTAGE: Final = re.compile(
    r"under-?voltage detected", re.IGNORECASE
)  # Raspberry Pi: rpi_volt, raspberrypi-firmware
_OVER_CURRENT: Final = re.compile(r"over-?current (change|condition)", re.IGNORECASE)  # usb hub.c
_USB_ERROR: Final = re.compile(
    r"usb \S+: (reset \S+ USB device|device descriptor read/\S+ error|device not accepting address|can't set config)"
    r"|unable to enumerate USB device|Non-zero status \(-\d+\) in video completion"
)
"""Messages of the kernel's hub.c and uvc_video.c when cable, supply or hub fail."""

_USB_DISCONNECT: Final = re.compile(r"usb \S+: USB disconnect")

_THROTTLED_NOW, _THROTTLED_BEFORE = 1 << 0, 1 << 16
"""Under-voltage bits of the Raspberry Pi firmware's get_throttled."""


@dataclass(frozen=True, slots=True)
class Disk:
    """A file system.

    Attributes:
        path: the path that was queried.
        free_bytes: free for users other than root.
        free_files: free inodes; also 0 if the file system does not count them.
        counts_files: whether it counts inodes.
        read_only: whether it is mounted read-only.
    """

    path: str
    free_bytes: int
    free_files: int
    counts_files: bool
    read_only: bool


@dataclass(frozen=True, slots=True)
class LogLine:
    """A line of the kernel's log.

    Attributes:
        age_s: its age, s.
        text: its text, without the stamp.
    """

    age_s: float
    text: str


@dataclass(frozen=True, slots=True)
class KernelLog:
    """The kernel's log of this boot.

    Attributes:
        readable: whether it could be read.
        lines: oldest first.
    """

    readable: bool
    lines: tuple[LogLine, ...] = ()


@dataclass(frozen=True, slots=True)
class Supply:
    """What a board's firmware says about its power supply.

    Attributes:
        sensor: where the firmware says so; empty for boards that do not.
        low_now: whether the voltage is too low now.
        low_before: whether it was too low at any time since the boot.
    """

    sensor: str = ""
    low_now: bool = False
    low_before: bool = False


@dataclass(frozen=True, slots=True)
class Clocks:
    """The machine's clocks.

    Attributes:
        date_s: the date, seconds since 1970.
        program_s: when the newest file of this program was made, seconds since 1970. No true date can be earlier.
        synchronised: whether the kernel considers the date synchronised (adjtimex).
        source: the kernel's clock source.
        resolution_ns: step of CLOCK_MONOTONIC, ns.
    """

    date_s: float
    program_s: float
    synchronised: bool
    source: str
    resolution_ns: int


@dataclass(frozen=True, slots=True)
class Bluetooth:
    """What Bluetooth support there is.

    Attributes:
        in_python: whether this Python has Bluetooth sockets.
        adapters: names such as hci0.
        blocked: adapters that are switched off (rfkill).
    """

    in_python: bool
    adapters: tuple[str, ...]
    blocked: tuple[str, ...] = ()


def check_disk(disk: Disk) -> Diagnostic:
    """Judge a file system: space, inodes, and whether it is writable."""
    if disk.read_only:
        return warn(
            "disk",
            f"{disk.path} is read-only",
            "if that is not meant so, the card is failing: look for I/O errors in dmesg",
        )
    if disk.counts_files and disk.free_files == 0:
        return warn("disk", f"{disk.path} takes no further file (no inode is left)", "remove what is not needed")
    room = f"{disk.path} has {disk.free_bytes / _MB:.0f} MB free"
    if disk.free_bytes < _LITTLE_BYTES:
        return warn(
            "disk", room, "make room (journalctl --vacuum-size=20M, apt clean); frames go on, logs and results don't"
        )
    return ok("disk", room)


def throttled(bits: int, sensor: str) -> Supply:
    """Decode the Raspberry Pi firmware's get_throttled bits."""
    return Supply(sensor, bool(bits & _THROTTLED_NOW), bool(bits & _THROTTLED_BEFORE))


def check_power(log: KernelLog, supply: Supply) -> Diagnostic:
    """Judge the power supply from what the firmware says now and what the kernel has logged since the boot."""
    remedy = "a stronger supply and a shorter cable; the camera on a hub with its own supply"
    if supply.low_now:
        return fail("power", f"the supply's voltage is too low now ({supply.sensor})", remedy)
    low = _matching(log, _UNDER_VOLTAGE)
    if low:
        return warn("power", f"under-voltage {_times(low)} in the kernel's log", remedy)
    if over := _matching(log, _OVER_CURRENT):
        return warn("power", f"USB over-current {_times(over)} in the kernel's log", remedy)
    if supply.low_before:
        return warn("power", f"the voltage was too low since the boot ({supply.sensor})", remedy)
    if not log.readable:
        return _unreadable("power")
    return ok("power", "no under-voltage in the kernel's log" + (f" nor in {supply.sensor}" if supply.sensor else ""))


def check_usb_log(log: KernelLog) -> Diagnostic:
    """Judge what the kernel has logged about USB devices since the boot."""
    if not log.readable:
        return _unreadable("usb-log")
    errors, pulled = _matching(log, _USB_ERROR), _matching(log, _USB_DISCONNECT)
    unplugged = f"; a device was unplugged {_times(pulled)}" if pulled else ""
    if errors:
        said = f"USB errors or resets {_times(errors)}; the last: {errors[-1].text}{unplugged}"
        return warn("usb-log", said, "another cable or port; a hub with its own supply; a shorter way")
    if pulled:
        return ok("usb-log", f"no USB error{unplugged}")
    return ok("usb-log", "no USB error since the boot")


def check_clocks(clocks: Clocks) -> list[Diagnostic]:
    """Judge the clocks. Only CLOCK_MONOTONIC matters for pairs; a wrong date affects nothing but the dates in the journal."""
    if clocks.resolution_ns > _COARSE_NS:
        step = f"CLOCK_MONOTONIC moves in steps of {clocks.resolution_ns / 1e6:g} ms (clock source {clocks.source})"
        steady = fail("clock", step, "boot a kernel with high-resolution timers; no pair can be told without")
    else:
        steady = ok(
            "clock", f"CLOCK_MONOTONIC runs in steps of {clocks.resolution_ns} ns (clock source {clocks.source})"
        )
    if clocks.date_s < clocks.program_s:
        date = warn(
            "date",
            "the date lies before this program was made: the machine has no clock of its own and met no time server",
            "does pairs no harm; for true dates in logs: timedatectl set-ntp true, and a network",
        )
    else:
        said = "synchronised" if clocks.synchronised else "not synchronised, which does pairs no harm"
        date = ok("date", f"the date is {said}")
    return [steady, date]


def check_bluetooth(bluetooth: Bluetooth, *, wanted: bool) -> Diagnostic:
    """Judge whether links over Bluetooth are possible."""
    usable = [name for name in bluetooth.adapters if name not in bluetooth.blocked]
    if not bluetooth.in_python:
        text, remedy = "this Python has no Bluetooth sockets", "use Debian's python3 (apt install python3)"
    elif not bluetooth.adapters:
        text, remedy = "no adapter was found", "plug one in; dmesg tells of one whose firmware is missing"
    elif not usable:
        text, remedy = f"{', '.join(bluetooth.adapters)} is switched off", "rfkill unblock bluetooth"
    else:
        return ok("bluetooth", f"adapter {', '.join(usable)}")
    return fail("bluetooth", text, remedy) if wanted else ok("bluetooth", f"{text}; no link asks for one")


def _unreadable(what: str) -> Diagnostic:
    return warn(what, LOG_UNREADABLE, "ask again as root: sudo")


def _matching(log: KernelLog, pattern: re.Pattern[str]) -> list[LogLine]:
    return [line for line in log.lines if pattern.search(line.text)]


def _times(lines: Sequence[LogLine]) -> str:
    count = times(len(lines))
    return f"{count}, {'' if len(lines) == 1 else 'the last '}{_ago(lines[-1].age_s)}"


def _ago(age_s: float) -> str:
    if age_s < 120:
        return f"{age_s:.0f} s ago"
    return f"{age_s / 60:.0f} min ago" if age_s < 7200 else f"{age_s / 3600:.0f} h ago"
