"""Recordings made to do harm: bombs, false heads, endless numbers, names that lead elsewhere. Each ends in one line, or is read without harm."""

import json
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest

from common.camera.factory import open_camera
from common.ledger import ledger_of
from common.recording.inflate import inflate
from common.recording.layout import ABOUT, CAPTURE, CLOCK, DELAYS, About, image_topic
from common.recording.opened import open_recorded
from common.recording.recording_file import RecordingFile, written
from common.recording.salvage import MOST_TRIED, Salvage
from common.strict_json import strict_json
from phone_host.cli import main
from phone_host.recording.clock_messages import told_clocks
from phone_host.recording.playback import open_playback
from tests.support import foreign_recordings as other
from tests.support.foreign_recordings import COMPRESSED, PERIOD_NS, ZERO_NS, Sent, picture
from tests.support.measured_command import run_measured

_MOST_MORE_BYTES = 250 << 20
"""What reading any small file may take beyond reading a sound one: a chunk that is believed, and its copies."""


def _run(*words: str) -> tuple[int, list[str], int]:
    """Exit code, lines of errors, and the greatest memory, bytes, of `phone-host` with these words."""
    code, _, errors, peak = run_measured(*words)
    return code, errors, peak


def _sound(folder: Path) -> Path:
    sent = other.stereo(
        lambda side, number, at_ns: other.compressed("jpeg", other.jpeg(picture(side, number)), at_ns), COMPRESSED
    )
    return other.file_of(folder, sent, "sound.mcap")


def _zstd_bomb(claim: int, size: int) -> bytes:
    zstandard = pytest.importorskip("zstandard", reason="the extra recordings is not installed")
    packer = zstandard.ZstdCompressor(level=3).compressobj()
    packed = b"".join(packer.compress(bytes(16 << 20)) for _ in range(size >> 24)) + packer.flush()
    return other.chunk("zstd", packed, claim)


def _lz4_bomb(claim: int, size: int) -> bytes:
    frame = pytest.importorskip("lz4.frame", reason="the extra recordings is not installed")
    packer = frame.LZ4FrameCompressor()
    packed = packer.begin() + b"".join(packer.compress(bytes(16 << 20)) for _ in range(size >> 24)) + packer.flush()
    return other.chunk("lz4", packed, claim)


BOMBS: dict[str, Callable[[], bytes]] = {
    "zstd, 1 GB as it claims": lambda: _zstd_bomb(1 << 30, 1 << 30),
    "zstd, 1 GB and claims 1 MB": lambda: _zstd_bomb(1 << 20, 1 << 30),
    "lz4, 384 MB and claims 1 MB": lambda: _lz4_bomb(1 << 20, 384 << 20),
    "zstd, many chunks of 112 MB": lambda: _zstd_bomb(112 << 20, 112 << 20) * 30,
}


@pytest.fixture(scope="module")
def usual_bytes(tmp_path_factory: pytest.TempPathFactory) -> int:
    """What reading a sound file takes."""
    return _run("sessions", "info", str(_sound(tmp_path_factory.mktemp("sound"))))[2]


@pytest.mark.parametrize("name", BOMBS)
def test_compressed_files_take_no_more_memory_than_they_may(tmp_path: Path, name: str, usual_bytes: int) -> None:
    """A small file that becomes gigabytes ends in one line, and takes a bounded amount on the way."""
    path = tmp_path / "bomb.mcap"
    path.write_bytes(other.whole(BOMBS[name]()))
    assert path.stat().st_size < 2 << 20
    code, lines, peak = _run("sessions", "repair", str(path), "--out", str(tmp_path / "out.mcap"))
    assert (code, len(lines)) == (4, 1)
    assert "Traceback" not in lines[0]
    assert peak < usual_bytes + _MOST_MORE_BYTES


