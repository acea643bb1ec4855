"""Messages to bytes and back, and anything that strangers may send."""

import random
import tracemalloc
from typing import Any

import msgpack
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.errors import ProtocolError
from common.frame import PixelFormat
from common.ledger import BoardMarks
from common.protocol.message import (
    BoardCounts,
    BoardHello,
    Bye,
    CameraDescription,
    Credit,
    DropReason,
    FrameMessage,
    HostHello,
    Knock,
    Lane,
    Message,
    Pacing,
    Ping,
    Pong,
    Refusal,
    RefusalReason,
    Rung,
    Steer,
)
from common.protocol.wire import (
    MAX_HEADER_BYTES,
    MAX_PAYLOAD_BYTES,
    VersionError,
    decode,
    encode,
    encode_for_any_version,
)
from common.versions import PROTOCOL_VERSION
from tests.support.messages import MESSAGES, mutated

MUTATIONS = 80
"""For each of 150 messages: 12000 mutated headers in all."""


def is_refused_or_read(header: bytes, payload: bytes = b"") -> None:
    """The only results of decode are a ProtocolError, or a message that can be encoded again."""
    try:
        message = decode(header, payload)
    except ProtocolError:
        return
    assert decode(*encode(message)) == message


@given(MESSAGES)
@settings(deadline=None, max_examples=300)
def test_round_trip(message: Message) -> None:
    """The message that is read is the one that was written, with the payload in its own buffer."""
    header, payload = encode(message)
    assert decode(header, payload) == message
    assert decode(memoryview(bytearray(header)), memoryview(payload)) == message
    assert len(header) <= MAX_HEADER_BYTES
    if isinstance(message, FrameMessage):
        assert payload is message.payload


@pytest.mark.many
@given(MESSAGES, st.integers(0, 2**32))
@settings(deadline=None, max_examples=150)
def test_mutated_headers_raise_nothing_but_protocol_errors(message: Message, seed: int) -> None:
    """However a valid header is changed, the codec refuses it or reads a valid message."""
    header, payload = encode(message)
    chance = random.Random(seed)
    for _ in range(MUTATIONS):
        is_refused_or_read(mutated(header, chance), bytes(payload))


@given(MESSAGES)
@settings(deadline=None, max_examples=60)
def test_every_truncation_is_refused(message: Message) -> None:
    """A header that is truncated anywhere is no message."""
    header, payload = encode(message)
    for length in range(len(header)):
        with pytest.raises(ProtocolError):
            decode(header[:length], payload)


@given(st.binary(max_size=MAX_HEADER_BYTES + 10))
@settings(deadline=None, max_examples=300)
def test_random_bytes_raise_nothing_but_protocol_errors(header: bytes) -> None:
    """A stranger's bytes are refused, without side effects."""
    is_refused_or_read(header)


@pytest.mark.many
@given(
    st.recursive(
        st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats() | st.text(max_size=9) | st.binary(),
        lambda items: st.lists(items, max_size=5) | st.dictionaries(st.text(max_size=3), items, max_size=3),
        max_leaves=20,
    ),
    st.integers(-1, 12),
)
@settings(deadline=None, max_examples=300)
def test_well_formed_msgpack_of_the_wrong_shape_is_refused(value: Any, kind: int) -> None:
    """Valid msgpack that is not one of our arrays is refused, whatever its types and nesting."""
    is_refused_or_read(msgpack.packb(value))
    fields = value if isinstance(value, list) else [value]
    is_refused_or_read(msgpack.packb([PROTOCOL_VERSION, kind, *fields]))


