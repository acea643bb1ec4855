"""Whether processes ran: tells a test that fails on a silent process whether it stood still or had nothing to hear."""

import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

from tests.support.programs import Program

_LOOK_S: Final = 0.05
_LONG_NS: Final = 1_500_000_000
"""Half of the tolerated silence: a process that did not run for this long caused the silence, not the link."""


@dataclass(slots=True)
class _Beat:
    """The longest time in which a process did not run, ns, and for how much of it it wanted to run.

    Attributes:
        ran_ns: processor time of all its threads so far.
        waited_ns: time for which they waited for a core.
        since_ns: when it was last seen to have run.
        since_waited_ns: their total waiting time at that moment.
        longest_ns: the longest time without running.
        longest_waited_ns: how long they waited for a core during it.
        at: when that began, wall-clock time.
    """

    ran_ns: int
    waited_ns: int
    since_ns: int
    since_waited_ns: int
    longest_ns: int = 0
    longest_waited_ns: int = 0
    at: str = ""

    def take(self, ran_ns: int, waited_ns: int, now_ns: int) -> None:
        """Add the kernel's current values."""
        rested_ns = now_ns - self.since_ns
        if rested_ns > self.longest_ns:
            self.longest_ns, self.longest_waited_ns = rested_ns, waited_ns - self.since_waited_ns
            self.at = time.strftime("%H:%M:%S", time.localtime(time.time() - rested_ns / 1e9))
        if ran_ns > self.ran_ns:
            self.since_ns, self.since_waited_ns = now_ns, waited_ns
        self.ran_ns, self.waited_ns = ran_ns, waited_ns


class Pulse:
    """Samples twenty times a second how long a program's threads have run and have waited for a core (/proc/PID/task/*/schedstat).

    Args:
        programs: by name.
    """

    def __init__(self, programs: Mapping[str, Program]) -> None:
        self._programs = dict(programs)
        self._beats: dict[str, _Beat] = {}
        self._late_ns = 0
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="pulse", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stop sampling."""
        self._stopping.set()
        self._thread.join()

    @property
    def told(self) -> str:
        """A report of what was seen, whether a process stood still or heard nothing, and the logs."""
        found = [self._tell(name, beat) for name, beat in self._beats.items()]
        stood = [name for name, beat in self._beats.items() if beat.longest_ns >= _LONG_NS]
        verdict = f"did not run: {' and '.join(stood)}" if stood else "all ran: the link itself was silent, or slow"
        logs = [f"--- {name}\n{program.stderr}" for name, program in self._programs.items()]
        mine = f"this test was late by {self._late_ns / 1e9:.2f} s at most"
        return "\n".join([verdict, *found, mine, *logs])

    @staticmethod
    def _tell(name: str, beat: _Beat) -> str:
        rested = f"{name}: at most {beat.longest_ns / 1e9:.2f} s without running, from {beat.at} on"
        return f"{rested}, {beat.longest_waited_ns / 1e9:.2f} s of it waiting for a core"

    def _watch(self) -> None:
        due_ns = time.monotonic_ns()
        while not self._stopping.wait(max(0, (due_ns - time.monotonic_ns()) / 1e9)):
            now_ns = time.monotonic_ns()
            self._late_ns = max(self._late_ns, now_ns - due_ns)
            due_ns = now_ns + int(_LOOK_S * 1e9)
            for name, program in self._programs.items():
                with suppress(OSError, ValueError):  # it has ended
                    ran_ns, waited_ns = _times_ns(program.process.pid)
                    beat = self._beats.setdefault(name, _Beat(ran_ns, waited_ns, now_ns, waited_ns))
                    beat.take(ran_ns, waited_ns, now_ns)


def _times_ns(pid: int) -> tuple[int, int]:
    """How long all threads of a process have run and have waited for a core (scheduler/sched-stats.rst in the kernel's documentation)."""
    ran_ns = waited_ns = 0
    for task in Path(f"/proc/{pid}/task").iterdir():
        ran, waited, _ = (task / "schedstat").read_text(encoding="ascii").split()
        ran_ns += int(ran)
        waited_ns += int(waited)
    return ran_ns, waited_ns
