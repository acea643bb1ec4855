"""Image files as they are sent: unchanged if a camera could have made them, otherwise converted without loss."""

from pathlib import Path

import cv2
import hypothesis.extra.numpy as hnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from common.camera.imagefile import load
from common.errors import DataError
from common.frame import PixelFormat, find_fault
from common.protocol.wire import MAX_PAYLOAD_BYTES
from tests.support.pictures import encoded, jpeg, picture

SHAPES = st.tuples(st.integers(1, 20), st.integers(1, 20))
PIXELS = st.one_of(
    hnp.arrays(np.uint8, SHAPES),
    hnp.arrays(np.uint16, SHAPES),
    hnp.arrays(np.uint8, SHAPES.map(lambda shape: (*shape, 3))),
    hnp.arrays(np.uint16, SHAPES.map(lambda shape: (*shape, 3))),
)


@given(PIXELS)
@settings(deadline=None, max_examples=80)
def test_raw_maps_become_lossless_png(
    tmp_path_factory: pytest.TempPathFactory, pixels: NDArray[np.uint8] | NDArray[np.uint16]
) -> None:
    """OpenCV reads back from the PNG the same pixels, and the reported size, of a grey or colour map of 8 or 16 bits."""
    path = tmp_path_factory.mktemp("maps") / ("map.pgm" if pixels.ndim == 2 else "map.ppm")
    assert cv2.imwrite(str(path), pixels)
    image = load(path)
    assert image.pixel_format is PixelFormat.PNG
    assert (image.height_px, image.width_px) == pixels.shape[:2]
    assert find_fault(image.pixel_format, image.payload) is None
    decoded = cv2.imdecode(np.frombuffer(image.payload, np.uint8), cv2.IMREAD_UNCHANGED)
    assert decoded is not None
    assert decoded.dtype == pixels.dtype
    np.testing.assert_array_equal(decoded, pixels)


@pytest.mark.parametrize(("suffix", "pixel_format"), [(".jpg", PixelFormat.MJPEG), (".png", PixelFormat.PNG)])
def test_jpeg_and_png_pass_untouched(tmp_path: Path, suffix: str, pixel_format: PixelFormat) -> None:
    """A file of a kind that hosts decode is sent byte for byte. Its size comes from its header."""
    path = tmp_path / f"image{suffix}"
    path.write_bytes(encoded(suffix, picture(37, 23)))
    image = load(path)
    assert (image.pixel_format, image.width_px, image.height_px) == (pixel_format, 37, 23)
    assert image.payload == path.read_bytes()


def test_the_contents_decide_not_the_name(tmp_path: Path) -> None:
    """A JPEG named .png is still a JPEG."""
    path = tmp_path / "image.png"
    path.write_bytes(jpeg())
    assert load(path).pixel_format is PixelFormat.MJPEG


@pytest.mark.parametrize("quality", [[cv2.IMWRITE_JPEG_PROGRESSIVE, 1], [cv2.IMWRITE_JPEG_RST_INTERVAL, 4]])
def test_size_of_other_kinds_of_jpeg(tmp_path: Path, quality: list[int]) -> None:
    """The size of progressive JPEGs and of JPEGs with restart intervals is read, too."""
    path = tmp_path / "image.jpg"
    assert cv2.imwrite(str(path), picture(41, 29), quality)
    assert (load(path).width_px, load(path).height_px) == (41, 29)


def test_fill_bytes_before_a_marker(tmp_path: Path) -> None:
    """Fill bytes FF before a JPEG's marker (T.81, B.1.1.2) are skipped."""
    path = tmp_path / "image.jpg"
    data = jpeg(41, 29)
    path.write_bytes(data[:2] + b"\xff\xff\xff" + data[2:])
    assert (load(path).width_px, load(path).height_px) == (41, 29)


def test_comments_and_blanks_in_a_map(tmp_path: Path) -> None:
    """Comments and any white space between a map's numbers (pgm(5)) make no difference."""
    path = tmp_path / "map.pgm"
    path.write_bytes(b"P5#made by hand\n# 2x1\n 2\t\r\n1 # next: maximum\n255\n\x07\x08")
    decoded = cv2.imdecode(np.frombuffer(load(path).payload, np.uint8), cv2.IMREAD_UNCHANGED)
    assert decoded is not None
    assert decoded.tolist() == [[7, 8]]


@pytest.mark.parametrize(
    "content",
    [
        pytest.param(b"", id="empty"),
        pytest.param(b"text", id="text"),
        pytest.param(b"\xff\xd8", id="start of a JPEG only"),
        pytest.param(b"\xff\xd8\xff\xd9", id="JPEG without frame"),
        pytest.param(b"\xff\xd8\xff" + bytes(20), id="JPEG with zeros"),
        pytest.param(b"\xff\xd8" + b"\xff" * 50, id="JPEG of fill bytes"),
        pytest.param(b"\xff\xd8\xff\xc0\x00\x0b\x08\x00\x00\x00\x10\x01\x01\x11\x00\xff\xd9", id="JPEG 0 px high"),
        pytest.param(b"\x89PNG\r\n\x1a\n", id="signature of a PNG only"),
        pytest.param(b"\x89PNG\r\n\x1a\n" + bytes(40), id="PNG 0 px wide"),
        pytest.param(b"P5 2 2 255 abc", id="map cut short"),
        pytest.param(b"P5 0 2 255 ", id="map 0 px wide"),
        pytest.param(b"P5 2 2 254 abcd", id="map with odd maximum"),
        pytest.param(b"P5 2 2 0 abcd", id="map with maximum 0"),
        pytest.param(b"P2 1 1 255 7", id="map in text form"),
        pytest.param(b"P5 20000 1 255 " + bytes(20000), id="wider than a link takes"),
        pytest.param(b"P5 " + b"9" * 5000 + b" 1 255 ", id="number without end"),
        pytest.param(b"P5" + b" " * 5000 + b"x", id="blanks without end"),
    ],
)
def test_what_cannot_be_replayed_is_named(tmp_path: Path, content: bytes) -> None:
    """A file that holds no image, or one that no link would take, is refused at once; the error names the file."""
    path = tmp_path / "bad.jpg"
    path.write_bytes(content)
    with pytest.raises(DataError, match=r"bad\.jpg"):
        load(path)


def test_an_image_too_large_for_any_link_is_refused(tmp_path: Path) -> None:
    """A file whose bytes no link would carry is refused when it is loaded, not frame by frame."""
    path = tmp_path / "huge.jpg"
    path.write_bytes(jpeg() + bytes(MAX_PAYLOAD_BYTES))
    with pytest.raises(DataError, match=r"huge\.jpg.*16 MB"):
        load(path)


def test_an_unreadable_file_is_named(tmp_path: Path) -> None:
    """A missing file or a folder raises DataError, not OSError."""
    for path in (tmp_path / "none.jpg", tmp_path):
        with pytest.raises(DataError, match=path.name):
            load(path)


@given(st.sampled_from([b"\xff\xd8\xff", b"P5 ", b"P6", b"\x89PNG\r\n\x1a\n", b""]), st.binary(max_size=200))
@settings(deadline=None, max_examples=200)
def test_any_content_is_read_or_refused(tmp_path_factory: pytest.TempPathFactory, start: bytes, rest: bytes) -> None:
    """For any file content the result is an image with a size or a DataError."""
    path = tmp_path_factory.getbasetemp() / "any.bin"
    path.write_bytes(start + rest)
    try:
        image = load(path)
    except DataError:
        return
    assert image.width_px > 0
    assert image.height_px > 0
