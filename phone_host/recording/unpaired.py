"""Takes frames into a recording, and nothing else: no pairs, no depth. As light as the link."""

from common.frame import Frame
from common.protocol.message import CameraDescription
from phone_host.diagnostics.run_snapshot import RecordingAccount
from phone_host.model import BoardFrame
from phone_host.recording.recorder import Recorder
from phone_host.sync.clock import ClockEstimate


class UnpairedFrames:
    """A taker that hands everything to a recorder."""

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
