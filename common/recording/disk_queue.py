"""A bounded queue before the one thread that writes a recording: whoever brings something never waits, however long the disk takes.

The thread wakes when a chunk's worth waits, or after a while: to wake it for each image would cost more than to write it. Once a second it
brings what came onto the disk.
"""

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Final, Protocol

from common import now
from common.errors import TandemError
from common.recording.mcap_writer import CHUNK_BYTES
from common.recording.recording_file import DeletedRecordingError

_GATHER_S: Final = 0.2
"""So long an image waits for others with which it makes a chunk."""

_SYNC_NS: Final = 600_000_000
"""From the begin of one sync to the begin of the next. A power cut takes a second at most: this, and the time that the disk takes."""

Job = Callable[[], None]
"""Writes something. Raises FullRecordingError if it does not fit any more, which ends the recording in order."""


class FullRecordingError(Exception):
    """Raised by a job that would make its recording larger than it may be. Nobody's fault."""


class WriteEnd(Enum):
    """Why no more is written."""

    FULL = "full"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class Queued:
    """What became of the images that came.

    Attributes:
        frames: images that were handed to the operating system.
        dropped: that came faster than the disk takes them.
        lost: that came after the end, or failed with it.
        ended_ns: when it ended, ns of the monotonic clock; 0: it goes on.
        end: why it ended early; None: it did not.
        cause: what failed, in words.
        remedy: what to do about it.
    """

    frames: int = 0
    dropped: int = 0
    lost: int = 0
    ended_ns: int = 0
    end: WriteEnd | None = None
    cause: str = ""
    remedy: str = ""


class Target(Protocol):
    """Where the jobs write to. Called by the thread alone; each of these may raise what ends the recording."""

    def end_chunk(self) -> None:
        """Hand what was written to the operating system."""

    def sync(self) -> None:
        """Bring it onto the disk."""

    def close(self) -> None:
        """End it in order."""

    def abandon(self, cause: str) -> None:
        """Leave it as it is, for this cause. Raises nothing."""


class DiskQueue:
    """Does jobs in their order, in a thread of its own.

    Args:
        name: of the thread.
        target: where they write to.
        most_bytes: what may wait.
    """

    def __init__(self, name: str, target: Target, most_bytes: int) -> None:
        self._target, self._most_bytes = target, most_bytes
        self._queue: deque[tuple[Job, int, bool]] = deque()
        self._queued_bytes = 0
        self._changed = threading.Condition()
        self._is_closing = False
        self._frames = self._dropped = self._lost = self._ended_ns = 0
        self._undone = 0  # frames of what is being done
        self._end: WriteEnd | None = None
        self._cause = self._remedy = ""
        self._thread = threading.Thread(target=self._work, name=name, daemon=True)
        self._thread.start()

    @property
    def account(self) -> Queued:
        """What became of the images so far."""
        with self._changed:
            counts = self._frames, self._dropped, self._lost
            return Queued(*counts, self._ended_ns, self._end, self._cause, self._remedy)

    def put(self, job: Job, size: int, *, is_frame: bool = False) -> None:
        """Take a job. Never waits.

        Args:
            job: writes something.
            size: what it holds in memory until then, bytes.
            is_frame: whether it counts in the account.
        """
        with self._changed:
            if self._ended_ns or self._is_closing:
                self._lost += is_frame
            elif self._queued_bytes + size > self._most_bytes:
                self._dropped += is_frame
            else:
                self._queue.append((job, size, is_frame))
                self._queued_bytes += size
                if self._queued_bytes >= CHUNK_BYTES:
                    self._changed.notify()

    def finish(self) -> Queued:
        """Do what waits, end the target in order, and return what became of the images."""
        with self._changed:
            self._is_closing = True
            self._changed.notify()
        self._thread.join()
        return self.account

    def _work(self) -> None:
        due_ns, end, cause, remedy = now.monotonic_ns() + _SYNC_NS, None, "", ""
        try:
            while end is None and (jobs := self._next((due_ns - now.monotonic_ns()) / 1e9)) is not None:
                end = self._do(jobs)
                if (now_ns := now.monotonic_ns()) >= due_ns:
                    due_ns = now_ns + _SYNC_NS
                    self._target.sync()
            self._target.close()
        except Exception as error:  # noqa: BLE001 - a thread's root: the run goes on, and its account says what is missing
            end, (cause, remedy) = WriteEnd.FAILED, _explained(error)
            self._target.abandon(cause)
        with self._changed:
            self._end, self._cause, self._remedy, self._ended_ns = end, cause, remedy, now.monotonic_ns()
            self._lost += self._undone + sum(is_frame for _, _, is_frame in self._queue)
            self._queue.clear()
            self._queued_bytes = 0

    def _do(self, jobs: list[tuple[Job, bool]]) -> WriteEnd | None:
        self._undone = left = frames = sum(is_frame for _, is_frame in jobs)
        end = None
        try:
            for job, is_frame in jobs:
                job()
                left -= is_frame
        except FullRecordingError:
            end = WriteEnd.FULL
        self._target.end_chunk()  # if it fails, all of them are lost
        self._undone = left
        with self._changed:
            self._frames += frames - left
        return end

    def _next(self, due_s: float) -> list[tuple[Job, bool]] | None:
        """Wait for a chunk's worth of jobs, but not long, and not after the next sync is due; None: nothing will come."""
        with self._changed:
            longest_s = max(0.0, min(_GATHER_S, due_s))
            self._changed.wait_for(lambda: self._is_closing or self._queued_bytes >= CHUNK_BYTES, longest_s)
            if not self._queue and self._is_closing:
                return None
            taken, size = [], 0
            while self._queue and size < CHUNK_BYTES:
                job, job_bytes, is_frame = self._queue.popleft()
                taken.append((job, is_frame))
                size += job_bytes
            self._queued_bytes -= size
            return taken


def _explained(error: Exception) -> tuple[str, str]:
    """Return what failed, in words, and what to do about it."""
    match error:
        case DeletedRecordingError():
            return str(error.strerror), "record again"
        case OSError() if error.strerror:
            return error.strerror, "make room; what is in it can be used"
        case TandemError():
            return error.problem, error.remedy
        case _:
            return f"{type(error).__name__}: {error}", "what is in it can be used"
