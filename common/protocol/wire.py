"""Encodes and decodes messages: a msgpack array [version, kind, fields…] as header and, for frames, the image beside it.

Rules: every field is checked for type and range before it is believed. A header has at most MAX_HEADER_BYTES and no more nesting than a
message needs. Anything else raises ProtocolError, and nothing but that. The first two elements keep their place in every future version,
so two versions can at least tell each other that they differ.
"""

from collections.abc import Callable
from typing import Any, Final, assert_never

import msgpack

from common.errors import ProtocolError
from common.frame import Buffer, Frame
from common.ledger import BoardMarks
from common.protocol.message import (
    BoardCounts,
    BoardHello,
    Bye,
    CameraDescription,
    Credit,
    End,
    FrameMessage,
    HostHello,
    Knock,
    Lane,
    Locks,
    LockState,
    Message,
    Ping,
    Pong,
    Refusal,
    RefusalReason,
    Rung,
    SetLocks,
    Status,
    Steer,
)
from common.protocol.wire_fields import (
    DROP_REASONS,
    FLIPS,
    LOCKS,
    MAX_COUNT,
    MAX_SIZE_PX,
    MAX_TEXT,
    MOST_NS,
    PIXEL_FORMATS,
    FieldReader,
    bad_field,
)
from common.versions import PROTOCOL_VERSION, other_protocol

MAX_HEADER_BYTES: Final = 2048
"""The longest honest header is a board's hello with all texts at full length. It stays below 1400 bytes."""

_READS_LONG: Final = "+long"
"""Ends the id of a host that reads long hellos. Boards of 0.2 and before take an id as it comes, but refuse a hello with a field too many."""

MAX_PAYLOAD_BYTES: Final = 16 * 1024 * 1024
"""Largest frame on any link (DESIGN's contract suite): 4096 x 2048 raw YUYV fits."""

_KINDS: Final[tuple[type, ...]] = (
    HostHello,
    BoardHello,
    Knock,
    Refusal,
    Credit,
    FrameMessage,
    Ping,
    Pong,
    Status,
    End,
    Bye,
    Steer,
    SetLocks,
    LockState,
)
_KIND_OF: Final = {kind: index for index, kind in enumerate(_KINDS)}
_FRAME: Final = _KIND_OF[FrameMessage]
_FRAME_RANGES: Final = (
    (0, MAX_COUNT),
    (0, MAX_COUNT),
    (1, MAX_SIZE_PX),
    (1, MAX_SIZE_PX),
    (0, len(PIXEL_FORMATS) - 1),
    (0, MOST_NS),
    (-MOST_NS, MOST_NS),
    (-MOST_NS, MOST_NS),
    (-MOST_NS, MOST_NS),
)
"""Ranges of a frame's numbers: index, sequence, width, height, encoding, exposure time (may be missing), three times."""

_EXPOSURE_AT: Final = 5

_PACKER: Final = msgpack.Packer()
"""Shared by all calls. `packb` makes a new one each time with a 1 MiB buffer, which a 32-bit libc maps and unmaps each time (1.7 ms on a board)."""


class VersionError(ProtocolError):
    """Raised for a header of another protocol version. Nobody's fault: one of the two sides needs an update.

    Args:
        theirs: the peer's version.
    """

    def __init__(self, theirs: int) -> None:
        super().__init__(*other_protocol(theirs, peer="the peer", own="this side"))
        self.theirs = theirs


def encode(message: Message) -> tuple[bytes, Buffer]:
    """Encode a message as header and payload. The payload is the frame's own buffer, not a copy.

    Returns:
        Header bytes and payload (empty for all but frames).
    """
    header: bytes = _PACKER.pack([PROTOCOL_VERSION, _KIND_OF[type(message)], *_fields(message)])
    return header, message.payload if isinstance(message, FrameMessage) else b""


def encode_stamped(message: Message, clock: Callable[[], int]) -> tuple[bytes, Buffer]:
    """Like `encode`, but read the send time of a frame, ping or pong last of all: just before the first byte is written.

    Args:
        message: any message; its own send time, if it has one, is ignored.
        clock: returns the sender's clock, ns.

    Returns:
        Header bytes and payload.
    """
    if not isinstance(message, FrameMessage | Ping | Pong):
        return encode(message)
    fields = _fields(message)
    fields[-1] = MOST_NS  # the send time comes last in all three; MOST_NS takes nine bytes, as any 64-bit integer does
    header: bytes = _PACKER.pack([PROTOCOL_VERSION, _KIND_OF[type(message)], *fields])
    payload = message.payload if isinstance(message, FrameMessage) else b""
    return header[:-8] + clock().to_bytes(8, "big"), payload


