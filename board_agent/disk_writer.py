"""Writes frames to the disk in a thread of its own: a disk that takes its time must not keep the loop from the camera."""

import threading
from collections import deque
from dataclasses import dataclass
from enum import Enum
from typing import Final

from board_agent.ring import BoundedFiles
from common import now
from common.errors import UnavailableError
from common.frame import Frame
from common.recording.layout import image_topic
from common.recording.ros_messages import RecordedImage, image_parts, image_type

SIDE: Final = "left"
"""Where a board's images stand in its own recording; which side they are seen from is known when they are joined with the host's."""

_MOST_BYTES: Final = 32 << 20
"""What may wait for the disk, and as much again may be under way to it: 20 s of one camera at 1.5 MB/s, in a board's 512 MB."""

_SYNC_NS: Final = 800_000_000
"""A power cut takes a second at most: this, and the time that the disk takes."""

_MESSAGE_BYTES: Final = 2000
"""More than what a frame takes beside its image; the first one of a file brings its topic's definition, twice."""


class WriteEnd(Enum):
    """Why no more is written."""

    FULL = "full"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class Written:
    """What became of the frames.

    Attributes:
        frames: that are in the recording, or were and gave way.
        dropped: that came faster than the disk takes them.
        lost: that came after its end.
        size_bytes: how much was written and is still there.
        files: how many files were begun.
        gave_way: how many of them, or of earlier ones, were deleted.
        end: why no more is written; None: it goes on, or was ended in order.
        cause: what failed, in words.
    """

    frames: int
    dropped: int
    lost: int
    size_bytes: int
    files: int
    gave_way: int
    end: WriteEnd | None
    cause: str


class DiskWriter:
    """Writes frames.

    Args:
        files: where; this class closes them.
        unix_ns: Unix time minus CLOCK_MONOTONIC, ns: what is added to each time.
    """

    def __init__(self, files: BoundedFiles, unix_ns: int) -> None:
        self._files, self._unix_ns = files, unix_ns
        self._queue: deque[Frame] = deque()
        self._queued_bytes = 0
        self._changed = threading.Condition()
        self._is_closing = False
        self._frames = self._dropped = self._lost = 0
        self._end: WriteEnd | None = None
        self._cause = ""
        self._thread = threading.Thread(target=self._write_all, name="disk", daemon=True)
        self._thread.start()

    @property
    def account(self) -> Written:
        """What became of the frames so far."""
        with self._changed:
            return Written(
                frames=self._frames,
                dropped=self._dropped,
                lost=self._lost,
                size_bytes=self._files.size_bytes,
                files=self._files.files,
                gave_way=self._files.gave_way,
                end=self._end,
                cause=self._cause,
            )

    def put(self, frame: Frame) -> None:
        """Take a frame. Never waits. Its bytes are those that its camera gave: nobody writes into them any more."""
        size = len(frame.payload)
        with self._changed:
            if self._end is not None:
                self._lost += 1
            elif self._queued_bytes + size > _MOST_BYTES:
                self._dropped += 1
            else:
                self._queue.append(frame)
                self._queued_bytes += size
                self._changed.notify()

    def finish(self) -> Written:
        """Write what waits, end the file in order, and return what became of the frames."""
        with self._changed:
            self._is_closing = True
            self._changed.notify()
        self._thread.join()
        return self.account

    def _write_all(self) -> None:
        synced_ns, taken = now.monotonic_ns(), deque[Frame]()
        try:
            while (came := self._next()) is not None:
                taken = came
                while taken and self._write(taken[0]):
                    taken.popleft()
                now_ns = now.monotonic_ns()
                if (
                    self._end is None and now_ns - synced_ns >= _SYNC_NS
                ):  # from the begin of one to the begin of the next
                    synced_ns = now_ns
                    self._files.file.sync()
            self._files.file.close()
        except (OSError, UnavailableError) as error:
            self._fail(getattr(error, "strerror", None) or str(error))
            self._files.file.abandon()
        with self._changed:
            self._lost += len(taken) + len(self._queue)
            self._queue.clear()

    def _next(self) -> "deque[Frame] | None":
        """Wait for what came, at most for a second; None: nothing will."""
        with self._changed:
            if not self._queue and not self._is_closing and self._end is None:
                self._changed.wait(_SYNC_NS / 1e9)
            if self._end is not None or (not self._queue and self._is_closing):
                return None
            taken, self._queue = self._queue, deque()
            self._queued_bytes = 0
            return taken

    def _write(self, frame: Frame) -> bool:
        """Write a frame; return False, if it does not fit any more."""
        size_px, unix_ns = (frame.width_px, frame.height_px), self._unix_ns
        image = RecordedImage(unix_ns + frame.exposed.ns, SIDE, frame.pixel_format, size_px, frame.payload)
        if not self._files.make_room(len(frame.payload) + _MESSAGE_BYTES):
            with self._changed:
                self._end = WriteEnd.FULL
            return False
        grabbed_ns = unix_ns + frame.grabbed.ns
        topic = image_topic(SIDE, image_type(frame.pixel_format))
        parts = image_parts(image)
        self._files.file.add(topic, *parts, sequence=frame.sequence, log_ns=grabbed_ns, publish_ns=grabbed_ns)
        with self._changed:
            self._frames += 1
        return True

    def _fail(self, cause: str) -> None:
        with self._changed:
            self._end, self._cause = WriteEnd.FAILED, cause
