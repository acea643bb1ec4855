"""Deep images: what they may take decoded, how long their sides may be, and numbers at the ends of their types."""

import warnings

import cv2
import numpy as np
import pytest

from common.errors import DataError
from common.imagesize.head import MEGAPIXEL, require_believable
from common.imagesize.read import read_head
from phone_host.stereo.eight_bit import to_8_bit
from phone_host.stereo.images import decode


def _encoded(kind: str, shape: tuple[int, ...], dtype: type) -> bytes:
    return bytes(cv2.imencode(kind, np.zeros(shape, dtype))[1])


@pytest.mark.parametrize(
    ("kind", "shape", "dtype", "expected"),
    [
        (".png", (8, 9), np.uint8, 1),
        (".png", (8, 9, 3), np.uint8, 3),
        (".png", (8, 9, 3), np.uint16, 6),
        (".png", (8, 9, 4), np.uint16, 8),
        (".tiff", (8, 9), np.uint8, 3),
        (".tiff", (8, 9, 3), np.uint16, 6),
        (".tiff", (8, 9), np.float32, 4),
        (".tiff", (8, 9, 4), np.float32, 16),
        (".tiff", (8, 9, 3), np.float64, 24),
        (".ppm", (8, 9, 3), np.uint16, 6),
    ],
)
def test_a_head_tells_how_much_a_pixel_takes(kind: str, shape: tuple[int, ...], dtype: type, expected: int) -> None:
    """Channels times bytes of each, or more: never less than what the decoder makes."""
    content = _encoded(kind, shape, dtype)
    head = read_head(content, "image")
    assert head.pixel_bytes == expected
    decoded = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
    assert decoded is not None
    assert decoded.nbytes <= head.pixel_bytes * 72


def test_the_limit_is_one_of_memory_too() -> None:
    """Three colours of 16 bit are within it; with alpha, or in floating point, the same pixels are refused, with the remedy."""
    size = (1024, 1024)
    require_believable(read_head(_encoded(".png", (*size, 3), np.uint16), "image"), MEGAPIXEL, "a.png")
    for kind, dtype, taken in ((".png", np.uint16, 8), (".tiff", np.float32, 16)):
        with pytest.raises(DataError) as caught:
            decode(_encoded(kind, (*size, 4), dtype), "a", MEGAPIXEL)
        assert f"a takes {taken} MB decoded ({taken} bytes a pixel), the limit is 6 MB" in str(caught.value)
        assert "without alpha" in caught.value.remedy


def test_a_side_that_cannot_be_remapped_is_refused() -> None:
    """OpenCV's remap has 16-bit coordinates: 32766 px are the longest side."""
    assert decode(_encoded(".png", (32_766, 1), np.uint8)).shape == (32_766, 1)
    for shape in ((32_767, 1), (1, 65_535)):
        with pytest.raises(DataError, match="the longest side may have 32766 px"):
            decode(_encoded(".png", shape, np.uint8))


@pytest.mark.parametrize("seed", range(6))
def test_counting_16_bit_values_finds_the_percentiles(seed: int) -> None:
    """A stretched image is black below the common 0.1 % and white above the 99.9 % of both images' values, as sorted."""
    random = np.random.default_rng(seed)
    images = tuple(random.integers(30_000, 30_000 + 100 * (seed + 1), (60, 70 + seed)).astype(np.uint16) for _ in "lr")
    low, high = np.percentile(np.concatenate([image.ravel() for image in images]), (0.1, 99.9))
    for image, found in zip(images, to_8_bit(images), strict=True):
        exact = np.clip((image - low) * 255 / (high - low), 0, 255)
        assert np.abs(found - exact).max() <= 0.51


@pytest.mark.parametrize("extreme", [np.inf, -np.inf, np.nan, 1e308, -1e308, 3.4e38])
def test_numbers_at_the_end_of_their_type_make_no_warning(extreme: float) -> None:
    """Hot pixels of a floating point image change nothing for the others, and numpy says nothing."""
    plain = np.tile(np.arange(256, dtype=np.float64), (64, 4))
    spoiled = plain.copy()
    spoiled[3, 5] = extreme
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        [expected], [found] = to_8_bit((plain,)), to_8_bit((spoiled,))
        to_8_bit((np.full((8, 8), extreme),))
        to_8_bit((np.where(plain > 128, 3.4e38, -3.4e38).astype(np.float32),))
    other = np.ones(plain.shape, np.bool_)
    other[3, 5] = False
    np.testing.assert_array_equal(found[other], expected[other])
