"""The size of an image is read from its header. What cannot be the image that it claims to be is refused before anything is decoded."""

import struct
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.frame import FrameFault, ImageSizeError, SpoiledImageError
from common.imagesize.head import MEGAPIXEL, MOST_PIXELS, ImageKind, require_believable
from common.imagesize.read import read_head, whole_image
from phone_host.stereo.images import decode
from tests.support import bombs
from tests.support.pictures import encoded, jpeg, picture

KINDS = {
    ".jpg": ImageKind.JPEG,
    ".png": ImageKind.PNG,
    ".bmp": ImageKind.BMP,
    ".ppm": ImageKind.PNM,
    ".tiff": ImageKind.TIFF,
    ".webp": ImageKind.WEBP,
}


def judge(content: bytes, name: str) -> bytes:
    """All checks before decoding."""
    head = read_head(content, name)
    require_believable(head, MOST_PIXELS, name)
    return whole_image(content, head, name)


def fault_of(content: bytes) -> FrameFault:
    """The reason for which an image is refused."""
    with pytest.raises(SpoiledImageError) as caught:
        judge(content, "frame 7")
    assert "frame 7" in caught.value.problem
    return caught.value.fault


@given(st.sampled_from(list(KINDS)), st.integers(1, 300), st.integers(1, 300))
@settings(deadline=None)
def test_the_size_is_what_the_writer_wrote(suffix: str, width_px: int, height_px: int) -> None:
    """Everything that OpenCV writes has the size in its header, and is whole."""
    content = encoded(suffix, picture(width_px, height_px))
    head = read_head(content, "image")
    assert (head.kind, head.size_px) == (KINDS[suffix], (width_px, height_px))
    assert decode(whole_image(content, head, "image")).shape[:2] == (height_px, width_px)


@pytest.mark.parametrize("quality", [0, 1, 50, 100])
@pytest.mark.parametrize("flags", [[], [cv2.IMWRITE_JPEG_PROGRESSIVE, 1], [cv2.IMWRITE_JPEG_OPTIMIZE, 1]])
@pytest.mark.parametrize("level", [0, 255])
def test_the_plainest_images_are_long_enough(quality: int, flags: list[int], level: int) -> None:
    """A black or white JPEG at any quality has no fewer bytes than the bound, which follows from the code and not from example images."""
    for channels in (1, 3):
        image = np.full((480, 640, channels), level, np.uint8)
        done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality, *flags])
        assert done
        head = read_head(data.tobytes(), "image")
        assert whole_image(data.tobytes(), head, "image") == data.tobytes()


def test_webp_of_both_codings_and_a_large_tiff() -> None:
    """The size of lossless and lossy WebP, of WebP with alpha and of tiled TIFF is read."""
    for quality in (50, 101):
        done, data = cv2.imencode(".webp", picture(53, 31), [cv2.IMWRITE_WEBP_QUALITY, quality])
        assert done
        assert read_head(data.tobytes(), "image").size_px == (53, 31)
    alpha = np.dstack([picture(53, 31), picture(53, 31)[..., 0]])
    done, data = cv2.imencode(".webp", alpha, [cv2.IMWRITE_WEBP_QUALITY, 50])
    assert done
    assert read_head(data.tobytes(), "image").size_px == (53, 31)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("is_big", [False, True])
def test_tiff_in_both_orders(order: str, is_big: bool) -> None:  # noqa: FBT001 - a parameter of the test
    """Classic and big TIFF, in both byte orders: the first directory gives the size; of repeated entries the larger one counts."""

    def entry(tag: int, value: int) -> bytes:
        number = struct.pack(f"{order}{'Q' if is_big else 'I'}", value)
        return struct.pack(f"{order}HH{'Q' if is_big else 'I'}", tag, 16 if is_big else 4, 1) + number

    magic = {"<": b"II", ">": b"MM"}[order] + struct.pack(f"{order}H", 43 if is_big else 42)
    start = magic + (struct.pack(f"{order}HHQ", 8, 0, 16) if is_big else struct.pack(f"{order}I", 8))
    entries = (entry(256, 70), entry(257, 50), entry(256, 90_000))
    content = start + struct.pack(f"{order}{'Q' if is_big else 'H'}", len(entries)) + b"".join(entries)
    assert read_head(content, "image").size_px == (90_000, 50)


