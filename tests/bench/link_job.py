"""The job of one end of a link under test, and its results."""

import json
import resource
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

SILENCE_S = 3.0
"""A receiver that hears nothing for this long stops: frames may be lost, including the last one."""


@dataclass(slots=True)
class Tally:
    """What one end saw.

    Attributes:
        warm_up: frames before the measurement.
        frames: frames in all.
    """

    warm_up: int
    frames: int
    delays_ns: list[int] = field(default_factory=list)
    came_bytes: int = 0
    first_ns: int = 0
    last_ns: int = 0
    _cpu: list[tuple[int, float]] = field(default_factory=list)

    def passed(self, number: int) -> None:
        """Record that a frame has passed this end; CPU time counts from the end of the warm-up to the last frame."""
        if number >= self.warm_up - 1 and (not self._cpu or number == self.frames - 1):
            usage = resource.getrusage(resource.RUSAGE_SELF)
            self._cpu.append((number, usage.ru_utime + usage.ru_stime))

    def arrived(self, number: int, sent_ns: int, size_bytes: int) -> None:
        """Record that a frame's bytes are usable."""
        now_ns = time.monotonic_ns()
        if number >= self.warm_up:
            self.delays_ns.append(now_ns - sent_ns)
            if self.first_ns:
                self.came_bytes += size_bytes
            self.first_ns = self.first_ns or now_ns
            self.last_ns = now_ns
        self.passed(number)

    def report(self) -> str:
        """The results as a JSON object; CPU time is NaN if the first or last frame never came."""
        per_frame = float("nan")
        if len(self._cpu) == 2:
            (first, before_s), (last, after_s) = self._cpu
            per_frame = (after_s - before_s) / (last - first) * 1e6
        took_s = (self.last_ns - self.first_ns) / 1e9
        mb_per_s = self.came_bytes / took_s / 1e6 if took_s else float("nan")
        return json.dumps({"cpu_us_per_frame": per_frame, "delays_ns": self.delays_ns, "mb_per_s": mb_per_s})


@dataclass(frozen=True, slots=True, kw_only=True)
class Job:
    """A worker's job; `fps` 0: as fast as possible."""

    address: str
    folder: Path
    fps: int
    warm_up: int
    frames: int

    def tally(self) -> Tally:
        """An empty tally for this job."""
        return Tally(self.warm_up, self.frames)

    def payloads(self) -> list[bytes]:
        """The images in the folder."""
        return [path.read_bytes() for path in sorted(self.folder.iterdir())]

    @property
    def endpoint(self) -> tuple[str, int]:
        """Host and port."""
        host, _, port = self.address.removeprefix("tcp://").rpartition(":")
        return host, int(port)


def pace(job: Job, send: Callable[[int, bytes], object]) -> Tally:
    """Send frames at a steady rate, or as fast as they are taken; every sender but ours uses this."""
    payloads, tally = job.payloads(), job.tally()
    start_s = time.monotonic()
    for number in range(job.frames):
        wait_s = start_s + number / job.fps - time.monotonic() if job.fps else 0
        if wait_s > 0:
            time.sleep(wait_s)
        send(number, payloads[number % len(payloads)])
        tally.passed(number)
    return tally
