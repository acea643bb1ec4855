"""Where the frames of a run come from: a board and this machine's camera, with or without a recorder beside them; or a recording of both."""

from collections.abc import Sequence
from typing import Final

from common import now
from common.camera.base import Camera
from common.camera.image_numbers import ShowsFiles
from common.frame import Frame
from common.link.base import Link
from common.protocol.message import CameraDescription
from phone_host.model import BoardFrame
from phone_host.recording.playback import Playback
from phone_host.recording.switch import RecordingSwitch
from phone_host.run.host_settings import HostSettings
from phone_host.stream.demand_clock import DemandClock
from phone_host.stream.own_camera import OwnCamera
from phone_host.stream.pair_queue import PairQueue
from phone_host.stream.receiver import Receiver
from phone_host.stream.streams import BoardStream, OwnStream
from phone_host.sync.fifo import FifoSettings, Overflow
from phone_host.sync.quarantine import Disbelief
from phone_host.sync.stills import Stills

_UNHURRIED: Final = FifoSettings(1000, Overflow.BLOCK)
"""A replay on demand waits for the worker: nothing is dropped."""


def demand_of(camera: Camera | Playback) -> DemandClock:
    """Return what says when a demand-paced camera shows an image, for this machine's camera or a recording."""
    stills = Stills(camera.images, camera.numbers) if isinstance(camera, ShowsFiles) else None
    is_timeless = isinstance(camera, Playback) and camera.is_timeless
    return DemandClock(camera.description.pacing, stills, is_timeless=is_timeless)


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


def paired_streams(
    settings: HostSettings,
    camera: Camera | Playback,
    links: Sequence[Link],
    demand: DemandClock,
    recording: RecordingSwitch | None,
) -> tuple[RecordedPairQueue, OwnStream, BoardStream]:
    """Return the queue of a run, and both sides that fill it, not started.

    Args:
        settings: of the run.
        camera: this machine's, open; or a recording.
        links: open links to the board; none beside a recording.
        demand: see `demand_of`.
        recording: sees every frame; None: nothing is recorded.
    """
    played = camera if isinstance(camera, Playback) else None
    queue = RecordedPairQueue(
        _UNHURRIED if played is not None and demand.is_timeless else settings.fifo,
        settings.tolerance_ns,
        camera.description.period_ns,
        demand=demand,
        time_offset_ns=settings.time_offset.offset_ns,
        own_images=camera.images if isinstance(camera, ShowsFiles) else None,
        clock=now.monotonic_ns if played is None else played.clock_ns,
        marking=now.monotonic_ns,
    )
    queue.recorder = recording
    if isinstance(camera, Playback):
        return queue, *camera.into(queue)
    own = OwnCamera(camera, queue.add_host, demand, queue.own_image_missing)
    return queue, own, Receiver(links, now.random_id(), queue)
