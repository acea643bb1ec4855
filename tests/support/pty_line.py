"""A serial cable between two pseudo terminals. It can be slow, delay or corrupt bytes, be pulled and plugged in again. Runs in a thread."""

import errno
import os
import pty
import select
import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Final, Self

Spoil = Callable[[bytes], bytes]

_HELD_BYTES: Final = 128 * 1024
"""The most that a direction holds; beyond this the ends have to wait."""

_GRAIN_BYTES: Final = 32
_GRAIN_NS: Final = 200_000
_TICK_S: Final = 0.005


class _Way:
    """One direction: bytes leave at a limited rate and arrive after a delay."""

    def __init__(self, bytes_per_s: float, delay_ns: int) -> None:
        self.bytes_per_s, self.delay_ns = bytes_per_s, delay_ns
        self.spoil: Spoil = bytes
        self._held: deque[tuple[int, bytes]] = deque()
        self._held_bytes = 0
        self._free_ns = 0

    @property
    def is_full(self) -> bool:
        return self._held_bytes >= _HELD_BYTES

    @property
    def due_ns(self) -> int:
        return self._held[0][0] if self._held else 2**63 - 1

    def put(self, data: bytes, now_ns: int) -> None:
        data = self.spoil(data)
        if not self.bytes_per_s:
            self._add(now_ns + self.delay_ns, data)
            return
        self._free_ns = max(self._free_ns, now_ns)
        step = max(_GRAIN_BYTES, int(self.bytes_per_s * _GRAIN_NS / 1e9))
        for at in range(0, len(data), step):
            grain = data[at : at + step]
            self._free_ns += round(len(grain) / self.bytes_per_s * 1e9)
            self._add(self._free_ns + self.delay_ns, grain)

    def move(self, descriptor: int, now_ns: int) -> None:
        """Write what has arrived."""
        while self._held and self._held[0][0] <= now_ns:
            due_ns, data = self._held.popleft()
            self._held_bytes -= len(data)
            try:
                written = os.write(descriptor, data)
            except BlockingIOError:
                written = 0
            if written < len(data):
                self._held.appendleft((max(due_ns, now_ns + 1_000_000), data[written:]))
                self._held_bytes += len(data) - written
                return

    def _add(self, due_ns: int, data: bytes) -> None:
        self._held.append((due_ns, data))
        self._held_bytes += len(data)


class PtyLine:
    """A cable with two ends, each a path that stays the same when the cable is plugged in again.

    Args:
        folder: where the two paths are created.
        bytes_per_s: rate of each direction; 0: unlimited.
        delay_ns: from one end to the other.
        urgent: give it priority over ordinary work where permitted: a real line never waits for a processor.
    """

    def __init__(self, folder: Path, bytes_per_s: float = 0, delay_ns: int = 0, *, urgent: bool = False) -> None:
        self._urgent = urgent
        self.paths = (folder / "ttyBoard", folder / "ttyHost")
        self.ways = (_Way(bytes_per_s, delay_ns), _Way(bytes_per_s, delay_ns))
        self._masters: list[int] = []
        self._lock = threading.Lock()
        self._stopping = False
        self.plug()
        self._thread = threading.Thread(target=self._run, name="cable", daemon=True)
        self._thread.start()

    @property
    def uris(self) -> tuple[str, str]:
        """Link URIs of the board's and the host's end."""
        board, host = self.paths
        return f"serial:{board}", f"serial:{host}"

    def plug(self) -> None:
        """Plug the cable in: both devices appear."""
        with self._lock:
            for path in self.paths:
                master, slave = pty.openpty()
                os.set_blocking(master, False)
                self._masters.append(master)
                path.unlink(missing_ok=True)
                path.symlink_to(os.ttyname(slave))
                os.close(slave)

    def pull(self) -> None:
        """Pull the cable: both devices vanish, and processes that have them open are notified."""
        with self._lock:
            for path in self.paths:
                path.unlink()
            for master in self._masters:
                os.close(master)
            self._masters.clear()
            self.ways = tuple(_Way(way.bytes_per_s, way.delay_ns) for way in self.ways)  # type: ignore[assignment]  # two of them

    def inject(self, data: bytes) -> None:
        """Make bytes appear at both ends that nobody has sent."""
        with self._lock:
            for way in self.ways:
                way.put(data, time.monotonic_ns())

    def close(self) -> None:
        """Remove it."""
        self._stopping = True
        self._thread.join()
        for master in self._masters:
            os.close(master)

    def __enter__(self) -> Self:
        """Itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Remove it."""
        self.close()

    def _run(self) -> None:
        if self._urgent:
            with suppress(PermissionError):  # for this thread only
                os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(20))
        while not self._stopping:
            with self._lock:
                idle = [self._step(*ends, way) for ends, way in self._directions()]
                due_ns = min((way.due_ns for _, way in self._directions()), default=2**63 - 1)
                readers = [ends[0] for ends, way in self._directions() if not way.is_full]
            wait_s = min(_TICK_S, max(0, (due_ns - time.monotonic_ns()) / 1e9))
            if any(idle) or not readers:  # an end that nobody has open always looks readable
                time.sleep(min(wait_s, 0.001) if len(readers) > idle.count(True) else wait_s)
            else:
                with suppress(OSError, ValueError):  # pulled in the meantime
                    select.select(readers, [], [], wait_s)

    def _directions(self) -> list[tuple[tuple[int, int], _Way]]:
        if not self._masters:
            return []
        board, host = self._masters
        return [((board, host), self.ways[0]), ((host, board), self.ways[1])]

    def _step(self, source: int, target: int, way: _Way) -> bool:
        """Read and write what is available; returns whether nobody has the source's end open."""
        absent = False
        try:
            if not way.is_full and (data := os.read(source, 65536)):
                way.put(data, time.monotonic_ns())
        except BlockingIOError:
            pass
        except OSError as error:
            if error.errno != errno.EIO:
                raise
            absent = True
        way.move(target, time.monotonic_ns())
        return absent
