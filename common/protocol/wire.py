"""Messages to bytes and back: a msgpack array [version, kind, fields…] as header, and for frames the image beside it.

Rules: every field is checked for type and range before it is believed; a header has at most MAX_HEADER_BYTES and no nesting beyond what a
message needs; anything else raises ProtocolError and nothing more. The first two elements keep their place in every future version, so
that two versions can at least tell each other so.
"""

from collections.abc import Callable
from enum import Enum
from typing import Any, Final, TypeVar, assert_never

import msgpack

from common.errors import ProtocolError
from common.frame import Buffer, PixelFormat
from common.ledger import BoardMarks
from common.protocol.message import (
    PROTOCOL_VERSION,
    BoardCounts,
    BoardHello,
    Bye,
    CameraDescription,
    Credit,
    DropReason,
    End,
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
    Status,
    Steer,
    Steering,
)

MAX_HEADER_BYTES: Final = 2048
"""The longest honest header, a board's hello with all its texts at full length, stays below 600 bytes."""

MAX_PAYLOAD_BYTES: Final = 16 * 1024 * 1024
"""Largest frame on any link (DESIGN's contract suite): 4096 x 2048 raw YUYV fits."""

MAX_SIZE_PX: Final = 16384
"""Largest width and height of a frame, px: well beyond any camera, and 28 bits for their product."""

_MAX_TEXT: Final = 96
_MAX_COUNT: Final = 2**53
_NS: Final = 2**62
"""146 years in ns: no honest clock is further from its zero; keeps sums inside 64 bits."""

_MAX_PERIOD_NS: Final = 3_600_000_000_000
"""A frame an hour: what counts as a pair follows from the period, so it is believed only as far as somebody would call it a stream."""

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
)
_KIND_OF: Final = {kind: index for index, kind in enumerate(_KINDS)}
_PIXEL_FORMATS: Final = tuple(PixelFormat)
_DROP_REASONS: Final = tuple(DropReason)

_FRAME_RANGES: Final = (
    (0, _MAX_COUNT),
    (0, _MAX_COUNT),
    (1, MAX_SIZE_PX),
    (1, MAX_SIZE_PX),
    (0, len(_PIXEL_FORMATS) - 1),
    (0, _NS),
    (-_NS, _NS),
    (-_NS, _NS),
    (-_NS, _NS),
)
"""Of a frame's numbers: index, sequence, width, height, encoding, exposure time (which may be missing), three times."""

_EXPOSURE_AT: Final = 5

_PACKER: Final = msgpack.Packer()
"""One for all: `packb` makes a new one each time with a buffer of 1 MiB, which a 32-bit libc maps and unmaps for each (1.7 ms of a board)."""

E = TypeVar("E", bound=Enum)


class VersionError(ProtocolError):
    """Raised for a header of another protocol version. Nobody's fault: one of the two needs an update.

    Args:
        theirs: the peer's version.
    """

    def __init__(self, theirs: int) -> None:
        super().__init__(
            f"the peer speaks protocol version {theirs}, this side {PROTOCOL_VERSION}", "update the older of the two"
        )
        self.theirs = theirs


def encode(message: Message) -> tuple[bytes, Buffer]:
    """Give a message's header and payload; the payload is the frame's own buffer, not a copy.

    Args:
        message: any message.

    Returns:
        Header bytes and payload (empty for all but frames).
    """
    header: bytes = _PACKER.pack([PROTOCOL_VERSION, _KIND_OF[type(message)], *_fields(message)])
    return header, message.payload if isinstance(message, FrameMessage) else b""


def encode_stamped(message: Message, clock: Callable[[], int]) -> tuple[bytes, Buffer]:
    """Like `encode`, but the send time of a frame, ping or pong is read when all else is encoded: just before the first byte is written.

    Args:
        message: any message; its own send time, if it has one, is not looked at.
        clock: gives the sender's clock, ns.

    Returns:
        Header bytes and payload.
    """
    if not isinstance(message, FrameMessage | Ping | Pong):
        return encode(message)
    fields = _fields(message)
    fields[-1] = _NS  # the send time comes last in all three; this one takes the nine bytes of any 64 bit integer
    header: bytes = _PACKER.pack([PROTOCOL_VERSION, _KIND_OF[type(message)], *fields])
    payload = message.payload if isinstance(message, FrameMessage) else b""
    return header[:-8] + clock().to_bytes(8, "big"), payload


