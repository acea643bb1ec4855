"""EXIF orientation: every kind of file that can state one is turned upright by it, files and frames alike; what cannot be read is told."""

import struct
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import DataError
from common.frame import PixelFormat, SpoiledImageError
from common.imagesize.read import read_head
from common.imagesize.tiff import exif_orientation
from common.orientation import UPRIGHT, Flip, Orientation
from phone_host.model import Image
from phone_host.stereo.images import decode, decode_file, open_image
from phone_host.stereo.raw_images import EncodedImage, decode_frames
from tests.support.oriented import SUFFIXES, exif, oriented
from tests.support.pictures import encoded, picture

# CIPA DC-008, 4.6.4: where row 0 and column 0 of the stored image lie in the upright one.
UPRIGHT_BY: dict[int, Callable[[Image], Image]] = {
    1: lambda image: image,
    2: lambda image: image[:, ::-1],
    3: lambda image: image[::-1, ::-1],
    4: lambda image: image[::-1],
    5: lambda image: image.swapaxes(0, 1),
    6: lambda image: image[::-1].swapaxes(0, 1),
    7: lambda image: image[::-1, ::-1].swapaxes(0, 1),
    8: lambda image: image[:, ::-1].swapaxes(0, 1),
}


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("orientation", range(9))
def test_every_orientation_is_applied(suffix: str, orientation: int) -> None:
    """All eight values, and 0 (not known), in all four kinds: upright pixels, and the upright size before decoding."""
    image = picture(48, 32, seed=3)
    content = oriented(suffix, image, orientation)
    stored = decode(encoded(suffix, image))
    expected = UPRIGHT_BY[max(orientation, 1)](stored)
    np.testing.assert_array_equal(decode(content), expected)
    assert read_head(content, "image").upright_px == expected.shape[1::-1]
    assert read_head(content, "image").size_px == (48, 32)


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("order", ["<", ">"])
def test_opencvs_own_reader_turns_a_jpeg_the_same_way(orientation: int, order: str) -> None:
    """With orientation not ignored, OpenCV gives the same pixels, whatever the byte order of the metadata."""
    content = oriented(".jpg", picture(48, 32), orientation, order)
    theirs = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)
    assert theirs is not None
    np.testing.assert_array_equal(decode(content), theirs)


@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_deep_tiff_is_turned_once(orientation: int) -> None:
    """16-bit TIFFs, which decoders turn otherwise than 8-bit ones, come out the same."""
    image = (picture(48, 32).astype(np.uint16)) * 257
    content = oriented(".tiff", image, orientation)  # type: ignore[arg-type]
    np.testing.assert_array_equal(decode(content), UPRIGHT_BY[orientation](picture(48, 32)))


def test_files_and_frames_are_turned_alike(tmp_path: Path) -> None:
    """A phone's JPEG read from a file and the same bytes as a frame of a stream give the same pixels."""
    content = oriented(".jpg", picture(48, 32), 6)
    (tmp_path / "a.jpg").write_bytes(content)
    checked: list[tuple[tuple[int, int], tuple[int, int]]] = []

    def plan(first_px: tuple[int, int], second_px: tuple[int, int]) -> tuple[int, int]:
        checked.append((first_px, second_px))
        return 1, 1

    frame = EncodedImage(
        payload=content, pixel_format=PixelFormat.MJPEG, width_px=48, height_px=32, name="frame", asked_px=(48, 32)
    )
    left, right = decode_frames(frame, frame, plan=plan)
    assert checked == [((32, 48), (32, 48))]
    np.testing.assert_array_equal(left, decode_file(open_image(tmp_path / "a.jpg")))
    np.testing.assert_array_equal(right, left)


def test_a_smaller_turned_frame_is_enlarged_to_the_turned_size() -> None:
    """Its camera was asked for 96x64, so the upright image is 64x96."""
    frame = EncodedImage(
        payload=oriented(".jpg", picture(48, 32), 8),
        pixel_format=PixelFormat.MJPEG,
        width_px=48,
        height_px=32,
        name="frame",
        asked_px=(96, 64),
    )
    assert decode_frames(frame, frame)[0].shape == (96, 64, 3)


def test_what_the_user_says_of_a_camera_comes_after_its_header(tmp_path: Path) -> None:
    """EXIF 6 turns clockwise by 90 degrees; mounted turned by another 90 degrees and mirrored, that is half a turn, then a mirror."""
    (tmp_path / "a.png").write_bytes(oriented(".png", picture(48, 32), 6))
    mounted = Orientation(90, Flip.H)
    assert open_image(tmp_path / "a.png", mounted=mounted).size_px == (48, 32)
    expected = picture(48, 32)[::-1, ::-1][:, ::-1]
    np.testing.assert_array_equal(decode_file(open_image(tmp_path / "a.png", mounted=mounted)), expected)


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("orientation", [9, 65535])
def test_an_orientation_that_does_not_exist_is_refused(suffix: str, orientation: int) -> None:
    """In words that name the image and the value."""
    with pytest.raises(SpoiledImageError, match=f"photo says that it has EXIF orientation {orientation}"):
        decode(oriented(suffix, picture(), orientation), "photo")


