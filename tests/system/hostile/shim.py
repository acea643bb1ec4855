"""A process whose clocks can be stepped from outside while it runs, and the conversion of its stamps back to true time.

True time is the kernel's CLOCK_MONOTONIC, which the shim shifts for one process alone. A `replay:` camera paces and stamps by the shifted clock, so its
images do not show the true time; the record of steps does. The clock's life is a series of segments, each with its step: a stamp lies in one of them, and true
time = stamp - step. A clock that steps forward leaves a gap of moments that never existed. Exposures that a replay claims there (it makes up
for what it missed) are handed over after the gap and count as part of the segment after it. A clock that should lose time does so as in a suspend or a stopped
machine: its process is stopped meanwhile, so that the clock never runs backwards; segments do not overlap.
"""

import atexit
import mmap
import os
import shutil
import signal
import struct
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Final

from tests.support.programs import Program, until

_SOURCE: Final = Path(__file__).with_name("clock_shim.c")
_FOREVER: Final = 2**63


@cache
def shim_library() -> Path:
    """Compile the shim once; return the shared object, which is deleted when this process ends."""
    folder = Path(mkdtemp(prefix="clock-shim-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    library = folder / "clock_shim.so"
    flags = ["-O2", "-Wall", "-Werror", "-shared", "-fPIC"]
    subprocess.run([os.environ.get("CC", "cc"), *flags, "-o", str(library), str(_SOURCE), "-ldl"], check=True)
    return library


@dataclass(frozen=True, slots=True)
class Segment:
    """A period in which the clock ran evenly.

    Attributes:
        from_ns: true time of its beginning.
        to_ns: true time of its end.
        step_ns: shifted clock - true time.
    """

    from_ns: int
    to_ns: int
    step_ns: int


class ShiftedClock:
    """The clocks of one process.

    Args:
        control: file to create for it.
    """

    def __init__(self, control: Path) -> None:
        control.write_bytes(bytes(16))
        self._path = control
        with control.open("r+b") as file:
            self._memory = mmap.mmap(file.fileno(), 16)
        self._boottime_ns = 0
        self._segments = [Segment(-_FOREVER, _FOREVER, 0)]

    @property
    def environment(self) -> dict[str, str]:
        """The environment for the process whose clocks these are."""
        return {"LD_PRELOAD": str(shim_library()), "CLOCK_SHIM": str(self._path)}

    @property
    def step_ns(self) -> int:
        """Shifted clock - true time, now."""
        return self._segments[-1].step_ns

    def jump(self, by_ns: int) -> None:
        """Step both clocks forward, from one reading to the next."""
        assert by_ns > 0
        at_ns = time.monotonic_ns()
        self._go_on(at_ns, at_ns, by_ns, boottime_by_ns=by_ns)

    def stand_still(self, program: Program, for_ns: int, *, asleep: bool, meanwhile: Callable[[], None]) -> None:
        """Stop the process for a while that CLOCK_MONOTONIC does not count.

        Args:
            program: the process whose clocks these are.
            for_ns: how long.
            asleep: whether CLOCK_BOOTTIME goes on meanwhile, as in a suspend; for a stopped virtual machine no clock does.
            meanwhile: called once the process has stopped.
        """
        with stopped(program):
            from_ns = time.monotonic_ns()
            meanwhile()
            time.sleep(max(0, for_ns - (time.monotonic_ns() - from_ns)) / 1e9)
            self._go_on(from_ns, time.monotonic_ns(), -for_ns, boottime_by_ns=0 if asleep else -for_ns)

    def true_ns(self, stamp_ns: int) -> int:
        """The true time of a stamp of the shifted clock; a stamp in a gap belongs to the segment after it."""
        for segment in self._segments:
            if stamp_ns < segment.to_ns + segment.step_ns:
                return stamp_ns - segment.step_ns
        raise AssertionError("the last segment has no end")

    def step_at(self, stamp_ns: int) -> int:
        """The step in force when the shifted clock showed this time."""
        return stamp_ns - self.true_ns(stamp_ns)

    def _go_on(self, end_ns: int, begin_ns: int, by_ns: int, *, boottime_by_ns: int) -> None:
        last = self._segments.pop()
        step_ns = last.step_ns + by_ns
        self._boottime_ns += boottime_by_ns
        self._segments += [Segment(last.from_ns, end_ns, last.step_ns), Segment(begin_ns, _FOREVER, step_ns)]
        self._memory[8:16] = struct.pack("=q", self._boottime_ns)
        self._memory[0:8] = struct.pack("=q", step_ns)


class stopped:  # noqa: N801 - a context manager, used like a function
    """A program is stopped (SIGSTOP) during the block."""

    def __init__(self, *programs: Program) -> None:
        self._programs = programs

    def __enter__(self) -> None:
        """Stop them, and wait until they have stopped."""
        for program in self._programs:
            program.send(signal.SIGSTOP)
        until(lambda: all(_is_stopped(program) for program in self._programs), "the process stands")

    def __exit__(self, *_: object) -> None:
        """Let them continue."""
        for program in self._programs:
            program.send(signal.SIGCONT)


def _is_stopped(program: Program) -> bool:
    tasks = Path(f"/proc/{program.process.pid}/task").iterdir()
    return all((task / "stat").read_text().rpartition(")")[2].split()[0] in "tT" for task in tasks)
