"""What is fuzzed, and what must hold of each reader whatever it is fed: only the documented errors, nothing delivered altered, no growth.

A target takes any bytes and raises only where something is wrong. The same functions run in `make fuzz`, guided by coverage, and in the test suite
over the corpus, which holds every input that ever found something.
"""

import random
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import msgpack

from common.camera import v4l2_abi as abi
from common.camera.imagefile import read_image
from common.camera.v4l2_controls import Axis, Control, ControlPlan, ControlWishes
from common.camera.v4l2_stamps import RateMeter, Timing, exposure_midpoint_ns, is_trusted, stamp_clock, stamp_source
from common.errors import DataError, ProtocolError, SettingsError, TandemError
from common.frame import PixelFormat, find_fault
from common.ledger import BoardMarks
from common.link.factory import parse_link
from common.protocol.board_session import BoardSession
from common.protocol.chunking import Whole
from common.protocol.duplex import GAP_NS, Duplex
from common.protocol.framing import MAX_BODY_BYTES, Deframer, Side, Unit, UnitKind, unit_parts
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
    Message,
    Pacing,
    Ping,
    Pong,
    Status,
)
from common.protocol.session import Arrived, Echo, Outgoing
from common.protocol.wire import MAX_HEADER_BYTES, MAX_PAYLOAD_BYTES, decode, encode
from common.settings import resolve
from phone_host.camera.factory import check_camera
from phone_host.camera.jpegs import MAX_IMAGE_BYTES, JpegStream
from phone_host.camera.jpegs import Whole as WholeImage
from phone_host.formats.rig_yaml import read_rig
from phone_host.settings import PhoneHostSettings, check
from phone_host.sync.clock import ClockEstimator
from tests.support.pictures import encoded, jpeg, picture

_CAMERA = CameraDescription("webcam", 640, 480, PixelFormat.MJPEG, 33_333_333, Pacing.CLOCK)
_COUNTS = BoardCounts(9, 5, ((DropReason.REPLACED, 3), (DropReason.NO_HOST, 1)))
_MARKS = BoardMarks(10**12, 10**12 + 5 * 10**6, 10**12 + 6 * 10**6)
SOUND_MESSAGES: tuple[Message, ...] = (
    HostHello("0123456789abcdef", Lane.FRAMES),
    BoardHello("s", "boot", _CAMERA, _COUNTS),
    Knock(Lane.CONTROL, "s"),
    Credit(7),
    FrameMessage("s", 5, 7, 640, 480, PixelFormat.MJPEG, 10**7, _MARKS, b""),
    Ping(1, 0),
    Pong(1, 10**12, 10**12, 10**12),
    Status("s", _COUNTS),
    End("s", _COUNTS),
)


@dataclass(frozen=True, slots=True)
class Target:
    """One reader.

    Attributes:
        what: for people.
        run: takes any bytes; raises where something is wrong.
        seeds: sound inputs to begin with.
        most_bytes: of one input.
        share: of the bytes that were asked for.
    """

    what: str
    run: Callable[[bytes], None]
    seeds: Callable[[], list[bytes]]
    most_bytes: int
    share: float


def _wire(side: Side, unit: Unit) -> bytes:
    return b"".join(unit_parts(side, unit))


_GOOD = Unit(UnitKind.CONTROL, first=True, last=True, number=77, body=b"the next good packet")


def deframer(data: bytes) -> None:
    """Bytes of a line in two ways of chopping: the same units, each of which stands in the bytes; the good one behind them is found."""
    stream = data + _wire(Side.LISTENER, _GOOD)
    whole, chopped = Deframer(Side.LISTENER), Deframer(Side.LISTENER)
    units = [_wire(Side.LISTENER, unit) for unit in whole.feed(stream)]
    pieces: list[bytes] = []
    at = 0
    while at < len(stream):
        step = 1 + 37 * stream[at]
        pieces += [_wire(Side.LISTENER, unit) for unit in chopped.feed(stream[at : at + step])]
        assert len(chopped._rest) <= 4096, "more than one unit's bytes are kept"
        at += step
    assert units == pieces, "chopping changes the units"
    units += [_wire(Side.LISTENER, unit) for unit in whole.give_up()]
    assert units, "the good unit is passed over"
    assert units[-1] == _wire(Side.LISTENER, _GOOD), "the good unit is not the last one"
    at = 0
    for unit in units:
        at = stream.find(unit, at)
        assert at >= 0, "a unit was never written"
        at += len(unit)
    assert whole.garbage_bytes == len(stream) - sum(map(len, units)), "bytes are unaccounted for"


