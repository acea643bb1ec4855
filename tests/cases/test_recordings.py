"""Recordings of other programs, each kind as a small file and what it holds. docs/recordings.md has a row for each."""

import subprocess
import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from common.errors import DataError
from common.recording.layout import ABOUT, About, image_topic
from common.recording.opened import open_recorded
from common.recording.recording_file import written
from phone_host.cli import main
from phone_host.recording.both_sides import encoded
from phone_host.stereo.raw_images import decode_frame
from tests.support import foreign_recordings as other
from tests.support.foreign_recordings import COMPRESSED, HEIGHT, PERIOD_NS, RAW, WIDTH, ZERO_NS, Sent, grey, picture

Message = Callable[[int, int, int], bytes]


def _raw(label: str, make: Callable[[NDArray[np.uint8]], NDArray[np.uint8]], pad: int = 0, **more: int) -> Message:
    """A raw image: made from the colour picture, with so many bytes behind each row."""

    def message(side: int, number: int, stamp_ns: int) -> bytes:
        made = np.ascontiguousarray(make(picture(side, number)))
        rows = made.reshape(len(made), -1)
        step = rows.shape[1] + pad
        return other.raw(label, other.padded(rows, step), stamp_ns, more.get("step", step), more.get("big_endian", 0))

    return message


def _of(code: int) -> Callable[[NDArray[np.uint8]], NDArray[np.uint8]]:
    return lambda image: np.asarray(cv2.cvtColor(image, code), np.uint8)


def _grey16(order: str) -> Callable[[NDArray[np.uint8]], NDArray[np.uint8]]:
    return lambda image: (_of(cv2.COLOR_BGR2GRAY)(image).astype(f"{order}u2") * 257).astype(f"{order}u2").view(np.uint8)


