"""Takes frames of both cameras into a recording: as they came, before they are paired, those that find no partner, too.

Whoever brings a frame never waits: it goes into a bounded queue, which a thread empties. A disk that is full ends the recording, not the run.
"""

import logging
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Final

from common import now
from common.diagnostic import Diagnostic, Severity
from common.errors import SettingsError, UnavailableError
from common.frame import Buffer, Frame
from common.ledger import BoardMarks, PairLedger
from common.program.logs import event
from common.protocol.message import CameraDescription
from common.recording.disk_queue import DiskQueue
from common.recording.layout import (
    ABOUT,
    CAPTURE,
    CLOCK,
    DELAYS,
    About,
    CaptureRuns,
    camera_info_topic,
    camera_name,
    camera_values,
    image_topic,
)
from common.recording.recording_file import RecordingFile
from common.recording.ros_messages import CameraInfo, RecordedImage, camera_info_message, image_parts, image_type
from common.versions import all_versions
from phone_host.diagnostics.run_snapshot import RecordingAccount
from phone_host.model import BoardFrame, CameraModel, Lens, Rectification, Rig, Side
from phone_host.recording.clock_messages import clock_text
from phone_host.stereo.rectify import rectify_rig
from phone_host.stream.demand_clock import has_own_time
from phone_host.sync.clock import ClockEstimate

_LOG = logging.getLogger(__name__)

_MOST_BYTES: Final = 64 << 20
"""What may wait for the disk: 20 s of both cameras at 3 MB/s, and a phone has memory for it."""

_TOLD_BYTES: Final = 1000
"""What values by name take, roughly."""


class _Writing:
    """What the thread does with its file. Images' bytes are those that their cameras gave: nobody writes into them any more."""

    def __init__(self, file: RecordingFile, unix_ns: int) -> None:
        self.file, self._unix_ns = file, unix_ns
        self._captured = CaptureRuns()
        self.clock: ClockEstimate | None = None
        self.attached: Mapping[str, bytes] = {}

    def image(self, image: RecordedImage, sequence: int, log_ns: int, publish_ns: int) -> None:
        """Write an image."""
        topic = image_topic(image.frame_id, image_type(image.pixel_format))
        self.message(topic, image_parts(image), sequence, log_ns, publish_ns)

    def board_image(self, image: RecordedImage, sequence: int, marks: BoardMarks, received_ns: int) -> None:
        """Write an image of the board; when it was grabbed stands with others in a message of its own."""
        self.image(image, sequence, received_ns, marks.sent_ns)
        self._captured.note(sequence, marks.grabbed_ns - marks.exposed_ns)

    def message(self, topic: str, parts: tuple[Buffer, ...], sequence: int, log_ns: int, publish_ns: int) -> None:
        """Write a message."""
        unix_ns = self._unix_ns
        self.file.add(topic, *parts, sequence=sequence, log_ns=unix_ns + log_ns, publish_ns=unix_ns + publish_ns)

    def end_chunk(self) -> None:
        """See Target."""
        self.file.end_chunk()

    def sync(self) -> None:
        """See Target."""
        self._write_captured()
        self.file.sync()

    def close(self) -> None:
        """See Target."""
        self._write_captured()
        at_ns = self._unix_ns + now.monotonic_ns()
        if self.clock is not None:
            self.file.tell("clock", {name: str(value) for name, value in asdict(self.clock).items()})
        for name, data in self.attached.items():
            self.file.attach(name, "application/octet-stream", data, at_ns)
        self.file.close()

    def abandon(self, cause: str) -> None:
        """See Target."""
        _LOG.error(event("recording_ended_early", file=self.file.path, cause=cause, remedy="what is in it can be used"))
        self.file.abandon()

    def _write_captured(self) -> None:
        """Write the board's marks of the last second in one message: one for each image would be a fifth of all that is not image."""
        if text := self._captured.take():
            at_ns = now.monotonic_ns()
            self.message(CAPTURE, (text,), 0, at_ns, at_ns)


