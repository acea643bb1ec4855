"""Frames whose bytes, header and camera contradict each other are refused before anything is decoded, each with its reason."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from common import now
from common.errors import DataError
from common.frame import FrameFault, ImageSizeError, PixelFormat, SpoiledImageError
from common.imagesize.head import MEGAPIXEL
from common.ledger import BoardMarks
from phone_host.model import BoardFrame, FramePair, Side
from phone_host.run.pipeline import Pipeline
from phone_host.stereo.core import StereoCore
from phone_host.stereo.interpolate import Interpolator
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.matcher_names import MatcherName
from tests.support import bombs
from tests.support.decoder_watch import watched_decoder
from tests.support.pictures import encoded, jpeg, picture
from tests.support.samples import FRAME, shot

JPEG, PNG = PixelFormat.MJPEG, PixelFormat.PNG


def pair_of(
    board: bytes,
    size_px: tuple[int, int],
    asked_px: tuple[int, int],
    pixel_format: PixelFormat = JPEG,
    own_px: tuple[int, int] = (64, 48),
) -> FramePair:
    """A board's frame as it came, beside a sound one of the host's camera."""
    marks = BoardMarks(exposed_ns=1, grabbed_ns=1, sent_ns=1)
    message = replace(
        FRAME,
        sequence=7,
        width_px=size_px[0],
        height_px=size_px[1],
        pixel_format=pixel_format,
        marks=marks,
        payload=board,
    )
    own = shot(0, 1, size_px=own_px, payload=jpeg(*own_px))
    return FramePair(
        board=BoardFrame(
            message=message, link="tcp", marks=marks, received_ns=1, offset_ns=0, uncertainty_ns=0, asked_px=asked_px
        ),
        host=own,
        time_skew_ns=0,
        paired_ns=1,
        queued_ns=1,
    )


SIZE = (64, 48)
LIES = {
    "a bomb": (pair_of(bombs.SMALL_BOMB, SIZE, SIZE), FrameFault.TOO_LARGE),
    "a bomb that its header admits": (
        pair_of(bombs.claiming(jpeg(), 4000, 3000), (4000, 3000), SIZE),
        FrameFault.TOO_LARGE,
    ),
    "a camera of a bomb's size": (pair_of(jpeg(*SIZE), SIZE, (16_384, 16_384)), FrameFault.TOO_LARGE),
    "another size in the bytes": (pair_of(jpeg(32, 24), SIZE, SIZE), FrameFault.OTHER_SIZE),
    "a PNG of another size": (pair_of(bombs.black_png(640, 480), SIZE, SIZE, PNG), FrameFault.OTHER_SIZE),
    "a PNG as a JPEG": (pair_of(bombs.black_png(*SIZE), SIZE, SIZE), FrameFault.NO_START),
    "a TIFF as a PNG": (pair_of(encoded(".tiff", picture(*SIZE)), SIZE, SIZE, PNG), FrameFault.NO_START),
    "a text": (pair_of(b"text", SIZE, SIZE), FrameFault.NO_START),
    "nothing": (pair_of(b"", SIZE, SIZE), FrameFault.EMPTY),
    "another shape": (pair_of(jpeg(48, 48), (48, 48), SIZE), FrameFault.OTHER_SIZE),
    "too few bytes": (
        pair_of(bombs.claiming(jpeg(16, 8), 1600, 1200), (1600, 1200), (1600, 1200)),
        FrameFault.TOO_SHORT,
    ),
    "too many scans": (pair_of(bombs.with_scans(bombs.progressive(*SIZE), 90), SIZE, SIZE), FrameFault.TOO_MANY_SCANS),
    "too few raw bytes": (pair_of(bytes(10), SIZE, SIZE, PixelFormat.GREY), FrameFault.WRONG_LENGTH),
    "a raw bomb": (pair_of(bytes(10), (9000, 9000), (0, 0), PixelFormat.GREY), FrameFault.TOO_LARGE),
}


@pytest.mark.parametrize("case", LIES)
def test_a_lie_is_refused_by_name(case: str) -> None:
    """Every lying frame is refused as spoiled, with its reason and the frame's name, and no decoder sees it."""
    pair, fault = LIES[case]
    decodings: list[int] = []
    with watched_decoder(lambda: decodings.append(1)), pytest.raises(SpoiledImageError, match="frame 7") as caught:
        Pipeline(None, Side.LEFT, now.monotonic_ns).process(pair)
    assert caught.value.fault is fault
    assert not decodings or fault in {FrameFault.TOO_SHORT, FrameFault.TOO_MANY_SCANS}


