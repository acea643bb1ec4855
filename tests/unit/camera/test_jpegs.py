"""JPEG images in a byte stream, multipart or not: each whole image comes once, with its own bytes, whatever lies between images."""

import random

import cv2
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.frame import FrameFault
from phone_host.camera.jpegs import MAX_IMAGE_BYTES, Broken, JpegStream, Whole
from tests.support.pictures import jpeg, picture

IMAGES = [jpeg(16 + 8 * seed, 8, seed=seed) for seed in range(6)]


def progressive(seed: int) -> bytes:
    """An image of several scans, with tables between them and restart markers in them."""
    flags = [cv2.IMWRITE_JPEG_PROGRESSIVE, 1, cv2.IMWRITE_JPEG_RST_INTERVAL, 1]
    done, data = cv2.imencode(".jpg", picture(64, 48, seed=seed), flags)
    assert done
    return data.tobytes()


def with_comment(image: bytes, comment: bytes) -> bytes:
    """The image with a comment segment after its first marker (T.81, B.2.4.5), such as a thumbnail in EXIF data."""
    return image[:2] + b"\xff\xfe" + (len(comment) + 2).to_bytes(2, "big") + comment + image[2:]


def parts(stream: JpegStream, data: bytes, now_ns: int = 1) -> list[bytes]:
    """Payloads of the images in these bytes."""
    return [event.payload for event in stream.feed(data, now_ns) if isinstance(event, Whole)]


BETWEEN = {
    "as RFC 2046 has it": b"\r\n--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n",
    "no length": b"\r\n--frame\r\nContent-Type: image/jpeg\r\n\r\n",
    "no line end before": b"--frame\r\nContent-Type: image/jpeg\r\n\r\n",
    "no dashes": b"\r\nframe\r\nContent-Type: image/jpeg\r\n\r\n",
    "bare newlines": b"\n--frame\nContent-Type: image/jpeg\n\n",
    "a lying length": b"\r\n--frame\r\nContent-Length: 7\r\n\r\n",
    "other headers": b"\r\n--frame\r\nX-Timestamp: 12.5\r\nServer: IP Webcam\r\nContent-type:image/jpeg\r\n\r\n",
    "no header": b"\r\n--frame\r\n\r\n",
    "zeros": bytes(300),
    "nothing": b"",
}


@pytest.mark.parametrize("between", BETWEEN.values(), ids=BETWEEN.keys())
def test_every_way_of_parting_images(between: bytes) -> None:
    """Whatever lies between the images of a stream, each comes once, with exactly its bytes and size."""
    stream = JpegStream()
    data = b"".join((between % len(image) if b"%d" in between else between) + image for image in IMAGES)
    events = stream.feed(data + between, 1)
    assert [event.payload for event in events if isinstance(event, Whole)] == IMAGES
    assert [(event.width_px, event.height_px) for event in events if isinstance(event, Whole)] == [
        (16 + 8 * seed, 8) for seed in range(6)
    ]
    assert len(events) == len(IMAGES)


@given(cuts=st.lists(st.integers(0, 20_000), max_size=30), between=st.sampled_from(sorted(BETWEEN.values())))
@settings(deadline=None, max_examples=60)
def test_any_chopping_gives_the_same_images(cuts: list[int], between: bytes) -> None:
    """However the bytes are split into chunks, the same images come."""
    data = b"".join(between + image for image in [*IMAGES, progressive(3)])
    edges = sorted(min(cut, len(data)) for cut in cuts)
    stream = JpegStream()
    pieces = [data[a:b] for a, b in zip([0, *edges], [*edges, len(data)], strict=True)]
    assert [image for piece in pieces for image in parts(stream, piece)] == [*IMAGES, progressive(3)]


def test_an_image_is_there_with_its_last_byte() -> None:
    """An image is given as soon as its last byte has arrived, not with the next part. The arrival time of its first byte is given, too."""
    stream, image = JpegStream(), IMAGES[2]
    assert stream.feed(b"--frame\r\n\r\n", 5) == []
    assert stream.feed(image[:1], 10) == []
    assert stream.feed(image[1:100], 20) == []
    assert stream.feed(image[100:-1], 30) == []
    assert stream.feed(image[-1:], 40) == [Whole(payload=image, width_px=32, height_px=8, began_ns=10, ended_ns=40)]


def test_a_thumbnail_ends_no_image() -> None:
    """An image inside a segment of another one, and an end marker there, belong to the outer image."""
    outer = with_comment(IMAGES[3], IMAGES[0] + b"\xff\xd9\xff\xd8")
    assert parts(JpegStream(), outer + IMAGES[1]) == [outer, IMAGES[1]]


@given(at=st.integers(400, 10_000), between=st.sampled_from(sorted(BETWEEN.values())))
@settings(deadline=None)
def test_a_truncated_image_costs_only_itself(at: int, between: bytes) -> None:
    """An image that breaks off in its data is reported once as broken; the images before and after it come."""
    image = jpeg(64, 48, seed=9)
    cut = image[: min(max(at, image.index(b"\xff\xda") + 20), len(image) - 2)]
    events = JpegStream().feed(between.join([IMAGES[0], cut, IMAGES[1], IMAGES[2]]), 1)
    assert [event.payload for event in events if isinstance(event, Whole)] == IMAGES[:3]
    assert [event for event in events if isinstance(event, Broken)] == [Broken(FrameFault.NO_END)]


