"""Fuzz targets: input from users, drivers, servers and disks. Each takes any bytes and raises only if something is wrong."""

import tempfile
from contextlib import suppress
from pathlib import Path

from common.camera import v4l2_abi as abi
from common.camera.imagefile import read_image
from common.camera.v4l2_controls import Axis, Control, ControlPlan, ControlWishes
from common.camera.v4l2_stamps import RateMeter, Timing, exposure_midpoint_ns, is_trusted, stamp_clock, stamp_source
from common.errors import DataError, SettingsError
from common.frame import ImageSizeError, SpoiledImageError, find_fault
from common.imagesize.head import MEGAPIXEL
from common.keys import KeyFolder
from common.link.factory import parse_link
from common.program.settings import resolve
from common.protocol.wire import MAX_PAYLOAD_BYTES
from common.recording.inflate import inflate
from common.recording.recorded import read_recorded
from phone_host.camera.factory import check_camera
from phone_host.camera.jpegs import MAX_IMAGE_BYTES, JpegStream
from phone_host.camera.jpegs import Whole as WholeImage
from phone_host.declared_settings import PhoneHostSettings
from phone_host.output.rig_yaml import read_rig
from phone_host.settings import check
from phone_host.stereo.images import decode_file, examine
from tests.fuzz.target import is_one_line
from tests.support.bombs import SMALL_BOMB, black_png, progressive
from tests.support.pictures import encoded, jpeg, picture
from tests.support.recorded import recording


def uri(data: bytes) -> None:
    """What a user may type as link or camera. Expected: a link, a camera, or a SettingsError that says in one line why not."""
    text = data.decode("utf-8", "surrogateescape")
    for read in (lambda: parse_link(text, listens_by_default=True), lambda: check_camera(text)):
        try:
            read()
        except SettingsError as error:
            is_one_line(error)


def uri_seeds() -> list[bytes]:
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
        b"browser:?w=640&h=480&fps=30&encoding=luma&quality=0.9&rotate=90",
    ]


def recordings(data: bytes) -> None:
    """What a disk may give back as a recording. Expected: whatever is whole, never an exception, and no more than the file holds."""
    found = read_recorded(memoryview(data), inflate)
    held = sum(len(shown.image.payload) for stream in found.images.values() for shown in stream)
    assert held <= len(data), "images longer than the file"
    for topic in found.images:
        with suppress(SpoiledImageError):
            found.camera(topic)


def recordings_seeds() -> list[bytes]:
    return [recording(1), recording(2, missing=frozenset({0}))]


def v4l2(data: bytes) -> None:
    """What a driver may claim about its controls and buffers. Plans set only what fits; stamps in the future are never trusted."""
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
        id=known[words[0] % len(known)],
        name="name",
        kind=words[1] & 7,
        minimum=words[2],
        maximum=words[3],
        step=words[4],
        default=words[5],
        flags=words[6],
        menu=menu,
    )


def v4l2_seeds() -> list[bytes]:
    control = b"".join(value.to_bytes(4, "little", signed=True) for value in (1, 1, 1, 5000, 1, 156, 0, 0, 0, 0))
    menu = b"".join(value.to_bytes(4, "little", signed=True) for value in (0, 3, 0, 3, 1, 3, 0, 1, 3, 0))
    return [control, menu + control, bytes(160)]


def image(data: bytes) -> None:
    """Image files. Expected: a DataError, or an image within the limits of what a link can carry."""
    try:
        read = read_image(Path("file"), data)
    except DataError as error:
        is_one_line(error)
        return
    assert read.width_px >= 1, "no width"
    assert read.height_px >= 1, "no height"
    assert len(read.payload) <= MAX_PAYLOAD_BYTES, "more than a link carries"
    find_fault(read.pixel_format, read.payload)


def image_seeds() -> list[bytes]:
    small = picture(8, 6)
    kinds = [encoded(suffix, small) for suffix in (".png", ".ppm")] + [jpeg(16, 8)]
    return [*kinds, b"P5\n# comment\n3 2\n255\nabcdef", b"P6 1 1 65535 abcdef", b"P5 4 4 255 "]


