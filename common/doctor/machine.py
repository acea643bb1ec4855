"""Reads what the checks need from /sys, /proc, /dev and systemd. Nothing is decided here, and nothing is changed."""

import ctypes
import fcntl
import os
import pwd
import re
import shutil
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

from common import now
from common.doctor.access import Account, Holder, Node
from common.doctor.camera_checks import UsbBus, UsbCamera
from common.doctor.machine_checks import Bluetooth, Clocks, Disk, KernelLog, LogLine, Supply, throttled
from common.doctor.network_checks import Card
from common.doctor.unit_check import Unit
from common.groups import group_name
from common.places import nearest

_VIDEO_CLASS: Final = "0e"
_SIOCGIFADDR: Final = 0x8915
"""Asks for a network card's IPv4 address (netdevice(7))."""

_AT_ADDRESS: Final = slice(20, 24)
"""Where the answer, a struct ifreq, holds it: behind name, family and port."""

_RECORD_BYTES: Final = 8192
"""The longest record of /dev/kmsg (kernel, Documentation/ABI/testing/dev-kmsg: LOG_LINE_MAX and its dictionary)."""

_PATIENCE_S: Final = 10.0
_UNSYNCHRONISED: Final = 0x40
"""STA_UNSYNC of <linux/timex.h>."""


def read_text(path: Path) -> str:
    """Contents of a small file, without blanks at its ends; empty if it cannot be read."""
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""


def own_account() -> Account:
    """The user who asks."""
    uid = os.geteuid()
    with suppress(KeyError):
        return Account(pwd.getpwuid(uid).pw_name, uid, frozenset({os.getegid(), *os.getgroups()}), is_me=True)
    return Account(str(uid), uid, frozenset({os.getegid(), *os.getgroups()}), is_me=True)


def account_of(name: str) -> Account | None:
    """A user by name; None if there is none."""
    try:
        user = pwd.getpwnam(name)
    except KeyError:
        return None
    groups = frozenset(os.getgrouplist(name, user.pw_gid))
    return Account(name, user.pw_uid, groups, is_me=user.pw_uid == os.geteuid())


def read_node(path: Path) -> Node | None:
    """The device node behind a path; None if there is none."""
    try:
        real = path.resolve()
        state = real.stat()
    except OSError:
        return None
    group = group_name(state.st_gid) or str(state.st_gid)
    usable = os.access(real, os.R_OK | os.W_OK)
    return Node(
        path=str(real), uid=state.st_uid, gid=state.st_gid, group=group, mode=state.st_mode & 0o777, open_to_me=usable
    )


def holders_of(target: str) -> tuple[tuple[Holder, ...], bool]:
    """Processes that have a file, device or socket open.

    Args:
        target: what their descriptors link to: a path, or `socket:[INODE]`.

    Returns:
        The processes, and whether all processes of the machine could be inspected.
    """
    found, all_seen = [], True
    for process in _processes():
        try:
            descriptors = list((process / "fd").iterdir())
        except PermissionError:
            all_seen = False
            continue
        except OSError:
            continue  # it has just ended
        for descriptor in descriptors:
            with suppress(OSError):
                if str(descriptor.readlink()) == target:
                    found.append(_holder(process))
                    break
    return tuple(found), all_seen


def terminals_on(path: Path) -> tuple[Holder, ...]:
    """Processes whose controlling terminal is a device: a getty and what it started. Any user may read this."""
    try:
        number = path.stat().st_rdev
    except OSError:
        return ()
    found = []
    for process in _processes():
        fields = read_text(process / "stat").rpartition(")")[2].split()
        # proc(5): tty_nr is the fifth field after the name; minor in bits 31-20 and 7-0, major in 15-8.
        terminal = int(fields[4]) if len(fields) > 4 else 0
        minor = terminal >> 12 & 0xFFF00 | terminal & 0xFF
        if terminal and os.makedev(terminal >> 8 & 0xFFF, minor) == number:
            found.append(_holder(process))
    return tuple(found)


def is_console(path: Path) -> bool:
    """Whether the kernel's console writes to a serial port."""
    return path.name in read_text(Path("/sys/class/tty/console/active")).split()


def socket_targets(port: int | None, path: str = "") -> list[str]:
    """The link targets of the descriptors of listening sockets.

    Args:
        port: TCP port; None for a Unix socket.
        path: path of the Unix socket.
    """
    if port is None:
        rows = [line.split() for line in read_text(Path("/proc/net/unix")).splitlines()[1:]]
        return [f"socket:[{row[6]}]" for row in rows if len(row) > 7 and row[7] == path]
    rows = [line.split() for name in ("tcp", "tcp6") for line in read_text(Path("/proc/net", name)).splitlines()[1:]]
    listening = "0A"  # TCP_LISTEN, proc_net_tcp of the kernel's documentation
    return [f"socket:[{row[9]}]" for row in rows if row[3] == listening and int(row[1].rpartition(":")[2], 16) == port]


