"""JPEGs of a camera much finer than the rectified images are decoded smaller: the same picture for less work."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from common.frame import SpoiledImageError
from common.orientation import Orientation
from phone_host.model import Image
from phone_host.stereo.core import StereoCore
from phone_host.stereo.images import decode_files, examine, size_px
from phone_host.stereo.match import MatchSettings
from phone_host.stereo.rectifier import Rectifier
from tests.support.rigs import unlike_rig


def smooth(width: int, height: int) -> Image:
    """A picture without detail finer than some pixels, so that all ways of reducing it agree."""
    noise = np.random.default_rng(3).integers(0, 256, (height // 20, width // 20, 3), np.uint8)
    return np.asarray(cv2.resize(noise, (width, height), interpolation=cv2.INTER_CUBIC), np.uint8)


def jpeg(image: Image) -> bytes:
    """An image as a camera sends it."""
    return bytes(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 95])[1].tobytes())


@pytest.mark.parametrize("reduction", [1, 2, 4, 8])
@pytest.mark.parametrize("grey", [False, True])
def test_a_reduced_image_is_the_average_of_blocks(reduction: int, grey: bool) -> None:  # noqa: FBT001
    """Each pixel is the mean of a block, to some levels, in the colours of the file; the other image stays whole."""
    image = smooth(640, 480)
    image = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8) if grey else image
    file = examine(jpeg(image), "a", 10**6)
    small, whole = decode_files(file, file, (reduction, 1))
    assert small.ndim == whole.ndim == (2 if grey else 3)
    assert size_px(whole) == (640, 480)
    blocks = cv2.resize(whole, (640 // reduction, 480 // reduction), interpolation=cv2.INTER_AREA)
    assert np.abs(small.astype(int) - blocks).max() <= 8
    assert np.abs(small.astype(int) - blocks).mean() < 1


def test_what_cannot_be_decoded_smaller_is_decoded_whole() -> None:
    """PNG files, sizes with cut blocks and factors that JPEG does not have come as they are stored."""
    png = examine(bytes(cv2.imencode(".png", smooth(64, 48))[1].tobytes()), "a", 10**6)
    odd = examine(jpeg(smooth(643, 480)), "b", 10**6)
    assert [size_px(image) for image in decode_files(png, odd, (2, 2))] == [(64, 48), (643, 480)]
    even = examine(jpeg(smooth(640, 480)), "c", 10**6)
    assert [size_px(image) for image in decode_files(even, even, (3, 16))] == [(640, 480), (640, 480)]


def test_it_is_turned_as_the_whole_one() -> None:
    """How the camera is mounted is applied after decoding, whatever the size."""
    file = replace(examine(jpeg(smooth(640, 480)), "a", 10**6), mounted=Orientation(rotate_deg=90))
    small, whole = decode_files(file, file, (2, 1))
    assert (size_px(small), size_px(whole)) == ((240, 320), (480, 640))
    assert np.abs(small.astype(int) - cv2.resize(whole, (240, 320), interpolation=cv2.INTER_AREA)).mean() < 1


def test_a_spoiled_image_names_the_side() -> None:
    """If one of the two is cut off, the error names that one, also when it is to be decoded smaller."""
    sound = jpeg(smooth(640, 480))
    spoiled = sound[: len(sound) // 2] + sound[-2:]
    with pytest.raises(SpoiledImageError, match=r"^the right one"):
        decode_files(examine(sound, "the left one", 10**6), examine(spoiled, "the right one", 10**6), (1, 2))


def test_a_finer_camera_is_rectified_alike_from_its_reduced_image() -> None:
    """The right camera of this rig is more than twice as fine: its halved image gives the same rectified picture."""
    rig = unlike_rig()
    core = StereoCore(MatchSettings(disparities=16), Rectifier(rig))
    sizes_px = (rig.left.width_px, rig.left.height_px), (rig.right.width_px, rig.right.height_px)
    reductions = core.reductions(*sizes_px)
    assert reductions == (1, 2)
    left, right = (examine(jpeg(smooth(*size)), "a", 10**7) for size in sizes_px)
    whole = core.compute(*decode_files(left, right), lambda: 0).pair
    small = core.compute(*decode_files(left, right, reductions), lambda: 0, whole_px=sizes_px).pair
    assert small.left.tobytes() == whole.left.tobytes()
    assert small.right.shape == whole.right.shape
    assert np.abs(small.right.astype(int) - whole.right).mean() < 1
