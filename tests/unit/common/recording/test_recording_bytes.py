"""A recording's bytes: messages as ROS 2 writes them, and a file of which all that is whole is read, whatever happened to it."""

import random
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.frame import PixelFormat, raw_bytes
from common.recording.cdr import BrokenMessageError
from common.recording.inflate import inflate
from common.recording.mcap_records import Attachment, Damage, Message, Metadata, Record
from common.recording.recorded import read_recorded
from common.recording.ros_messages import (
    COMPRESSED_IMAGE,
    IMAGE,
    CameraInfo,
    RecordedImage,
    camera_info_message,
    cloud_parts,
    depth_parts,
    image_message,
    image_type,
    read_image,
)
from common.recording.salvage import Salvage, is_mcap
from tests.support.camera_infos import read_camera_info
from tests.support.recorded import recording

PAIRS = 24
WHOLE = recording(PAIRS)
CHUNK_MESSAGES = 8
SIZES = st.integers(1, 20).map(lambda half: 2 * half)


def _read(data: bytes) -> tuple[list[Record], bool]:
    salvage = Salvage(memoryview(data), inflate)
    return list(salvage.records()), salvage.is_complete


def _messages(records: list[Record]) -> list[Message]:
    return [record for record in records if isinstance(record, Message)]


def test_a_compressed_image_has_the_bytes_of_ros() -> None:
    """OMG DDSI-RTPS 2.5, 10.5 and CORBA 3.4 part 2, 9.3: the header, then each value aligned to its size behind it."""
    image = RecordedImage(5_000_000_007, "left", PixelFormat.MJPEG, (0, 0), b"\xff\xd8\xff")
    by_hand = (
        b"\x00\x01\x00\x00"
        b"\x05\x00\x00\x00"
        b"\x07\x00\x00\x00"
        b"\x05\x00\x00\x00left\x00"
        b"\x00\x00\x00"
        b"\x05\x00\x00\x00jpeg\x00"
        b"\x00\x00\x00"
        b"\x03\x00\x00\x00\xff\xd8\xff"
    )
    assert image_message(image) == by_hand


def test_depth_and_cloud_have_the_bytes_of_ros() -> None:
    """A depth of 1 x 2 and a cloud of one point, value by value; strings and numbers are aligned as above."""
    stamp = b"\x00\x01\x00\x00\x05\x00\x00\x00\x07\x00\x00\x00\x05\x00\x00\x00left\x00"
    depth = (
        b"\x00\x00\x00"
        b"\x01\x00\x00\x00"
        b"\x02\x00\x00\x00"  # height, width
        b"\x06\x00\x00\x0016UC1\x00"
        b"\x00"
        b"\x00"
        b"\x04\x00\x00\x00"  # little endian; aligned; bytes of a row
        b"\x04\x00\x00\x00"
        b"\xe8\x03\x00\x00"
    )
    assert b"".join(depth_parts(5_000_000_007, "left", (2, 1), b"\xe8\x03\x00\x00")) == stamp + depth

    def field(name: bytes, offset: int) -> bytes:
        return (
            b"\x02\x00\x00\x00"
            + name
            + b"\x00\x00\x00"
            + bytes([offset, 0, 0, 0])
            + b"\x07\x00\x00\x00"
            + b"\x01\x00\x00\x00"
        )

    cloud = (
        b"\x00\x00\x00" b"\x01\x00\x00\x00" b"\x01\x00\x00\x00" b"\x04\x00\x00\x00"  # height, width, fields
        + field(b"x", 0) + field(b"y", 4) + field(b"z", 8)
        + b"\x04\x00\x00\x00rgb\x00" b"\x0c\x00\x00\x00" b"\x07\x00\x00\x00" b"\x01\x00\x00\x00"
        + b"\x00\x00\x00\x00" b"\x10\x00\x00\x00" b"\x10\x00\x00\x00" b"\x10\x00\x00\x00" + bytes(16) + b"\x01"
    )  # fmt: skip
    assert b"".join(cloud_parts(5_000_000_007, "left", bytes(16))) == stamp + cloud


