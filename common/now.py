"""The only reader of the operating system's clocks and of its boot id. Cores get `now_ns` as an argument instead."""

import os
import time
from pathlib import Path
from typing import Final

_LEAST_SLEEP_NS: Final = 5_000_000
"""A shorter sleep would spoil no pair. A process that is delayed between two clock readings sees a sleep as shorter, never as longer."""


monotonic_ns: Final = time.monotonic_ns
"""Nanoseconds of CLOCK_MONOTONIC, which never steps. V4L2 stamps with this clock; a board without an RTC has no other honest one."""

_RUNS_ON: Final = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)
"""The clock that keeps running during a suspend. Where the kernel has none, no sleep is seen."""


def asleep_ns() -> int:
    """How long this machine has slept since it booted, ns: CLOCK_MONOTONIC stands still in a suspend, CLOCK_BOOTTIME keeps running.

    The result never exceeds the true value: time that passes between the two readings makes it smaller. 0 where the kernel has no clock that
    keeps running.
    """
    return time.clock_gettime_ns(_RUNS_ON) - time.monotonic_ns()


class SleepWatch:
    """Tells whether this machine has slept, with CLOCK_MONOTONIC standing still, since the last call."""

    def __init__(self) -> None:
        self._asleep_ns = max(asleep_ns() for _ in range(3))  # a delay between readings makes one too small

    def slept_ns(self) -> int:
        """Nanoseconds of sleep not yet reported; 0: none."""
        slept_ns = time.clock_gettime_ns(_RUNS_ON) - time.monotonic_ns() - self._asleep_ns  # asleep_ns, once per frame
        if slept_ns < _LEAST_SLEEP_NS:
            return 0
        self._asleep_ns += slept_ns
        return slept_ns


class StandstillWatch:
    """Tells whether this machine's CLOCK_MONOTONIC has, or may have, stood still since the last call.

    A suspend shows on CLOCK_BOOTTIME. A machine stopped by an emulator shows none. If it is then given the time again, the time of day has jumped;
    only the fact of the jump is used, never its value. This is called before each message, so it reads each clock once.
    """

    def __init__(self) -> None:
        self._asleep_ns = max(asleep_ns() for _ in range(3))
        self._apart_ns = time.time_ns() - time.monotonic_ns()

    def look(self) -> tuple[int, bool]:
        """Return the ns of sleep not yet reported, and whether the time of day has jumped. A pause between the readings does not count as a jump."""
        runs_on_ns, now_ns, wall_ns = time.clock_gettime_ns(_RUNS_ON), time.monotonic_ns(), time.time_ns()
        slept_ns = runs_on_ns - now_ns - self._asleep_ns
        if slept_ns < _LEAST_SLEEP_NS:
            slept_ns = 0
        self._asleep_ns += slept_ns
        moved_ns = wall_ns - now_ns - self._apart_ns
        jumped = not -_LEAST_SLEEP_NS < moved_ns < _LEAST_SLEEP_NS
        if jumped and time.monotonic_ns() - now_ns >= _LEAST_SLEEP_NS // 5:
            return slept_ns, False  # check again at the next call
        self._apart_ns += moved_ns
        return slept_ns, jumped


def unix_offset_ns() -> int:
    """Unix time minus CLOCK_MONOTONIC, ns. For files that others read; nothing of ours is computed from it."""
    return time.time_ns() - time.monotonic_ns()


def wall_time() -> str:
    """Local wall time as ISO 8601 to the second. For reports only; nothing is ever computed from it."""
    return time.strftime("%Y-%m-%dT%H:%M:%S%z")


def boot_id() -> str:
    """Id of this boot of the machine, which is one life of its CLOCK_MONOTONIC.

    Where the kernel does not show one (Android hides /proc/sys), the id is random. Then a restart looks like a reboot, which is safe.
    """
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip().replace("-", "")
    except OSError:
        return os.urandom(16).hex()


def random_id() -> str:
    """A fresh id of 16 hexadecimal digits (64 random bits); identifies one life of a process."""
    return os.urandom(8).hex()