def encode_frame(session: str, sent_index: int, frame: Frame, clock: Callable[[], int]) -> bytes:
    """Encode the header of a `FrameMessage` straight from a frame, thirty times a second. The send time is read last of all.

    Args:
        session: of the board process.
        sent_index: the frame's number among those sent.
        frame: a sound frame; its payload travels beside the header.
        clock: returns the sender's clock, ns.

    Returns:
        Header bytes.
    """
    header: bytes = _PACKER.pack(
        (
            PROTOCOL_VERSION,
            _FRAME,
            session,
            sent_index,
            frame.sequence,
            frame.width_px,
            frame.height_px,
            PIXEL_FORMATS.index(frame.pixel_format),
            frame.exposure_ns,
            frame.exposed.ns,
            frame.grabbed.ns,
            MOST_NS,
        )
    )
    return header[:-8] + clock().to_bytes(8, "big")


def decode(header: Buffer, payload: Buffer = b"") -> Message:
    """Decode one message.

    Args:
        header: the header's bytes; they may come from anybody.
        payload: the bytes that came with it; kept, not copied.

    Raises:
        VersionError: the peer speaks another version.
        ProtocolError: these bytes are no message.
    """
    if len(header) > MAX_HEADER_BYTES:
        raise bad_field(f"header of {len(header)} bytes")
    try:
        items = msgpack.unpackb(
            header,
            strict_map_key=True,
            max_array_len=64,
            max_map_len=0,
            max_ext_len=0,
            max_bin_len=0,
            max_str_len=4 * MAX_TEXT,
        )
    except (ValueError, RecursionError, msgpack.exceptions.UnpackException) as error:
        raise bad_field(f"header is not msgpack ({error})") from None
    if not isinstance(items, list) or len(items) < 2:
        raise bad_field("header is not [version, kind, …]")
    version, kind = items[0], items[1]
    if type(version) is not int or not 0 <= version <= MAX_COUNT:
        raise bad_field("header without a version")
    if version != PROTOCOL_VERSION:
        raise VersionError(version)
    if type(kind) is not int or not 0 <= kind < len(_KINDS):
        raise bad_field(f"unknown kind {kind!r:.40}")
    if kind == _FRAME:
        return _read_frame(items, payload)
    if len(payload):
        raise bad_field(f"{_KINDS[kind].__name__} with a payload")
    reader = FieldReader(items, 2)
    message = _read(_KINDS[kind], reader)
    reader.finish()
    return message


def encode_for_any_version(version: int, refusal: Refusal) -> bytes:
    """Encode a refusal in the envelope of another version, so that an older or newer peer can read the reason."""
    header: bytes = _PACKER.pack([version, _KINDS.index(Refusal), *_fields(refusal)])
    return header


def _fields(message: Message) -> list[Any]:  # noqa: C901, PLR0911, PLR0912 - one line for each kind of message
    match message:
        case HostHello(host_id, lane, reads_long):
            return [host_id + _READS_LONG * reads_long, lane.value]
        case BoardHello(session=session, boot_id=boot_id, camera=camera, counts=counts, rung=rung):
            short = [session, boot_id, *_camera_fields(camera), *_counts_fields(counts), *_rung_fields(rung)]
            return [*short, _more_camera_fields(camera)] if message.is_long else short
        case Knock(lane, session):
            return [lane.value, session]
        case Refusal(reason):
            return [reason.value]
        case Credit(below_index):
            return [below_index]
        case FrameMessage():
            marks = message.marks
            size = [message.width_px, message.height_px, PIXEL_FORMATS.index(message.pixel_format)]
            times = [message.exposure_ns, marks.exposed_ns, marks.grabbed_ns, marks.sent_ns]
            return [message.session, message.sent_index, message.sequence, *size, *times]
        case Ping(wave, t0_ns):
            # As long as its answer. On a 640 kbit/s serial line, 18 more bytes in one direction would shift the clock by 0.14 ms.
            return [wave, MOST_NS, MOST_NS, t0_ns]
        case Pong(wave=wave, t0_ns=t0_ns, t1_ns=t1_ns, t2_ns=t2_ns):
            return [wave, t0_ns, t1_ns, t2_ns]
        case Status(session, counts, rung):
            return [session, *_counts_fields(counts), *_rung_fields(rung)]
        case End(session, counts):
            return [session, *_counts_fields(counts)]
        case Bye(counts):
            return _counts_fields(counts)
        case Steer(later_ns):
            return [later_ns]
        case SetLocks(locks):
            return [_lock_fields(locks)]
        case LockState(session=session, asked=asked, held=held):
            return [session, _lock_fields(asked), _lock_fields(held)]
        case _:
            assert_never(message)


def _camera_fields(camera: CameraDescription) -> list[Any]:
    encoding = PIXEL_FORMATS.index(camera.pixel_format)
    name = camera.name.encode("utf-8", "replace").decode()[:MAX_TEXT]  # a folder's name need not be UTF-8
    return [
        name,
        camera.width_px,
        camera.height_px,
        encoding,
        camera.period_ns,
        camera.pacing.value,
        camera.steering.value,
    ]


