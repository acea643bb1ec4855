"""Hands what a run has measured and computed to its recording: the delays of each pair, depth at most once a second in a thread of its own."""

from collections.abc import Collection
from enum import Enum
from functools import partial
from typing import Final

import numpy as np

from common.recording.layout import CLOUD, DEPTH
from common.recording.ros_messages import POINT_BYTES, cloud_parts, depth_parts
from phone_host.accounts.delays import SinkAccount
from phone_host.model import CloudImage, Image, Result, Side
from phone_host.output.depth_png import depth_mm
from phone_host.recording.switch import RecordingSwitch
from phone_host.run.sinks import OneQueueSink, SinkQueue

_EVERY_NS: Final = 1_000_000_000
"""A cloud of 640x480 has 5 MB: thirty a second would be fifty times what both cameras give."""


class Computed(Enum):
    """What may be recorded beside the images."""

    DEPTH = "depth"
    CLOUD = "cloud"


class ComputedSink(OneQueueSink):
    """A sink that records what was computed.

    Args:
        recording: takes it; while nothing is recorded, nothing is made.
        wanted: what is recorded.
        board_side: the side on which the board's camera stands: depth belongs to the left image's moment.
    """

    def __init__(self, recording: RecordingSwitch, wanted: Collection[Computed], board_side: Side) -> None:
        super().__init__(SinkQueue[Result]("recorded depth", self._take, depth=1))
        self._recording, self._wanted, self._is_board_left = recording, wanted, board_side is Side.LEFT
        self._last_ns: int | None = None

    def offer(self, result: Result) -> None:
        """See Sink; results between the seconds are not wanted."""
        done_ns = result.ledger.done_ns
        is_due = self._last_ns is None or done_ns - self._last_ns >= _EVERY_NS
        if is_due and self._recording.is_on and self._queue.offer(result):
            self._last_ns = done_ns

    def _take(self, result: Result) -> None:
        cloud, ledger = result.processed.cloud, result.ledger
        if cloud is None:
            return
        at_ns = ledger.board.exposed_ns if self._is_board_left else ledger.host.exposed_ns
        frame_id = Side.LEFT.value
        if Computed.DEPTH in self._wanted:
            depth, _ = depth_mm(cloud)
            size_px = depth.shape[1], depth.shape[0]
            data = depth.astype("<u2").tobytes()
            write = partial(depth_parts, frame_id=frame_id, size_px=size_px, data=data)
            self._recording.computed(DEPTH, write, ledger, at_ns)
        if Computed.CLOUD in self._wanted:
            data = cloud_data(cloud, result.processed.pair.left)
            self._recording.computed(CLOUD, partial(cloud_parts, frame_id=frame_id, data=data), ledger, at_ns)


class RecordingSink:
    """A sink that records the delays of each pair. It needs no queue of its own: the recorder has one.

    Attributes:
        failure: none: a disk that is full ends the recording, not the run.
    """

    def __init__(self, recorder: RecordingSwitch) -> None:
        self._recorder = recorder
        self.failure: Exception | None = None

    def await_place(self, number: int) -> None:
        """See Sink."""

    def offer(self, result: Result) -> None:
        """See Sink."""
        self._recorder.delays(result.ledger)

    def finish(self) -> None:
        """See Sink; the host ends the recorder."""

    @property
    def accounts(self) -> tuple[SinkAccount, ...]:
        """None: the recording has its own account."""
        return ()


def cloud_data(cloud: CloudImage, colours: Image) -> bytes:
    """Return the points of a cloud as a recording has them.

    Args:
        cloud: (H, W, 3) float32, m; NaN: none.
        colours: (H, W) grey or (H, W, 3) BGR, uint8: of each point.

    Returns:
        x, y, z, m, and 0x00RRGGBB of each point that is there, `POINT_BYTES` each, little endian.
    """
    there = ~np.isnan(cloud[..., 2])
    points = np.empty((int(np.count_nonzero(there)), POINT_BYTES // 4), "<f4")
    points[:, :3] = cloud[there]
    seen = colours[there].astype("<u4")
    blue, green, red = seen.T if seen.ndim > 1 else (seen, seen, seen)
    points[:, 3] = (red << 16 | green << 8 | blue).view("<f4")
    return points.tobytes()