def read_usb_cameras() -> tuple[UsbCamera, ...]:
    """USB devices with a video interface, whether or not a kernel driver handles them."""
    found: dict[Path, bool] = {}
    for interface in sorted(Path("/sys/bus/usb/devices").glob("*:*")):
        if read_text(interface / "bInterfaceClass") == _VIDEO_CLASS:
            device = interface.resolve().parent
            found[device] = found.get(device, False) or (interface / "driver").exists()
    return tuple(UsbCamera(read_text(device / "product") or device.name, driven) for device, driven in found.items())


def read_usb_bus(node: Path) -> UsbBus | None:
    """How a camera's node is plugged in; None if it is not on USB."""
    device = _usb_device(node.resolve().name)
    if device is None:
        return None
    number = read_text(device / "busnum")
    on_bus = {
        other
        for entry in Path("/sys/class/video4linux").glob("video*")
        if (other := _usb_device(entry.name)) is not None and read_text(other / "busnum") == number
    }
    try:
        return UsbBus(device.name, float(read_text(device / "speed")), len(on_bus))
    except ValueError:
        return None


def read_kernel_log() -> KernelLog:
    """The kernel's log of this boot, from the kernel itself or otherwise from the journal."""
    try:
        fd = os.open("/dev/kmsg", os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError:
        return _journal_log()
    try:
        return KernelLog(readable=True, lines=tuple(_records(fd)))
    except PermissionError:  # everybody may open it, few may read it
        return _journal_log()
    finally:
        os.close(fd)


def read_supply() -> Supply:
    """What a Raspberry Pi's firmware says about its power supply; nothing on other boards."""
    bits = read_text(Path("/sys/devices/platform/soc/soc:firmware/get_throttled"))
    if re.fullmatch(r"(0x)?[0-9a-fA-F]+", bits):
        return throttled(int(bits, 16), "get_throttled")
    for sensor in sorted(Path("/sys/class/hwmon").glob("hwmon*")):
        if read_text(sensor / "name") == "rpi_volt" and (alarm := read_text(sensor / "in0_lcrit_alarm")):
            return Supply("rpi_volt", low_now=alarm != "0", low_before=alarm != "0")
    return Supply()


def read_disk(path: Path) -> Disk:
    """The file system of a folder, or of its nearest existing parent.

    Raises:
        OSError: there is no telling where the path leads.
    """
    there, _ = nearest(path)
    state = os.statvfs(there)
    return Disk(
        path=str(there),
        free_bytes=state.f_bavail * state.f_frsize,
        free_files=state.f_favail,
        counts_files=state.f_files > 0,
        read_only=bool(state.f_flag & os.ST_RDONLY),
    )


def read_clocks(program: Path) -> Clocks:
    """The machine's clocks."""
    newest_s = max((file.stat().st_mtime for file in program.glob("*.py")), default=0.0)
    source = Path("/sys/devices/system/clocksource/clocksource0/current_clocksource")
    return Clocks(
        date_s=time.time(),
        program_s=newest_s,
        synchronised=_synchronised(),
        source=read_text(source) or "unknown",
        resolution_ns=round(time.get_clock_info("monotonic").resolution * 1e9),
    )


def read_cards() -> tuple[Card, ...]:
    """The network cards that have an IPv4 address, without loopback; none where the system shows none."""
    found = []
    with suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        for _, name in socket.if_nameindex():
            with suppress(OSError):  # it has no address
                answer = fcntl.ioctl(asking, _SIOCGIFADDR, struct.pack("256s", name.encode()[:15]))
                address = socket.inet_ntoa(answer[_AT_ADDRESS])
                carrier = read_text(Path("/sys/class/net", name, "carrier"))
                if not address.startswith("127."):
                    found.append(Card(name, address, carrier == "1" if carrier else None))
    return tuple(found)


def read_way(host: str) -> tuple[str, str]:
    """The IPv4 address of another machine, and the one from which the kernel would go there; empty: unknown. No packet is sent.

    Args:
        host: name or address.
    """
    address = own = ""
    with suppress(OSError, UnicodeError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        address = socket.gethostbyname(host)
        asking.connect((address, 9))
        own = str(asking.getsockname()[0])
    return address, own


def read_property(name: str) -> str:
    """What an Android phone says of itself; empty where it does not.

    Args:
        name: of the property, such as ro.product.model.
    """
    return _output("getprop", name).strip()


def has_usb_device_socket() -> bool:
    """Whether this machine can be a device on a USB cable."""
    return any(Path("/sys/class/udc").glob("*"))


def read_bluetooth() -> Bluetooth:
    """What Bluetooth support there is."""
    adapters = sorted(entry for entry in Path("/sys/class/bluetooth").glob("hci*") if ":" not in entry.name)
    blocked = [
        adapter.name
        for adapter in adapters
        if any("1" in (read_text(switch / "soft"), read_text(switch / "hard")) for switch in adapter.glob("rfkill*"))
    ]
    return Bluetooth(hasattr(socket, "AF_BLUETOOTH"), tuple(item.name for item in adapters), tuple(blocked))


def read_unit(name: str) -> Unit:
    """A unit's state, if there is a systemd to ask."""
    if not Path("/run/systemd/system").is_dir():
        return Unit(name)
    wanted = (
        "LoadState",
        "ActiveState",
        "SubState",
        "UnitFileState",
        "Result",
        "NRestarts",
        "StatusText",
        "User",
        "MainPID",
    )
    shown = _output("systemctl", "show", name, "--property", ",".join(wanted))
    state = dict(line.partition("=")[::2] for line in shown.splitlines())
    if not state:
        return Unit(name)
    return Unit(
        name=name,
        load=state.get("LoadState", ""),
        active=state.get("ActiveState", ""),
        sub=state.get("SubState", ""),
        enabled=state.get("UnitFileState", ""),
        result=state.get("Result", ""),
        restarts=int(state.get("NRestarts") or 0),
        status=state.get("StatusText", ""),
        user=state.get("User", ""),
        pid=int(state.get("MainPID") or 0),
    )


class _Timex(ctypes.Structure):
    """The beginning of struct timex, up to its status; the rest is padding."""

    _fields_ = (
        ("modes", ctypes.c_uint),
        ("offset", ctypes.c_long),
        ("freq", ctypes.c_long),
        ("maxerror", ctypes.c_long),
        ("esterror", ctypes.c_long),
        ("status", ctypes.c_int),
        ("rest", ctypes.c_byte * 512),
    )


def _synchronised() -> bool:
    """Whether a time service keeps the date correct: adjtimex(2) that changes nothing needs no rights."""
    if sys.platform != "linux":
        return False
    state = _Timex()
    try:
        result = ctypes.CDLL(None).adjtimex(ctypes.byref(state))
    except (OSError, AttributeError):
        return False
    return bool(result >= 0 and not state.status & _UNSYNCHRONISED)


def _processes() -> Iterator[Path]:
    return (entry for entry in Path("/proc").iterdir() if entry.name.isdecimal())


def _holder(process: Path) -> Holder:
    return Holder(int(process.name), read_text(process / "comm") or "?")


def _usb_device(node: str) -> Path | None:
    """The USB device of a video node, by its name in /sys."""
    interface = Path("/sys/class/video4linux", node, "device")
    if not interface.exists():
        return None
    device = interface.resolve().parent
    return device if (device / "busnum").exists() else None


def _records(fd: int) -> Iterator[LogLine]:
    """The records now in /dev/kmsg: `priority,number,microseconds,flags;text`. Further lines belong to the first."""
    now_s = now.monotonic_ns() / 1e9
    while True:
        try:
            record = os.read(fd, _RECORD_BYTES)
        except BlockingIOError:
            return
        except BrokenPipeError:
            continue  # overwritten while being read; the next one is there
        head, _, text = record.decode("utf-8", "replace").partition(";")
        fields = head.split(",")
        if len(fields) >= 3 and fields[2].isdecimal():
            yield LogLine(max(0.0, now_s - int(fields[2]) / 1e6), text.partition("\n")[0])


def _journal_log() -> KernelLog:
    """The kernel's lines in the journal, for members of adm and systemd-journal: `[  12.345678] host kernel: text`."""
    shown = _output("journalctl", "--dmesg", "--boot", "--output", "short-monotonic", "--no-pager", "--quiet")
    found = re.findall(r"^\[\s*(\d+\.\d+)\] \S+ kernel: (.*)$", shown, re.MULTILINE)
    now_s = now.monotonic_ns() / 1e9
    return KernelLog(bool(found), tuple(LogLine(max(0.0, now_s - float(at)), text) for at, text in found))


def _output(program: str, *arguments: str) -> str:
    """A program's output; empty if it does not exist or fails."""
    found = shutil.which(program)
    if found is None:
        return ""
    try:
        done = subprocess.run(
            [found, *arguments], capture_output=True, text=True, errors="replace", check=False, timeout=_PATIENCE_S
        )
    except (OSError, subprocess.SubprocessError):
        return ""
    return done.stdout if done.returncode == 0 else ""
