"""Bags of which a part is spoiled, or that become gigabytes: what is whole is read, what is lost is reported, and memory stays bounded."""

import bz2
import json
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from common.recording.inflate import inflate
from common.recording.mcap_records import Message
from common.recording.opened import open_recorded, stored_data
from common.recording.ros_messages import CAMERA_INFO, CameraInfo, camera_info_message
from common.recording.salvage import Salvage
from phone_host.cli import main
from tests.support import foreign_recordings as other
from tests.support.camera_infos import read_camera_info
from tests.support.foreign_bags import BAGS, PAIRS, ros1_with_more
from tests.support.foreign_recordings import COMPRESSED, Sent, picture
from tests.support.measured_command import run_measured

zstandard = pytest.importorskip("zstandard", reason="the extra recordings is not installed")

_INFO = CameraInfo(
    stamp_ns=other.ZERO_NS,
    frame_id="cam",
    size_px=(other.WIDTH, other.HEIGHT),
    model="plumb_bob",
    distortion=(0.1, 0.0, 0.0, 0.0, 0.0),
    matrix=(30.0, 0.0, 16.0, 0.0, 30.0, 12.0, 0.0, 0.0, 1.0),
    rotation=(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
    projection=(30.0, 0.0, 16.0, 0.0, 0.0, 30.0, 12.0, 0.0, 0.0, 0.0, 1.0, 0.0),
)
_MOST_BYTES = 500 << 20
"""What a command may take, whatever the bag is."""


def _sent() -> list[Sent]:
    images = other.stereo(
        lambda side, number, at_ns: other.compressed("jpeg", other.jpeg(picture(side, number)), at_ns), COMPRESSED
    )
    info = Sent("/left/camera_info", CAMERA_INFO, "cdr", other.ZERO_NS, camera_info_message(_INFO))
    return [info, *images]


def _mcap_bag(folder: Path, change: Callable[[bytes], bytes] = lambda data: data) -> Path:
    """A folder of rosbag2 with one MCAP part, in which each message is a chunk of its own."""
    bag = folder / "bag"
    bag.mkdir()
    (bag / "metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    sent = _sent()
    chunks = [other.records([each]) for each in sent]
    packed = [zstandard.ZstdCompressor().compress(each) for each in chunks]
    body = b"".join(other.chunk("zstd", part, len(each)) for part, each in zip(packed, chunks, strict=True))
    (bag / "bag_0.mcap").write_bytes(change(other.whole(body)))
    return bag


@pytest.mark.parametrize("words", [["repair"], ["cut", "--to", "10"]])
def test_copies_of_a_bag_keep_their_messages(tmp_path: Path, words: list[str]) -> None:
    """`repair` and `cut` of a bag write camera_info with its content."""
    out = tmp_path / "out.mcap"
    assert main(["sessions", words[0], str(_mcap_bag(tmp_path)), *words[1:], "--out", str(out)]) == 0
    contents = [message.data for message in _messages(out, "/left/camera_info")]
    assert [read_camera_info(data) for data in contents] == [_INFO]


def _messages(path: Path, topic: str) -> list[Message]:
    return [
        record
        for record in Salvage(stored_data(path), inflate).records()
        if isinstance(record, Message) and record.channel is not None and record.channel.topic == topic
    ]


_TASKS = ("info", "repair", "cut", "export", "import")


@pytest.mark.parametrize("task", _TASKS)
def test_damage_of_a_bags_part_is_reported(tmp_path: Path, task: str, capsys: pytest.CaptureFixture[str]) -> None:
    """A chunk of the part is spoiled: each task names the part and what is wrong in its text and in its JSON, and takes the rest."""

    def spoil(data: bytes) -> bytes:
        at = data.index(zstandard.FRAME_HEADER, len(data) // 2)
        return data[: at + 4] + bytes(4) + data[at + 8 :]

    words = ["sessions", task, str(_mcap_bag(tmp_path, spoil))]
    out = [] if task == "info" else ["--out", str(tmp_path / ("out" if task == "export" else "out.mcap"))]
    assert main([*words, *out]) == 0
    assert "(bag_0.mcap)" in capsys.readouterr().out
    out = [] if task == "info" else ["--out", str(tmp_path / ("out2" if task == "export" else "out2.mcap"))]
    assert main([*words, *out, "--json"]) == 0
    damages = json.loads(capsys.readouterr().out)["damages"]
    assert len(damages) == 1
    assert "bag_0.mcap" in json.dumps(damages)


def _spoil_message(bag: Path) -> None:
    with sqlite3.connect(next(bag.glob("*.db3"))) as base:
        number, data = base.execute("select id, data from messages order by id limit 1").fetchone()
        base.execute("update messages set data = ? where id = ?", (data[:12] + bytes(len(data) - 12), number))


def _cut_message(bag: Path) -> None:
    with sqlite3.connect(next(bag.glob("*.db3"))) as base:
        number, data = base.execute("select id, data from messages order by id limit 1").fetchone()
        base.execute("update messages set data = ? where id = ?", (data[: len(data) // 2], number))


def _grow_message(bag: Path) -> None:
    with sqlite3.connect(next(bag.glob("*.db3"))) as base:
        [number] = base.execute("select id from messages order by id limit 1").fetchone()
        base.execute("update messages set data = ? where id = ?", (_zeros(1 << 30), number))


def _zeros(size: int) -> bytes:
    """Zeros of a multiple of 16 MB, compressed with zstd."""
    packer = zstandard.ZstdCompressor(level=3).compressobj()
    packed: bytes = b"".join(packer.compress(bytes(16 << 20)) for _ in range(size >> 24)) + packer.flush()
    return packed


@pytest.mark.parametrize("spoil", [_spoil_message, _cut_message])
def test_a_spoiled_message_is_left_out(
    tmp_path: Path, spoil: Callable[[Path], None], capsys: pytest.CaptureFixture[str]
) -> None:
    """One message that cannot be decompressed or is cut is reported with its topic; the others are read."""
    bag, out = tmp_path / "bag", tmp_path / "out.mcap"
    BAGS["rosbag2, sqlite3, messages zstd"](bag)
    spoil(bag)
    assert main(["sessions", "import", str(bag), "--out", str(out)]) == 0
    assert "missing: 1 message of /stereo/left/image_raw cannot be decompressed (" in capsys.readouterr().out
    assert _image_counts(out) == (PAIRS - 1, PAIRS)


def _image_counts(path: Path) -> tuple[int, int]:
    found = open_recorded(path)
    left, right = (len(found.images[found.topic_of(side)]) for side in ("left", "right"))
    return left, right


@pytest.mark.parametrize("share", [0.3, 0.9])
def test_a_compressed_part_that_is_cut_gives_what_is_whole(
    tmp_path: Path, share: float, capsys: pytest.CaptureFixture[str]
) -> None:
    """`bag_0.mcap.zstd` that ends too early: the rest is read and the cut is reported, or one line with exit code 4 names it."""
    bag = _mcap_bag(tmp_path)
    plain = (bag / "bag_0.mcap").read_bytes()
    packed = zstandard.ZstdCompressor().compress(plain)
    (bag / "bag_0.mcap").unlink()
    (bag / "bag_0.mcap.zstd").write_bytes(packed[: round(share * len(packed))])
    code = main(["sessions", "info", str(bag)])
    printed = capsys.readouterr()
    assert code in {0, 4}
    assert "bag_0.mcap" in (printed.out if code == 0 else printed.err)
    assert len(printed.err.splitlines()) == (1 if code else 0)


def test_a_bag_may_have_the_name_of_a_copy(tmp_path: Path) -> None:
    """`bag.mcap.zstd` becomes `bag.mcap` without its compression: no other file of the program has that name."""
    bag = _mcap_bag(tmp_path)
    packed = tmp_path / "bag.mcap.zstd"
    packed.write_bytes(zstandard.ZstdCompressor().compress((bag / "bag_0.mcap").read_bytes()))
    assert main(["sessions", "info", str(packed)]) == 0


def test_a_part_that_is_there_twice_is_read_once(tmp_path: Path) -> None:
    """Whoever runs `unzstd` has the part with and without its compression: no image is taken twice."""
    bag, out = _mcap_bag(tmp_path), tmp_path / "out.mcap"
    part = bag / "bag_0.mcap"
    part.with_name("bag_0.mcap.zstd").write_bytes(zstandard.ZstdCompressor().compress(part.read_bytes()))
    assert main(["sessions", "import", str(bag), "--out", str(out)]) == 0
    assert _image_counts(out) == (4, 4)


def _ros1_bomb(folder: Path, more: bytes, *, is_hidden: bool = False) -> Path:
    bag = folder / "bag.bag"
    BAGS["rosbag1, bz2"](bag)
    return _file(folder / "bomb.bag", ros1_with_more(bag.read_bytes(), more, is_hidden=is_hidden))


def _computing_bag(folder: Path) -> Path:
    """A database that gives 300 MB for each message and holds none of them."""
    bag = folder / "bag"
    BAGS["rosbag2, sqlite3"](bag)
    (part,) = bag.glob("*.db3")
    with closing(sqlite3.connect(part)) as database, database:
        database.execute("ALTER TABLE messages RENAME TO held")
        computed = "data BLOB GENERATED ALWAYS AS (zeroblob(300000000)) VIRTUAL"
        database.execute(
            f"CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, {computed})"
        )
        database.execute("INSERT INTO messages(id, topic_id, timestamp) SELECT id, topic_id, timestamp FROM held")
    return bag


def _bag_that_grows(folder: Path) -> Path:
    bag = folder / "bag"
    BAGS["rosbag2, sqlite3, messages zstd"](bag)
    _grow_message(bag)
    return bag


def _file(path: Path, content: bytes) -> Path:
    path.write_bytes(content)
    return path


BOMBS: dict[str, tuple[Callable[[Path], Path], str]] = {
    "rosbag2, a file of zstd becomes 1 GB": (
        lambda folder: _file(folder / "bag.db3.zstd", _zeros(1 << 30)),
        "becomes larger than is believed: undo",
    ),
    "ROS 1, a chunk of 40 streams of bz2 becomes 1.9 GB": (
        lambda folder: _ros1_bomb(folder, bz2.compress(bytes(48 << 20)) * 40),
        "becomes larger than is believed: undo",
    ),
    "ROS 1, a chunk that only the index leads to becomes 1.9 GB": (
        lambda folder: _ros1_bomb(folder, bz2.compress(bytes(48 << 20)) * 40, is_hidden=True),
        "becomes larger than is believed: undo",
    ),
    "ROS 1, a chunk of 50 000 empty streams": (
        lambda folder: _ros1_bomb(folder, bz2.compress(b"") * 50_000),
        "becomes larger than is believed: undo",
    ),
    "rosbag2, a table that computes 300 MB a message": (_computing_bag, "computes what is in its table messages"),
    "rosbag2, a message of zstd becomes 1 GB": (
        _bag_that_grows,
        "1 message of /stereo/left/image_raw cannot be decompressed (it becomes larger than is believed",
    ),
}


@pytest.mark.parametrize("name", BOMBS)
def test_bags_take_no_more_memory_than_they_may(tmp_path: Path, name: str) -> None:
    """A small bag that becomes gigabytes ends in one line and exit code 4, or its message is left out, in bounded memory."""
    make, words = BOMBS[name]
    path = make(tmp_path)
    assert sum(each.stat().st_size for each in (path.iterdir() if path.is_dir() else [path])) < 1 << 20
    code, printed, errors, peak = run_measured("sessions", "info", str(path))
    assert (code, len(errors)) in {(4, 1), (0, 0)}
    assert words in " ".join([printed, *errors])
    assert peak < _MOST_BYTES