def test_a_tile_counts_like_an_image() -> None:
    """A small TIFF whose tile would decode into gigabytes exceeds the limit."""
    fields = ((256, 70), (257, 50), (322, 40_000), (323, 40_000))
    entries = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in fields)
    content = b"II*\0" + struct.pack("<IH", 8, len(fields)) + entries
    assert fault_of(content) is FrameFault.TOO_LARGE


def short_tiff(*entries: tuple[int, int, int]) -> bytes:
    """A 32-bit TIFF with a directory of tags, kinds and values, and nothing else."""
    fields = b"".join(struct.pack("<HHII", tag, kind, 1, value) for tag, kind, value in entries)
    return b"II*\0" + struct.pack("<IH", 8, len(entries)) + fields


def webp(kind: bytes, body: bytes) -> bytes:
    """A WebP of one chunk (RFC 9649, 2.3 and 2.4)."""
    return b"RIFF" + struct.pack("<I", 12 + len(body)) + b"WEBP" + kind + struct.pack("<I", len(body)) + body


EMPTY_TEXT = bombs.chunk(b"tEXt", b"")

BAD = {
    "a small JPEG of 30000x30000": (bombs.SMALL_BOMB, FrameFault.TOO_LARGE),
    "a small JPEG of 8000x8000": (bombs.claiming(jpeg(16, 8), 8000, 8000), FrameFault.TOO_SHORT),
    "a progressive one of 8000x8000": (bombs.claiming(bombs.progressive(), 8000, 8000), FrameFault.TOO_SHORT),
    "a PNG of 16000x16000": (bombs.claiming(bombs.black_png(10, 10), 16_000, 16_000), FrameFault.TOO_LARGE),
    "a PNG of 8000x8000": (bombs.claiming(bombs.black_png(10, 10), 8000, 8000), FrameFault.TOO_SHORT),
    "80 scans": (bombs.with_scans(bombs.progressive(), 80), FrameFault.TOO_MANY_SCANS),
    "two frame headers": (jpeg(16, 8)[:2] + bombs.claiming(jpeg(640, 480), 8, 8)[2:200] + jpeg(16, 8)[2:], None),
    "two PNG headers": (bombs.black_png(8, 8, extra=bombs.black_png(900, 900)[8:33]), FrameFault.OTHER_SIZE),
    "far more pixels than its size": (
        bombs.black_png(8, 8)[:33] + bombs.chunk(b"IDAT", bytes(100_000)) + bombs.chunk(b"IEND", b""),
        FrameFault.WRONG_LENGTH,
    ),
    "nothing": (b"", FrameFault.EMPTY),
    "a text": (b"text", FrameFault.NO_START),
    "a film": (b"GIF89a" + bytes(100), FrameFault.NO_START),
    "a TIFF whose width is a fraction": (short_tiff((256, 5, 8), (257, 4, 50)), FrameFault.NO_START),
    "a TIFF of 64 bits without the room": (short_tiff((256, 16, 8), (257, 4, 50)), FrameFault.NO_START),
    "a lossy WebP without its start code": (webp(b"VP8 ", bytes(3) + b"\0\0\0" + bytes(4)), FrameFault.NO_START),
    "a lossless WebP without its signature": (webp(b"VP8L", b"\x2e" + bytes(4)), FrameFault.NO_START),
    "a JPEG with a segment shorter than its length": (b"\xff\xd8\xff\xe0\0\1" + jpeg()[2:], FrameFault.CORRUPT),
    "a PNG of too many chunks": (bombs.black_png(8, 8, extra=EMPTY_TEXT * 2**17), FrameFault.NO_END),
    "a JPEG cut before its image": (jpeg()[:40], FrameFault.NO_END),
    "a JPEG without its end": (jpeg()[:-2], FrameFault.NO_END),
    "a PNG without its end": (bombs.black_png(8, 8)[:-12], FrameFault.NO_END),
}


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_whole_is_refused(case: str) -> None:
    """Each kind of lie is refused with its own reason, before anything is decoded."""
    content, expected = BAD[case]
    found = fault_of(content)
    assert expected in {None, found}


