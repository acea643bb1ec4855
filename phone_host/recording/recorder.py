"""Takes frames of both cameras into a recording: as they came, before they are paired, those that find no partner, too.

Whoever brings a frame never waits: it goes into a bounded queue, which a thread empties. A disk that is full ends the recording, not the run.
"""

import logging
import threading
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Final

from common import now
from common.frame import Buffer, Frame
from common.ledger import PairLedger
from common.program.logs import event
from common.protocol.message import CameraDescription
from common.recording.capture_runs import CaptureRuns
from common.recording.layout import CAPTURE, CLOCK, DELAYS, camera_name, camera_values, image_topic
from common.recording.mcap_writer import CHUNK_BYTES
from common.recording.recording_file import RecordingFile
from common.recording.ros_messages import RecordedImage, image_parts, image_type
from phone_host.measure.recording_account import RecordingAccount
from phone_host.measure.trouble import Trouble
from phone_host.model import BoardFrame, Side
from phone_host.recording.clock_messages import clock_text
from phone_host.sync.clock import ClockEstimate

_LOG = logging.getLogger(__name__)

_MOST_BYTES: Final = 64 << 20
"""What may wait for the disk, and as much again may be under way to it: 10 s of both cameras at 3 MB/s, and a phone has memory for it."""

_TOLD_BYTES: Final = 1000
"""What values by name take, roughly."""

_GATHER_S: Final = 0.1
"""So long an image waits for others with which it makes a chunk. To wake the writer for each would cost more than to write it."""

_SYNC_NS: Final = 700_000_000
"""A power cut takes a second at most: this, what waits, and the time that the disk takes."""


@dataclass(frozen=True, slots=True, eq=False)
class _Image:
    """An image on its way. Its bytes are those that its camera gave: nobody writes into them any more.

    `capture_ns` is the time from its exposure until it was grabbed, of the board's images only.
    """

    image: RecordedImage
    sequence: int
    log_ns: int
    publish_ns: int
    capture_ns: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class _Message:
    """A message that is no image of a camera on its way, in pieces."""

    topic: str
    parts: tuple[Buffer, ...]
    sequence: int
    at_ns: int


@dataclass(frozen=True, slots=True, eq=False)
class _Told:
    """Values by name on their way."""

    name: str
    values: dict[str, str]


_Item = _Image | _Message | _Told


