"""What every benchmark's table says about its machine, and how a benchmark asks for quiet there."""

import importlib.metadata
import os
import platform
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import zmq

from common import now

_FIFO_PRIORITY = 10


@dataclass(frozen=True, slots=True)
class Machine:
    """Machine, versions and date of a benchmark.

    Attributes:
        cpu: the processor's name.
        cores: processors that this process may use.
        kernel: release of the operating system's kernel.
        python: version of the interpreter.
        pyzmq: version of pyzmq.
        libzmq: version of ZeroMQ itself.
        date: local wall-clock time.
    """

    cpu: str
    cores: int
    kernel: str
    python: str
    pyzmq: str
    libzmq: str
    date: str

    def __str__(self) -> str:
        versions = f"Python {self.python}, pyzmq {self.pyzmq}, libzmq {self.libzmq}"
        return f"{self.cpu}, {self.cores} cores, {self.kernel}, {versions}, {self.date}"


def machine() -> Machine:
    """Describe this machine."""
    names = [platform.processor() or platform.machine()]
    with suppress(OSError):
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
        names += [line.partition(":")[2].strip() for line in lines if line.lower().startswith("model name")]
    return Machine(
        cpu=names[-1],
        cores=len(os.sched_getaffinity(0)),
        kernel=f"{platform.system()} {platform.release()}",
        python=platform.python_version(),
        pyzmq=importlib.metadata.version("pyzmq"),
        libzmq=zmq.zmq_version(),
        date=now.wall_time(),
    )


class Busyness:
    """How busy each core has been since this was created, with any work; the load average does not show what disturbs microsecond measurements."""

    def __init__(self) -> None:
        self._before = _ticks()

    @property
    def percents(self) -> tuple[int, ...]:
        """Share of the time in which each core was not idle, %; proc_stat(5)."""
        pairs = zip(self._before, _ticks(), strict=True)
        return tuple(round(100 * (b - a) / max(1, total_b - total_a)) for (a, total_a), (b, total_b) in pairs)


def _ticks() -> list[tuple[int, int]]:
    """Ticks of each core: not idle, and all."""
    found = []
    for line in Path("/proc/stat").read_text(encoding="ascii").splitlines():
        name, *fields = line.split()
        if name.startswith("cpu") and name != "cpu":
            ticks = [int(field) for field in fields[:8]]
            found.append((sum(ticks) - ticks[3] - ticks[4], sum(ticks)))
    return found


def may_use_fifo() -> bool:
    """Whether this process may use SCHED_FIFO; it restores its own scheduling at once."""
    policy, parameter = os.sched_getscheduler(0), os.sched_getparam(0)
    if not _take_fifo():
        return False
    os.sched_setscheduler(0, policy, parameter)
    return True


def be_quiet(core: int) -> None:
    """Pin this process to one core and give it priority over ordinary work there, as far as permitted.

    Args:
        core: index among the cores that it may use.
    """
    cores = sorted(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {cores[core % len(cores)]})
    _take_fifo()


def _take_fifo() -> bool:
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_FIFO_PRIORITY))
    except PermissionError:
        return False
    return True
