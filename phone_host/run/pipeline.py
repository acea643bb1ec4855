"""The processing of a pair: decode, optionally interpolate and rectify, match, reproject. Each stage is timed.

This module alone defines the order of the stages.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from common.errors import DataError
from common.frame import Frame
from common.imagesize.head import MOST_PIXELS
from common.ledger import StageTimes
from common.protocol.message import FrameMessage
from phone_host.model import FramePair, Image, Processed, RectifiedPair, Side
from phone_host.stereo.core import StereoCore
from phone_host.stereo.interpolate import LARGEST_FRACTION, Interpolator
from phone_host.stereo.raw_images import EncodedImage, decode_frame, decode_frames

T = TypeVar("T")


class Pipeline:
    """The stereo pipeline.

    Args:
        core: rectification, matching and reprojection; None to decode only (delays without depth).
        board_side: which view the board's frame is.
        clock: returns CLOCK_MONOTONIC, ns.
        interpolator: interpolates the board's image to the moment of the host's; None to leave it unchanged.
        most_pixels: largest accepted image size of either camera, pixels.
    """

    def __init__(
        self,
        core: StereoCore | None,
        board_side: Side,
        clock: Callable[[], int],
        interpolator: Interpolator | None = None,
        most_pixels: int = MOST_PIXELS,
    ) -> None:
        self._most_pixels = most_pixels
        self._interpolator = interpolator
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
            SpoiledImageError: a frame's bytes are not a whole image, or its size is not believed.
            DataError: the cameras' image sizes do not fit the rig.
        """
        board, host = _encoded(pair.board.message, "board", pair.board.asked_px), _encoded(pair.host, "host")
        start_ns = self._clock()
        board_image, host_image = decode_frames(board, host, self._most_pixels, self._check_sizes)
        decoded_ns = self._clock()
        board_image = self._at_host_time(pair, board_image)
        interpolated_ns = self._clock()
        left, right = self._in_sides(board_image, host_image)
        if self._core is None:
            processed = Processed(RectifiedPair(left, right), None, None, StageTimes())
        else:
            processed = self._core.compute(left, right, self._clock)
        stages = replace(processed.stages, decode=decoded_ns - start_ns, interpolate=interpolated_ns - decoded_ns)
        return replace(processed, stages=stages)

    def _in_sides(self, board: T, host: T) -> tuple[T, T]:
        """Return (left, right). Only this function knows which camera is which."""
        return (board, host) if self._board_side is Side.LEFT else (host, board)

    def _check_sizes(self, board_px: tuple[int, int], host_px: tuple[int, int]) -> None:
        if self._core is not None:
            self._core.require_sizes(*self._in_sides(board_px, host_px))

    def _at_host_time(self, pair: FramePair, image: Image) -> Image:
        """Return the board's image as it would look at the host's exposure.

        If the previous frame is missing, too far away in time or spoiled, return the image unchanged.
        """
        if self._interpolator is None or pair.before is None:
            return image
        fraction = pair.time_skew_ns / (pair.board.marks.exposed_ns - pair.before.marks.exposed_ns)
        if abs(fraction) > LARGEST_FRACTION:
            return image
        try:
            before = _encoded(pair.before.message, "board", pair.before.asked_px)
            earlier = decode_frame(before, self._most_pixels)
        except DataError:
            return image
        return self._interpolator.back(earlier, image, fraction) if earlier.shape == image.shape else image


def _encoded(frame: FrameMessage | Frame, whose: str, asked_px: tuple[int, int] = (0, 0)) -> EncodedImage:
    name = f"{whose} frame {frame.sequence}"
    return EncodedImage(
        payload=memoryview(frame.payload),
        pixel_format=frame.pixel_format,
        width_px=frame.width_px,
        height_px=frame.height_px,
        name=name,
        asked_px=asked_px,
    )