class Recorder:
    """Writes a recording in a thread of its own.

    Args:
        file: the recording; this class closes it.
        board_side: the side on which the board's camera stands.
        unix_ns: Unix time minus the host's monotonic clock, ns: what is added to each time.
    """

    def __init__(self, file: RecordingFile, board_side: Side, unix_ns: int) -> None:
        self._unix_ns = unix_ns
        self._board, self._own = board_side.value, board_side.other.value
        self._camera: CameraDescription | None = None
        self._began_ns, self._begun_ns = 0, now.monotonic_ns()
        self._session = ""
        self._clock: ClockEstimate | None = None
        self._writing = _Writing(file, unix_ns)
        self._queue = DiskQueue("recorder", self._writing, _MOST_BYTES)

    @property
    def account(self) -> RecordingAccount:
        """What became of the images so far."""
        queued, file = self._queue.account, self._writing.file
        trouble = Diagnostic(f"it ended early ({queued.cause})", queued.remedy, Severity.FAIL)
        return RecordingAccount(
            file=str(file.path),
            frames=queued.frames,
            dropped=queued.dropped,
            lost=queued.lost,
            size_bytes=file.size_bytes,
            seconds=((queued.ended_ns or now.monotonic_ns()) - self._begun_ns) / 1e9,
            left_bytes=file.left_bytes,
            is_over=queued.ended_ns > 0,
            failure=None if queued.end is None else trouble,
        )

    def own_camera(self, camera: CameraDescription) -> None:
        """Take what the host's camera says of itself."""
        self._tell(camera_name(self._own), camera_values(camera))

    def board_camera(self, camera: CameraDescription) -> None:
        """Take what the board's camera says of itself, at the begin of a session. Called by the thread that brings its frames."""
        self._camera, self._began_ns = camera, now.monotonic_ns()

    def board_frame(self, frame: BoardFrame) -> None:
        """Take a frame of the board. Never waits."""
        message, marks = frame.message, frame.marks
        if message.session != self._session and self._camera is not None:
            self._session = message.session
            told = {**camera_values(self._camera), "session": message.session, "link": frame.link}
            self._tell(camera_name(self._board), {**told, "began_ns": str(self._unix_ns + self._began_ns)})
        size, stamp_ns = (message.width_px, message.height_px), self._unix_ns + marks.exposed_ns
        image = RecordedImage(stamp_ns, self._board, message.pixel_format, size, message.payload)
        job = partial(self._writing.board_image, image, message.sequence, marks, frame.received_ns)
        self._queue.put(job, len(image.payload), is_frame=True)

    def own_frame(self, frame: Frame) -> None:
        """Take a frame of the host's camera. Never waits."""
        size, stamp_ns = (frame.width_px, frame.height_px), self._unix_ns + frame.exposed.ns
        image = RecordedImage(stamp_ns, self._own, frame.pixel_format, size, bytes(frame.payload))
        job = partial(self._writing.image, image, frame.sequence, now.monotonic_ns(), frame.grabbed.ns)
        self._queue.put(job, len(image.payload), is_frame=True)

    def delays(self, ledger: PairLedger) -> None:
        """Take the ledger of a pair. Never waits."""
        self._message(DELAYS, (ledger.to_json().encode(),), ledger.sequence, ledger.done_ns)

    def clock(self, estimate: ClockEstimate | None, boot_id: str, at_ns: int) -> None:
        """Take a clock estimate and the boot of the board whose clock it is; one that is not new is left out. Never waits."""
        if estimate is not None and estimate != self._clock:
            self._clock = estimate
            self._message(CLOCK, (clock_text(estimate, boot_id).encode(),), 0, at_ns)

    def computed(self, topic: str, write: Callable[[int], tuple[Buffer, ...]], ledger: PairLedger, at_ns: int) -> None:
        """Take what was computed of a pair. Never waits.

        Args:
            topic: where it goes.
            write: makes the message, in pieces, with its stamp in ns since 1970.
            ledger: of the pair.
            at_ns: when the image was exposed that it belongs to.
        """
        self._message(topic, write(self._unix_ns + at_ns), ledger.sequence, ledger.done_ns)

    def finish(self, attached: Mapping[str, bytes] | None = None) -> RecordingAccount:
        """Write what waits, end the file in order, and return what became of the images.

        Args:
            attached: files to be added at the end, by name.
        """
        self._writing.clock, self._writing.attached = self._clock, attached or {}
        self._queue.finish()
        return self.account

    def _message(self, topic: str, parts: tuple[Buffer, ...], sequence: int, at_ns: int) -> None:
        job = partial(self._writing.message, topic, parts, sequence, at_ns, at_ns)
        self._queue.put(job, sum(map(len, parts)))

    def _tell(self, name: str, values: dict[str, str]) -> None:
        self._queue.put(partial(self._writing.file.tell, name, values), _TOLD_BYTES)


_LENSES = {Lens.PINHOLE: ("plumb_bob", 5), Lens.RATIONAL: ("rational_polynomial", 8), Lens.FISHEYE: ("equidistant", 4)}


