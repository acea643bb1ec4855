"""Small bags of ROS 1 and folders of rosbag2, written by the library rosbags: in each storage and compression."""

import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support.foreign_recordings import HEIGHT, PERIOD_NS, WIDTH, ZERO_NS, picture

pytest.importorskip("rosbags", reason="the extra recordings is not installed")

from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_typestore

_TOPICS = ("/stereo/left/image_raw", "/stereo/right/image_raw")
_IMAGE, _STRING = "sensor_msgs/msg/Image", "std_msgs/msg/String"
PAIRS = 3


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
        for number in range(PAIRS):
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
        for number in range(PAIRS):
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


def ros1_with_more(bag: bytes, more: bytes, *, is_hidden: bool = False) -> bytes:
    """Put bytes behind those of the only chunk of a ROS 1 bag; a hidden chunk lies in a record of another kind, where only its index leads to it.

    Source: ROS Bag Format Version 2.0.
    """
    out, chunk_at, index_at = b"#ROSBAG V2.0\n", 0, 0
    records = list(_ros1_records(bag))
    for fields, data in records:
        match fields[b"op"]:
            case b"\x05":
                chunk = _ros1_record(fields, data + more)
                if is_hidden:
                    head = _ros1_record({b"op": b"\x04"}, b"")[:-4]
                    out += head + struct.pack("<I", len(chunk))
                chunk_at = len(out)
                out += chunk
            case b"\x06":
                out += _ros1_record(fields | {b"chunk_pos": struct.pack("<Q", chunk_at)}, data)
            case op:
                index_at = index_at or (len(out) if op == b"\x07" else 0)
                out += _ros1_record(fields, data)
    fields, data = records[0]
    head = _ros1_record(fields | {b"index_pos": struct.pack("<Q", index_at)}, data)
    return out[:13] + head + out[13 + len(head) :]


def _ros1_record(fields: dict[bytes, bytes], data: bytes) -> bytes:
    each = [name + b"=" + value for name, value in fields.items()]
    head = b"".join(struct.pack("<I", len(one)) + one for one in each)
    return struct.pack("<I", len(head)) + head + struct.pack("<I", len(data)) + data


def _ros1_records(bag: bytes) -> Iterator[tuple[dict[bytes, bytes], bytes]]:
    at = 13
    while at < len(bag):
        (size,) = struct.unpack_from("<I", bag, at)
        head, at = bag[at + 4 : at + 4 + size], at + 4 + size
        (size,) = struct.unpack_from("<I", bag, at)
        data, at = bag[at + 4 : at + 4 + size], at + 4 + size
        fields, place = dict[bytes, bytes](), 0
        while place < len(head):
            (size,) = struct.unpack_from("<I", head, place)
            name, _, value = head[place + 4 : place + 4 + size].partition(b"=")
            fields[name] = value
            place += 4 + size
        yield fields, data