def _yuv(chroma_first: bool) -> Callable[[NDArray[np.uint8]], NDArray[np.uint8]]:  # noqa: FBT001 - one of two
    """Two bytes a pixel: luminance of each, chrominance of every other."""

    def convert(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        yuv = cv2.cvtColor(image, cv2.COLOR_BGR2YUV_I420)
        luminance = yuv[:HEIGHT].astype(np.uint8)
        blue, red = (
            part.reshape(HEIGHT // 2, WIDTH // 2).repeat(2, axis=0) for part in np.split(yuv[HEIGHT:].ravel(), 2)
        )
        chroma = np.stack([blue, red], axis=2).reshape(HEIGHT, WIDTH)
        order = [chroma, luminance] if chroma_first else [luminance, chroma]
        return np.stack(order, axis=2).astype(np.uint8)

    return convert


def _nv12(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    yuv = cv2.cvtColor(image, cv2.COLOR_BGR2YUV_I420)
    blue, red = np.split(yuv[HEIGHT:].ravel(), 2)
    return np.concatenate([yuv[:HEIGHT], np.stack([blue, red], axis=1).reshape(-1, WIDTH)]).astype(np.uint8)


def _plain(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return image


def _jpeg(label: str) -> Message:
    return lambda side, number, at_ns: other.compressed(label, other.jpeg(picture(side, number)), at_ns)


def _short_last_row(side: int, number: int, at_ns: int) -> bytes:
    return other.raw("mono8", other.padded(grey(side, number), WIDTH + 8)[:-8], at_ns, WIDTH + 8)


READ: dict[str, tuple[str, Message, int]] = {
    "JPEG, called jpg": (COMPRESSED, _jpeg("jpg"), 6),
    "JPEG, called nothing": (COMPRESSED, _jpeg(""), 6),
    "JPEG, called png": (COMPRESSED, _jpeg("png"), 6),
    "JPEG, as image_transport calls it": (COMPRESSED, _jpeg("bgr8; jpeg compressed bgr8"), 6),
    "JPEG in big-endian CDR": (
        COMPRESSED,
        lambda side, number, at_ns: other.compressed("jpeg", other.jpeg(picture(side, number)), at_ns, ">"),
        6,
    ),
    "JPEG in a raw image's message": (
        RAW,
        lambda side, number, at_ns: other.raw("jpeg", other.jpeg(picture(side, number)), at_ns, 0),
        6,
    ),
    "PNG, called jpeg": (
        COMPRESSED,
        lambda side, number, at_ns: other.compressed("jpeg", other.png(picture(side, number)), at_ns),
        0,
    ),
    "mono8": (RAW, _raw("mono8", _of(cv2.COLOR_BGR2GRAY)), 0),
    "mono8, rows padded": (RAW, _raw("mono8", _of(cv2.COLOR_BGR2GRAY), 32), 0),
    "mono8, last row not padded": (RAW, _short_last_row, 0),
    "mono8, no step": (RAW, _raw("mono8", _of(cv2.COLOR_BGR2GRAY), step=0), 0),
    "mono8, rows padded, step wrong": (RAW, _raw("mono8", _of(cv2.COLOR_BGR2GRAY), 4, step=WIDTH), 0),
    "8UC1": (RAW, _raw("8UC1", _of(cv2.COLOR_BGR2GRAY)), 0),
    "bgr8": (RAW, _raw("bgr8", _plain), 0),
    "bgr8, rows padded": (RAW, _raw("bgr8", _plain, 32), 0),
    "rgb8": (RAW, _raw("rgb8", _of(cv2.COLOR_BGR2RGB)), 0),
    "8UC3": (RAW, _raw("8UC3", _plain), 0),
    "bgra8": (RAW, _raw("bgra8", _of(cv2.COLOR_BGR2BGRA)), 0),
    "rgba8": (RAW, _raw("rgba8", _of(cv2.COLOR_BGR2RGBA)), 0),
    "8UC4": (RAW, _raw("8UC4", _of(cv2.COLOR_BGR2BGRA), 64), 0),
    "mono16": (RAW, _raw("mono16", _grey16("<")), 0),
    "16UC1, high byte first": (RAW, _raw("16UC1", _grey16(">"), 6, big_endian=1), 0),
    "yuv422_yuy2": (RAW, _raw("yuv422_yuy2", _yuv(chroma_first=False), 16), 8),
    "yuv422": (RAW, _raw("yuv422", _yuv(chroma_first=True)), 8),
    "yuyv": (RAW, _raw("yuyv", _yuv(chroma_first=False)), 8),
    "uyvy": (RAW, _raw("UYVY", _yuv(chroma_first=True), 2), 8),
    "nv12": (RAW, _raw("nv12", _nv12), 8),
}
"""What is read: the message's kind, the message, and by how much a value may be off."""


def _decoded(path: Path, topic: str) -> list[NDArray[np.uint8]]:
    found = open_recorded(path)
    camera = found.camera(topic)
    return [decode_frame(encoded(shown, camera, "an image")) for shown in found.images[topic]]


@pytest.mark.parametrize("name", READ)
def test_images_of_other_programs_are_read(tmp_path: Path, name: str) -> None:
    """Whatever the message calls them, each has the pixels that were put into it, and nothing is left out."""
    kind, message, tolerance = READ[name]
    path = other.file_of(tmp_path, other.stereo(message, kind))
    for side, topic in enumerate(other.TOPICS):
        for number, image in enumerate(_decoded(path, topic)):
            expected = picture(side, number) if image.ndim == 3 else grey(side, number)
            assert image.shape == expected.shape
            assert np.abs(image.astype(int) - expected).max() <= tolerance
    found = open_recorded(path)
    assert [len(found.images[topic]) for topic in other.TOPICS] == [4, 4]
    assert (found.damages, found.unused, found.remarks) == ([], {}, [])


UNREAD: dict[str, tuple[str, str, Message, str]] = {
    "Bayer": (RAW, "cdr", _raw("bayer_rggb8", _of(cv2.COLOR_BGR2GRAY)), "encoded as 'bayer_rggb8'; mono8, "),
    "depth": (RAW, "cdr", _raw("32FC1", _of(cv2.COLOR_BGR2BGRA)), "encoded as '32FC1'"),
    "a wrong label": (RAW, "cdr", _raw("mono8", _of(cv2.COLOR_BGR2GRAY), 320), "32 pixels take 32 bytes and not 352"),
    "WebP": (
        COMPRESSED,
        "cdr",
        lambda _, __, at_ns: other.compressed("webp", b"RIFF\0\0\0\0WEBPVP8 ", at_ns),
        "holds WebP, encoded as 'webp'; JPEG and PNG are read",
    ),
    "protobuf": ("foxglove.CompressedImage", "protobuf", lambda *_: b"\n\0", "foxglove.CompressedImage is no image"),
    "an IMU": ("sensor_msgs/msg/Imu", "cdr", lambda *_: b"\0\1\0\0", "sensor_msgs/msg/Imu is no image"),
    "messages compressed one by one": (
        RAW,
        "cdr",
        lambda *_: b"\x28\xb5\x2f\xfd" + bytes(20),
        "each message is compressed: give the folder of the bag",
    ),
}
"""What is not read: kind and encoding of the message, the message, and the reason that is told."""


@pytest.mark.parametrize("name", UNREAD)
def test_what_is_not_used_has_its_reason(tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Beside images that are read it is one line of `info` and of `import`; alone it is the one line of the error, and nothing is written."""
    kind, encoding, message, reason = UNREAD[name]
    good = other.stereo(_jpeg("jpeg"), COMPRESSED)
    bad = [Sent("/else", kind, encoding, sent.log_ns, message(0, 0, sent.log_ns)) for sent in good]
    path, out = str(other.file_of(tmp_path, [*good, *bad])), str(tmp_path / "out.mcap")
    for words in (["info", path], ["import", path, "--out", out]):
        assert main(["sessions", *words]) == 0
        [told] = [line for line in capsys.readouterr().out.splitlines() if "not used" in line]
        assert told.startswith("  not used: /else (")
        assert reason in told
    alone = str(other.file_of(tmp_path, bad, "alone.mcap"))
    assert main(["sessions", "import", alone, "--out", str(tmp_path / "none.mcap")]) == 4
    [line] = capsys.readouterr().err.splitlines()
    assert reason in line
    assert not (tmp_path / "none.mcap").exists()


def test_a_third_camera_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With the option that takes it."""
    sent = other.stereo(_jpeg("jpeg"), COMPRESSED)
    third = [Sent("/cam2/image", each.kind, "cdr", each.log_ns, each.data) for each in sent[::2]]
    path = other.file_of(tmp_path, [*sent, *third])
    assert main(["sessions", "import", str(path), "--out", str(tmp_path / "out.mcap")]) == 0
    assert "not used: /cam2/image (another camera; --topics" in capsys.readouterr().out


def _log(number: int) -> int:
    return ZERO_NS + number * PERIOD_NS + other.LATE_NS


WRONG_STAMPS: dict[str, tuple[Callable[[int], int], str]] = {
    "zero": (lambda _: 0, "are zero"),
    "equal": (lambda _: ZERO_NS, "are equal for several images"),
    "backwards": (lambda number: ZERO_NS - number * PERIOD_NS, "run backwards"),
    "ms taken as s": (lambda number: number * 100_000_000_000 + 10**9, "are further apart than 10 s"),
    "ns taken as s": (lambda number: ZERO_NS + number * 100, "are closer together than 1 ms"),
}


@pytest.mark.parametrize("name", WRONG_STAMPS)
def test_stamps_that_cannot_be_are_not_believed(tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The times of receipt are taken for both cameras and that is said; if these cannot be either, one line asks for the rate, with which it is imported."""
    stamp, words = WRONG_STAMPS[name]
    path = other.file_of(tmp_path, other.stamped(stamp, _log))
    found = open_recorded(path)
    for topic in other.TOPICS:
        assert [shown.image.stamp_ns for shown in found.images[topic]] == [_log(number) for number in range(4)]
    assert main(["sessions", "info", str(path)]) == 0
    assert f"the stamps of /cam0/image {words}: the times of receipt are used" in capsys.readouterr().out
    lost = other.file_of(tmp_path, other.stamped(stamp, lambda _: 0), "lost.mcap")
    with pytest.raises(DataError, match=f"{words}, the times of receipt of /cam0/image are zero: give the rate"):
        open_recorded(lost)
    assert main(["sessions", "import", str(lost), "--fps", "10", "--out", str(tmp_path / "out.mcap")]) == 0
    assert "the images are taken for 10 a second" in capsys.readouterr().out
    given = open_recorded(tmp_path / "out.mcap").images["/right/image/compressed"]
    assert {b.image.stamp_ns - a.image.stamp_ns for a, b in pairwise(given)} == {PERIOD_NS}


def test_stamps_are_used_where_the_times_of_receipt_cannot_be(tmp_path: Path) -> None:
    """And that is said, too."""
    found = open_recorded(
        other.file_of(tmp_path, other.stamped(lambda number: ZERO_NS + number * PERIOD_NS, lambda _: 0))
    )
    assert [shown.log_ns for shown in found.images["/cam1/image"]] == [ZERO_NS + n * PERIOD_NS for n in range(4)]
    assert found.remarks == ["the times of receipt of /cam0/image are zero: the stamps are used for all images"]


def test_equal_stamps_overwrite_no_picture(tmp_path: Path) -> None:
    """Two images of one moment are two files with the bytes of both."""
    path = tmp_path / "ours.mcap"
    with written(path) as file:
        file.tell(ABOUT, About().values())
        for side, name in enumerate(("left", "right")):
            for number in range(3):
                data = other.compressed("jpeg", other.jpeg(picture(side, number)), ZERO_NS)
                file.add(image_topic(name, COMPRESSED), data, sequence=number, log_ns=number, publish_ns=number)
    assert main(["sessions", "export", str(path), "--out", str(tmp_path / "out")]) == 0
    rows = (tmp_path / "out" / "left" / "data.csv").read_text().splitlines()[1:]
    names = [row.split(",")[1] for row in rows]
    assert [(tmp_path / "out" / "left" / name).read_bytes() for name in names] == [
        other.jpeg(picture(0, number)) for number in range(3)
    ]


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_compressed_chunks_are_read(tmp_path: Path, compression: str) -> None:
    """Each picture, also when they are looked at out of order: the chunk is decompressed again."""
    library = pytest.importorskip(
        {"zstd": "zstandard", "lz4": "lz4.frame"}[compression], reason="the extra recordings is not installed"
    )
    body = b""
    sent = other.stereo(_raw("bgr8", _plain, 16), RAW)
    for part in (sent[:4], sent[4:]):
        plain = other.records(part)
        packed = library.ZstdCompressor().compress(plain) if compression == "zstd" else library.compress(plain)
        body += other.chunk(compression, packed, len(plain))
    path = tmp_path / "packed.mcap"
    path.write_bytes(other.whole(body))
    found = open_recorded(path)
    for number in (3, 0, 2, 1):
        for side, topic in enumerate(other.TOPICS):
            shown = found.images[topic][number]
            image = decode_frame(encoded(shown, found.camera(topic), "an image"))
            assert np.array_equal(image, picture(side, number))


def test_spoiled_images_make_no_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Messages without a byte of image: one line, exit 4, nothing written. Where only the first is spoiled, the others are used, and names stay on a line."""
    empty = other.stereo(lambda _, __, at_ns: other.compressed("jpeg", b"", at_ns), COMPRESSED)
    path, out = other.file_of(tmp_path, empty), tmp_path / "out.mcap"
    for task, target in (("info", tmp_path / "page"), ("import", out), ("export", tmp_path / "folder")):
        assert main(["sessions", task, str(path), "--out", str(target)]) == 4
        assert len(capsys.readouterr().err.splitlines()) == 1
    assert not out.exists()
    sound = other.stereo(_jpeg("jpeg"), COMPRESSED)
    named = [Sent("/a\nb", "x\ny", "cdr", sent.log_ns, b"") for sent in sound[2:]]
    mixed = other.file_of(tmp_path, [*empty[:2], *sound[2:], *named], "mixed.mcap")
    assert main(["sessions", "info", str(mixed)]) == 0
    printed = capsys.readouterr().out
    assert "/cam0/image: 4 images 32x24" in printed
    assert "not used: /a\\nb (x\\ny is no image)" in printed


def test_a_recording_without_an_image_is_not_done(tmp_path: Path) -> None:
    """A camera all of whose images are spoiled: exit 4 and what to look at, of the host and of the board."""
    sent = other.stereo(
        lambda side, number, at: other.compressed("jpeg", other.jpeg(picture(side, number))[:-9], at), COMPRESSED
    )
    whole = other.stereo(_jpeg("jpeg"), COMPRESSED)
    path = other.file_of(tmp_path, [whole[0], *sent[2:]])
    camera = f"replay:{path}?topic=/cam1/image&pace=clock"
    for program, words in (("phone_host.start", ["record", "--alone"]), ("board_agent.start", ["record"])):
        command = [
            sys.executable,
            "-m",
            program,
            *words,
            "--camera",
            camera,
            "--out",
            str(tmp_path / f"{program}.mcap"),
        ]
        ended = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
        assert ended.returncode == 4
        assert "recorded: 0 images" in ended.stdout
        assert "; no image came: look at the camera" in ended.stdout


def _ros1_file(folder: Path) -> Path:
    sent = other.stereo(
        lambda side, number, at_ns: other.ros1("jpeg", other.jpeg(picture(side, number)), at_ns),
        "sensor_msgs/CompressedImage",
        encoding="ros1",
    )
    return other.file_of(folder, sent, "ros1.mcap")


def test_ros_1_messages_are_read(tmp_path: Path) -> None:
    """With the extra `recordings` as those of ROS 2."""
    pytest.importorskip("rosbags", reason="the extra recordings is not installed")
    path = _ros1_file(tmp_path)
    assert np.abs(_decoded(path, "/cam1/image")[2].astype(int) - picture(1, 2)).max() <= 6


def test_without_the_extra_one_line_names_it(tmp_path: Path) -> None:
    """Messages of ROS 1, a bag of ROS 1, and a compressed chunk: what to install. Exit 3 for the bag; 4 for files that can be read otherwise."""
    bag, packed = tmp_path / "old.bag", tmp_path / "packed.mcap"
    bag.write_bytes(b"#ROSBAG V2.0\n" + bytes(100))
    packed.write_bytes(other.whole(other.chunk("zstd", b"\x28\xb5\x2f\xfd", 10)))
    script = (
        "import sys; sys.modules.update(rosbags=None, zstandard=None); from phone_host.cli import main; "
        "sys.exit(main(sys.argv[1:]))"
    )
    for path, code, words in (
        (_ros1_file(tmp_path), 4, "holds ROS 1 messages, which need the package rosbags: install it: pip install"),
        (bag, 3, "needs the package rosbags, which is not installed: install it: pip install 'tandemscan[recordings]'"),
        (packed, 4, "a chunk is compressed with zstd: pip install zstandard"),
    ):
        ended = subprocess.run(
            [sys.executable, "-c", script, "sessions", "info", str(path)],
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        assert ended.returncode == code, ended.stderr
        [line] = ended.stderr.splitlines()
        assert words in line
