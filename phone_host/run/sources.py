"""Where the frames of a run come from: a board and this machine's camera, with or without a recorder beside them; or a recording of both."""

from collections.abc import Sequence

from common import now
from common.camera.base import Camera
from common.frame import Frame
from common.link.base import Link
from common.protocol.message import CameraDescription
from phone_host.model import BoardFrame
from phone_host.recording.playback import Playback
from phone_host.recording.switch import RecordingSwitch
from phone_host.stream.demand_clock import DemandClock
from phone_host.stream.frame_sink import FrameSink
from phone_host.stream.own_camera import OwnCamera
from phone_host.stream.pair_queue import PairQueue
from phone_host.stream.receiver import Receiver
from phone_host.stream.streams import BoardStream, OwnStream
from phone_host.sync.quarantine import Disbelief


def streams(
    camera: Camera | Playback,
    links: Sequence[Link],
    queue: PairQueue,
    demand: DemandClock,
    recorder: RecordingSwitch | None,
) -> tuple[OwnStream, BoardStream]:
    """Return both sides of a run, not started.

    Args:
        camera: this machine's, open; or a recording.
        links: open links to the board; none beside a recording.
        queue: takes the frames.
        demand: says when a demand-paced camera shows an image.
        recorder: sees every frame; None: nothing is recorded.
    """
    if isinstance(camera, Playback):
        return camera.into(queue)
    if recorder is None:
        own = OwnCamera(camera, queue.add_host, demand, queue.own_image_missing)
        return own, Receiver(links, now.random_id(), queue)

    def seen(frame: Frame) -> None:
        recorder.own_frame(frame)
        queue.add_host(frame)

    own = OwnCamera(camera, seen, demand, queue.own_image_missing)
    return own, Receiver(links, now.random_id(), Tap(queue, recorder))


class Tap:
    """A frame sink with a recorder before it, which sees every frame that is believed, also those that the sink does not want.

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
