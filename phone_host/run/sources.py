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
from phone_host.stream.own_camera import OwnCamera
from phone_host.stream.pair_queue import PairQueue
from phone_host.stream.receiver import Receiver
from phone_host.stream.streams import BoardStream, OwnStream
from phone_host.sync.quarantine import Disbelief


def streams(
    camera: Camera | Playback, links: Sequence[Link], queue: PairQueue, demand: DemandClock
) -> tuple[OwnStream, BoardStream]:
    """Return both sides of a run, not started.

    Args:
        camera: this machine's, open; or a recording.
        links: open links to the board; none beside a recording.
        queue: takes the frames.
        demand: says when a demand-paced camera shows an image.
    """
    if isinstance(camera, Playback):
        return camera.into(queue)
    return OwnCamera(camera, queue.add_host, demand, queue.own_image_missing), Receiver(links, now.random_id(), queue)


class RecordedPairQueue(PairQueue):
    """A pair queue with a recorder before it.

    Attributes:
        recorder: sees every frame that is believed, also those that the queue does not want; None: nothing is recorded.
    """

    recorder: RecordingSwitch | None = None

    def begin(self, camera: CameraDescription) -> None:
        """See FrameSink."""
        if self.recorder is not None:
            self.recorder.board_camera(camera)
        super().begin(camera)

    def objection(self, frame: BoardFrame) -> Disbelief | None:
        """See FrameSink."""
        if self.recorder is not None:
            self.recorder.board_frame(frame)
        return super().objection(frame)

    def add_host(self, frame: Frame) -> None:
        """Take a frame of the host camera."""
        if self.recorder is not None:
            self.recorder.own_frame(frame)
        super().add_host(frame)
