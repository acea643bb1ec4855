"""Writes a board's frames to the disk in a thread of its own: a disk that takes its time must not keep the loop from the camera."""

from dataclasses import dataclass
from functools import partial
from typing import Final

from board_agent.ring import BoundedFiles
from common.frame import Frame
from common.recording.disk_queue import DiskQueue, FullRecordingError, WriteEnd
from common.recording.layout import image_topic
from common.recording.ros_messages import RecordedImage, image_parts, image_type

SIDE: Final = "left"
"""Where a board's images stand in its own recording; which side they are seen from is known when they are joined with the host's."""

_MOST_BYTES: Final = 64 << 20
"""What may wait for the disk: 40 s of one camera at 1.5 MB/s, in a board's 512 MB."""

_MESSAGE_BYTES: Final = 2000
"""More than what a frame takes beside its image; the first one of a file brings its topic's definition, twice."""


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
        remedy: what to do about it.
    """

    frames: int
    dropped: int
    lost: int
    size_bytes: int
    files: int
    gave_way: int
    end: WriteEnd | None
    cause: str
    remedy: str


class DiskWriter:
    """Writes frames.

    Args:
        files: where; this class closes them.
        unix_ns: Unix time minus CLOCK_MONOTONIC, ns: what is added to each time.
    """

    def __init__(self, files: BoundedFiles, unix_ns: int) -> None:
        self._files, self._unix_ns = files, unix_ns
        self._queue = DiskQueue("disk", files, _MOST_BYTES)

    @property
    def account(self) -> Written:
        """What became of the frames so far."""
        queued = self._queue.account
        return Written(
            frames=queued.frames,
            dropped=queued.dropped,
            lost=queued.lost,
            size_bytes=self._files.size_bytes,
            files=self._files.files,
            gave_way=self._files.gave_way,
            end=queued.end,
            cause=queued.cause,
            remedy=queued.remedy,
        )

    def put(self, frame: Frame) -> None:
        """Take a frame. Never waits. Its bytes are those that its camera gave: nobody writes into them any more."""
        self._queue.put(partial(self._write, frame), len(frame.payload), is_frame=True)

    def finish(self) -> Written:
        """Write what waits, end the file in order, and return what became of the frames."""
        self._queue.finish()
        return self.account

    def _write(self, frame: Frame) -> None:
        if not self._files.make_room(len(frame.payload) + _MESSAGE_BYTES):
            raise FullRecordingError
        size_px, unix_ns = (frame.width_px, frame.height_px), self._unix_ns
        image = RecordedImage(unix_ns + frame.exposed.ns, SIDE, frame.pixel_format, size_px, frame.payload)
        grabbed_ns = unix_ns + frame.grabbed.ns
        topic = image_topic(SIDE, image_type(frame.pixel_format))
        parts = image_parts(image)
        self._files.file.add(topic, *parts, sequence=frame.sequence, log_ns=grabbed_ns, publish_ns=grabbed_ns)
