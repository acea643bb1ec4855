"""The ROS 2 messages of a recording: images as they were encoded, what is known of the cameras, and what was computed. Pure.

Their bytes are those that ROS 2 itself writes, so that its tools, Foxglove and Rerun read them.
Source: common_interfaces, sensor_msgs/msg/CompressedImage, Image, CameraInfo, PointCloud2 and PointField; std_msgs/msg/Header; builtin_interfaces/msg/Time.
"""

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

from common.frame import Buffer, PixelFormat
from common.recording.cdr import HEADER, CdrReader, CdrWriter
from common.recording.image_layouts import RawForm, RawLayout, compressed_format, frame_bytes, raw_layout

NS: Final = 1_000_000_000
_MOST_SECONDS: Final = 2**31 - 1

_LINE: Final = "=" * 80
_HEADER: Final = f"""
{_LINE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_LINE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
COMPRESSED_IMAGE: Final = "sensor_msgs/msg/CompressedImage"
IMAGE: Final = "sensor_msgs/msg/Image"
CAMERA_INFO: Final = "sensor_msgs/msg/CameraInfo"
POINT_CLOUD: Final = "sensor_msgs/msg/PointCloud2"

SCHEMAS: Final[dict[str, str]] = {
    COMPRESSED_IMAGE: f"std_msgs/Header header\nstring format\nuint8[] data{_HEADER}",
    IMAGE: "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data"
    + _HEADER,
    CAMERA_INFO: "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\n"
    f"float64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi{_HEADER}{_LINE}\n"
    "MSG: sensor_msgs/RegionOfInterest\nuint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n",
    POINT_CLOUD: "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\nbool is_bigendian\n"
    f"uint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense{_HEADER}{_LINE}\n"
    "MSG: sensor_msgs/PointField\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n",
}
"""The definition of each message with all that it holds, as `ros2msg` writes them."""

_STAMP: Final = struct.Struct("<iI")
_COUNT: Final = struct.Struct("<I")
_COMPRESSED: Final = {PixelFormat.MJPEG: "jpeg", PixelFormat.PNG: "png"}
_RAW: Final = {PixelFormat.GREY: ("mono8", 1), PixelFormat.YUYV: ("yuv422_yuy2", 2), PixelFormat.NV12: ("nv12", 1)}
_FLOAT32: Final = 7  # PointField's number for it
_FIELDS: Final = ("x", "y", "z", "rgb")
POINT_BYTES: Final = 4 * len(_FIELDS)
"""A point of a cloud: x, y, z, m, and its colour 0x00RRGGBB in the place of a number, as ROS has it."""


class StoredBytes:
    """Bytes that are made anew whenever somebody wants them, so that nobody holds those of a whole file.

    Args:
        read: makes them.
        size: how many stand in the file.
    """

    __slots__ = ("_read", "_size")

    def __init__(self, read: Callable[[], Buffer], size: int) -> None:
        self._read, self._size = read, size

    def __len__(self) -> int:
        return self._size

    def read(self) -> Buffer:
        """Make them."""
        return self._read()


@dataclass(frozen=True, slots=True, eq=False)
class RecordedImage:
    """An image of a recording.

    Attributes:
        stamp_ns: exposure mid-point, ns since 1970.
        frame_id: whose image it is: left or right.
        pixel_format: its encoding.
        size_px: width and height; (0, 0): the image itself says it.
        content: the image as its camera gave it, or what makes it.
    """

    stamp_ns: int
    frame_id: str
    pixel_format: PixelFormat
    size_px: tuple[int, int]
    content: Buffer | StoredBytes

    @property
    def payload(self) -> Buffer:
        """The image as its camera gave it. Where it is made from other bytes, each look makes it anew: see `loaded`."""
        return self.content.read() if isinstance(self.content, StoredBytes) else self.content

    def loaded(self) -> "RecordedImage":
        """Return the same image with its bytes in memory."""
        return replace(self, content=self.payload) if isinstance(self.content, StoredBytes) else self


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraInfo:
    """What is known of one camera of a rectified pair.

    Attributes:
        stamp_ns: ns since 1970.
        frame_id: left or right.
        size_px: width and height of its images.
        model: plumb_bob, rational_polynomial or equidistant.
        distortion: its coefficients, as ROS orders them.
        matrix: K, 3 x 3 in rows, px.
        rotation: R into the rectified frame, 3 x 3 in rows.
        projection: P of the rectified images, 3 x 4 in rows, px; the right one's P[3] is -f·b.
    """

    stamp_ns: int
    frame_id: str
    size_px: tuple[int, int]
    model: str
    distortion: Sequence[float]
    matrix: Sequence[float]
    rotation: Sequence[float]
    projection: Sequence[float]


def image_type(pixel_format: PixelFormat) -> str:
    """Return the name of the message that holds images of this encoding."""
    return COMPRESSED_IMAGE if pixel_format in _COMPRESSED else IMAGE


def image_message(image: RecordedImage) -> bytes:
    """Write an image."""
    return b"".join(image_parts(image))


def image_parts(image: RecordedImage) -> tuple[bytes, Buffer]:
    """Write an image in two pieces, the second of which is its own bytes: copies of them would cost more than all else."""
    head = bytearray(_image_head(image.frame_id, image.pixel_format, image.size_px))
    _STAMP.pack_into(head, len(HEADER), *_stamp(image.stamp_ns))
    _COUNT.pack_into(head, len(head) - _COUNT.size, len(image.payload))
    return bytes(head), image.payload


@lru_cache(maxsize=16)
def _image_head(frame_id: str, pixel_format: PixelFormat, size_px: tuple[int, int]) -> bytes:
    """Return what stands before the bytes of an image, its stamp and their count 0: but for those it is the same for all images of a camera."""
    writer = CdrWriter()
    _write_header(writer, 0, frame_id)
    if pixel_format in _COMPRESSED:
        writer.text(_COMPRESSED[pixel_format])
    else:
        _write_raw(writer, size_px, *_RAW[pixel_format])
    writer.number("I", 0)
    return writer.done()


def depth_parts(stamp_ns: int, frame_id: str, size_px: tuple[int, int], data: Buffer) -> tuple[Buffer, ...]:
    """Write a picture of depths, in two pieces (ROS Enhancement Proposal 118).

    Args:
        stamp_ns: when it was exposed, ns since 1970.
        frame_id: whose picture it is.
        size_px: width and height.
        data: the depths in rows, uint16, little endian, mm; 0: none.
    """
    writer = CdrWriter()
    _write_header(writer, stamp_ns, frame_id)
    _write_raw(writer, size_px, "16UC1", 2)
    writer.number("I", len(data))
    return writer.done(), data


def cloud_parts(stamp_ns: int, frame_id: str, data: Buffer) -> tuple[Buffer, ...]:
    """Write a point cloud, in three pieces.

    Args:
        stamp_ns: when it was exposed, ns since 1970.
        frame_id: whose coordinates they are: x right, y down, z forward.
        data: the points, `POINT_BYTES` each, little endian.
    """
    count = len(data) // POINT_BYTES
    writer = CdrWriter()
    _write_header(writer, stamp_ns, frame_id)
    writer.number("I", 1)
    writer.number("I", count)
    writer.number("I", len(_FIELDS))
    for place, name in enumerate(_FIELDS):
        writer.text(name)
        writer.number("I", 4 * place)
        writer.number("B", _FLOAT32)
        writer.number("I", 1)
    writer.number("B", 0)
    writer.number("I", POINT_BYTES)
    writer.number("I", POINT_BYTES * count)
    writer.number("I", len(data))
    return writer.done(), data, b"\1"  # every point is one


def read_image(kind: str, data: "bytes | memoryview") -> RecordedImage:
    """Read an image.

    Args:
        kind: name of its message, COMPRESSED_IMAGE or IMAGE.
        data: the message.

    Raises:
        UnreadableEncodingError: its encoding is none that is read.
        BrokenMessageError: it is no image.
    """
    reader = CdrReader(data)
    stamp_ns, frame_id = _read_header(reader)
    if kind == COMPRESSED_IMAGE:
        label = reader.text()
        return compressed_image(stamp_ns, frame_id, label, reader.data())
    height, width = int(reader.number("I")), int(reader.number("I"))
    label, is_big_endian = reader.text(), bool(reader.number("B"))
    step_bytes = int(reader.number("I"))
    form = RawForm(label, (width, height), step_bytes, is_big_endian)
    return raw_image(stamp_ns, frame_id, form, reader.data())


def compressed_image(stamp_ns: int, frame_id: str, label: str, data: Buffer) -> RecordedImage:
    """Return an image that a message holds encoded.

    Args:
        stamp_ns: its stamp, ns since 1970.
        frame_id: whose image it is.
        label: the encoding, as the message says.
        data: the image.

    Raises:
        UnreadableEncodingError: its encoding is none that is read.
    """
    return RecordedImage(stamp_ns, frame_id, compressed_format(data, label), (0, 0), data)


def raw_image(stamp_ns: int, frame_id: str, form: RawForm, data: Buffer) -> RecordedImage:
    """Return an image that a message holds as pixels.

    Args:
        stamp_ns: its stamp, ns since 1970.
        frame_id: whose image it is.
        form: what its message says of its bytes.
        data: the pixels.

    Raises:
        UnreadableEncodingError: its encoding is none that is read.
        BrokenMessageError: it is shorter than its size says.
    """
    layout = raw_layout(form, data)
    if not isinstance(layout, RawLayout):
        return RecordedImage(stamp_ns, frame_id, layout, (0, 0), data)
    content = (
        frame_bytes(layout, data) if layout.is_packed else StoredBytes(lambda: frame_bytes(layout, data), len(data))
    )
    return RecordedImage(stamp_ns, frame_id, layout.encoding.pixel_format, form.size_px, content)


def camera_info_message(info: CameraInfo) -> bytes:
    """Write what is known of a camera."""
    writer = CdrWriter()
    _write_header(writer, info.stamp_ns, info.frame_id)
    width, height = info.size_px
    writer.number("I", height)
    writer.number("I", width)
    writer.text(info.model)
    writer.doubles(info.distortion, counted=True)
    for values in (info.matrix, info.rotation, info.projection):
        writer.doubles(values, counted=False)
    for _ in range(6):  # binning, and a region of interest that is the whole image
        writer.number("I", 0)
    writer.number("B", 0)
    return writer.done()


def _write_raw(writer: CdrWriter, size_px: tuple[int, int], encoding: str, bytes_per_column: int) -> None:
    """Write what stands between the header and the data of an image that is not encoded."""
    width, height = size_px
    writer.number("I", height)
    writer.number("I", width)
    writer.text(encoding)
    writer.number("B", 0)
    writer.number("I", width * bytes_per_column)


def _write_header(writer: CdrWriter, stamp_ns: int, frame_id: str) -> None:
    seconds, rest = _stamp(stamp_ns)
    writer.number("i", seconds)
    writer.number("I", rest)
    writer.text(frame_id)


def _stamp(stamp_ns: int) -> tuple[int, int]:
    """Return the seconds and nanoseconds of a stamp."""
    seconds, rest = divmod(stamp_ns, NS)
    return min(seconds, _MOST_SECONDS), rest


def _read_header(reader: CdrReader) -> tuple[int, str]:
    seconds, rest = int(reader.number("i")), int(reader.number("I"))
    return seconds * NS + rest, reader.text()
