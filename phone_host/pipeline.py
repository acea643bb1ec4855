"""What the worker does with a pair: decode, rectify or pass, match, reproject; each stage timed. The order of the stages lives here."""

from collections.abc import Callable
from dataclasses import dataclass

from common.frame import Frame
from common.ledger import StageTimes
from common.protocol.message import FrameMessage
from phone_host.model import CloudImage, Disparity, FramePair, RectifiedPair, Side
from phone_host.stereo.core import StereoCore
from phone_host.stereo.raw_images import EncodedImage, decode_frames


@dataclass(frozen=True, slots=True)
class Processed:
    """What became of a pair.

    Attributes:
        pair: the rectified images (as they came when there is no core).
        disparity: px; None without a core.
        cloud: metres; None without a core or geometry.
        stages: time of each stage, `write` still 0.
    """

    pair: RectifiedPair
    disparity: Disparity | None
    cloud: CloudImage | None
    stages: StageTimes


class Pipeline:
    """The stereo pipeline.

    Args:
        core: rectification, matching and reprojection; None to decode only (delays without depth).
        board_side: which view the board's frame is.
        clock: gives ns of CLOCK_MONOTONIC.
    """

    def __init__(self, core: StereoCore | None, board_side: Side, clock: Callable[[], int]) -> None:
        self._core = core
        self._board_side = board_side
        self._clock = clock

    def process(self, pair: FramePair) -> Processed:
        """Compute a pair's depth.

        Args:
            pair: two encoded frames.

        Returns:
            Images, disparity, cloud and stage times.

        Raises:
            DataError: a frame's bytes are no image, or its size does not fit the rig.
        """
        board, host = _encoded(pair.board.message, "board"), _encoded(pair.host, "host")
        first, second = (board, host) if self._board_side is Side.LEFT else (host, board)
        start_ns = self._clock()
        left, right = decode_frames(first, second)
        decoded_ns = self._clock()
        if self._core is None:
            return Processed(RectifiedPair(left, right), None, None, StageTimes(decode=decoded_ns - start_ns))
        rectified = self._core.rectify(left, right)
        rectified_ns = self._clock()
        disparity = self._core.match(rectified)
        matched_ns = self._clock()
        cloud = self._core.reproject(disparity) if self._core.geometry is not None else None
        reprojected_ns = self._clock()
        stages = StageTimes(
            decode=decoded_ns - start_ns,
            rectify=rectified_ns - decoded_ns,
            match=matched_ns - rectified_ns,
            reproject=reprojected_ns - matched_ns,
        )
        return Processed(rectified, disparity, cloud, stages)


def _encoded(frame: FrameMessage | Frame, whose: str) -> EncodedImage:
    payload = memoryview(frame.payload)
    return EncodedImage(payload, frame.pixel_format, frame.width_px, frame.height_px, f"{whose} frame {frame.sequence}")
