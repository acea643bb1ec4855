"""The root of a board that records alone: camera -> disk, in one poll loop. No host, no clock but its own."""

import logging
import socket
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Final

from board_agent.camera_watch import CameraWatch
from board_agent.disk_writer import DiskWriter, Written
from common import now
from common.camera.base import Camera, CameraState, Ended, Skipped, Spoiled
from common.frame import Frame
from common.link.waiter import Waiter
from common.program.logs import event
from common.recording.disk_queue import WriteEnd

_LOG: Final = logging.getLogger(__name__)
_LONGEST_WAIT_MS: Final = 200
_TELL_NS: Final = 1_000_000_000


class End(Enum):
    """Why a recording ended."""

    STOPPED = "stopped"
    TIME = "its time is over"
    CAMERA = "the camera ended"
    FULL = "full"
    FAILED = "failed"
    SLEPT = "the machine slept"


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What a recording came to.

    Attributes:
        end: why it ended.
        written: what became of the frames.
        grabbed: frames that the camera gave.
        spoiled: those whose bytes were no whole image.
        skipped: those that came faster than this program reads.
    """

    end: End
    written: Written
    grabbed: int
    spoiled: int
    skipped: int


class BoardRecording:
    """Records until told to stop.

    Args:
        camera: open camera.
        writer: writes its frames.
        wake: readable end of a socket that signals write to.
        until_ns: when it ends, CLOCK_MONOTONIC; None: when it is stopped.
        tell: called once a second with the frames grabbed and the camera's state.
    """

    def __init__(
        self,
        camera: Camera,
        writer: DiskWriter,
        wake: socket.socket,
        until_ns: int | None,
        tell: Callable[[int, CameraState], None],
    ) -> None:
        self._camera, self._writer, self._wake = camera, writer, wake
        self._until_ns, self._tell = until_ns, tell
        self._waiter = Waiter([wake])
        self._camera_watch = CameraWatch(camera, self._waiter)
        self._grabbed = self._spoiled = self._skipped = 0
        self._sleep = now.SleepWatch()

    def run(self) -> Outcome:
        """Record; return what it came to.

        Raises:
            DataError: the camera's images have become unreadable.
        """
        told_ns, end = 0, None
        self._camera.resume(now.monotonic_ns())
        try:
            while end is None:
                end = self._round()
                now_ns = now.monotonic_ns()
                if now_ns - told_ns >= _TELL_NS:
                    told_ns = now_ns
                    self._tell(self._grabbed, self._camera.health.state)
                    if end is None:
                        end = _ended(self._writer.account)
        finally:
            written = self._writer.finish()
        return Outcome(
            end=_ended(written) or end,
            written=written,
            grabbed=self._grabbed,
            spoiled=self._spoiled,
            skipped=self._skipped,
        )

    def _round(self) -> End | None:
        """Wait for what comes next and take it."""
        now_ns = now.monotonic_ns()
        self._camera_watch.look()
        wait_ms = min(_LONGEST_WAIT_MS, max(0, -((now_ns - self._camera.due_ns(now_ns)) // 1_000_000)))
        if self._wake.fileno() in self._waiter.wait(wait_ms):
            return End.STOPPED
        if self._sleep.slept_ns():
            return End.SLEPT
        now_ns = now.monotonic_ns()
        if self._until_ns is not None and now_ns >= self._until_ns:
            return End.TIME
        return self._grab(now_ns)

    def _grab(self, now_ns: int) -> End | None:
        for grab in self._camera.read(now_ns):
            match grab:
                case Frame():
                    self._grabbed += 1
                    self._writer.put(grab)
                case Spoiled(sequence, fault):
                    self._grabbed, self._spoiled = self._grabbed + 1, self._spoiled + 1
                    _LOG.debug(event("frame_spoiled", sequence=sequence, fault=fault.value))
                case Skipped(_, frames):
                    self._grabbed, self._skipped = self._grabbed + frames, self._skipped + frames
                case Ended():
                    return End.CAMERA
        return None


def _ended(written: Written) -> End | None:
    """Return what the disk has ended; None: nothing."""
    return {None: None, WriteEnd.FULL: End.FULL, WriteEnd.FAILED: End.FAILED}[written.end]
