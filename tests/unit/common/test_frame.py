"""Whole and broken images, told apart by their first and last bytes."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.frame import Buffer, FrameFault, PixelFormat, find_fault
from tests.support.pictures import encoded, jpeg, picture

JPEG = jpeg()
PNG = encoded(".png", picture())


@given(st.integers(0, 255))
@settings(deadline=None)
def test_whole_jpeg_is_sound_with_and_without_padding(zeros: int) -> None:
    """A JPEG from an encoder is sound, even with the zeros that some webcams append."""
    assert find_fault(PixelFormat.MJPEG, JPEG + bytes(min(zeros, 254))) is None


@pytest.mark.parametrize("kind", [bytes, bytearray, memoryview])
def test_any_buffer_will_do(kind: type[Buffer]) -> None:
    """Bytes, bytearrays and views are judged alike."""
    assert find_fault(PixelFormat.MJPEG, kind(JPEG)) is None
    assert find_fault(PixelFormat.MJPEG, kind(JPEG[:-1])) is FrameFault.NO_END
    assert find_fault(PixelFormat.PNG, kind(PNG)) is None


def test_every_truncation_of_a_jpeg_is_found() -> None:
    """A JPEG that lost its end is faulty at any length, and so is one that lost its start too."""
    for length in range(len(JPEG)):
        assert find_fault(PixelFormat.MJPEG, JPEG[:length]) is not None
        assert find_fault(PixelFormat.MJPEG, JPEG[:length] + bytes(100)) is not None
    for start in range(1, len(JPEG)):
        assert find_fault(PixelFormat.MJPEG, JPEG[start:]) is FrameFault.NO_START


def test_every_truncation_of_a_png_is_found() -> None:
    """A PNG that lost its end or start is faulty at any length."""
    for length in range(len(PNG)):
        assert find_fault(PixelFormat.PNG, PNG[:length]) is not None
    for start in range(1, len(PNG)):
        assert find_fault(PixelFormat.PNG, PNG[start:]) is FrameFault.NO_START


@pytest.mark.parametrize("pixel_format", PixelFormat)
def test_nothing_is_empty(pixel_format: PixelFormat) -> None:
    """Zero bytes are no image, whatever format they claim."""
    assert find_fault(pixel_format, b"") is FrameFault.EMPTY
    assert find_fault(pixel_format, memoryview(b"")) is FrameFault.EMPTY


def test_formats_are_not_mistaken_for_each_other() -> None:
    """A PNG is not taken for a JPEG, nor the other way round."""
    assert find_fault(PixelFormat.MJPEG, PNG) is FrameFault.NO_START
    assert find_fault(PixelFormat.PNG, JPEG) is FrameFault.NO_START


@given(st.binary(max_size=600))
@settings(deadline=None)
def test_random_bytes_never_raise(payload: bytes) -> None:
    """Whatever a driver hands over, the answer is a fault or none."""
    for pixel_format in PixelFormat:
        assert find_fault(pixel_format, payload) in {None, *FrameFault}