def _deframer_seeds() -> list[bytes]:
    chance = random.Random(1)
    sizes = (0, 1, 20, 300, MAX_BODY_BYTES)
    sound = [_wire(Side.LISTENER, Unit(UnitKind.FRAMES, True, False, n, chance.randbytes(n))) for n in sizes]  # noqa: FBT003 - first, not last
    return [*sound, b"".join(sound), sound[2][:-3] + sound[3], chance.randbytes(60_000), b"\xc6" * 3000, b"login: "]


def wire(data: bytes) -> None:
    """Headers of a stranger, each behind its length: refused, or read as what can be written and read again."""
    for header in _parts(data):
        try:
            message = decode(header[:MAX_HEADER_BYTES], b"")
        except ProtocolError:
            continue
        assert decode(*encode(message)) == message, "what was read is not what is written"


def _parts(data: bytes) -> Iterator[bytes]:
    """Cut an input into parts, each behind its length: one byte, in eights."""
    at = 0
    while at < len(data):
        length = 1 + data[at] if data[at] < 128 else 8 * (data[at] - 111)
        yield data[at + 1 : at + 1 + length]
        at += 1 + length


def _as_parts(items: list[bytes]) -> bytes:
    return b"".join(bytes((len(item) - 1 if len(item) <= 128 else 111 + -(-len(item) // 8),)) + item for item in items)


def _wire_seeds() -> list[bytes]:
    headers = [encode(message)[0] for message in SOUND_MESSAGES]
    deep = [
        b"\x93\x01\x06" + b"\x91" * 100,
        b"\xdd\xff\xff\xff\xff",
        b"\x93\x02\x00" + msgpack.packb([1.5, None, {"a": b"b"}]),
    ]
    return [*(_as_parts([header]) for header in headers), _as_parts(headers), _as_parts(deep)]


def line(data: bytes) -> None:
    """Units with sound checks and hostile contents: no error, no packet beyond the limits, no more bytes held than came."""
    for side in Side:
        end = Duplex(side, 17)
        now_ns, at, numbers = 1, 0, [0, 0, 0, 0]
        while at + 4 <= len(data):
            flags, low, high, extra = data[at : at + 4]
            kind = UnitKind(flags & 3)
            length = (low | high << 8) % (MAX_BODY_BYTES + 1) if flags & 16 else low % 32
            number = extra * 257 if flags & 32 else numbers[kind.value]
            unit = Unit(kind, bool(flags & 4), bool(flags & 8), number, data[at + 4 : at + 4 + length])
            numbers[kind.value] = (number + 1) % 65536
            at += 4 + len(unit.body)
            for event in end.feed(_wire(side.peer, unit), now_ns):
                if isinstance(event, Whole):
                    assert len(event.header) <= MAX_HEADER_BYTES, "a header beyond the limit"
                    assert len(event.payload) <= MAX_PAYLOAD_BYTES, "a payload beyond the limit"
            assert sum(len(item.data) for item in end._joiner._under_way.values()) <= len(data), (
                "more is held than came"
            )
            if flags & 64:
                end.put(Lane(flags >> 7), b"answer", bytes(extra * 64 * (flags >> 7 ^ 1)))
            end.take(now_ns)
            now_ns += extra * 10**6
            end.silence(now_ns + GAP_NS)


def _line_seeds() -> list[bytes]:
    met = bytes((3 | 12, 5, 0, 1)) + b"\0\x11\0\0\0" + bytes((3 | 12, 5, 0, 1)) + b"\1\x11\0\0\0"
    header = encode(SOUND_MESSAGES[4])[0]
    packet = len(header).to_bytes(2, "little") + (100).to_bytes(4, "little") + header + bytes(100)
    cut = [packet[:90], packet[90:]]
    chunks = bytes((0 | 4 | 16 | 64, 90, 0, 3)) + cut[0] + bytes((0 | 8 | 16, len(cut[1]), 0, 3)) + cut[1]
    return [met, met + chunks, met + chunks + bytes((2 | 12 | 32, 0, 0, 0))]


def session(data: bytes) -> None:
    """Sound messages of a hostile peer in any order: both roles and the clock go on, and what they answer can be written."""
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


def _session_seeds() -> list[bytes]:
    hello = encode(SOUND_MESSAGES[1])[0]
    pongs = [b"c" + encode(Pong(wave, 10**12, 5 * 10**9, 5 * 10**9 + 1000))[0] for wave in range(1, 5)]
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


def uri(data: bytes) -> None:
    """What a user may type as link or camera: a link, a camera or a SettingsError that says why not in one line."""
    text = data.decode("utf-8", "surrogateescape")
    for read in (lambda: parse_link(text, listens_by_default=True), lambda: check_camera(text)):
        try:
            read()
        except SettingsError as error:
            _is_one_line(error)


def _uri_seeds() -> list[bytes]:
    return [
        b"tcp://127.0.0.1:5555?bind=1",
        b"tcp://*:1",
        b"tcp://[::1]:99",
        b"ipc:///tmp/board",
        b"serial:/dev/ttyGS0?baud=115200&connect=1",
        b"rfcomm://AA:BB:CC:DD:EE:FF/1",
        b"replay:folder/*.png?fps=29.97&loop=1&pace=demand",
        b"replay:a?fps=30/1",
        b"v4l2:auto?size=640x480&fps=30&format=mjpeg&exposure_ms=10&lock=0&power_line=50&readout_ms=1e1&latency_ms=4",
        b"replay:a?fps=1e999999",
        b"v4l2:/dev/video0?send=luma&gain=3&white_balance=4600&focus=2",
        b"https://[::1]/?action=stream&verify=0&latency_uncertainty_ms=3.5",
        b"http://user:pass@phone:8080/video?latency_ms=120",
    ]


def v4l2(data: bytes) -> None:
    """What a driver may claim of its controls and buffers: plans set only what fits, stamps in the future are never trusted."""
    size = 40
    controls = tuple(_control(data[at : at + size]) for at in range(0, len(data) - size + 1, size))
    plan = ControlPlan(controls)
    wishes = ControlWishes(held=((Axis.EXPOSURE, 100), (Axis.FOCUS, -(2**31))))
    found = tuple((axis, control.maximum) for axis, control in plan.to_find(wishes))
    for step in [*plan.to_start(wishes), *plan.to_lock(found, wishes.with_found(found))]:
        assert step.control.can_be_set, "a control that cannot be set"
        limits = step.control.minimum, step.control.maximum
        ranged = step.control.kind in {abi.CTRL_TYPE_INTEGER, abi.CTRL_TYPE_BOOLEAN} and limits[0] <= limits[1]
        assert not ranged or limits[0] <= step.value <= limits[1], "a value out of range"
    meter = RateMeter()
    for at in range(0, len(data) - 16, 16):
        flags, sequence = (int.from_bytes(data[at + k : at + k + 4], "little") for k in (0, 4))
        stamp_ns = int.from_bytes(data[at + 8 : at + 16], "little", signed=True)
        clock, source = stamp_clock(flags), stamp_source(flags, "uvcvideo" if flags & 1 else "vivid")
        assert not is_trusted(stamp_ns, clock, stamp_ns - 1), "a stamp of the future is trusted"
        exposure_midpoint_ns(stamp_ns, source, Timing("vivid", 16_000_000), None)
        meter.add(stamp_ns, sequence)
        meter.differs_from(33_333_333)


def _control(data: bytes) -> Control:
    words = [int.from_bytes(data[at : at + 4], "little", signed=True) for at in range(0, 40, 4)]
    known = [
        abi.CID_AUTO_EXPOSURE,
        abi.CID_EXPOSURE_TIME_ABSOLUTE,
        abi.CID_AUTOGAIN,
        abi.CID_GAIN,
        abi.CID_FOCUS_ABSOLUTE,
    ]
    menu = tuple((words[7] & 7 | k, "item") for k in range(words[8] & 3))
    return Control(
        known[words[0] % len(known)], "name", words[1] & 7, words[2], words[3], words[4], words[5], words[6], menu
    )


def _v4l2_seeds() -> list[bytes]:
    control = b"".join(value.to_bytes(4, "little", signed=True) for value in (1, 1, 1, 5000, 1, 156, 0, 0, 0, 0))
    menu = b"".join(value.to_bytes(4, "little", signed=True) for value in (0, 3, 0, 3, 1, 3, 0, 1, 3, 0))
    return [control, menu + control, bytes(160)]


def image(data: bytes) -> None:
    """Image files: a DataError, or an image within the limits that a link can carry."""
    try:
        read = read_image(Path("file"), data)
    except DataError as error:
        _is_one_line(error)
        return
    assert read.width_px >= 1, "no width"
    assert read.height_px >= 1, "no height"
    assert len(read.payload) <= MAX_PAYLOAD_BYTES, "more than a link carries"
    find_fault(read.pixel_format, read.payload)


def _image_seeds() -> list[bytes]:
    small = picture(8, 6)
    kinds = [encoded(suffix, small) for suffix in (".png", ".ppm")] + [jpeg(16, 8)]
    return [*kinds, b"P5\n# comment\n3 2\n255\nabcdef", b"P6 1 1 65535 abcdef", b"P5 4 4 255 "]


def mjpeg(data: bytes) -> None:
    """A server's stream in two ways of chopping: the same images, each of which stands in the bytes; nothing beyond the limit; good ones come again."""
    good = _JPEG
    stream = data + bytes(70_000) + good  # no segment of the garbage covers what comes behind so many bytes
    whole, chopped = JpegStream(), JpegStream()
    images = [event.payload for event in whole.feed(stream, 1) if isinstance(event, WholeImage)]
    pieces: list[bytes] = []
    at, step = 0, 1 + len(data) % 97
    while at < len(stream):
        pieces += [event.payload for event in chopped.feed(stream[at : at + step], 1) if isinstance(event, WholeImage)]
        assert chopped.held_bytes <= MAX_IMAGE_BYTES, "more is held than an image"
        at, step = at + step, 1 + step * 31 % 4099
    assert images == pieces, "chopping changes the images"
    assert images, "the good image is passed over"
    assert images[-1] == good, "the good image is not the last one"
    at = 0
    for found in images:
        at = stream.find(found, at)
        assert at >= 0, "an image was never sent"
        at += len(found)
    assert whole.passed_bytes == len(stream) - sum(map(len, images)), "bytes are unaccounted for"


_JPEG = jpeg(16, 8)


def _mjpeg_seeds() -> list[bytes]:
    header = b"\r\n--frame\r\nContent-Type: image/jpeg\r\n\r\n"
    comment = _JPEG[:2] + b"\xff\xfe\x00\x06\xff\xd9\xff\xd8" + _JPEG[2:]
    return [
        header + _JPEG + header + _JPEG,
        _JPEG[:-20] + header + _JPEG,
        comment,
        _JPEG[:30],
        b"\xff\xd8\xff\xda\x00\x02\xff\xd0\xff\xd9",
    ]


def _is_one_line(error: TandemError) -> None:
    assert "\n" not in str(error), "an error of several lines"


_FOLDER = tempfile.TemporaryDirectory(prefix="fuzz")


def rig(data: bytes) -> None:
    """rig.yaml: a rig, or a DataError in one line."""
    path = Path(_FOLDER.name) / "rig.yaml"
    path.write_bytes(data)
    try:
        read_rig(path)
    except DataError as error:
        _is_one_line(error)


def _rig_seeds() -> list[bytes]:
    def matrix(rows: int, columns: int, values: str) -> str:
        return f"!!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {values} ]\n"

    eye = matrix(3, 3, "1., 0., 0., 0., 1., 0., 0., 0., 1.")
    camera = matrix(3, 3, "600., 0., 320., 0., 600., 240., 0., 0., 1.")
    sizes = "".join(f"{side}_image_{edge}: 640\n" for side in ("left", "right") for edge in ("width", "height"))
    lens = matrix(1, 5, "0.1, 0., 0., 0., 0.")
    text = f"%YAML:1.0\n---\n{sizes}board_side: left\nM1: {camera}D1: {lens}M2: {camera}D2: {lens}R: {eye}"
    return [f"{text}T: {matrix(3, 1, '-0.06, 0., 0.')}rms_stereo: .Nan\n".encode(), b"%YAML:1.0\n---\n"]


def settings(data: bytes) -> None:
    """A settings file: settings that `run` could use, or a SettingsError in one line."""
    path = Path(_FOLDER.name) / "settings.toml"
    path.write_bytes(data)
    try:
        check(resolve(PhoneHostSettings, "FUZZ_NOBODY_SETS_THIS", path, {}).values)
    except SettingsError as error:
        _is_one_line(error)


def _settings_seeds() -> list[bytes]:
    text = (
        b'link = "tcp://127.0.0.1:5555"\ncamera = "replay:a?fps=30"\ntolerance = 5\nfifo = "2:block"\nmatcher = "bm"\n'
    )
    return [text, b'log_level = "debug"\ntolerance = nan\n', b"fifo = '1'\n", b'calibration = """\na"""\n']


TARGETS: dict[str, Target] = {
    "deframer": Target("units in a byte stream", deframer, _deframer_seeds, 65_536, 0.5),
    "wire": Target("message headers", wire, _wire_seeds, 16_384, 0.5),
    "line": Target("chunks, contact and pacing behind sound checks", line, _line_seeds, 16_384, 0.02),
    "session": Target("both roles of a session and the clock", session, _session_seeds, 8192, 0.005),
    "uri": Target("link and camera URIs", uri, _uri_seeds, 300, 0.01),
    "v4l2": Target("a driver's controls and stamps", v4l2, _v4l2_seeds, 2048, 0.005),
    "image": Target("JPEG, PNG and PNM headers", image, _image_seeds, 4096, 0.005),
    "mjpeg": Target("images in a server's stream", mjpeg, _mjpeg_seeds, 8192, 0.01),
    "rig": Target("rig.yaml", rig, _rig_seeds, 4096, 0.005),
    "settings": Target("settings files", settings, _settings_seeds, 2048, 0.005),
}
