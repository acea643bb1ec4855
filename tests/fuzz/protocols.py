"""Fuzz targets: input from links. Each takes any bytes and raises only if something is wrong."""

import random
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

import msgpack

from common.camera_identity import CameraIdentity, Lock
from common.errors import ProtocolError
from common.frame import PixelFormat
from common.ledger import BoardMarks
from common.link.sdp import channel_in
from common.orientation import Flip, Orientation
from common.protocol.board_session import BoardSession
from common.protocol.chunking import Whole
from common.protocol.duplex import GAP_NS, Duplex
from common.protocol.enrolment_code import Asking, Desk, Enrolled, Say
from common.protocol.enrolment_wire import MAX_WORD_BYTES, WordReader, decode_word, encode_word
from common.protocol.enrolment_words import (
    COMMITMENT_BYTES,
    NONCE_BYTES,
    Ask,
    Begin,
    Commit,
    Denial,
    Identity,
    Open,
    Refuse,
    Shown,
    Word,
)
from common.protocol.framing import MAX_BODY_BYTES, Deframer, LinkEnd, Unit, UnitKind, unit_parts
from common.protocol.host_session import HostSession
from common.protocol.message import (
    BoardCounts,
    BoardHello,
    CameraDescription,
    Credit,
    DropReason,
    End,
    FrameMessage,
    HostHello,
    Knock,
    Lane,
    LockState,
    Message,
    Pacing,
    Ping,
    Pong,
    Rung,
    SetLocks,
    Status,
)
from common.protocol.session import Arrived, Echo, Outgoing
from common.protocol.wire import MAX_HEADER_BYTES, MAX_PAYLOAD_BYTES, decode, encode
from common.protocol.zap import KEY_BYTES, deny, read_request
from phone_host.sync.clock import ClockEstimator

_CAMERA = CameraDescription(
    name="webcam",
    width_px=640,
    height_px=480,
    pixel_format=PixelFormat.MJPEG,
    period_ns=33_333_333,
    pacing=Pacing.CLOCK,
)
_KNOWN = replace(
    _CAMERA,
    orientation=Orientation(90, Flip.V),
    identity=CameraIdentity("uvcvideo", "HD Pro Webcam C920", "A1B2"),
    controls=((Lock.FOCUS, 20), (Lock.EXPOSURE, 10_000)),
)
_RUNG = Rung(index=2, last=5, changes=3, period_ns=66_666_666, quality=50, width_px=320, height_px=240)
_COUNTS = BoardCounts(9, 5, ((DropReason.REPLACED, 3), (DropReason.NO_HOST, 1)))
_MARKS = BoardMarks(exposed_ns=10**12, grabbed_ns=10**12 + 5 * 10**6, sent_ns=10**12 + 6 * 10**6)
SOUND_MESSAGES: tuple[Message, ...] = (
    HostHello("0123456789abcdef", Lane.FRAMES),
    BoardHello(session="s", boot_id="boot", camera=_CAMERA, counts=_COUNTS, rung=_RUNG),
    Knock(Lane.CONTROL, "s"),
    Credit(7),
    FrameMessage(
        session="s",
        sent_index=5,
        sequence=7,
        width_px=640,
        height_px=480,
        pixel_format=PixelFormat.MJPEG,
        exposure_ns=10**7,
        marks=_MARKS,
        payload=b"",
    ),
    Ping(1, 0),
    Pong(wave=1, t0_ns=10**12, t1_ns=10**12, t2_ns=10**12),
    Status("s", _COUNTS, _RUNG),
    End("s", _COUNTS),
    HostHello("0123456789abcdef", Lane.CONTROL, reads_long=True),
    BoardHello(session="s", boot_id="boot", camera=_KNOWN, counts=_COUNTS, rung=_RUNG, is_long=True),
    SetLocks(_KNOWN.controls),
    LockState(session="s", asked=_KNOWN.controls, held=((Lock.FOCUS, 25),)),
)


def _wire(side: LinkEnd, unit: Unit) -> bytes:
    return b"".join(unit_parts(side, unit))


_GOOD = Unit(kind=UnitKind.CONTROL, first=True, last=True, number=77, body=b"the next good packet")


def deframer(data: bytes) -> None:
    """Bytes of a line split in two ways give the same units, each found in the bytes; the good unit after them is found."""
    stream = data + _wire(LinkEnd.LISTENER, _GOOD)
    whole, chopped = Deframer(LinkEnd.LISTENER), Deframer(LinkEnd.LISTENER)
    units = [_wire(LinkEnd.LISTENER, unit) for unit in whole.feed(stream)]
    pieces: list[bytes] = []
    at = 0
    while at < len(stream):
        step = 1 + 37 * stream[at]
        pieces += [_wire(LinkEnd.LISTENER, unit) for unit in chopped.feed(stream[at : at + step])]
        assert len(chopped.rest) <= 4096, "more than one unit's bytes are kept"
        at += step
    assert units == pieces, "chopping changes the units"
    units += [_wire(LinkEnd.LISTENER, unit) for unit in whole.give_up()]
    assert units, "the good unit is passed over"
    assert units[-1] == _wire(LinkEnd.LISTENER, _GOOD), "the good unit is not the last one"
    at = 0
    for unit in units:
        at = stream.find(unit, at)
        assert at >= 0, "a unit was never written"
        at += len(unit)
    assert whole.garbage_bytes == len(stream) - sum(map(len, units)), "bytes are unaccounted for"


