"""Coloured images through maps: the bits of cv2.remap, on every instruction set."""

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from common.diagnostic import Diagnostic
from phone_host.model import Image
from phone_host.native.library import Library
from phone_host.stereo.rectifier import Maps, remap, remap_by

NONE = Diagnostic(message="left out by this test", remedy="none")
same_fixture = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=80, deadline=None)


def noise(height: int, width: int, seed: int = 1) -> Image:
    return np.random.default_rng(seed).integers(0, 256, (height, width, 3), np.uint8)


def maps_over(height: int, width: int, reach: float, count: tuple[int, int], seed: int) -> Maps:
    """Random places in an image and up to `reach` px beyond it."""
    random = np.random.default_rng(seed)
    x, y = (random.uniform(-reach, side - 1 + reach, count).astype(np.float32) for side in (width, height))
    return cv2.convertMaps(x, y, cv2.CV_16SC2)


@same_fixture
@given(
    size=st.tuples(st.integers(1, 40), st.integers(1, 40)),
    reach=st.sampled_from([0.0, 2.0, 50.0, 40000.0]),
    count=st.tuples(st.integers(1, 4), st.integers(1, 23)),
    seed=st.integers(0, 1000),
)
def test_every_map_gives_the_bits_of_opencv(
    library: Library, size: tuple[int, int], reach: float, count: tuple[int, int], seed: int
) -> None:
    """Images of any size, down to one pixel, and maps that point inside, to the edge and far outside."""
    image = noise(*size, seed)
    maps = maps_over(*size, reach, count, seed)
    np.testing.assert_array_equal(remap_by(library, image, maps), remap(image, maps, NONE))


def test_the_identity_gives_the_image_to_its_last_pixel(library: Library) -> None:
    """Each pixel maps to itself; nothing behind the last row and column is read into the result."""
    image = noise(37, 53)
    x, y = np.meshgrid(np.arange(53, dtype=np.float32), np.arange(37, dtype=np.float32))
    np.testing.assert_array_equal(remap_by(library, image, cv2.convertMaps(x, y, cv2.CV_16SC2)), image)


@pytest.mark.parametrize("part", [np.s_[2:30, 3:41], np.s_[::2], np.s_[::-1], np.s_[:, ::2], np.s_[:, :, ::-1]])
def test_views_with_any_strides_are_read_rightly(library: Library, part: tuple[slice, ...]) -> None:
    """Parts of larger images give what their copies give, whether the kernel reads them or OpenCV."""
    seen = noise(60, 90)[part]
    maps = maps_over(seen.shape[0], seen.shape[1], 1.0, (19, 31), 5)
    np.testing.assert_array_equal(remap_by(library, seen, maps), remap(seen.copy(), maps, NONE))


def test_grey_images_pass(library: Library) -> None:
    """Images of one channel go to OpenCV."""
    maps = maps_over(20, 30, 1.0, (9, 9), 7)
    grey = np.ascontiguousarray(noise(20, 30)[..., 0])
    np.testing.assert_array_equal(remap_by(library, grey, maps), remap(grey, maps, NONE))
