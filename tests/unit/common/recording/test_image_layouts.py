"""What other programs' image messages hold is told by their bytes; what is neither is refused by name."""

import pytest

from common.frame import PixelFormat
from common.recording.image_layouts import RawForm, UnreadableEncodingError, compressed_format, raw_layout

_JPEG, _PNG = b"\xff\xd8\xff\xe0" + bytes(20), b"\x89PNG\r\n\x1a\n" + bytes(20)


@pytest.mark.parametrize(("data", "pixel_format"), [(_JPEG, PixelFormat.MJPEG), (_PNG, PixelFormat.PNG)])
def test_a_raw_image_that_is_none_is_what_its_bytes_say(data: bytes, pixel_format: PixelFormat) -> None:
    """A label that is no pixel format does not keep a JPEG or a PNG away."""
    assert raw_layout(RawForm("mystery", (4, 4), 12, is_big_endian=False), data) is pixel_format
    assert compressed_format(data, "mystery") is pixel_format


def test_other_bytes_are_refused_by_what_they_are() -> None:
    """An unknown label with unknown bytes names those that are read; HEIC and AVIF are named."""
    with pytest.raises(UnreadableEncodingError, match=r"encoded as 'mystery'; .*JPEG and PNG are read"):
        raw_layout(RawForm("mystery", (4, 4), 12, is_big_endian=False), bytes(48))
    with pytest.raises(UnreadableEncodingError, match="holds HEIC or AVIF, encoded as 'heic'"):
        compressed_format(b"\x00\x00\x00\x18ftypheic" + bytes(20), "heic")