def deframer_seeds() -> list[bytes]:
    chance = random.Random(1)
    sizes = (0, 1, 20, 300, MAX_BODY_BYTES)
    sound = [
        _wire(LinkEnd.LISTENER, Unit(kind=UnitKind.FRAMES, first=True, last=False, number=n, body=chance.randbytes(n)))
        for n in sizes
    ]
    return [*sound, b"".join(sound), sound[2][:-3] + sound[3], chance.randbytes(60_000), b"\xc6" * 3000, b"login: "]


def wire(data: bytes) -> None:
    """Headers from a stranger, each after its length: rejected, or read as something that can be written and read again."""
    for header in _parts(data):
        try:
            message = decode(header[:MAX_HEADER_BYTES], b"")
        except ProtocolError:
            continue
        assert decode(*encode(message)) == message, "what was read is not what is written"


def _parts(data: bytes) -> Iterator[bytes]:
    """Cut an input into parts, each preceded by its length in one byte; large lengths are in units of eight."""
    at = 0
    while at < len(data):
        length = 1 + data[at] if data[at] < 128 else 8 * (data[at] - 111)
        yield data[at + 1 : at + 1 + length]
        at += 1 + length


def _as_parts(items: list[bytes]) -> bytes:
    return b"".join(bytes((len(item) - 1 if len(item) <= 128 else 111 + -(-len(item) // 8),)) + item for item in items)


def wire_seeds() -> list[bytes]:
    headers = [encode(message)[0] for message in SOUND_MESSAGES]
    deep = [
        b"\x93\x01\x06" + b"\x91" * 100,
        b"\xdd\xff\xff\xff\xff",
        b"\x93\x02\x00" + msgpack.packb([1.5, None, {"a": b"b"}]),
    ]
    return [*(_as_parts([header]) for header in headers), _as_parts(headers), _as_parts(deep)]


def line(data: bytes) -> None:
    """Units with valid checksums and hostile content: no error, no packet beyond the limits, no more bytes held than came."""
    for side in LinkEnd:
        end = Duplex(side, 17)
        now_ns, at, numbers = 1, 0, [0, 0, 0, 0]
        while at + 4 <= len(data):
            flags, low, high, extra = data[at : at + 4]
            kind = UnitKind(flags & 3)
            length = (low | high << 8) % (MAX_BODY_BYTES + 1) if flags & 16 else low % 32
            number = extra * 257 if flags & 32 else numbers[kind.value]
            unit = Unit(
                kind=kind,
                first=bool(flags & 4),
                last=bool(flags & 8),
                number=number,
                body=data[at + 4 : at + 4 + length],
            )
            numbers[kind.value] = (number + 1) % 65536
            at += 4 + len(unit.body)
            for event in end.feed(_wire(side.peer, unit), now_ns):
                if isinstance(event, Whole):
                    assert len(event.header) <= MAX_HEADER_BYTES, "a header beyond the limit"
                    assert len(event.payload) <= MAX_PAYLOAD_BYTES, "a payload beyond the limit"
            assert sum(len(item.data) for item in end.joiner.under_way.values()) <= len(data), "more is held than came"
            if flags & 64:
                end.put(Lane(flags >> 7), b"answer", bytes(extra * 64 * (flags >> 7 ^ 1)))
            end.take(now_ns)
            now_ns += extra * 10**6
            end.silence(now_ns + GAP_NS)


def line_seeds() -> list[bytes]:
    met = bytes((3 | 12, 5, 0, 1)) + b"\0\x11\0\0\0" + bytes((3 | 12, 5, 0, 1)) + b"\1\x11\0\0\0"
    header = encode(SOUND_MESSAGES[4])[0]
    packet = len(header).to_bytes(2, "little") + (100).to_bytes(4, "little") + header + bytes(100)
    cut = [packet[:90], packet[90:]]
    chunks = bytes((0 | 4 | 16 | 64, 90, 0, 3)) + cut[0] + bytes((0 | 8 | 16, len(cut[1]), 0, 3)) + cut[1]
    return [met, met + chunks, met + chunks + bytes((2 | 12 | 32, 0, 0, 0))]


def session(data: bytes) -> None:
    """Valid messages from a hostile peer in any order: both roles and the clock go on, and their answers can be written."""
    lanes = {Lane.FRAMES: b"\0f", Lane.CONTROL: b"\0c"}
    host, board, clock = HostSession("host", [lanes]), BoardSession("s", "boot", _CAMERA), ClockEstimator()
    now_ns = 10**12
    for number, part in enumerate(_parts(data)):
        lane = b"\0f" if part[:1] == b"f" else b"\0c"
        try:
            message = decode(part[1 : 1 + MAX_HEADER_BYTES], b"")
        except ProtocolError:
            continue
        now_ns += 10**6 * (1 + number * 50)
        outputs = [*host.receive(lane, message, now_ns), *host.tick(now_ns), *host.grant(3)]
        answers = [*board.receive(lane, message, now_ns, _COUNTS), *board.tick(now_ns, _COUNTS)]
        for output in [*outputs, *answers]:
            match output:
                case Outgoing(_, answer):
                    encode(answer)
                case Echo():
                    clock.add(output)
                case Arrived(frame, lost):
                    assert lost >= 0, "fewer than no frame lost"
                    if clock.estimate is not None:
                        told = clock.estimate.to_host(frame.marks.sent_ns)
                        assert 0 <= told.uncertainty_ns <= told.bound_ns, "the uncertainty is beyond the bound"
                case _:
                    pass
        assert host.outstanding >= 0, "credit below nothing"


def session_seeds() -> list[bytes]:
    hello = encode(SOUND_MESSAGES[1])[0]
    pongs = [
        b"c" + encode(Pong(wave=wave, t0_ns=10**12, t1_ns=5 * 10**9, t2_ns=5 * 10**9 + 1000))[0] for wave in range(1, 5)
    ]
    said = [
        b"f" + hello,
        b"c" + hello,
        *pongs,
        b"f" + hello,
        b"f" + encode(SOUND_MESSAGES[4])[0],
        b"c" + encode(SOUND_MESSAGES[7])[0],
    ]
    asked = [b"f" + encode(HostHello("h", Lane.FRAMES))[0], b"c" + encode(HostHello("h", Lane.CONTROL))[0]]
    return [_as_parts(said), _as_parts([*asked, b"c" + encode(Credit(3))[0], b"c" + encode(Ping(1, 0))[0]])]


def pairing(data: bytes) -> None:
    """Pairing messages from anybody, in any order: a ProtocolError or an answer; nobody is let in without the code."""
    door = Desk(Identity(b"b" * KEY_BYTES, "board"), bytes)
    asking = Asking(Identity(b"h" * KEY_BYTES, "host"), lambda count: b"\1" * count)
    now_ns = 10**12
    reader = WordReader()
    with suppress(ProtocolError):
        for part in _parts(data):
            reader.feed(part)
            assert reader.unread_bytes <= MAX_WORD_BYTES, "more than one unfinished word is kept"
    for part in _parts(data):
        try:
            word = decode_word(part[1:])
        except ProtocolError:
            continue
        assert decode_word(encode_word(word)) == word, "what was read is not what is written"
        now_ns += 10**9
        for output in door.receive(part[:1], word, now_ns):
            assert not isinstance(output, Enrolled), "let in without the code"
            if isinstance(output, Say):
                encode_word(output.word)
        with suppress(ProtocolError):
            asking.receive(word)
        assert not asking.proved, "a board is believed without the code"


def pairing_seeds() -> list[bytes]:
    """Valid pairing messages."""
    words: list[Word] = [
        Ask(Identity(b"k" * KEY_BYTES, "phone")),
        Shown(Identity(b"k" * KEY_BYTES, "board")),
        Commit(1, b"c" * COMMITMENT_BYTES),
        Open(1, b"n" * NONCE_BYTES),
        Refuse(Denial.PAUSE, 30),
        Begin(Identity(b"k" * KEY_BYTES, "phone"), b"c" * COMMITMENT_BYTES),
    ]
    packed = [b"x" + encode_word(word) for word in words]
    return [_as_parts([word]) for word in packed] + [_as_parts(packed)]


def doors(data: bytes) -> None:
    """What ZeroMQ's authentication and Bluetooth's service directory may deliver: a request or ProtocolError, a channel or none."""
    try:
        request = read_request(list(_parts(data)))
        assert len(request.key) in {0, KEY_BYTES}, "half a key"
        deny(request)
    except ProtocolError:
        pass
    assert 0 <= channel_in(data) <= 30, "no channel"


def doors_seeds() -> list[bytes]:
    """A valid request of each kind, and a valid record."""
    request = [b"1.0", b"1", b"global", b"127.0.0.1", b"id", b"CURVE", b"k" * KEY_BYTES]
    record = b"\x35\x11\x35\x0f\x09\x00\x04\x35\x0a\x35\x03\x19\x01\x00\x35\x03\x19\x00\x03\x08\x05"
    return [
        _as_parts(request),
        _as_parts([*request[:5], b"NULL"]),
        b"\x07\x00\x01\x00\x00" + len(record).to_bytes(2, "big") + record + b"\x00",
    ]
