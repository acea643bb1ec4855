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
from common.orientation import UPRIGHT, Orientation
from phone_host.model import BoardFrame, FramePair, Image, Processed, RectifiedPair, Side
from phone_host.run.pair_budget import PairBudget
from phone_host.stereo.core import StereoCore
from phone_host.stereo.images import WHOLE
from phone_host.stereo.interpolate import LARGEST_FRACTION, Interpolator
from phone_host.stereo.raw_images import EncodedImage, decode_frame, decode_frames

T = TypeVar("T")
Size = tuple[int, int]


class Pipeline:
    """The stereo pipeline.

    Args:
        core: rectification, matching and reprojection; None to decode only (delays without depth).
        board_side: which view the board's frame is.
        clock: returns CLOCK_MONOTONIC, ns.
        interpolator: interpolates the board's image to the moment of the host's; None to leave it unchanged.
        most_pixels: largest accepted image size of either camera, pixels.
        budget: holds a time budget for each pair; None: there is none.
        host_orientation: how the host camera's images become upright; a board's frame says that itself.
    """

    def __init__(
        self,
        core: StereoCore | None,
        board_side: Side,
        clock: Callable[[], int],
        interpolator: Interpolator | None = None,
        most_pixels: int = MOST_PIXELS,
        *,
        budget: PairBudget | None = None,
        host_orientation: Orientation = UPRIGHT,
    ) -> None:
        self._budget = budget
        self._host_orientation = host_orientation
        self._most_pixels = most_pixels
        self._interpolator = interpolator
        self._core = core
        self._board_side = board_side
        self._clock = clock

    def process(self, pair: FramePair) -> Processed:
        """Compute a pair's depth.

        Raises:
            SpoiledImageError: a frame's bytes are not a whole image, or its size is not believed.
            DataError: the cameras' image sizes do not fit the rig.
        """
        board, host = _of_board(pair.board), self._of_host(pair.host)
        start_ns = self._clock()
        whole_px: tuple[Size, Size] = (0, 0), (0, 0)  # of both upright images as they are stored
        by = WHOLE

        def reductions(board_px: Size, host_px: Size) -> tuple[int, int]:
            """Check both sizes before anything is decoded; return by how much each image may be decoded smaller."""
            nonlocal whole_px, by
            whole_px = self._in_sides(board_px, host_px)
            if self._core is not None:
                by = self._in_sides(*self._core.reductions(*whole_px))
            return by

        board_image, host_image = decode_frames(board, host, self._most_pixels, reductions)
        decoded_ns = self._clock()
        board_image = self._at_host_time(pair, board_image, by[0])
        interpolated_ns = self._clock()
        left, right = self._in_sides(board_image, host_image)
        if self._core is None:
            processed = Processed(RectifiedPair(left, right), None, None, StageTimes())
        else:
            choice = None if self._budget is None else self._budget.choice(*whole_px)
            processed = self._core.compute(left, right, self._clock, whole_px=whole_px, choice=choice)
        stages = replace(processed.stages, decode=decoded_ns - start_ns, interpolate=interpolated_ns - decoded_ns)
        if self._budget is not None:
            end_ns = self._clock()
            self._budget.add(end_ns - start_ns, stages.match, end_ns)
        return replace(processed, stages=stages)

    def _of_host(self, frame: Frame) -> EncodedImage:
        return EncodedImage(
            payload=memoryview(frame.payload),
            pixel_format=frame.pixel_format,
            width_px=frame.width_px,
            height_px=frame.height_px,
            name=f"host frame {frame.sequence}",
            orientation=self._host_orientation,
        )

    def _in_sides(self, board: T, host: T) -> tuple[T, T]:
        """Return (left, right). Only this function knows which camera is which."""
        return (board, host) if self._board_side is Side.LEFT else (host, board)

    def _at_host_time(self, pair: FramePair, image: Image, reduction: int) -> Image:
        """Return the board's image as it would look at the host's exposure.

        If the previous frame is missing, too far away in time or spoiled, return the image unchanged.
        """
        if self._interpolator is None or pair.before is None:
            return image
        fraction = pair.time_skew_ns / (pair.board.marks.exposed_ns - pair.before.marks.exposed_ns)
        if abs(fraction) > LARGEST_FRACTION:
            return image
        try:
            earlier = decode_frame(_of_board(pair.before), self._most_pixels, reduction)
        except DataError:
            return image
        return self._interpolator.back(earlier, image, fraction) if earlier.shape == image.shape else image


def _of_board(frame: BoardFrame) -> EncodedImage:
    message = frame.message
    return EncodedImage(
        payload=memoryview(message.payload),
        pixel_format=message.pixel_format,
        width_px=message.width_px,
        height_px=message.height_px,
        name=f"board frame {message.sequence}",
        asked_px=frame.asked_px,
        orientation=frame.orientation,
    )