@pytest.mark.parametrize(
    "claim",
    [
        pytest.param(b"\xdd\xff\xff\xff\xff", id="array of 4 G items"),
        pytest.param(b"\xdf\xff\xff\xff\xff", id="map of 4 G items"),
        pytest.param(b"\xdb\xff\xff\xff\xff", id="text of 4 GB"),
        pytest.param(b"\xc6\xff\xff\xff\xff", id="bytes of 4 GB"),
        pytest.param(b"\xc9\xff\xff\xff\xff\x01", id="extension of 4 GB"),
        pytest.param(b"\x91" * MAX_HEADER_BYTES, id="arrays within arrays"),
        pytest.param(b"\x93\x01\x06" + b"\xdc\x00\x40" * 600, id="wide arrays within arrays"),
        pytest.param(b"\xd6\xff\x00\x00\x00\x00", id="a timestamp"),
    ],
)
def test_a_claim_of_great_size_costs_no_memory(claim: bytes) -> None:
    """A header that announces huge or deeply nested contents is refused without allocating memory for them."""
    tracemalloc.start()
    try:
        for header in (claim, b"\x93\x01\x06" + claim):
            with pytest.raises(ProtocolError):
                decode(header[:MAX_HEADER_BYTES])
        assert tracemalloc.get_traced_memory()[1] < 2**20
    finally:
        tracemalloc.stop()


def test_long_header_is_refused() -> None:
    """A header beyond the limit is refused by its length alone."""
    with pytest.raises(ProtocolError, match="2049 bytes"):
        decode(bytes(MAX_HEADER_BYTES + 1))


@given(MESSAGES.filter(lambda message: not isinstance(message, FrameMessage)), st.binary(min_size=1, max_size=9))
@settings(deadline=None, max_examples=50)
def test_only_frames_carry_a_payload(message: Message, payload: bytes) -> None:
    """Image bytes after any other message make it invalid."""
    with pytest.raises(ProtocolError, match="payload"):
        decode(encode(message)[0], payload)


FRAME_FIELDS: list[Any] = ["s", 0, 0, 640, 480, 0, None, 1, 2, 3]
"""A frame's header after version and kind: session, sent index, sequence, width, height, format, exposure, three marks."""


@pytest.mark.parametrize(
    ("field", "value"),
    [
        (0, "x" * 97),
        (0, b"s"),
        (0, None),
        (1, -1),
        (1, 2**53 + 1),
        (1, True),
        (1, 0.0),
        (2, -1),
        (2, None),
        (3, 0),
        (3, 16385),
        (4, 0),
        (4, "480"),
        (5, len(PixelFormat)),
        (5, -1),
        (6, -1),
        (6, 2**62 + 1),
        (7, 2**62 + 1),
        (8, -(2**62) - 1),
        (9, None),
    ],
)
def test_fields_out_of_range_are_refused(field: int, value: Any) -> None:
    """Each field of a frame is checked for its type and range."""
    sound = [PROTOCOL_VERSION, 5, *FRAME_FIELDS]
    assert isinstance(decode(msgpack.packb(sound)), FrameMessage)
    with pytest.raises(ProtocolError):
        decode(msgpack.packb([*sound[: field + 2], value, *sound[field + 3 :]]))


@pytest.mark.parametrize("fields", [FRAME_FIELDS[:-1], [*FRAME_FIELDS, 0]])
def test_number_of_fields_is_exact(fields: list[Any]) -> None:
    """One field too few or too many makes a header invalid."""
    with pytest.raises(ProtocolError):
        decode(msgpack.packb([PROTOCOL_VERSION, 5, *fields]))


@pytest.mark.parametrize(
    ("message", "more", "said"),
    [
        (Credit(7), [0], "1 fields too many"),
        (Steer(7), [0, 0], "2 fields too many"),
        (Bye(BoardCounts(grabbed=9, sent=8)), [0], "1 fields too many"),
    ],
)
def test_what_follows_the_last_field_is_refused_and_counted(message: Message, more: list[int], said: str) -> None:
    """A sound header with something behind it is no message of this version."""
    header = msgpack.unpackb(encode(message)[0])
    assert decode(msgpack.packb(header)) == message
    with pytest.raises(ProtocolError, match=said):
        decode(msgpack.packb([*header, *more]))


def test_drops_are_pairs_of_a_reason_and_a_count() -> None:
    """A reason without its count is refused, and the field is named: the third of a goodbye, the fifth of its header."""
    reason = next(iter(DropReason))
    sound = Bye(BoardCounts(grabbed=9, sent=8, dropped=((reason, 1),)))
    *before, drops = msgpack.unpackb(encode(sound)[0])
    assert decode(msgpack.packb([*before, drops])) == sound
    with pytest.raises(ProtocolError, match="field 5 is no list of drops"):
        decode(msgpack.packb([*before, drops[:1]]))