def _more_camera_fields(camera: CameraDescription) -> list[Any]:
    """The list that ends a long hello. A later version may add to its end; readers ignore what they do not know."""
    turn, identity = camera.orientation, camera.identity
    return [
        turn.rotate_deg // 90,
        FLIPS.index(turn.flip),
        *(identity.driver, identity.name, identity.serial),
        _lock_fields(camera.controls),
    ]


def _lock_fields(locks: Locks) -> list[int]:
    return [n for lock, value in locks for n in (LOCKS.index(lock), value)]


def _rung_fields(rung: Rung) -> list[Any]:
    size = [rung.width_px, rung.height_px]
    return [rung.index, rung.last, rung.changes, rung.period_ns, rung.quality, *size]


def _counts_fields(counts: BoardCounts) -> list[Any]:
    return [
        counts.grabbed,
        counts.sent,
        [n for reason, count in counts.dropped for n in (DROP_REASONS.index(reason), count)],
    ]


def _read(kind: type, reader: "FieldReader") -> Message:  # noqa: C901, PLR0911 - one line for each kind of message
    if kind is Ping:
        wave, _, _, t0_ns = (
            reader.count(),
            reader.time_ns(),
            reader.time_ns(),
            reader.time_ns(),
        )  # skip the padding in the middle
        return Ping(wave, t0_ns)
    if kind is Pong:
        return Pong(wave=reader.count(), t0_ns=reader.time_ns(), t1_ns=reader.time_ns(), t2_ns=reader.time_ns())
    if kind is Credit:
        return Credit(reader.count())
    if kind is HostHello:
        host_id, lane = reader.text(), reader.enum(Lane)
        return HostHello(host_id.removesuffix(_READS_LONG), lane, host_id.endswith(_READS_LONG))
    if kind is BoardHello:
        session, boot_id, camera = reader.text(), reader.text(), reader.camera()
        counts, rung = reader.counts(), reader.rung()
        is_long = reader.has_more
        camera = reader.more_of(camera) if is_long else camera
        return BoardHello(session=session, boot_id=boot_id, camera=camera, counts=counts, rung=rung, is_long=is_long)
    if kind is Knock:
        return Knock(reader.enum(Lane), reader.text())
    if kind is Refusal:
        return Refusal(reader.enum(RefusalReason))
    if kind is Status:
        return Status(reader.text(), reader.counts(), reader.rung())
    if kind is End:
        return End(reader.text(), reader.counts())
    if kind is Steer:
        return Steer(reader.later_ns())
    if kind is SetLocks:
        return SetLocks(reader.locks())
    if kind is LockState:
        return LockState(session=reader.text(), asked=reader.locks(), held=reader.locks())
    return Bye(reader.counts())


def _check_frame(items: list[Any]) -> None:
    """Say which of a frame's numbers is not of its type or in its range, if any is not."""
    for at, (low, high) in enumerate(_FRAME_RANGES):
        value = items[at + 3]
        if (type(value) is not int or not low <= value <= high) and not (at == _EXPOSURE_AT and value is None):
            raise bad_field(f"a frame's number {at} is no integer in {low}..{high}")


def _read_frame(items: list[Any], payload: Buffer) -> FrameMessage:
    """Decode the message that comes thirty times a second, with the checks of FieldReader in one expression."""
    if len(payload) > MAX_PAYLOAD_BYTES:
        raise bad_field(f"payload of {len(payload)} bytes")
    if len(items) != 3 + len(_FRAME_RANGES):
        raise bad_field(f"frame of {len(items)} fields")
    _, _, session, sent_index, sequence, width_px, height_px, encoding, exposure_ns, exposed_ns, grabbed_ns, sent_ns = (
        items
    )
    if type(session) is not str or len(session) > MAX_TEXT:
        raise bad_field("a frame's session is not a short text")
    if not (
        type(sent_index) is type(sequence) is type(width_px) is type(height_px) is type(encoding) is int
        and type(exposed_ns) is type(grabbed_ns) is type(sent_ns) is int
        and (exposure_ns is None or (type(exposure_ns) is int and 0 <= exposure_ns <= MOST_NS))
        and 0 <= sent_index <= MAX_COUNT
        and 0 <= sequence <= MAX_COUNT
        and 1 <= width_px <= MAX_SIZE_PX
        and 1 <= height_px <= MAX_SIZE_PX
        and 0 <= encoding < len(PIXEL_FORMATS)
        and -MOST_NS <= exposed_ns <= MOST_NS
        and -MOST_NS <= grabbed_ns <= MOST_NS
        and -MOST_NS <= sent_ns <= MOST_NS
    ):
        _check_frame(items)
    marks = BoardMarks(exposed_ns=exposed_ns, grabbed_ns=grabbed_ns, sent_ns=sent_ns)
    pixel_format = PIXEL_FORMATS[encoding]
    return FrameMessage(
        session=session,
        sent_index=sent_index,
        sequence=sequence,
        width_px=width_px,
        height_px=height_px,
        pixel_format=pixel_format,
        exposure_ns=exposure_ns,
        marks=marks,
        payload=payload,
    )