def decode(header: Buffer, payload: Buffer = b"") -> Message:
    """Read one message.

    Args:
        header: the header's bytes, from anybody.
        payload: the bytes that came with it; kept, not copied.

    Returns:
        The message.

    Raises:
        VersionError: the peer speaks another version.
        ProtocolError: these bytes are no message.
    """
    if len(header) > MAX_HEADER_BYTES:
        raise _bad(f"header of {len(header)} bytes")
    try:
        items = msgpack.unpackb(
            header,
            strict_map_key=True,
            max_array_len=64,
            max_map_len=0,
            max_ext_len=0,
            max_bin_len=0,
            max_str_len=4 * _MAX_TEXT,
        )
    except (ValueError, RecursionError, msgpack.exceptions.UnpackException) as error:
        raise _bad(f"header is not msgpack ({error})") from None
    if not isinstance(items, list) or len(items) < 2:
        raise _bad("header is not [version, kind, …]")
    version, kind = items[0], items[1]
    if type(version) is not int or not 0 <= version <= _MAX_COUNT:
        raise _bad("header without a version")
    if version != PROTOCOL_VERSION:
        raise VersionError(version)
    if type(kind) is not int or not 0 <= kind < len(_KINDS):
        raise _bad(f"unknown kind {kind!r:.40}")
    if kind == _KIND_OF[FrameMessage]:
        return _read_frame(items, payload)
    if len(payload):
        raise _bad(f"{_KINDS[kind].__name__} with a payload")
    reader = _Reader(items, 2)
    message = _read(_KINDS[kind], reader)
    reader.finish()
    return message


def encode_for_any_version(version: int, refusal: Refusal) -> bytes:
    """Give a refusal's header in the envelope of another version, so that an older or newer peer can read why.

    Args:
        version: the peer's version.
        refusal: what to say.
    """
    header: bytes = _PACKER.pack([version, _KINDS.index(Refusal), *_fields(refusal)])
    return header


def _bad(problem: str) -> ProtocolError:
    return ProtocolError(problem, "the packet is dropped; check what else talks to this address")


def _fields(message: Message) -> list[Any]:  # noqa: C901, PLR0911, PLR0912 - one line for each kind of message
    match message:
        case HostHello(host_id, lane):
            return [host_id, lane.value]
        case BoardHello(session=session, boot_id=boot_id, camera=camera, counts=counts, rung=rung):
            return [session, boot_id, *_camera_fields(camera), *_counts_fields(counts), *_rung_fields(rung)]
        case Knock(lane, session):
            return [lane.value, session]
        case Refusal(reason):
            return [reason.value]
        case Credit(below_index):
            return [below_index]
        case FrameMessage():
            marks = message.marks
            size = [message.width_px, message.height_px, _PIXEL_FORMATS.index(message.pixel_format)]
            times = [message.exposure_ns, marks.exposed_ns, marks.grabbed_ns, marks.sent_ns]
            return [message.session, message.sent_index, message.sequence, *size, *times]
        case Ping(wave, t0_ns):
            # As long as its answer: on a serial line 18 bytes more one way would make the clock wrong by 0.14 ms (640 kbit/s).
            return [wave, _NS, _NS, t0_ns]
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
        case _:
            assert_never(message)


def _camera_fields(camera: CameraDescription) -> list[Any]:
    encoding = _PIXEL_FORMATS.index(camera.pixel_format)
    name = camera.name.encode("utf-8", "replace").decode()[:_MAX_TEXT]  # a folder's name need not be UTF-8
    return [
        name,
        camera.width_px,
        camera.height_px,
        encoding,
        camera.period_ns,
        camera.pacing.value,
        camera.steering.value,
    ]


def _rung_fields(rung: Rung) -> list[Any]:
    size = [rung.width_px, rung.height_px]
    return [rung.index, rung.last, rung.changes, rung.period_ns, rung.quality, *size]


def _counts_fields(counts: BoardCounts) -> list[Any]:
    return [
        counts.grabbed,
        counts.sent,
        [n for reason, count in counts.dropped for n in (_DROP_REASONS.index(reason), count)],
    ]


def _read(kind: type, reader: "_Reader") -> Message:  # noqa: PLR0911 - one line for each kind of message
    if kind is Ping:
        wave, _, _, t0_ns = (
            reader.count(),
            reader.time_ns(),
            reader.time_ns(),
            reader.time_ns(),
        )  # filling in the middle
        return Ping(wave, t0_ns)
    if kind is Pong:
        return Pong(wave=reader.count(), t0_ns=reader.time_ns(), t1_ns=reader.time_ns(), t2_ns=reader.time_ns())
    if kind is Credit:
        return Credit(reader.count())
    if kind is HostHello:
        return HostHello(reader.text(), reader.enum(Lane))
    if kind is BoardHello:
        return BoardHello(
            session=reader.text(),
            boot_id=reader.text(),
            camera=reader.camera(),
            counts=reader.counts(),
            rung=reader.rung(),
        )
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
    return Bye(reader.counts())


