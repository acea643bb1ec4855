"""Bags of ROS 1 and folders of rosbag2, written by the library rosbags: in each storage and compression."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.recording.opened import open_recorded
from phone_host.cli import main
from phone_host.recording.both_sides import encoded
from phone_host.stereo.raw_images import decode_frame
from tests.support.foreign_recordings import HEIGHT, PERIOD_NS, WIDTH, ZERO_NS, picture

pytest.importorskip("rosbags", reason="the extra recordings is not installed")

from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_typestore

_TOPICS = ("/stereo/left/image_raw", "/stereo/right/image_raw")
_IMAGE, _STRING = "sensor_msgs/msg/Image", "std_msgs/msg/String"
_PAIRS = 3


def _image(store: Any, side: int, number: int, **more: int) -> Any:
    at_ns = ZERO_NS + number * PERIOD_NS
    stamp = store.types["builtin_interfaces/msg/Time"](sec=at_ns // 10**9, nanosec=at_ns % 10**9)
    return store.types[_IMAGE](
        header=store.types["std_msgs/msg/Header"](stamp=stamp, frame_id="cam", **more),
        height=HEIGHT,
        width=WIDTH,
        encoding="bgr8",
        is_bigendian=0,
        step=3 * WIDTH,
        data=picture(side, number).ravel(),
    )


def _ros2(path: Path, storage: rosbag2.StoragePlugin, mode: rosbag2.CompressionMode | None) -> None:
    store = get_typestore(Stores.ROS2_HUMBLE)
    writer = rosbag2.Writer(path, version=9, storage_plugin=storage)
    if mode is not None:
        writer.set_compression(mode, rosbag2.CompressionFormat.ZSTD)
    with writer:
        cameras = [writer.add_connection(topic, _IMAGE, typestore=store) for topic in _TOPICS]
        words = writer.add_connection("/words", _STRING, typestore=store)
        for number in range(_PAIRS):
            at_ns = ZERO_NS + number * PERIOD_NS
            for side, camera in enumerate(cameras):
                writer.write(camera, at_ns, store.serialize_cdr(_image(store, side, number), _IMAGE))
            writer.write(words, at_ns, store.serialize_cdr(store.types[_STRING](data="x"), _STRING))


def _ros1(path: Path, form: rosbag1.Writer.CompressionFormat | None) -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    writer = rosbag1.Writer(path)
    if form is not None:
        writer.set_compression(form)
    with writer:
        cameras = [writer.add_connection(topic, _IMAGE, typestore=store) for topic in _TOPICS]
        words = writer.add_connection("/words", _STRING, typestore=store)
        for number in range(_PAIRS):
            at_ns = ZERO_NS + number * PERIOD_NS
            for side, camera in enumerate(cameras):
                message = _image(store, side, number, seq=number)
                writer.write(camera, at_ns, bytes(store.serialize_ros1(message, _IMAGE)))
            writer.write(words, at_ns, bytes(store.serialize_ros1(store.types[_STRING](data="x"), _STRING)))


_SQLITE, _MCAP = rosbag2.StoragePlugin.SQLITE3, rosbag2.StoragePlugin.MCAP
_MESSAGE, _FILE = rosbag2.CompressionMode.MESSAGE, rosbag2.CompressionMode.FILE
BAGS: dict[str, Callable[[Path], None]] = {
    "rosbag2, sqlite3": lambda path: _ros2(path, _SQLITE, None),
    "rosbag2, sqlite3, messages zstd": lambda path: _ros2(path, _SQLITE, _MESSAGE),
    "rosbag2, sqlite3, file zstd": lambda path: _ros2(path, _SQLITE, _FILE),
    "rosbag2, mcap": lambda path: _ros2(path, _MCAP, None),
    "rosbag2, mcap, messages zstd": lambda path: _ros2(path, _MCAP, _MESSAGE),
    "rosbag2, mcap, file zstd": lambda path: _ros2(path, _MCAP, _FILE),
    "rosbag1": lambda path: _ros1(path, None),
    "rosbag1, lz4": lambda path: _ros1(path, rosbag1.Writer.CompressionFormat.LZ4),
    "rosbag1, bz2": lambda path: _ros1(path, rosbag1.Writer.CompressionFormat.BZ2),
}


@pytest.mark.parametrize("name", BAGS)
def test_bags_become_recordings(tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """`import` takes every picture with its pixels and stamp, and tells the topic that it does not use; `info` reads the bag itself."""
    bag, out = tmp_path / "a.bag", tmp_path / "out.mcap"
    BAGS[name](bag)
    for words in (["info", str(bag)], ["import", str(bag), "--out", str(out)]):
        assert main(["sessions", *words]) == 0
        assert "not used: /words (std_msgs/msg/String is no image)" in capsys.readouterr().out
    found = open_recorded(out)
    for side, topic in enumerate(("/left/image/compressed", "/right/image/compressed")):
        shown = found.images[topic]
        assert [each.image.stamp_ns for each in shown] == [ZERO_NS + n * PERIOD_NS for n in range(_PAIRS)]
        for number, each in enumerate(shown):
            pixels = decode_frame(encoded(each, found.camera(topic), "an image"))
            assert np.array_equal(pixels, picture(side, number))


@pytest.mark.parametrize("name", BAGS)
def test_damaged_bags_are_one_line(tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Cut in the middle: exit 4 and one line with the bag's name, or what is whole; never more than that."""
    bag, out = tmp_path / "a.bag", tmp_path / "out.mcap"
    BAGS[name](bag)
    for file in [path for path in bag.iterdir() if path.suffix != ".yaml"] if bag.is_dir() else [bag]:
        content = file.read_bytes()
        file.write_bytes(content[: len(content) // 2])
    code = main(["sessions", "import", str(bag), "--out", str(out)])
    printed = capsys.readouterr()
    if code:
        [line] = printed.err.splitlines()
        assert code == 4
        assert str(bag) in line
        assert not out.exists()
    else:
        assert "mcap" in name
