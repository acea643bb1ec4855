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
    """A JPEG that an encoder wrote is sound, also with the zeros that some webcams put behind it."""
    assert find_fault(PixelFormat.MJPEG, JPEG + bytes(min(zeros, 254))) is None


@pytest.mark.parametrize("kind", [bytes, bytearray, memoryview])
def test_any_buffer_will_do(kind: type[Buffer]) -> None:
    """Bytes, bytearrays and views are judged alike."""
    assert find_fault(PixelFormat.MJPEG, kind(JPEG)) is None
    assert find_fault(PixelFormat.MJPEG, kind(JPEG[:-1])) is FrameFault.NO_END
    assert find_fault(PixelFormat.PNG, kind(PNG)) is None


def test_every_truncation_of_a_jpeg_is_found() -> None:
    """Whatever its length, a JPEG that lost its end is faulty, and one that lost its start too."""
    for length in range(len(JPEG)):
        assert find_fault(PixelFormat.MJPEG, JPEG[:length]) is not None
        assert find_fault(PixelFormat.MJPEG, JPEG[:length] + bytes(100)) is not None
    for start in range(1, len(JPEG)):
        assert find_fault(PixelFormat.MJPEG, JPEG[start:]) is FrameFault.NO_START


def test_every_truncation_of_a_png_is_found() -> None:
    """Whatever its length, a PNG that lost its end or start is faulty."""
    for length in range(len(PNG)):
        assert find_fault(PixelFormat.PNG, PNG[:length]) is not None
    for start in range(1, len(PNG)):
        assert find_fault(PixelFormat.PNG, PNG[start:]) is FrameFault.NO_START


@pytest.mark.parametrize("pixel_format", PixelFormat)
def test_nothing_is_empty(pixel_format: PixelFormat) -> None:
    """No bytes are no image, whatever they claim to be."""
    assert find_fault(pixel_format, b"") is FrameFault.EMPTY
    assert find_fault(pixel_format, memoryview(b"")) is FrameFault.EMPTY


def test_formats_are_not_mistaken_for_each_other() -> None:
    """A PNG is no JPEG and the other way round."""
    assert find_fault(PixelFormat.MJPEG, PNG) is FrameFault.NO_START
    assert find_fault(PixelFormat.PNG, JPEG) is FrameFault.NO_START


@given(st.binary(max_size=600))
@settings(deadline=None)
def test_random_bytes_never_raise(payload: bytes) -> None:
    """Whatever a driver hands over, the answer is a fault or none."""
    for pixel_format in PixelFormat:
        assert find_fault(pixel_format, payload) in {None, *FrameFault}
