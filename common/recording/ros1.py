"""Reads images in messages of ROS 1, with the library rosbags: an extra, imported when the first such message comes.

The library needs numpy, which the board does not have: there these messages are told as not readable.
"""

from functools import lru_cache
from typing import Any, Final

from common.recording.cdr import BrokenMessageError
from common.recording.image_layouts import RawForm
from common.recording.ros_messages import COMPRESSED_IMAGE, NS, RecordedImage, compressed_image, raw_image

ROS1: Final = "ros1"
"""Encoding of such messages in an MCAP file."""

ROS1_REASON: Final = "ROS 1 messages, which need the package rosbags"
EXTRA: Final = "pip install 'tandemscan[recordings]'"


class NoRos1Error(Exception):
    """Raised for a message of ROS 1 where the library rosbags is not installed. Nobody's fault: it is an extra."""


@lru_cache(maxsize=1)
def _deserialize() -> Any:  # noqa: ANN401 - rosbags has types of its own
    """Return what reads a message; None: rosbags is not installed."""
    try:
        from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415 - an extra
    except ImportError:
        return None
    return get_typestore(Stores.ROS1_NOETIC).deserialize_ros1


def read_ros1_image(kind: str, data: "bytes | memoryview") -> RecordedImage:
    """Read an image.

    Args:
        kind: name of its message, COMPRESSED_IMAGE or IMAGE.
        data: the message. The image's bytes are a view of it.

    Raises:
        NoRos1Error: rosbags is not installed.
        UnreadableEncodingError: its encoding is none that is read.
        BrokenMessageError: it is no image.
    """
    deserialize = _deserialize()
    if deserialize is None:
        raise NoRos1Error(ROS1_REASON)
    try:
        read = deserialize(data, kind)
    except Exception as error:
        raise BrokenMessageError("it is no message of ROS 1") from error
    return image_of(kind, read)


def image_of(kind: str, read: Any) -> RecordedImage:  # noqa: ANN401 - rosbags makes its classes at run time
    """Return the image of a message that rosbags has read.

    Args:
        kind: name of the message, COMPRESSED_IMAGE or IMAGE.
        read: the message.

    Raises:
        UnreadableEncodingError: its encoding is none that is read.
        BrokenMessageError: it is shorter than its size says.
    """
    header, data = read.header, memoryview(read.data).cast("B")
    stamp_ns = int(header.stamp.sec) * NS + int(header.stamp.nanosec)
    if kind == COMPRESSED_IMAGE:
        return compressed_image(stamp_ns, header.frame_id, read.format, data)
    size_px = int(read.width), int(read.height)
    form = RawForm(read.encoding, size_px, int(read.step), bool(read.is_bigendian))
    return raw_image(stamp_ns, header.frame_id, form, data)