def begin_recording(
    path: Path,
    camera: CameraDescription,
    board_side: Side,
    rig: Rig | None = None,
    attached: Mapping[str, bytes] | None = None,
) -> Recorder:
    """Begin a recording.

    Args:
        path: the file; it must not exist.
        camera: the host's camera.
        board_side: the side on which the board's camera stands.
        rig: for what is known of both cameras; None: nothing is.
        attached: files to be kept in it, by name.

    Raises:
        SettingsError: the host's camera has no clock.
        UnavailableError: the file exists or cannot be made.
    """
    if not has_own_time(camera.pacing):
        raise SettingsError("--camera has pace=demand, and so no clock", "give it fps= or pace=clock")
    file = RecordingFile(path)
    try:
        return _begun(file, camera, board_side, rig, attached or {})
    except OSError as error:
        _drop(file)
        raise UnavailableError(
            f"{path} cannot be written ({error.strerror})", "make room, or name another file"
        ) from None
    except BaseException:
        _drop(file)
        raise


def _drop(file: RecordingFile) -> None:
    """Remove a recording that holds nothing yet: the next try may use its name again."""
    file.abandon()
    file.path.unlink(missing_ok=True)


def _begun(
    file: RecordingFile, camera: CameraDescription, board_side: Side, rig: Rig | None, attached: Mapping[str, bytes]
) -> Recorder:
    unix_ns = now.unix_offset_ns()
    at_ns = unix_ns + now.monotonic_ns()
    about = About(unix_ns=unix_ns, board_side=board_side.value, host_boot_id=now.boot_id(), versions=all_versions())
    file.tell(ABOUT, about.values())
    for name, data in attached.items():
        file.attach(name, "application/octet-stream", data, at_ns)
    for side, info in () if rig is None else camera_infos(rig, rectify_rig(rig), at_ns):
        data = camera_info_message(info)
        file.add(camera_info_topic(side.value), data, sequence=0, log_ns=at_ns, publish_ns=at_ns)
    recorder = Recorder(file, board_side, unix_ns)
    recorder.own_camera(camera)
    return recorder


def camera_infos(rig: Rig, rectification: Rectification, stamp_ns: int) -> tuple[tuple[Side, CameraInfo], ...]:
    """Return what ROS calls camera_info of both cameras.

    Args:
        rig: the cameras.
        rectification: how their images are rectified.
        stamp_ns: when, ns since 1970.
    """
    left = _info(Side.LEFT, rig.left, rectification, stamp_ns)
    return (Side.LEFT, left), (Side.RIGHT, _info(Side.RIGHT, rig.right, rectification, stamp_ns))


def _info(side: Side, camera: CameraModel, rectification: Rectification, stamp_ns: int) -> CameraInfo:
    is_left = side is Side.LEFT
    coefficients = [float(value) for value in camera.distortion.ravel()]
    is_rational = camera.lens is Lens.PINHOLE and len(coefficients) > _LENSES[Lens.PINHOLE][1]
    model, count = _LENSES[Lens.RATIONAL if is_rational else camera.lens]
    return CameraInfo(
        stamp_ns=stamp_ns,
        frame_id=side.value,
        size_px=(camera.width_px, camera.height_px),
        model=model,
        distortion=[*coefficients, *[0.0] * (count - len(coefficients))],
        matrix=[float(value) for value in camera.matrix.ravel()],
        rotation=[float(v) for v in (rectification.R_left if is_left else rectification.R_right).ravel()],
        projection=[float(v) for v in (rectification.P_left if is_left else rectification.P_right).ravel()],
    )


class UnpairedFrames:
    """A taker that hands everything to a recorder.

    Args:
        recorder: writes.
    """

    def __init__(self, recorder: Recorder) -> None:
        self._recorder = recorder
        self.begun_ns: int | None = None

    @property
    def account(self) -> RecordingAccount:
        """What became of the frames so far."""
        return self._recorder.account

    @property
    def is_full(self) -> bool:
        """Whether the recording has ended early."""
        return self._recorder.account.failure is not None

    def begin(self, camera: CameraDescription) -> None:
        """See FrameSink."""
        self._recorder.board_camera(camera)

    def change_period(self, board_period_ns: int) -> None:
        """See FrameSink."""

    def void(self) -> None:
        """See FrameSink."""

    def room(self) -> None:
        """There is always room: what the disk cannot take is dropped and counted."""

    def objection(self, frame: BoardFrame) -> None:
        """Every frame is wanted."""

    def tick(self) -> None:
        """See FrameSink."""

    def add_board(self, frame: BoardFrame) -> None:
        """Take a frame of the board."""
        self.begun_ns = self.begun_ns or frame.received_ns
        self._recorder.board_frame(frame)

    def add_host(self, frame: Frame) -> None:
        """Take a frame of the own camera."""
        self._recorder.own_frame(frame)

    def clock(self, estimate: ClockEstimate | None, boot_id: str, at_ns: int) -> None:
        """Take what is known of the board's clock."""
        self._recorder.clock(estimate, boot_id, at_ns)
