"""Images of every kind and depth, and spoiled ones."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import DataError
from phone_host.stereo.eight_bit import to_8_bit
from phone_host.stereo.images import (
    decode,
    decode_file,
    decode_files,
    examine,
    open_image,
    require_same_size,
)

_RAMP = np.arange(256, dtype=np.uint8).reshape(16, 16)
_COLOUR = np.dstack([_RAMP, _RAMP.T, 255 - _RAMP])


def _png(image: np.ndarray[Any, Any]) -> bytes:
    return cv2.imencode(".png", image)[1].tobytes()


def _jpeg(image: np.ndarray[Any, Any]) -> bytes:
    return cv2.imencode(".jpg", image)[1].tobytes()


@pytest.mark.parametrize("suffix", [".png", ".bmp", ".tiff", ".pgm"])
def test_grey_files_keep_their_values(tmp_path: Path, suffix: str) -> None:
    """A lossless grey file comes back as (H, W) with the same values."""
    path = tmp_path / f"a{suffix}"
    cv2.imwrite(str(path), _RAMP)
    np.testing.assert_array_equal(decode_file(open_image(path)), _RAMP)


def test_colour_stays_bgr_and_alpha_is_dropped() -> None:
    """Three channels come back unchanged; a fourth one is removed."""
    np.testing.assert_array_equal(decode(_png(_COLOUR)), _COLOUR)
    np.testing.assert_array_equal(decode(_png(np.dstack([_COLOUR, _RAMP]))), _COLOUR)


def test_memoryview_is_taken() -> None:
    """The bytes of a received message are decoded in place, from a view."""
    np.testing.assert_array_equal(decode(memoryview(_png(_RAMP))), _RAMP)


def test_a_16_bit_copy_of_an_8_bit_pair_gives_the_same_images(tmp_path: Path) -> None:
    """Values times 257 come back exactly."""
    left, right = tmp_path / "l.png", tmp_path / "r.png"
    left.write_bytes(_png(_RAMP.astype(np.uint16) * 257))
    right.write_bytes(_png(_COLOUR.astype(np.uint16) * 257))
    first, second = decode_files(open_image(left), open_image(right))
    np.testing.assert_array_equal(first, _RAMP)
    np.testing.assert_array_equal(second, _COLOUR)


@pytest.mark.parametrize("bits", [10, 12, 14, 16])
def test_both_images_get_one_scale(bits: int) -> None:
    """A right image half as bright stays half as bright, for every usual sensor depth."""
    left = np.linspace(0, 2**bits - 1, 4096).reshape(64, 64).astype(np.uint16)
    first, second = decode_files(examine(_png(left), "left"), examine(_png(left // 2), "right"))
    assert first.max() == 255
    np.testing.assert_allclose(second.astype(float), first / 2, atol=1)


def test_hot_pixels_do_not_set_the_scale() -> None:
    """One saturated pixel does not change the levels of the others."""
    image = np.linspace(0, 1023, 4096).reshape(64, 64).astype(np.uint16)
    expected = to_8_bit((image,))[0]
    image[3, 3] = 65535
    got = to_8_bit((image,))[0]
    got[3, 3] = expected[3, 3]
    np.testing.assert_array_equal(got, expected)


def test_a_narrow_band_is_stretched() -> None:
    """A thermal image that uses 2000 of 65536 levels still gets most of the 256."""
    image = np.linspace(29000, 31000, 4096).reshape(64, 64).astype(np.uint16)
    assert np.ptp(to_8_bit((image,))[0]) >= 250


@pytest.mark.parametrize("value", [0, 5, 255, 65535])
def test_a_constant_deep_image_does_not_fail(value: int) -> None:
    """A black image (lens cap) and a saturated one are images, too."""
    assert np.ptp(to_8_bit((np.full((4, 4), value, np.uint16),))[0]) == 0


def test_float_images_are_stretched_without_their_nan() -> None:
    """A float TIFF with NaN becomes 0..255."""
    image = np.linspace(-1, 1, 4096).reshape(64, 64).astype(np.float32)
    image[0, 0] = np.nan
    assert np.ptp(to_8_bit((image,))[0]) == 255


@pytest.mark.parametrize("content", [b"", b"no image at all", b"\xff\xd8\xff\xd9", b"\x89PNG\r\n\x1a\n"])
def test_bytes_that_are_no_image_are_refused(content: bytes) -> None:
    """Empty and foreign bytes raise a DataError with the given name."""
    with pytest.raises(DataError, match="frame 7"):
        decode(content, "frame 7")


@pytest.mark.parametrize("share", [0.2, 0.5, 0.9, 0.999])
@pytest.mark.parametrize("encode", [_jpeg, _png])
def test_cut_images_are_refused(encode: Any, share: float) -> None:
    """Half a JPEG decodes to an image whose lower part is grey; it must be refused."""
    noise = np.random.default_rng(1).integers(0, 255, (64, 64, 3)).astype(np.uint8)
    content = encode(noise)
    with pytest.raises(DataError):
        decode(content[: int(len(content) * share)])


def test_bytes_behind_the_end_of_a_jpeg_are_legal() -> None:
    """Padding from webcams and trailers from phones do not spoil the image."""
    content = _jpeg(_COLOUR)
    for trailer in (bytes(512), b"SEFT" + bytes(range(256)) * 40):
        np.testing.assert_array_equal(decode(content + trailer), decode(content))


def test_the_end_of_a_thumbnail_is_not_the_end_of_the_picture() -> None:
    """A truncated JPEG with an EXIF thumbnail is refused although it holds an end marker."""
    content, thumbnail = _jpeg(_COLOUR), _jpeg(_RAMP)
    segment = b"Exif\0\0" + thumbnail
    whole = content[:2] + b"\xff\xe1" + (len(segment) + 2).to_bytes(2, "big") + segment + content[2:]
    np.testing.assert_array_equal(decode(whole), decode(content))
    with pytest.raises(DataError, match="cut short"):
        decode(whole[:-40])


@given(st.binary(max_size=200), st.sampled_from([b"", b"\xff\xd8", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff\xda"]))
@settings(deadline=None, max_examples=200)
def test_any_bytes_give_an_image_or_a_data_error(content: bytes, head: bytes) -> None:
    """Bytes from outside never raise any other error."""
    try:
        image = decode(head + content)
    except DataError:
        return
    assert image.dtype == np.uint8


def test_missing_and_empty_files_are_named(tmp_path: Path) -> None:
    """The message names the file."""
    with pytest.raises(DataError, match=r"none\.png cannot be read"):
        decode_file(open_image(tmp_path / "none.png"))
    (tmp_path / "empty.png").touch()
    with pytest.raises(DataError, match=r"empty\.png is empty"):
        decode_file(open_image(tmp_path / "empty.png"))
    with pytest.raises(DataError, match="is a folder"):
        decode_file(open_image(tmp_path))


def test_two_sizes_are_no_rectified_pair() -> None:
    """The message names both files with their sizes, width first."""
    with pytest.raises(DataError, match=r"a\.png is 4x3 px, b\.png is 5x3 px.*--calibration"):
        require_same_size((4, 3), (5, 3), "a.png", "b.png")


def test_an_image_on_its_side_is_told_from_one_of_another_camera() -> None:
    """Width and height exchanged between the two: the remedy is a turn."""
    with pytest.raises(DataError, match=r"lies on its side.*--rotate-left 90"):
        require_same_size((4, 3), (3, 4), "a.png", "b.png")