def _images(pixel_format: PixelFormat, size_px: tuple[int, int]) -> st.SearchStrategy[RecordedImage]:
    """Images of one encoding and size; raw ones have as many bytes as that takes."""
    size = raw_bytes(pixel_format, *size_px)
    content = st.binary() if size is None else st.binary(min_size=size, max_size=size)
    stamps, sides = st.integers(0, 2**31 * 10**9 - 1), st.sampled_from(["left", "right", ""])
    return st.builds(RecordedImage, stamps, sides, st.just(pixel_format), st.just(size_px), content)


IMAGES = st.tuples(st.sampled_from(list(PixelFormat)), st.tuples(SIZES, SIZES)).flatmap(lambda each: _images(*each))


@given(IMAGES)
def test_images_come_back_as_they_were(image: RecordedImage) -> None:
    """Any image is read as it was written; a compressed one tells its size itself."""
    kind = image_type(image.pixel_format)
    back = read_image(kind, image_message(image))
    assert (back.stamp_ns, back.frame_id, back.pixel_format) == (image.stamp_ns, image.frame_id, image.pixel_format)
    assert bytes(back.payload) == image.payload
    assert back.size_px == (image.size_px if kind == IMAGE else (0, 0))


def test_camera_info_comes_back_as_it_was() -> None:
    """Every number of it."""
    info = CameraInfo(
        stamp_ns=7,
        frame_id="right",
        size_px=(640, 480),
        model="plumb_bob",
        distortion=(0.1, -0.2, 0.0, 0.0, 0.5),
        matrix=tuple(map(float, range(9))),
        rotation=tuple(map(float, range(9, 18))),
        projection=tuple(map(float, range(12))),
    )
    assert read_camera_info(camera_info_message(info)) == info


@given(st.binary(max_size=200))
def test_other_bytes_are_no_image(data: bytes) -> None:
    """Any bytes are read as an image, or refused with the one error there is."""
    for kind in (COMPRESSED_IMAGE, IMAGE):
        try:
            read = read_image(kind, data)
        except BrokenMessageError:
            continue
        assert read.pixel_format in PixelFormat


def test_a_whole_file_is_read_whole() -> None:
    """All messages, the attachment and the metadata, and that it was ended in order."""
    records, is_complete = _read(WHOLE)
    assert is_complete
    assert len(_messages(records)) == 2 * PAIRS + 1
    assert [record.name for record in records if isinstance(record, Attachment)] == ["rig.yaml"]
    assert [record.name for record in records if isinstance(record, Metadata)] == ["channels", "tandemscan"]
    assert not [record for record in records if isinstance(record, Damage)]


def test_a_file_that_was_cut_gives_every_whole_chunk() -> None:
    """At any byte: what lies before the cut is read, in order; the file does not count as ended."""
    whole = [(one.log_ns, bytes(one.data)) for one in _messages(_read(WHOLE)[0])]
    random_ = random.Random(1)
    fewest = 0
    for cut in sorted(random_.sample(range(9, len(WHOLE) - 200), 60)):
        records, _ = _read(WHOLE[:cut])
        found = [(one.log_ns, bytes(one.data)) for one in _messages(records)]
        assert found == whole[: len(found)]
        assert len(found) >= fewest, "a later cut leaves no less"
        fewest = len(found)
    assert fewest >= len(whole) - CHUNK_MESSAGES - 1


def test_a_flipped_bit_costs_at_most_one_chunk() -> None:
    """Wherever it is: no exception, no message that is not of the file, and only its own chunk is missing."""
    whole = {(one.log_ns, bytes(one.data)) for one in _messages(_read(WHOLE)[0])}
    random_ = random.Random(2)
    for at in random_.sample(range(len(WHOLE)), 80):
        spoiled = bytearray(WHOLE)
        spoiled[at] ^= 1 << random_.randrange(8)
        found = _messages(_read(bytes(spoiled))[0])
        assert {(one.log_ns, bytes(one.data)) for one in found} <= whole
        assert len(found) >= len(whole) - CHUNK_MESSAGES, at
        assert all(one.channel is not None for one in found)


def test_a_missing_summary_is_not_missed() -> None:
    """All that counts stands before it."""
    records, is_complete = _read(WHOLE[:-300])
    assert is_complete
    assert len(_messages(records)) == 2 * PAIRS + 1