def test_images_of_compressed_chunks_are_not_all_held(tmp_path: Path, usual_bytes: int) -> None:
    """A recording whose six chunks become 60 MB each is looked at with the memory of a few of them."""
    zstandard = pytest.importorskip("zstandard", reason="the extra recordings is not installed")
    body = b""
    for number in range(6):
        at_ns = ZERO_NS + number * PERIOD_NS
        images = [other.jpeg(picture(side, number)) + bytes(30 << 20) for side in (0, 1)]
        sent = [
            Sent(topic, COMPRESSED, "cdr", at_ns, other.compressed("jpeg", image, at_ns))
            for topic, image in zip(other.TOPICS, images, strict=True)
        ]
        plain = other.records(sent)
        body += other.chunk("zstd", zstandard.ZstdCompressor(level=1).compress(plain), len(plain))
    path = tmp_path / "large.mcap"
    path.write_bytes(other.whole(body) + bytes(6 << 20))
    code, lines, peak = _run("sessions", "info", str(path))
    assert (code, lines) == (0, [])
    assert peak < usual_bytes + _MOST_MORE_BYTES


def _nested(opcode: int, size: int) -> bytes:
    """False heads one in the other, each with the length that ends with the file, and a checksum that is wrong."""
    if opcode == 0x06:
        inner = struct.pack("<QQQI", 0, 0, 0, 1) + other.text("") + struct.pack("<Q", 0)
    elif opcode == 0x09:
        inner = struct.pack("<QQ", 0, 0) + other.text("x") + other.text("") + struct.pack("<Q", 0)
    else:
        inner = other.text("x") + struct.pack("<I", 0)
    each = struct.calcsize("<BQ") + len(inner)
    heads = []
    for number in range(size // each):
        left = size - number * each - struct.calcsize("<BQ")
        behind = left - len(inner)
        if opcode == 0x06:
            told = struct.pack("<QQQI", 0, 0, behind, 1) + other.text("") + struct.pack("<Q", behind)
        elif opcode == 0x09:
            told = struct.pack("<QQ", 0, 0) + other.text("x") + other.text("") + struct.pack("<Q", behind - 4)
        else:
            told = other.text("x") + struct.pack("<I", behind)
        heads.append(struct.pack("<BQ", opcode, left) + told)
    return b"".join(heads).ljust(size, b"\1")


@pytest.mark.parametrize("opcode", [0x06, 0x09, 0x0C])
def test_false_heads_cost_a_few_times_the_file(opcode: int) -> None:
    """Of heads nested one in the other, whatever their number: what is looked at grows with the file's length, not with its square."""
    data = other.MAGIC + _nested(opcode, 2 << 20)
    salvage = Salvage(memoryview(data), inflate)
    assert len(list(salvage.records())) < len(data) // 16
    assert salvage.tried_bytes <= (MOST_TRIED + 1) * len(data) + (16 << 20)


def test_what_is_whole_behind_false_heads_is_read(tmp_path: Path) -> None:
    """A few false heads before sound records hide none of them."""
    sent = [
        Sent(
            other.TOPICS[0],
            COMPRESSED,
            "cdr",
            ZERO_NS + n,
            other.compressed("jpeg", other.jpeg(picture(0, n)), ZERO_NS + n * PERIOD_NS),
        )
        for n in range(3)
    ]
    plain = other.records(sent)
    content = (
        struct.pack("<QQQI", 0, 0, len(plain), zlib.crc32(plain))
        + other.text("")
        + struct.pack("<Q", len(plain))
        + plain
    )
    path = tmp_path / "behind.mcap"
    path.write_bytes(other.whole(_nested(0x06, 2000) + other.record(6, content)))
    assert len(open_recorded(path).images[other.TOPICS[0]]) == 3


HOSTILE_JSON = {
    "Infinity": '{"queued_ns": Infinity, "offset_ns": Infinity, "session": "s"}',
    "1e999": '{"queued_ns": 1e999, "offset_ns": 1e999}',
    "NaN": "[[NaN, [1]], [0, [NaN]]]",
    "nested deep": "[" * 200_000,
    "a huge number": '{"queued_ns": ' + "9" * 4000 + "}",
    "a huge run": f"[[0, [{10**300}, 5]], [{10**30}, [1]]]",
    "other kinds": '[[{}, "x"], null]',
    "no object": "[]",
}


def _ours(folder: Path, texts: dict[str, str], attached: dict[str, bytes] | None = None) -> Path:
    """A recording of ours with these JSON messages and attachments."""
    path = folder / "ours.mcap"
    with written(path) as file:
        file.tell(ABOUT, About().values())
        for name, data in (attached or {}).items():
            file.attach(name, "text/plain", data, 0)
        for topic, content in texts.items():
            file.add(topic, content.encode(), sequence=0, log_ns=ZERO_NS, publish_ns=ZERO_NS)
        _add_pairs(file)
    return path


def _add_pairs(file: RecordingFile) -> None:
    for number in range(3):
        for side, name in enumerate(("left", "right")):
            at_ns = ZERO_NS + number * PERIOD_NS
            data = other.compressed("jpeg", other.jpeg(picture(side, number)), at_ns)
            file.add(image_topic(name, COMPRESSED), data, sequence=number, log_ns=at_ns, publish_ns=at_ns)


@pytest.mark.parametrize("name", HOSTILE_JSON)
def test_hostile_json_is_left_out(tmp_path: Path, name: str) -> None:
    """In delays, clock estimates, capture times and settings: the recording is read as without it."""
    content = HOSTILE_JSON[name]
    path = _ours(tmp_path, {DELAYS: content, CLOCK: content, CAPTURE: content}, {"settings.json": content.encode()})
    playback = open_playback(str(path))
    assert (playback.ledgers(), told_clocks(playback.recorded)) == ([], [])
    assert all(0 <= shown.grabbed_ns - shown.image.stamp_ns < 10**9 for shown, _ in playback.frames)
    assert main(["sessions", "info", str(path)]) == 0
    camera = open_camera(f"replay:{path}?topic=/left/image/compressed&pace=clock", "here", 0)
    assert len(camera.read(10**9)) == 3
    with pytest.raises(ValueError, match=r"."):
        ledger_of(content)
    assert strict_json(json.dumps({"a": [1, 2.5, None]})) == {"a": [1, 2.5, None]}


def test_attachments_stay_in_their_folder(tmp_path: Path) -> None:
    """Names with NUL, `..`, a path, or too many bytes are not written by export; the pictures and sound names are."""
    names = ["a\0b", "..", ".", "../up", "/etc/x", "left", "x\ny", "\N{OK HAND SIGN}" * 64, "a\\b", "rig.yaml"]
    path = _ours(tmp_path, {}, dict.fromkeys(names, b"content"))
    assert main(["sessions", "export", str(path), "--out", str(tmp_path / "out")]) == 0
    assert sorted(each.name for each in (tmp_path / "out").iterdir()) == ["left", "rig.yaml", "right"]
    assert not (tmp_path / "up").exists()
    assert len(list((tmp_path / "out" / "left").glob("*.jpg"))) == 3


def _many_topics(folder: Path) -> Path:
    """One channel number after the other is given 66 000 names; each has one image."""
    data = other.compressed("jpeg", other.jpeg(picture(0, 0)), ZERO_NS)
    parts = [
        other.record(3, struct.pack("<H", 1) + other.text(COMPRESSED) + other.text("ros2msg") + struct.pack("<I", 0))
    ]
    message = other.record(5, struct.pack("<HIQQ", 1, 0, ZERO_NS, ZERO_NS) + data)
    for number in range(66_000):
        channel = struct.pack("<HH", 1, 1) + other.text(f"/t{number}") + other.text("cdr") + struct.pack("<I", 0)
        parts += [other.record(4, channel), message]
    path = folder / "many.mcap"
    path.write_bytes(other.whole(b"".join(parts)))
    return path


def test_more_topics_than_a_file_can_have_are_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`repair` refuses them; `board-agent run` on such a replay names a few topics, exit 4, and ends."""
    path, out = _many_topics(tmp_path), tmp_path / "out.mcap"
    assert main(["sessions", "repair", str(path), "--out", str(out)]) == 4
    [line] = capsys.readouterr().err.splitlines()
    assert "more than 65535 topics" in line
    assert not out.exists()
    words = ["run", "--camera", f"replay:{path}", "--link", f"ipc://{tmp_path}/link"]
    ended = subprocess.run(
        [sys.executable, "-m", "board_agent.start", *words], capture_output=True, text=True, timeout=60, check=False
    )
    assert ended.returncode == 4
    assert len(ended.stderr.splitlines()[-1]) < 1000
    assert "Traceback" not in ended.stderr
