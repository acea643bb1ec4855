"""A board's image made smaller for the link stands in for the larger one: rig and geometry hold for it."""

from dataclasses import replace
from typing import Final

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common import now
from common.errors import DataError
from common.frame import PixelFormat
from common.ledger import BoardMarks
from phone_host.model import BoardFrame, FramePair, Image, Side
from phone_host.run.pipeline import Pipeline
from phone_host.stereo.core import StereoCore
from phone_host.stereo.images import enlarged
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.matcher_names import MatcherName
from tests.support.pictures import encoded
from tests.support.planes import Plane, plane
from tests.support.samples import FRAME, shot

_SCENE: Final = plane(shortest_px=14.0)
"""Textures that half of the pixels still show: Shannon's limit there is 4 px."""


def halved(image: Image) -> Image:
    """The image of a camera that bins four pixels into one."""
    height, width = image.shape[:2]
    return np.asarray(image.reshape(height // 2, 2, width // 2, 2).mean(axis=(1, 3)).round(), np.uint8)


def pair_of(left: Image, right: Image, board_side: Side, asked_px: tuple[int, int]) -> FramePair:
    """Two frames as they come to the worker."""
    board, host = (left, right) if board_side is Side.LEFT else (right, left)
    marks = BoardMarks(exposed_ns=1, grabbed_ns=1, sent_ns=1)
    message = replace(
        FRAME,
        sequence=7,
        width_px=board.shape[1],
        height_px=board.shape[0],
        pixel_format=PixelFormat.PNG,
        marks=marks,
        payload=encoded(".png", board),
    )
    frame = BoardFrame(
        message=message, link="tcp", marks=marks, received_ns=1, offset_ns=0, uncertainty_ns=0, asked_px=asked_px
    )
    own = shot(
        0, 1, size_px=(host.shape[1], host.shape[0]), pixel_format=PixelFormat.PNG, payload=encoded(".png", host)
    )
    return FramePair(board=frame, host=own, time_skew_ns=0, paired_ns=1, queued_ns=1)


def disparity_error_px(scene: Plane, left: Image, right: Image, side: Side) -> float:
    """The median error of the disparity over the middle of the view, px."""
    core = StereoCore(create_matcher(MatchSettings(MatcherName.SGBM, 48)))
    height, width = scene.disparity_px.shape
    done = Pipeline(core, side, now.monotonic_ns).process(pair_of(left, right, side, (width, height)))
    assert done.disparity is not None
    assert done.pair.left.shape == done.pair.right.shape == (height, width)
    error = (done.disparity - scene.disparity_px)[20:-20, 60:-20]
    assert np.isfinite(error).mean() > 0.8
    return float(np.nanmedian(error))


@pytest.mark.parametrize("side", Side)
def test_depth_is_that_of_the_whole_size(side: Side) -> None:
    """With the board's image at half its size the disparity is that of the scene, in pixels of the full size, without a shift."""
    left, right = _SCENE.pair.left, _SCENE.pair.right
    small = (halved(left), right) if side is Side.LEFT else (left, halved(right))
    assert abs(disparity_error_px(_SCENE, left, right, side)) < 0.05
    assert abs(disparity_error_px(_SCENE, *small, side)) < 0.1  # half a pixel of the small one would be 1


@given(st.sampled_from([2, 3, 4]), st.integers(2, 12), st.integers(2, 12), st.floats(-2, 2), st.floats(-2, 2))
def test_edges_coincide(part: int, width: int, height: int, slope_x: float, slope_y: float) -> None:
    """A plane of grey levels whose pixels were averaged comes back as the same plane, except for rounding and the outermost pixels."""
    y, x = np.mgrid[: height * part, : width * part].astype(np.float64)
    level = 128 + slope_x * (x - x.mean()) + slope_y * (y - y.mean())
    small = level.reshape(height, part, width, part).mean(axis=(1, 3))
    back = enlarged(np.asarray(small.round(), np.uint8), (width * part, height * part), "image")
    inside = (slice(part, -part), slice(part, -part))
    # Half a level for each rounding, and half for OpenCV's fixed-point sums, which cut off quarters of a level.
    np.testing.assert_allclose(back[inside], level[inside], rtol=0, atol=1.5)


def test_another_shape_is_refused() -> None:
    """An image of another shape shows only part of the view: this is bad data, reported with both sizes and the remedy."""
    frame = pair_of(np.zeros((90, 160), np.uint8), np.zeros((480, 640), np.uint8), Side.LEFT, (640, 480))
    with pytest.raises(DataError) as caught:
        Pipeline(None, Side.LEFT, now.monotonic_ns).process(frame)
    assert "board frame 7 is 160x90 px, its camera was asked for 640x480" in str(caught.value)
    assert "adapt" in str(caught.value)


def test_a_frame_of_the_asked_size_is_left_alone() -> None:
    """An image of the requested size, or of a board that named none, passes as it is."""
    image = cv2.merge([_SCENE.pair.left] * 3)
    assert enlarged(np.asarray(image, np.uint8), (image.shape[1], image.shape[0]), "image") is image
    frame = pair_of(_SCENE.pair.left, _SCENE.pair.right, Side.LEFT, (0, 0))
    done = Pipeline(None, Side.LEFT, now.monotonic_ns).process(replace(frame))
    np.testing.assert_array_equal(done.pair.left, _SCENE.pair.left)
