"""Takes frames of both cameras into a recording: as they came, before they are paired, those that find no partner, too.

Whoever brings a frame never waits: it goes into a bounded queue, which a thread empties. A disk that is full ends the recording, not the run.
"""

import json
import threading
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from common import now
from common.frame import Frame
from common.ledger import PairLedger
from phone_host.measure.trouble import Trouble
from phone_host.model import BoardFrame, Side
from phone_host.recording.recording_file import JSON, RecordingFile
from phone_host.recording.ros_messages import RecordedImage, image_message, image_type
from phone_host.sync.clock import ClockEstimate

_MOST_BYTES: Final = 64 << 20
"""What may wait for the disk: 10 s of both cameras at 3 MB/s, and a phone has memory for it."""

_SYNC_NS: Final = 1_000_000_000
"""A power cut takes a second at most."""

DELAYS: Final = "/delays"
CLOCK: Final = "/clock_estimate"


def image_topic(side: Side, *, is_raw: bool) -> str:
    """Return the topic of one camera's images."""
    return f"/{side.value}/image" if is_raw else f"/{side.value}/image/compressed"


@dataclass(frozen=True, slots=True)
class RecordingAccount:
    """What became of the frames.

    Attributes:
        frames: how many are in the file.
        dropped: how many came faster than the disk takes them.
        lost: how many came after the recording had ended early.
        size_bytes: how long the file is.
        failure: what ended the recording early; None: nothing did.
    """

    frames: int
    dropped: int
    lost: int
    size_bytes: int
    failure: Trouble | None


@dataclass(frozen=True, slots=True, eq=False)
class _Waiting:
    """A message on its way. An image's bytes are those that its camera gave: nobody writes into them any more."""

    topic: str
    content: "RecordedImage | Mapping[str, object]"
    sequence: int
    log_ns: int
    publish_ns: int

    @property
    def size(self) -> int:
        """Its bytes, roughly."""
        return len(self.content.payload) if isinstance(self.content, RecordedImage) else 1000


class Recorder:
    """Writes a recording in a thread of its own.

    Args:
        file: the recording; this class closes it.
        board_side: the side on which the board's camera stands.
        unix_ns: Unix time minus the host's monotonic clock, ns: what is added to each time.
    """

    def __init__(self, file: RecordingFile, board_side: Side, unix_ns: int) -> None:
        self._file, self._unix_ns = file, unix_ns
        self._board, self._own = board_side, board_side.other
        self._queue: deque[_Waiting] = deque()
        self._queued_bytes = 0
        self._changed = threading.Condition()
        self._is_closing = False
        self._frames = self._dropped = self._lost = 0
        self._failure: Trouble | None = None
        self._thread = threading.Thread(target=self._write_all, name="recorder", daemon=True)
        self._thread.start()

    @property
    def account(self) -> RecordingAccount:
        """What became of the frames so far."""
        with self._changed:
            return RecordingAccount(self._frames, self._dropped, self._lost, self._file.size_bytes, self._failure)

    def board_frame(self, frame: BoardFrame) -> None:
        """Take a frame of the board. Never waits."""
        message = frame.message
        size = (message.width_px, message.height_px)
        image = RecordedImage(
            self._unix_ns + frame.marks.exposed_ns, self._board.value, message.pixel_format, size, message.payload
        )
        self._offer(image, message.sequence, frame.received_ns, frame.marks.sent_ns)

    def own_frame(self, frame: Frame) -> None:
        """Take a frame of the host's camera. Never waits."""
        size = (frame.width_px, frame.height_px)
        image = RecordedImage(
            self._unix_ns + frame.exposed.ns, self._own.value, frame.pixel_format, size, bytes(frame.payload)
        )
        self._offer(image, frame.sequence, now.monotonic_ns(), frame.grabbed.ns)

    def delays(self, ledger: PairLedger) -> None:
        """Take the ledger of a pair. Never waits."""
        self._put(_Waiting(DELAYS, ledger.as_json(), ledger.sequence, ledger.done_ns, ledger.done_ns))

    def clock(self, estimate: ClockEstimate, at_ns: int) -> None:
        """Take a clock estimate. Never waits."""
        values = {
            "offset_ns": estimate.offset_ns,
            "uncertainty_ns": estimate.uncertainty_ns,
            "bound_ns": estimate.bound_ns,
        }
        self._put(_Waiting(CLOCK, values, 0, at_ns, at_ns))

    def finish(self) -> RecordingAccount:
        """Write what waits, end the file in order, and return what became of the frames."""
        with self._changed:
            self._is_closing = True
            self._changed.notify()
        self._thread.join()
        return self.account

    def _offer(self, image: RecordedImage, sequence: int, log_ns: int, publish_ns: int) -> None:
        side = Side(image.frame_id)
        topic = image_topic(side, is_raw="Compressed" not in image_type(image.pixel_format))
        self._put(_Waiting(topic, image, sequence, log_ns, publish_ns))

    def _put(self, item: _Waiting) -> None:
        is_image = isinstance(item.content, RecordedImage)
        with self._changed:
            if self._failure is not None or self._is_closing:
                self._lost += is_image
            elif self._queued_bytes + item.size > _MOST_BYTES:
                self._dropped += is_image
            else:
                self._queue.append(item)
                self._queued_bytes += item.size
                self._changed.notify()

    def _write_all(self) -> None:
        synced_ns = now.monotonic_ns()
        try:
            while (item := self._next()) is not None:
                self._write(item)
                if now.monotonic_ns() - synced_ns > _SYNC_NS:
                    self._file.sync()
                    synced_ns = now.monotonic_ns()
            self._file.close()
        except OSError as error:
            with self._changed:
                self._failure = Trouble(
                    f"the recording {self._file.path} ended early ({error.strerror})",
                    "make room; what it holds until then can be read",
                )
                self._lost += sum(isinstance(each.content, RecordedImage) for each in self._queue)
                self._queue.clear()
            self._file.abandon()

    def _next(self) -> _Waiting | None:
        with self._changed:
            while not self._queue and not self._is_closing:
                self._changed.wait()
            if not self._queue:
                return None
            item = self._queue.popleft()
            self._queued_bytes -= item.size
            return item

    def _write(self, item: _Waiting) -> None:
        is_image = isinstance(item.content, RecordedImage)
        data = image_message(item.content) if is_image else json.dumps(item.content).encode()  # type: ignore[arg-type]
        self._file.add(
            item.topic,
            data,
            sequence=item.sequence,
            log_ns=self._unix_ns + item.log_ns,
            publish_ns=self._unix_ns + item.publish_ns,
        )
        with self._changed:
            self._frames += is_image


TOPICS: Final[Mapping[str, str]] = {DELAYS: JSON, CLOCK: JSON}
"""Those of a recording that are no images."""
