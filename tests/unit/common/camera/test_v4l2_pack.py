"""What is taken from a buffer, and the faults of raw and encoded bytes."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.camera.v4l2_formats import Packing, PixelFormatSet, SendPart
from common.frame import FrameFault, PixelFormat, find_fault, raw_bytes

_LETTERS = {PixelFormat.YUYV: "YUYV", PixelFormat.GREY: "GREY", PixelFormat.NV12: "NV12"}
_even = st.integers(1, 12).map(lambda half: 2 * half)


@given(
    source=st.sampled_from(list(_LETTERS)),
    part=st.sampled_from(SendPart),
    width=_even,
    height=_even,
    padding=st.integers(0, 9),
)
def test_rows_lose_their_padding_and_nothing_else(
    source: PixelFormat, part: SendPart, width: int, height: int, padding: int
) -> None:
    """For any row length, the payload holds the image's bytes in order: all of them, or only the luma."""
    row = width * (2 if source is PixelFormat.YUYV else 1)
    rows = height * 3 // 2 if source is PixelFormat.NV12 else height
    image = bytes((31 * i + 7) % 251 for i in range(row * rows))
    buffer = b"".join(image[i : i + row] + b"\xee" * padding for i in range(0, len(image), row))
    made = PixelFormatSet(
        letters=_LETTERS[source], size_px=(width, height), row_bytes=row + padding, image_bytes=len(buffer)
    )
    packing = Packing.of(made, source, part)
    payload = packing.pack(memoryview(buffer))
    if part is SendPart.WHOLE:
        assert (packing.sent_as, payload) == (source, image)
    else:
        luma = image[::2] if source is PixelFormat.YUYV else image[: width * height]
        assert (packing.sent_as, payload) == (PixelFormat.GREY, luma)
    assert len(payload) == raw_bytes(packing.sent_as, width, height)


@pytest.mark.parametrize("part", list(SendPart))
def test_jpeg_passes_untouched(part: SendPart) -> None:
    """A JPEG is passed on unchanged, even if luma is requested: extracting it would need decoding."""
    packing = Packing.of(
        PixelFormatSet(letters="MJPG", size_px=(640, 480), row_bytes=0, image_bytes=614400), PixelFormat.MJPEG, part
    )
    payload = b"\xff\xd8 some scan \xff\xd9"
    assert (packing.pack(memoryview(payload)), packing.sent_as, packing.least_bytes) == (
        payload,
        PixelFormat.MJPEG,
        None,
    )


def test_a_raw_buffer_that_is_too_short_is_spoiled() -> None:
    """A raw image is whole if its last used byte is there; one byte less is a fault, none at all is another one."""
    made = PixelFormatSet(letters="YUYV", size_px=(8, 4), row_bytes=20, image_bytes=80)
    least = Packing.of(made, PixelFormat.YUYV, SendPart.WHOLE).least_bytes
    assert least == 3 * 20 + 16
    assert find_fault(PixelFormat.YUYV, bytes(76), least) is None
    assert find_fault(PixelFormat.YUYV, bytes(75), least) is FrameFault.WRONG_LENGTH
    assert find_fault(PixelFormat.YUYV, b"", least) is FrameFault.EMPTY