@pytest.mark.parametrize("data", [b"", b"\x89PNG\r\n\x1a\n", b"words"])
def test_other_files_are_no_mcap(data: bytes) -> None:
    """They are told apart by their first bytes."""
    assert is_mcap(memoryview(WHOLE))
    assert not is_mcap(memoryview(data))


def _record(opcode: int, content: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(content)) + content


@pytest.mark.parametrize(
    "spoiled",
    [
        _record(0x00, b"x"),
        _record(0x06, b"short"),
        _record(0x06, struct.pack("<QQQII", 0, 1, 9, 0, 4) + b"zstd" + struct.pack("<Q", 3) + b"abc"),
        _record(0x06, struct.pack("<QQQII", 0, 1, 9, 0, 0) + struct.pack("<Q", 7) + b"abc"),
        _record(0x06, struct.pack("<QQQII", 0, 1, 9, 1, 0) + struct.pack("<Q", 9) + bytes(9)),
        _record(0x06, struct.pack("<QQQII", 0, 1, 9, 0, 0) + struct.pack("<Q", 9) + struct.pack("<BQ", 5, 4)),
        _record(0x09, bytes(16) + struct.pack("<I", 1) + b"a" + struct.pack("<IQ", 0, 9) + bytes(4)),
        _record(0x09, bytes(16) + struct.pack("<I", 1) + b"a" + struct.pack("<IQ", 0, 1) + b"x" + struct.pack("<I", 7)),
        _record(0x0C, struct.pack("<I", 1) + b"a" + struct.pack("<I", 9)),
        _record(0x0C, struct.pack("<I", 2) + b"\xff\xff" + struct.pack("<I", 0)),
        _record(0x0C, struct.pack("<I", 99) + b"a"),
    ],
)
def test_a_spoiled_record_is_passed_over(spoiled: bytes) -> None:
    """Whatever is wrong with one record before the others: it is told, and the rest is read."""
    at = WHOLE.index(b"\x0c")
    records, is_complete = _read(WHOLE[:at] + spoiled + WHOLE[at:])
    assert is_complete
    assert len(_messages(records)) == 2 * PAIRS + 1
    assert [record for record in records if isinstance(record, Damage)]


def test_damage_before_the_very_end_costs_nothing_else() -> None:
    """After it, the record that ends the data is found by its form: all messages are there, and the file counts as ended."""
    at = WHOLE.rindex(struct.pack("<BQ", 0x0F, 4))
    records, is_complete = _read(WHOLE[:at] + _record(0x00, b"x") + WHOLE[at:])
    assert is_complete
    assert len(_messages(records)) == 2 * PAIRS + 1
    assert len([record for record in records if isinstance(record, Damage)]) == 1


def test_a_channel_without_a_number_is_no_channel() -> None:
    """Told channels are numbered: one with a name instead is passed over, and every message keeps its topic."""
    told = b"".join(struct.pack("<I", len(text)) + text for text in (b"left", b"/left x json"))
    extra = _record(0x0C, struct.pack("<I", 8) + b"channels" + struct.pack("<I", len(told)) + told)
    at = WHOLE.index(b"\x0c")
    records, _ = _read(WHOLE[:at] + extra + WHOLE[at:])
    assert [one.channel for one in _messages(records)] == [one.channel for one in _messages(_read(WHOLE)[0])]
    assert not [record for record in records if isinstance(record, Damage)]


def test_messages_of_an_unknown_channel_are_counted() -> None:
    """Two of a channel that nothing tells of: one damage says how many, and the images are those without them."""
    extra = 2 * _record(0x05, struct.pack("<HIQQ", 77, 0, 1, 1) + b"?")
    at = WHOLE.index(b"\x0c")
    found = read_recorded(memoryview(WHOLE[:at] + extra + WHOLE[at:]), inflate)
    assert [damage.words for damage in found.damages] == ["2 messages are of an unknown topic or spoiled"]
    assert {topic: len(shown) for topic, shown in found.images.items()} == {
        f"/{side}/image/compressed": PAIRS for side in ("left", "right")
    }