def _read_frame(items: list[Any], payload: Buffer) -> FrameMessage:
    """Read the message that comes thirty times a second: the same checks as a reader's, in one loop.

    Args:
        items: the whole header, version and kind included.
        payload: the image.
    """
    if len(payload) > MAX_PAYLOAD_BYTES:
        raise _bad(f"payload of {len(payload)} bytes")
    if len(items) != 3 + len(_FRAME_RANGES):
        raise _bad(f"frame of {len(items)} fields")
    _, _, session, *numbers = items
    if type(session) is not str or len(session) > _MAX_TEXT:
        raise _bad("a frame's session is not a short text")
    for at, (low, high) in enumerate(_FRAME_RANGES):
        value = numbers[at]
        if (type(value) is not int or not low <= value <= high) and not (at == _EXPOSURE_AT and value is None):
            raise _bad(f"a frame's number {at} is no integer in {low}..{high}")
    sent_index, sequence, width_px, height_px, encoding, exposure_ns, exposed_ns, grabbed_ns, sent_ns = numbers
    marks = BoardMarks(exposed_ns=exposed_ns, grabbed_ns=grabbed_ns, sent_ns=sent_ns)
    pixel_format = _PIXEL_FORMATS[encoding]
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


class _Reader:
    """Takes checked fields off a header, front to back."""

    def __init__(self, items: list[Any], at: int = 0) -> None:
        self._items = items
        self._at = at

    def finish(self) -> None:
        """Check that nothing is left over."""
        if self._at != len(self._items):
            raise _bad(f"{len(self._items) - self._at} fields too many")

    def count(self) -> int:
        return self._integer(0, _MAX_COUNT)

    def time_ns(self) -> int:
        return self._integer(-_NS, _NS)

    def later_ns(self) -> int:
        return self._integer(0, _NS)

    def size_px(self) -> int:
        return self._integer(1, MAX_SIZE_PX)

    def text(self) -> str:
        value = self._next()
        if type(value) is not str or len(value) > _MAX_TEXT:
            raise _bad(f"field {self._at} is not a short text")
        return value

    def enum(self, kind: type[E]) -> E:
        try:
            return kind(self._integer(0, _MAX_COUNT))
        except ValueError:
            raise _bad(f"field {self._at} is no {kind.__name__}") from None

    def choice(self, options: tuple[E, ...]) -> E:
        return options[self._integer(0, len(options) - 1)]

    def camera(self) -> CameraDescription:
        name, width_px, height_px = self.text(), self.size_px(), self.size_px()
        return CameraDescription(
            name=name,
            width_px=width_px,
            height_px=height_px,
            pixel_format=self.choice(_PIXEL_FORMATS),
            period_ns=self._integer(1, _MAX_PERIOD_NS),
            pacing=self.enum(Pacing),
            steering=self.enum(Steering),
        )

    def counts(self) -> BoardCounts:
        grabbed, sent, flat = self.count(), self.count(), self._next()
        if not isinstance(flat, list) or len(flat) % 2:
            raise _bad(f"field {self._at} is no list of drops")
        inner = _Reader(flat)
        return BoardCounts(
            grabbed, sent, tuple((inner.choice(_DROP_REASONS), inner.count()) for _ in range(len(flat) // 2))
        )

    def rung(self) -> Rung:
        index, last, changes, period_ns = self.count(), self.count(), self.count(), self._integer(1, _MAX_PERIOD_NS)
        quality, width_px, height_px = self.count(), self._integer(0, MAX_SIZE_PX), self._integer(0, MAX_SIZE_PX)
        return Rung(
            index=index,
            last=last,
            changes=changes,
            period_ns=period_ns,
            quality=quality,
            width_px=width_px,
            height_px=height_px,
        )

    def _next(self) -> Any:  # noqa: ANN401 - whatever msgpack found; every caller checks it
        if self._at >= len(self._items):
            raise _bad("fields are missing")
        self._at += 1
        return self._items[self._at - 1]

    def _integer(self, low: int, high: int) -> int:
        at = self._at
        if at >= len(self._items):
            raise _bad("fields are missing")
        self._at = at + 1
        value = self._items[at]
        if type(value) is not int or not low <= value <= high:  # bool is an int to isinstance
            raise _bad(f"field {self._at} is no integer in {low}..{high}")
        return int(value)
