"""Raw camera images are converted to the images that they show."""

import cv2
import numpy as np
import pytest

from common.errors import DataError
from common.frame import PixelFormat
from phone_host.stereo.raw_images import EncodedImage, decode_frames, decode_raw

_WIDTH, _HEIGHT = 8, 4
# ITU-R BT.601 limited range: Y 16 is black, 235 white, 81/90/240 pure red.
_BLACK_Y, _WHITE_Y, _NEUTRAL = 16, 235, 128
_RED = (81, 90, 240)


def _image(payload: bytes, pixel_format: PixelFormat) -> EncodedImage:
    return EncodedImage(payload=payload, pixel_format=pixel_format, width_px=_WIDTH, height_px=_HEIGHT, name="frame 3")


def _yuyv(y: int, u: int, v: int) -> bytes:
    return bytes([y, u, y, v] * (_WIDTH * _HEIGHT // 2))


def _nv12(y: int, u: int, v: int) -> bytes:
    return bytes([y] * (_WIDTH * _HEIGHT) + [u, v] * (_WIDTH * _HEIGHT // 4))


@pytest.mark.parametrize(("encode", "pixel_format"), [(_yuyv, PixelFormat.YUYV), (_nv12, PixelFormat.NV12)])
def test_colours_by_the_standard(encode: object, pixel_format: PixelFormat) -> None:
    """BT.601's black, white and red become black, white and red, within rounding."""
    assert callable(encode)
    for yuv, bgr in (
        ((_BLACK_Y, _NEUTRAL, _NEUTRAL), (0, 0, 0)),
        ((_WHITE_Y, _NEUTRAL, _NEUTRAL), (255, 255, 255)),
        (_RED, (0, 0, 255)),
    ):
        image = decode_raw(_image(encode(*yuv), pixel_format))
        assert image.shape == (_HEIGHT, _WIDTH, 3)
        assert np.abs(image.astype(int) - bgr).max() <= 2


def test_grey_is_taken_as_it_is() -> None:
    """A grey image keeps every value, row by row."""
    payload = bytes(range(_WIDTH * _HEIGHT))
    image = decode_raw(_image(payload, PixelFormat.GREY))
    assert image.tobytes() == payload
    assert image.shape == (_HEIGHT, _WIDTH)


@pytest.mark.parametrize("pixel_format", [PixelFormat.YUYV, PixelFormat.NV12, PixelFormat.GREY])
@pytest.mark.parametrize("excess", [-1, 1])
def test_another_length_is_refused(pixel_format: PixelFormat, excess: int) -> None:
    """One byte too few or too many is an error that names the frame and both lengths."""
    whole = {PixelFormat.YUYV: 2, PixelFormat.NV12: 1.5, PixelFormat.GREY: 1}[pixel_format] * _WIDTH * _HEIGHT
    with pytest.raises(DataError, match=rf"frame 3 has {int(whole) + excess} bytes.*has {int(whole)}"):
        decode_raw(_image(bytes(int(whole) + excess), pixel_format))


def test_a_raw_and_an_encoded_frame_make_a_pair() -> None:
    """The two cameras of a rig may encode differently."""
    shade = np.arange(_WIDTH * _HEIGHT, dtype=np.uint8).reshape(_HEIGHT, _WIDTH)
    png = cv2.imencode(".png", shade)[1].tobytes()
    left, right = decode_frames(_image(shade.tobytes(), PixelFormat.GREY), _image(png, PixelFormat.PNG))
    np.testing.assert_array_equal(left, right)


@pytest.mark.parametrize(
    ("pixel_format", "size_px", "size_bytes"),
    [(PixelFormat.YUYV, (7, 4), 56), (PixelFormat.NV12, (7, 4), 42), (PixelFormat.NV12, (8, 3), 36)],
)
def test_a_size_that_a_format_cannot_have_is_refused(
    pixel_format: PixelFormat, size_px: tuple[int, int], size_bytes: int
) -> None:
    """Two pixels share their colour in YUYV, two by two in NV12, so an odd side is refused, whatever the number of bytes."""
    with pytest.raises(DataError, match=rf"frame 9 is {size_px[0]}x{size_px[1]}, which {pixel_format.value} cannot be"):
        decode_raw(
            EncodedImage(
                payload=bytes(size_bytes),
                pixel_format=pixel_format,
                width_px=size_px[0],
                height_px=size_px[1],
                name="frame 9",
            )
        )
