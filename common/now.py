"""The only reader of the operating system's clocks and of its boot id. Cores get `now_ns` as an argument instead."""

import os
import time
from pathlib import Path
from typing import Final

_LEAST_SLEEP_NS: Final = 5_000_000
"""A shorter sleep would spoil no pair; a process that is held up between two readings of clocks makes less than nothing of it."""


def monotonic_ns() -> int:
    """Nanoseconds of CLOCK_MONOTONIC: never steps, the clock that V4L2 stamps with (a board without RTC has no other honest one)."""
    return time.monotonic_ns()


_RUNS_ON: Final = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)
"""The clock that goes on in a suspend; where the kernel has none, no sleep is seen."""


def asleep_ns() -> int:
    """How long this machine has slept since it booted, ns: CLOCK_MONOTONIC stands still in a suspend, CLOCK_BOOTTIME goes on.

    At most that: what passes between the two readings makes it less, never more. 0 where the kernel has no clock that runs on.
    """
    return time.clock_gettime_ns(_RUNS_ON) - time.monotonic_ns()


class SleepWatch:
    """Tells when this machine has slept since it was last asked; its CLOCK_MONOTONIC stood still meanwhile."""

    def __init__(self) -> None:
        self._asleep_ns = max(asleep_ns() for _ in range(3))  # held up between its readings, one says less

    def slept_ns(self) -> int:
        """Nanoseconds of sleep that were not told yet; 0: none."""
        slept_ns = asleep_ns() - self._asleep_ns
        if slept_ns < _LEAST_SLEEP_NS:
            return 0
        self._asleep_ns += slept_ns
        return slept_ns


class StandstillWatch:
    """Tells when this machine's CLOCK_MONOTONIC has, or may have, stood still since it was last asked.

    A suspend shows on CLOCK_BOOTTIME. A machine that an emulator stops shows none; where it is given the time again afterwards, the time of day has jumped:
    only that it did is used, never its value. Asked before each message, so it reads each clock once.
    """

    def __init__(self) -> None:
        self._sleep = SleepWatch()
        self._apart_ns = time.time_ns() - time.monotonic_ns()

    def look(self) -> tuple[int, bool]:
        """Nanoseconds of sleep that were not told yet, and whether the time of day was set; not where the process was held up between two readings."""
        slept_ns, now_ns, wall_ns = self._sleep.slept_ns(), time.monotonic_ns(), time.time_ns()
        moved_ns = wall_ns - now_ns - self._apart_ns
        jumped = not -_LEAST_SLEEP_NS < moved_ns < _LEAST_SLEEP_NS
        if jumped and time.monotonic_ns() - now_ns >= _LEAST_SLEEP_NS // 5:
            return slept_ns, False  # looked at again the next time
        self._apart_ns += moved_ns
        return slept_ns, jumped


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