def test_a_size_that_is_not_believed_has_a_class_of_its_own() -> None:
    """Wrong sizes raise ImageSizeError; it is a DataError like all the others."""
    with pytest.raises(ImageSizeError) as caught:
        Pipeline(None, Side.LEFT, now.monotonic_ns).process(pair_of(jpeg(32, 24), SIZE, SIZE))
    assert isinstance(caught.value, DataError)
    assert caught.value.exit_code == 4
    assert "32x24 px, its header says 64x48" in caught.value.problem


def test_the_limit_is_a_setting() -> None:
    """A sound pair beyond the limit is refused; with a higher limit it is taken."""
    size = (1200, 1000)
    pair = pair_of(jpeg(*size), size, size)
    with pytest.raises(ImageSizeError, match="limit is 1 MPx"):
        Pipeline(None, Side.LEFT, now.monotonic_ns, most_pixels=MEGAPIXEL).process(pair)
    done = Pipeline(None, Side.LEFT, now.monotonic_ns, most_pixels=2 * MEGAPIXEL).process(pair)
    assert done.pair.left.shape == (1000, 1200, 3)


def test_a_smaller_image_of_a_lower_rung_is_still_enlarged() -> None:
    """A board that sends the same view with fewer pixels is accepted."""
    decodings: list[int] = []
    with watched_decoder(lambda: decodings.append(1)):
        done = Pipeline(None, Side.LEFT, now.monotonic_ns).process(pair_of(jpeg(32, 24), (32, 24), SIZE))
    assert done.pair.left.shape == (48, 64, 3)
    assert len(decodings) == 2  # the watch of the tests above does see both images of a pair


def test_sizes_that_do_not_fit_each_other_are_told_before_decoding() -> None:
    """With a core two true sizes that make no rectified pair are bad data, not spoiled images, and are reported before decoding."""
    decodings: list[int] = []
    core = StereoCore(create_matcher(MatchSettings(MatcherName.SGBM, 16)))
    pair = pair_of(jpeg(*SIZE), SIZE, SIZE, own_px=(80, 60))
    with watched_decoder(lambda: decodings.append(1)), pytest.raises(DataError, match=r"64x48.*80x60") as caught:
        Pipeline(core, Side.LEFT, now.monotonic_ns).process(pair)
    assert not isinstance(caught.value, SpoiledImageError)
    assert not decodings


def test_the_frame_before_may_lie_too() -> None:
    """A lie in the previous frame, which interpolation uses, costs only the interpolation."""
    pair = pair_of(jpeg(*SIZE), SIZE, SIZE)
    before = pair_of(bombs.SMALL_BOMB, SIZE, SIZE).board
    marks = BoardMarks(exposed_ns=-33_000_000, grabbed_ns=-33_000_000, sent_ns=-33_000_000)
    earlier = BoardFrame(
        message=before.message, link="tcp", marks=marks, received_ns=1, offset_ns=0, uncertainty_ns=0, asked_px=SIZE
    )
    doubled = FramePair(
        board=pair.board, host=pair.host, time_skew_ns=5_000_000, paired_ns=1, queued_ns=1, before=earlier
    )
    done = Pipeline(None, Side.LEFT, now.monotonic_ns, Interpolator()).process(doubled)
    expected = cv2.imdecode(np.frombuffer(jpeg(*SIZE), np.uint8), cv2.IMREAD_UNCHANGED)
    assert expected is not None
    np.testing.assert_array_equal(done.pair.left, expected)