@given(garbage=st.binary(max_size=2000))
@settings(deadline=None)
def test_images_behind_garbage_are_found(garbage: bytes) -> None:
    """After any garbage images come again: all from the first one on that no false segment length in the garbage covers."""
    stream = JpegStream()
    came = parts(stream, garbage + bytes(70_000) + b"".join(IMAGES))
    assert came == IMAGES


def test_an_image_without_end_is_bounded() -> None:
    """An image that never ends is given up at the limit of a link's payload, and the images after it come."""
    stream, endless = JpegStream(), IMAGES[0][:-2]
    stream.feed(endless, 1)
    broken = 0
    for _ in range(40):
        broken += len(stream.feed(bytes(1 << 20), 2))
        assert stream.held_bytes <= MAX_IMAGE_BYTES
    assert broken == 1
    assert parts(stream, IMAGES[1]) == [IMAGES[1]]


@pytest.mark.parametrize("between", [between for between in BETWEEN.values() if b"--" in between or not between])
def test_a_server_that_never_ends_an_image_is_understood_after_five(between: bytes) -> None:
    """Five images are broken; from then on each comes as it was before its end marker was left out, when the next begins."""
    stream = JpegStream()
    images = IMAGES[:4] * 4
    came: list[Whole | Broken] = []
    for number, image in enumerate(images):
        head = between % len(image) if b"%d" in between else between
        came += stream.feed(head + image[:-2], number)
    assert came[:5] == [Broken(FrameFault.NO_END)] * 5
    assert [event.payload for event in came[5:] if isinstance(event, Whole)] == images[5:-1]
    assert [(event.began_ns, event.ended_ns) for event in came[5:] if isinstance(event, Whole)] == [
        (number, number + 1) for number in range(5, len(images) - 1)
    ]


def test_a_server_that_ended_an_image_once_has_no_such_habit() -> None:
    """Where any image has ended, those that do not are truncated, however many they are."""
    data = b"".join([IMAGES[0], *[IMAGES[1][:-2]] * 12, IMAGES[2]])
    events = JpegStream().feed(data, 1)
    assert [event.payload for event in events if isinstance(event, Whole)] == [IMAGES[0], IMAGES[2]]
    assert sum(event == Broken(FrameFault.NO_END) for event in events) == 12


def test_ten_million_random_bytes() -> None:
    """During 10^7 random bytes no more than one image's bytes are held, and the next good image comes within a segment's length."""
    chance, stream = random.Random(4), JpegStream()
    for _ in range(100):
        stream.feed(chance.randbytes(100_000), 1)
        assert stream.held_bytes <= MAX_IMAGE_BYTES
    came = parts(stream, b"".join(IMAGES * 200))
    assert came
    assert came[-1] == IMAGES[-1]


def test_an_image_without_size_is_broken() -> None:
    """A JPEG of height 0, which some encoders write and fill in later, is reported as broken."""
    image = bytearray(IMAGES[0])
    at = image.index(b"\xff\xc0")
    image[at + 5 : at + 7] = b"\0\0"
    assert JpegStream().feed(bytes(image), 1) == [Broken(FrameFault.WRONG_LENGTH)]


SOI, EOI = b"\xff\xd8", b"\xff\xd9"
FRAME = b"\xff\xc0\x00\x0b\x08\x00\x10\x00\x20\x01\x01\x11\x00"
"""A frame header of 32 x 16 pixels, one component (T.81, B.2.2)."""
SCAN = b"\xff\xda\x00\x08\x01\x01\x00\x00\x3f\x00entropy"


@pytest.mark.parametrize(
    "markers",
    [FRAME, b"\xff\xff" + FRAME, b"\xff\xd0\xff\xd7" + FRAME, b"\xff\xfe\x00\x04no" + FRAME],
    ids=["plain", "filled up", "restarts", "a comment"],
)
def test_legal_markers_are_walked_over_byte_by_byte(markers: bytes) -> None:
    """Fill bytes, restart markers and comments belong to an image. It is whole with its last byte, and no part of it is skipped."""
    image = SOI + markers + SCAN + EOI
    stream = JpegStream()
    events = [event for at in range(len(image)) for event in stream.feed(image[at : at + 1], at)]
    [whole] = events
    assert isinstance(whole, Whole)
    assert (whole.payload, whole.width_px, whole.height_px) == (image, 32, 16)
    assert (stream.passed_bytes, stream.held_bytes) == (0, 0)


@pytest.mark.parametrize(
    "spoiled",
    [
        SOI + b"\xff\xd0\x00",
        SOI + b"\xff\xd0\x00\x00\x00\x00",
        SOI + b"\xff\x01\x00\x04",
        SOI + b"\xff\xfe\x00\x01",
        SOI + FRAME,
    ],
    ids=["no marker, short", "no marker", "a code that is none", "a length of one", "another beginning"],
)
def test_illegal_markers_break_the_image_and_only_that(spoiled: bytes) -> None:
    """An illegal marker breaks the image in progress; the next image is found."""
    stream = JpegStream()
    events = [*stream.feed(spoiled, 1), *stream.feed(IMAGES[0], 2)]
    assert [type(event) for event in events] == [Broken, Whole]
    last = events[-1]
    assert isinstance(last, Whole)
    assert last.payload == IMAGES[0]


def test_what_is_no_marker_is_told_with_its_first_byte() -> None:
    """If another byte comes where a marker must be, the image is broken at once, without waiting for more; the next one is whole."""
    stream = JpegStream()
    assert stream.feed(b"\xff\xd8\xff\xe0\0\4JF", 1) == []
    assert stream.feed(b"\x20", 2) == [Broken(FrameFault.NO_END)]
    assert parts(stream, IMAGES[1]) == [IMAGES[1]]