class Recorder:
    """Writes a recording in a thread of its own.

    Args:
        file: the recording; this class closes it.
        board_side: the side on which the board's camera stands.
        unix_ns: Unix time minus the host's monotonic clock, ns: what is added to each time.
    """

    def __init__(self, file: RecordingFile, board_side: Side, unix_ns: int) -> None:
        self._file, self._unix_ns = file, unix_ns
        self._board, self._own = board_side.value, board_side.other.value
        self._camera: CameraDescription | None = None
        self._began_ns = self._ended_ns = 0
        self._begun_ns = now.monotonic_ns()
        self._session = ""
        self._clock: ClockEstimate | None = None
        self._captured = CaptureRuns()
        self._queue: deque[_Item] = deque()
        self._queued_bytes = 0
        self._changed = threading.Condition()
        self._is_closing = False
        self._frames = self._dropped = self._lost = 0
        self._failure: Trouble | None = None
        self._attached: Mapping[str, bytes] = {}
        self._thread = threading.Thread(target=self._write_all, name="recorder", daemon=True)
        self._thread.start()

    @property
    def account(self) -> RecordingAccount:
        """What became of the images so far."""
        left_bytes = self._file.left_bytes  # before the lock, for which frames would wait: a disk may be slow
        with self._changed:
            return RecordingAccount(
                file=str(self._file.path),
                frames=self._frames,
                dropped=self._dropped,
                lost=self._lost,
                size_bytes=self._file.size_bytes,
                seconds=((self._ended_ns or now.monotonic_ns()) - self._begun_ns) / 1e9,
                left_bytes=left_bytes,
                is_over=self._ended_ns > 0,
                failure=self._failure,
            )

    def own_camera(self, camera: CameraDescription) -> None:
        """Take what the host's camera says of itself."""
        self._put(_Told(camera_name(self._own), camera_values(camera)))

    def board_camera(self, camera: CameraDescription) -> None:
        """Take what the board's camera says of itself, at the begin of a session. Called by the thread that brings its frames."""
        self._camera, self._began_ns = camera, now.monotonic_ns()

    def board_frame(self, frame: BoardFrame) -> None:
        """Take a frame of the board. Never waits."""
        message, marks = frame.message, frame.marks
        if message.session != self._session and self._camera is not None:
            self._session = message.session
            told = {**camera_values(self._camera), "session": message.session, "link": frame.link}
            told["began_ns"] = str(self._unix_ns + self._began_ns)
            self._put(_Told(camera_name(self._board), told))
        size = (message.width_px, message.height_px)
        stamp_ns = self._unix_ns + marks.exposed_ns
        image = RecordedImage(stamp_ns, self._board, message.pixel_format, size, message.payload)
        capture_ns = marks.grabbed_ns - marks.exposed_ns
        self._put(_Image(image, message.sequence, frame.received_ns, marks.sent_ns, capture_ns))

    def own_frame(self, frame: Frame) -> None:
        """Take a frame of the host's camera. Never waits."""
        size, stamp_ns = (frame.width_px, frame.height_px), self._unix_ns + frame.exposed.ns
        image = RecordedImage(stamp_ns, self._own, frame.pixel_format, size, bytes(frame.payload))
        self._put(_Image(image, frame.sequence, now.monotonic_ns(), frame.grabbed.ns))

    def delays(self, ledger: PairLedger) -> None:
        """Take the ledger of a pair. Never waits."""
        self._put(_Message(DELAYS, (ledger.to_json().encode(),), ledger.sequence, ledger.done_ns))

    def clock(self, estimate: ClockEstimate | None, boot_id: str, at_ns: int) -> None:
        """Take a clock estimate and the boot of the board whose clock it is; one that is not new is left out. Never waits."""
        if estimate is not None and estimate != self._clock:
            self._clock = estimate
            self._put(_Message(CLOCK, (clock_text(estimate, boot_id).encode(),), 0, at_ns))

    def computed(self, topic: str, write: Callable[[int], tuple[Buffer, ...]], ledger: PairLedger, at_ns: int) -> None:
        """Take what was computed of a pair. Never waits.

        Args:
            topic: where it goes.
            write: makes the message, in pieces, with its stamp in ns since 1970.
            ledger: of the pair.
            at_ns: when the image was exposed that it belongs to.
        """
        self._put(_Message(topic, write(self._unix_ns + at_ns), ledger.sequence, ledger.done_ns))

    def finish(self, attached: Mapping[str, bytes] | None = None) -> RecordingAccount:
        """Write what waits, end the file in order, and return what became of the images.

        Args:
            attached: files to be added at the end, by name.
        """
        with self._changed:
            self._attached = attached or {}
            self._is_closing = True
            self._changed.notify()
        self._thread.join()
        with self._changed:
            self._ended_ns = self._ended_ns or now.monotonic_ns()
        return self.account

    def _put(self, item: _Item) -> None:
        size, is_image = _size(item), isinstance(item, _Image)
        with self._changed:
            if self._failure is not None or self._is_closing:
                self._lost += is_image
            elif self._queued_bytes + size > _MOST_BYTES:
                self._dropped += is_image
            else:
                self._queue.append(item)
                self._queued_bytes += size
                if self._queued_bytes >= CHUNK_BYTES:
                    self._changed.notify()

    def _write_all(self) -> None:
        synced_ns, waiting = now.monotonic_ns(), 0
        try:
            while (taken := self._next()) is not None:
                waiting = images = sum(isinstance(item, _Image) for item in taken)
                for item in taken:
                    self._write(item)
                    waiting -= isinstance(item, _Image)
                now_ns = now.monotonic_ns()
                is_due = now_ns - synced_ns >= _SYNC_NS  # counted from the begin of one to the begin of the next
                if is_due:
                    synced_ns = now_ns
                    self._write_captured()
                self._file.end_chunk()
                with self._changed:
                    self._frames += images
                if is_due:
                    self._file.sync()
            self._end()
        except Exception as error:  # noqa: BLE001 - a thread's root: the run goes on, and its account says what is missing
            self._fail(error, waiting)

    def _end(self) -> None:
        self._write_captured()
        at_ns = self._unix_ns + now.monotonic_ns()
        if self._clock is not None:
            self._file.tell("clock", {name: str(value) for name, value in asdict(self._clock).items()})
        for name, data in self._attached.items():
            self._file.attach(name, "application/octet-stream", data, at_ns)
        self._file.close()

    def _fail(self, error: Exception, unwritten: int) -> None:
        cause = getattr(error, "strerror", None) or f"{type(error).__name__}: {error}"
        failure = Trouble(f"it ended early ({cause})", "make room; what is in it can be used")
        _LOG.error(
            event("recording_ended_early", file=self._file.path, cause=cause, remedy="make room; the run goes on")
        )
        with self._changed:
            self._failure, self._ended_ns = failure, now.monotonic_ns()
            self._lost += unwritten + sum(isinstance(each, _Image) for each in self._queue)
            self._queue.clear()
            self._queued_bytes = 0
        self._file.abandon()

    def _next(self) -> list[_Item] | None:
        """Wait until there is enough for a chunk, but not long; None: nothing will come."""
        with self._changed:
            self._changed.wait_for(lambda: self._is_closing or self._queued_bytes >= CHUNK_BYTES, _GATHER_S)
            if not self._queue and self._is_closing:
                return None
            taken = list(self._queue)
            self._queue.clear()
            self._queued_bytes = 0
            return taken

    def _write(self, item: _Item) -> None:
        match item:
            case _Image(image, sequence, log_ns, publish_ns, capture_ns):
                topic = image_topic(image.frame_id, image_type(image.pixel_format))
                self._add(topic, image_parts(image), sequence, log_ns, publish_ns)
                if capture_ns is not None:
                    self._captured.note(sequence, capture_ns)
            case _Message(topic, parts, sequence, at_ns):
                self._add(topic, parts, sequence, at_ns, at_ns)
            case _Told(name, values):
                self._file.tell(name, values)

    def _add(self, topic: str, parts: tuple[Buffer, ...], sequence: int, log_ns: int, publish_ns: int) -> None:
        unix_ns = self._unix_ns
        self._file.add(topic, *parts, sequence=sequence, log_ns=unix_ns + log_ns, publish_ns=unix_ns + publish_ns)

    def _write_captured(self) -> None:
        """Write the board's marks of the last second in one message: one for each image would be a fifth of all that is not image."""
        if text := self._captured.take():
            at_ns = now.monotonic_ns()
            self._add(CAPTURE, (text,), 0, at_ns, at_ns)


def _size(item: _Item) -> int:
    match item:
        case _Image(image):
            return len(image.payload)
        case _Message(_, parts):
            return sum(map(len, parts))
        case _Told():
            return _TOLD_BYTES
