"""The only reader of the operating system's clocks and of its boot id. Cores get `now_ns` as an argument instead."""

import os
import time
from pathlib import Path


def monotonic_ns() -> int:
    """Nanoseconds of CLOCK_MONOTONIC: never steps, the clock that V4L2 stamps with (a board without RTC has no other honest one)."""
    return time.monotonic_ns()


def wall_time() -> str:
    """Local wall time as ISO 8601 to the second, for reports only; nothing is ever computed from it."""
    return time.strftime("%Y-%m-%dT%H:%M:%S%z")


def boot_id() -> str:
    """Id of this boot of the machine: the life of its CLOCK_MONOTONIC.

    Where the kernel does not show one (Android hides /proc/sys), a random id is given: then a restart looks like a reboot, which is safe.
    """
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip().replace("-", "")
    except OSError:
        return os.urandom(16).hex()


def random_id() -> str:
    """A fresh id, 16 hexadecimal digits (64 random bits): names one life of a process."""
    return os.urandom(8).hex()
