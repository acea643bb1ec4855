"""Stands before a frame sink and lets a recorder see what comes by: every frame that is believed, also those that the sink does not want."""

from common.protocol.message import CameraDescription
from phone_host.model import BoardFrame
from phone_host.recording.switch import RecordingSwitch
from phone_host.stream.frame_sink import FrameSink
from phone_host.sync.quarantine import Disbelief


class Tap:
    """A frame sink with a recorder before it.

    Args:
        sink: takes the frames as before.
        recorder: sees them first.
    """

    def __init__(self, sink: FrameSink, recorder: RecordingSwitch) -> None:
        self._sink, self._recorder = sink, recorder

    def begin(self, camera: CameraDescription) -> None:
        """See FrameSink."""
        self._recorder.board_camera(camera)
        self._sink.begin(camera)

    def change_period(self, board_period_ns: int) -> None:
        """See FrameSink."""
        self._sink.change_period(board_period_ns)

    def void(self) -> None:
        """See FrameSink."""
        self._sink.void()

    def room(self) -> int | None:
        """See FrameSink."""
        return self._sink.room()

    def objection(self, frame: BoardFrame) -> Disbelief | None:
        """See FrameSink."""
        self._recorder.board_frame(frame)
        return self._sink.objection(frame)

    def add_board(self, frame: BoardFrame) -> None:
        """See FrameSink."""
        self._sink.add_board(frame)

    def tick(self) -> None:
        """See FrameSink."""
        self._sink.tick()