def test_the_limit_is_told() -> None:
    """An image beyond the limit is refused. The error gives its name, its size, the limit and the remedy. Phones' 64 MP are within the limit."""
    head = read_head(bombs.black_png(200, 100), "image")
    require_believable(head, 20_000, "a.png")
    with pytest.raises(ImageSizeError) as caught:
        require_believable(read_head(bombs.SMALL_BOMB, "image"), 64 * MEGAPIXEL, "a.jpg")
    assert str(caught.value) == (
        "a.jpg is 30000x30000 px (858 MPx), the limit is 64 MPx: scale it down, or raise --max-megapixels if its size is right"
    )
    assert MOST_PIXELS >= 9248 * 6936


def test_usual_progressive_images_pass() -> None:
    """The usual ten scans are well within the limit."""
    content = bombs.progressive()
    assert content.count(b"\xff\xda") == 10
    assert whole_image(content, read_head(content, "image"), "image") == content
    assert whole_image(bombs.with_scans(content, 20), read_head(content, "image"), "image")


def test_only_pixels_of_a_png_are_decoded() -> None:
    """Texts, profiles and animations do not reach the decoder; the image is unchanged."""
    texts = bombs.chunk(b"zTXt", b"a\0\0" + bombs.packed_zeros(7)) * 3 + bombs.chunk(b"iCCP", b"a\0\0" + bytes(100))
    plain, padded = bombs.black_png(64, 48), bombs.black_png(64, 48, extra=texts)
    assert whole_image(padded, read_head(padded, "image"), "image") == plain


def test_bytes_before_a_marker_are_passed_over() -> None:
    """As in decoders, fill bytes and a sloppy writer's junk between segments change nothing, and hide no size."""
    content = jpeg(41, 29)
    for junk in (b"\xff\xff\xff", b"\0\0\0", b"\xff\0", b"abc"):
        sloppy = content[:20] + junk + content[20:]  # behind the JFIF segment
        assert read_head(sloppy, "image").size_px == (41, 29)
        np.testing.assert_array_equal(decode(sloppy), decode(content))


@pytest.mark.many
@given(
    st.sampled_from([b"", b"\xff\xd8", b"\x89PNG\r\n\x1a\n", b"BM", b"II*\0", b"MM\0+", b"RIFF1234WEBPVP8", b"P6 1 "]),
    st.binary(max_size=300),
)
@settings(deadline=None, max_examples=500)
def test_any_bytes_are_read_or_refused(start: bytes, rest: bytes) -> None:
    """For any bytes the result is a head with a size or a SpoiledImageError."""
    try:
        head = read_head(start + rest, "image")
        whole_image(start + rest, head, "image")
    except SpoiledImageError:
        return
    assert min(head.size_px) >= 1


@pytest.mark.many
@given(st.sampled_from(sorted(KINDS)), st.data())
@settings(deadline=None, max_examples=300)
def test_what_is_decoded_has_the_size_that_was_read(suffix: str, data: st.DataObject) -> None:
    """An image with changed bytes is refused, or OpenCV decodes it to the size that was read and judged before."""
    content = bytearray(encoded(suffix, picture(24, 16)))
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, min(len(content) - 1, 400)))] = data.draw(st.integers(0, 255))
    try:
        image = decode(bytes(content), most_pixels=MEGAPIXEL)
    except SpoiledImageError:
        return
    assert (image.shape[1], image.shape[0]) == read_head(bytes(content), "image").size_px


def test_markers_without_a_length_are_passed_over() -> None:
    """A JPEG with TEM and restart markers, which carry no length (T.81, table B.1), before its frame header has the size that it was written with."""
    content = jpeg(41, 29)
    assert read_head(content[:2] + b"\xff\x01\xff\xd0\xff\xd7" + content[2:], "image").size_px == (41, 29)


def test_a_foreign_marker_between_scans_is_no_segment() -> None:
    """After a marker that may not stand between scans the search continues at once: the bytes after it are not taken as a length, and the end is found."""
    content = jpeg(16, 8)
    inside = content[:-2] + b"\xff\x02\xff\xff" + b"\xff\xd9"
    assert whole_image(inside, read_head(inside, "image"), "image") == inside


def test_real_files_of_a_folder_keep_their_bytes(tmp_path: Path) -> None:
    """A PNG without texts is passed on as it is, not copied."""
    path = tmp_path / "a.png"
    cv2.imwrite(str(path), picture())
    content = path.read_bytes()
    assert whole_image(content, read_head(content, "a.png"), "a.png") is content