def test_payload_has_a_limit() -> None:
    """A frame of exactly the maximum size is read; one byte more is refused."""
    whole = memoryview(bytes(MAX_PAYLOAD_BYTES + 1))
    header = encode(
        FrameMessage(
            session="s",
            sent_index=0,
            sequence=0,
            width_px=1,
            height_px=1,
            pixel_format=PixelFormat.MJPEG,
            exposure_ns=None,
            marks=BoardMarks(exposed_ns=0, grabbed_ns=0, sent_ns=0),
            payload=b"",
        )
    )[0]
    message = decode(header, whole[:-1])
    assert isinstance(message, FrameMessage)
    assert len(message.payload) == MAX_PAYLOAD_BYTES
    with pytest.raises(ProtocolError, match="payload"):
        decode(header, whole)


@given(MESSAGES, st.integers(0, 2**53).filter(lambda version: version != PROTOCOL_VERSION))
@settings(deadline=None, max_examples=60)
def test_another_version_is_told_apart_from_garbage(message: Message, version: int) -> None:
    """A header of another version raises VersionError with its number, whatever the rest means there."""
    items = msgpack.unpackb(encode(message)[0])
    with pytest.raises(VersionError) as caught:
        decode(msgpack.packb([version, *items[1:]]), b"anything")
    assert caught.value.theirs == version


@pytest.mark.parametrize("reason", RefusalReason)
def test_a_refusal_can_be_said_in_any_version(reason: RefusalReason) -> None:
    """A refusal keeps its kind and field in the envelope of the peer's version, and reads the same there as here."""
    for version in (0, PROTOCOL_VERSION + 1, 2**31):
        foreign = msgpack.unpackb(encode_for_any_version(version, Refusal(reason)))
        assert foreign[0] == version
        assert foreign[1:] == msgpack.unpackb(encode(Refusal(reason))[0])[1:]
    assert decode(encode_for_any_version(PROTOCOL_VERSION, Refusal(reason))) == Refusal(reason)


def test_kinds_keep_their_numbers() -> None:
    """The bytes of version 3 are fixed: a hello is kind 0 with id and lane, a knock kind 2 with lane and session, a refusal kind 3."""
    assert msgpack.unpackb(encode(HostHello("h", Lane.CONTROL))[0]) == [3, 0, "h", 1]
    assert msgpack.unpackb(encode(Knock(Lane.FRAMES, "s"))[0]) == [3, 2, 0, "s"]
    assert msgpack.unpackb(encode(Refusal(RefusalReason.VERSION))[0]) == [3, 3, 1]


@pytest.mark.parametrize("name", ["caf\udce9", "x" * 300, "\U0001f4f7" * 300, "\udcff" * 97])
def test_any_folder_name_makes_a_hello(name: str) -> None:
    """A camera name that is too long, or a path that is not UTF-8, is shortened or repaired, never refused."""
    camera = CameraDescription(
        name=name, width_px=640, height_px=480, pixel_format=PixelFormat.MJPEG, period_ns=1, pacing=Pacing.CLOCK
    )
    message = decode(
        encode(BoardHello(session="s", boot_id="b", camera=camera, counts=BoardCounts(), rung=Rung(period_ns=1)))[0]
    )
    assert isinstance(message, BoardHello)
    assert message.camera.name[:3] == name[:3].replace("\udcff", "?")


def test_an_echo_is_as_long_as_its_answer() -> None:
    """On a slow line unequal lengths would look like a difference of the clocks."""
    uptime_ns = 3600 * 10**9
    ping, pong = encode(Ping(7, uptime_ns)), encode(Pong(wave=7, t0_ns=uptime_ns, t1_ns=uptime_ns, t2_ns=uptime_ns))
    assert len(ping[0]) == len(pong[0])
    assert decode(*ping) == Ping(7, uptime_ns)
