"""Small recordings as other programs write them, byte by byte: MCAP files with any message, label, stamp, and compression."""

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
MAGIC = b"\x89MCAP0\r\n"
COMPRESSED = "sensor_msgs/msg/CompressedImage"
RAW = "sensor_msgs/msg/Image"
TOPICS = ("/cam0/image", "/cam1/image")
ZERO_NS = 1_700_000_000_000_000_000
PERIOD_NS = 100_000_000
LATE_NS = 5_000_000
"""Each message is received this much after its stamp."""

WIDTH, HEIGHT = 32, 24


@dataclass(frozen=True, slots=True)
class Sent:
    """A message: topic, kind, its own encoding, when it was received, ns, and its bytes."""

    topic: str
    kind: str
    encoding: str
    log_ns: int
    data: bytes


def picture(side: int, number: int) -> Image:
    """The picture of a camera, (24, 32, 3) BGR: smooth, so that JPEG and YUV change it little."""
    v, u = np.mgrid[0:HEIGHT, 0:WIDTH]
    channels = [60 + 4 * u + 2 * number, 80 + 5 * v + side * 20, 200 - 3 * u - v]
    return np.stack(channels, axis=2).astype(np.uint8)


def grey(side: int, number: int) -> Image:
    """The same, (24, 32) grey."""
    return np.asarray(cv2.cvtColor(picture(side, number), cv2.COLOR_BGR2GRAY), np.uint8)


def text(value: str) -> bytes:
    """A text of MCAP or ROS 1."""
    data = value.encode()
    return struct.pack("<I", len(data)) + data


def record(opcode: int, content: bytes) -> bytes:
    """A record of MCAP."""
    return struct.pack("<BQ", opcode, len(content)) + content


def compressed(label: str, data: bytes, stamp_ns: int, order: str = "<") -> bytes:
    """A CompressedImage in CDR of either order."""
    body = _header(stamp_ns, order)
    body = _text(body, label, order)
    body = _aligned(body, 4) + struct.pack(f"{order}I", len(data)) + data
    return (b"\0\1\0\0" if order == "<" else b"\0\0\0\0") + body


def raw(label: str, data: bytes, stamp_ns: int, step: int, big_endian: int = 0) -> bytes:
    """An Image in CDR, 32x24."""
    body = _aligned(_header(stamp_ns, "<"), 4) + struct.pack("<II", HEIGHT, WIDTH)
    body = _text(body, label, "<") + bytes([big_endian])
    body = _aligned(body, 4) + struct.pack("<II", step, len(data)) + data
    return b"\0\1\0\0" + body


def ros1(label: str, data: bytes, stamp_ns: int) -> bytes:
    """A CompressedImage of ROS 1."""
    head = struct.pack("<III", 0, *divmod(stamp_ns, 10**9)) + text("cam")
    return head + text(label) + struct.pack("<I", len(data)) + data


def padded(rows: Image, step: int) -> bytes:
    """Rows with 7s behind each."""
    flat = rows.reshape(len(rows), -1)
    out = np.full((len(flat), step), 7, np.uint8)
    out[:, : flat.shape[1]] = flat
    return out.tobytes()


def records(messages: Sequence[Sent]) -> bytes:
    """Schemas, channels and messages, as they stand in a chunk or outside."""
    channels = list(dict.fromkeys((sent.topic, sent.kind, sent.encoding) for sent in messages))
    found = b""
    for number, (topic, kind, encoding) in enumerate(channels, 1):
        form = text(f"{encoding}msg") + struct.pack("<I", 0)
        found += record(3, struct.pack("<H", number) + text(kind) + form)
        found += record(4, struct.pack("<HH", number, number) + text(topic) + text(encoding) + struct.pack("<I", 0))
    for count, sent in enumerate(messages):
        number = channels.index((sent.topic, sent.kind, sent.encoding)) + 1
        found += record(5, struct.pack("<HIQQ", number, count, sent.log_ns, sent.log_ns) + sent.data)
    return found


def chunk(compression: str, packed: bytes, size: int) -> bytes:
    """A chunk without a checksum."""
    return record(6, struct.pack("<QQQI", 0, 0, size, 0) + text(compression) + struct.pack("<Q", len(packed)) + packed)


def whole(body: bytes) -> bytes:
    """A file with this between its head and its end."""
    end = record(15, struct.pack("<I", 0)) + record(2, struct.pack("<QQI", 0, 0, 0))
    return MAGIC + record(1, text("ros2") + text("another program")) + body + end + MAGIC


def stereo(
    message: Callable[[int, int, int], bytes],
    kind: str,
    count: int = 4,
    *,
    encoding: str = "cdr",
    log: Callable[[int], int] = lambda number: ZERO_NS + number * PERIOD_NS + LATE_NS,
) -> list[Sent]:
    """The messages of two cameras.

    Args:
        message: makes one of side, number and stamp.
        kind: of the message.
        count: of pairs.
        encoding: of the messages.
        log: when a number was received.
    """
    return [
        Sent(TOPICS[side], kind, encoding, log(number), message(side, number, ZERO_NS + number * PERIOD_NS))
        for number in range(count)
        for side in (0, 1)
    ]


def stamped(stamp: Callable[[int], int], log: Callable[[int], int]) -> list[Sent]:
    """Two cameras whose stamps and times of receipt are given by number."""
    return stereo(
        lambda side, number, _: compressed("jpeg", jpeg(picture(side, number)), stamp(number)), COMPRESSED, log=log
    )


def jpeg(image: Image) -> bytes:
    """As JPEG."""
    return cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 98])[1].tobytes()


def png(image: NDArray[np.uint8] | NDArray[np.uint16]) -> bytes:
    """As PNG."""
    return cv2.imencode(".png", image)[1].tobytes()


def file_of(folder: Path, messages: Sequence[Sent], name: str = "other.mcap") -> Path:
    """A file with these messages, not compressed."""
    path = folder / name
    path.write_bytes(whole(records(messages)))
    return path


def _header(stamp_ns: int, order: str) -> bytes:
    return _text(struct.pack(f"{order}iI", *divmod(stamp_ns, 10**9)), "cam", order)


def _text(body: bytes, value: str, order: str) -> bytes:
    data = value.encode() + b"\0"
    return _aligned(body, 4) + struct.pack(f"{order}I", len(data)) + data


def _aligned(body: bytes, size: int) -> bytes:
    return body + b"\0" * (-len(body) % size)