def decoding(data: bytes) -> None:
    """Images of every kind. Expected: a SpoiledImageError before or by the decoder, or an image of the size read and judged before."""
    try:
        file = examine(data, "image", MEGAPIXEL)
    except SpoiledImageError as error:
        is_one_line(error)
        return
    try:
        shape = decode_file(file).shape
    except ImageSizeError as error:
        raise AssertionError("an image of a size that nobody had judged") from error
    except SpoiledImageError as error:
        is_one_line(error)
        return
    assert (shape[1], shape[0]) == file.size_px, "another size"


def decoding_seeds() -> list[bytes]:
    """One small image of each kind."""
    small = picture(24, 16)
    kinds = [encoded(suffix, small) for suffix in (".jpg", ".png", ".bmp", ".ppm", ".tiff", ".webp")]
    return [*kinds, progressive(24, 16), black_png(9, 7, bits=16, interlaced=True), SMALL_BOMB]


def mjpeg(data: bytes) -> None:
    """A stream split in two ways gives the same images, each found in the bytes; none exceeds the limit; a good one after garbage is found."""
    good = _JPEG
    stream = data + bytes(70_000) + good  # no segment in the garbage is long enough to cover what follows so many bytes
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


def mjpeg_seeds() -> list[bytes]:
    header = b"\r\n--frame\r\nContent-Type: image/jpeg\r\n\r\n"
    comment = _JPEG[:2] + b"\xff\xfe\x00\x06\xff\xd9\xff\xd8" + _JPEG[2:]
    return [
        header + _JPEG + header + _JPEG,
        _JPEG[:-20] + header + _JPEG,
        comment,
        _JPEG[:30],
        b"\xff\xd8\xff\xda\x00\x02\xff\xd0\xff\xd9",
    ]


_FOLDER = tempfile.TemporaryDirectory(prefix="fuzz")


def rig(data: bytes) -> None:
    """rig.yaml. Expected: a rig, or a one-line DataError."""
    path = Path(_FOLDER.name) / "rig.yaml"
    path.write_bytes(data)
    try:
        read_rig(path)
    except DataError as error:
        is_one_line(error)


def rig_seeds() -> list[bytes]:
    def matrix(rows: int, columns: int, values: str) -> str:
        return f"!!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {values} ]\n"

    eye = matrix(3, 3, "1., 0., 0., 0., 1., 0., 0., 0., 1.")
    camera = matrix(3, 3, "600., 0., 320., 0., 600., 240., 0., 0., 1.")
    sizes = "".join(f"{side}_image_{edge}: 640\n" for side in ("left", "right") for edge in ("width", "height"))
    lens = matrix(1, 5, "0.1, 0., 0., 0., 0.")
    text = f"%YAML:1.0\n---\n{sizes}board_side: left\nM1: {camera}D1: {lens}M2: {camera}D2: {lens}R: {eye}"
    return [f"{text}T: {matrix(3, 1, '-0.06, 0., 0.')}rms_stereo: .Nan\n".encode(), b"%YAML:1.0\n---\n"]


def settings(data: bytes) -> None:
    """A settings file. Expected: settings that `run` could use, or a one-line SettingsError."""
    path = Path(_FOLDER.name) / "settings.toml"
    path.write_bytes(data)
    try:
        check(resolve(PhoneHostSettings, "FUZZ_NOBODY_SETS_THIS", path, {}).values)
    except SettingsError as error:
        is_one_line(error)


def settings_seeds() -> list[bytes]:
    text = (
        b'link = "tcp://127.0.0.1:5555"\ncamera = "replay:a?fps=30"\ntolerance = 5\nfifo = "2:block"\nmatcher = "bm"\n'
    )
    return [text, b'log_level = "debug"\ntolerance = nan\n', b"fifo = '1'\n", b'calibration = """\na"""\n']


def peers(data: bytes) -> None:
    """Lists of peers from a disk. Expected: their content, or a one-line DataError."""
    path = Path(_FOLDER.name) / "peers.json"
    path.write_bytes(data)
    path.chmod(0o600)
    folder = KeyFolder(Path(_FOLDER.name))
    try:
        folder.peers()
    except DataError as error:
        is_one_line(error)


def peers_seeds() -> list[bytes]:
    return [b'[{"name": "a", "key": "b", "address": ""}]']