def test_other_metadata_come_before_or_beside() -> None:
    """XMP, which is an APP1 segment as well, and a second EXIF segment behind the first change nothing."""
    content = oriented(".jpg", picture(48, 32), 6)
    xmp = b"\xff\xe1" + struct.pack(">H", 2 + 29 + 8) + b"http://ns.adobe.com/xap/1.0/\0" + b"<xmp/>  "
    second = b"Exif\0\0" + exif(3)
    second = b"\xff\xe1" + struct.pack(">H", 2 + len(second)) + second
    first_end = 4 + struct.unpack_from(">H", content, 4)[0]
    assert read_head(content[:2] + xmp + content[2:], "image").orientation == Orientation(90)
    assert read_head(content[:first_end] + second + content[first_end:], "image").orientation == Orientation(90)


@pytest.mark.parametrize(
    "entry",
    [
        struct.pack("<HHI4s", 271, 2, 4, b"abc\0"),
        struct.pack("<HHIHH", 274, 3, 2, 6, 6),
        struct.pack("<HHI4s", 274, 2, 2, b"6\0\0\0"),
    ],
    ids=["only the maker", "two orientations", "a text"],
)
def test_metadata_without_one_orientation_leave_an_image_as_it_is_stored(entry: bytes) -> None:
    """The standard has one SHORT for the orientation: two of them or a text say nothing, as does no entry at all."""
    metadata = b"II*\0" + struct.pack("<IH", 8, 1) + entry + struct.pack("<I", 0)
    assert exif_orientation(metadata, "image") == UPRIGHT


@pytest.mark.parametrize(("chunks", "orientation"), [(20, Orientation(90)), (5000, UPRIGHT)])
def test_the_walk_through_a_webp_has_an_end(chunks: int, orientation: Orientation) -> None:
    """EXIF is found behind other chunks, but not behind thousands of empty ones, which no still image has."""
    content = oriented(".webp", picture(48, 32), 6)
    header_end = 12 + 8 + 10
    body = content[8:header_end] + struct.pack("<4sI", b"none", 0) * chunks + content[header_end:]
    assert read_head(b"RIFF" + struct.pack("<I", len(body)) + body, "image").orientation == orientation


@given(st.binary(max_size=80), st.integers(0, 60))
def test_spoiled_metadata_say_nothing(noise: bytes, cut: int) -> None:
    """Any bytes in their place, and metadata that end early, leave an image as it is stored or name an orientation that exists."""
    for metadata in (noise, b"II*\0" + noise, exif(6)[:cut]):
        try:
            orientation = exif_orientation(metadata, "image")
        except SpoiledImageError:
            continue
        assert orientation in {
            UPRIGHT, *(Orientation(turn) for turn in (90, 180, 270)), Orientation(0, Flip.H), Orientation(0, Flip.V),
            Orientation(90, Flip.H), Orientation(90, Flip.V),
        }  # fmt: skip


@pytest.mark.parametrize(("brand", "kind"), [(b"heic", "HEIC"), (b"mif1", "HEIC"), (b"avif", "AVIF")])
def test_phone_formats_are_refused_with_the_way_to_convert_them(tmp_path: Path, brand: bytes, kind: str) -> None:
    """HEIC and AVIF are named, and so is a command that converts them."""
    (tmp_path / "photo").write_bytes(struct.pack(">I4s4sI", 24, b"ftyp", brand, 0) + b"mif1heic" + b"\0" * 400)
    with pytest.raises(DataError, match=f"is a {kind} image, which is not read: convert it to JPEG.*magick"):
        decode_file(open_image(tmp_path / "photo"))


def test_a_raw_photograph_is_refused() -> None:
    """A DNG is a TIFF whose first directory is a thumbnail."""
    entries = b"".join(struct.pack("<HHII", tag, kind, count, value) for tag, kind, count, value in (
        (256, 4, 1, 160), (257, 4, 1, 120), (50706, 1, 4, 0x0401),
    ))  # fmt: skip
    with pytest.raises(SpoiledImageError, match="raw photograph"):
        read_head(b"II*\0" + struct.pack("<IH", 8, 3) + entries + b"\0" * 100, "photo")
