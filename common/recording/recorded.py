"""A recording that is read: what is in it, in the order in which it came, however much of it is whole. Pure: bytes in.

A file of another program is read, too: any topics with CompressedImage or Image. Without our metadata its times are Unix times, and are used only
if they can be true. What is not used of it has its reason.
"""

import statistics
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Final, assert_never

from common.frame import Buffer, SpoiledImageError
from common.imagesize.read import read_head
from common.protocol.message import CameraDescription
from common.recording.cdr import BrokenMessageError
from common.recording.file_bytes import StoredData
from common.recording.image_layouts import UnreadableEncodingError
from common.recording.inflate import ZSTD
from common.recording.layout import (
    ABOUT,
    CAPTURE,
    CLOCK,
    COMPUTED,
    DELAYS,
    SIDES,
    About,
    about_of,
    camera_name,
    camera_of,
    side_of,
)
from common.recording.mcap_records import Attachment, Channel, Damage, Inflate, Message, Metadata, StoredMessage
from common.recording.ros1 import ROS1, NoRos1Error, read_ros1_image
from common.recording.ros_messages import CAMERA_INFO, COMPRESSED_IMAGE, IMAGE, RecordedImage, StoredBytes, read_image
from common.recording.salvage import Salvage
from common.recording.stamps import stamp_fault
from common.strict_json import strict_json, whole_number
from common.words import counted

_TEXTS: Final = (DELAYS, CLOCK, CAPTURE)
_LARGEST_NS: Final = 2**62
_LONGEST_CAPTURE_NS: Final = 60_000_000_000
_NEVER_NS: Final = 33_333_333
"""The time between images of a camera that gave only one."""


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """An image of a recording, with its times in ns since 1970.

    Attributes:
        image: the image, with its exposure mid-point.
        sequence: its number in its stream.
        log_ns: when it was received.
        publish_ns: the board's: when it was sent; the host's: when it was grabbed.
        grabbed_ns: when it was dequeued from its driver; the same as `image.stamp_ns`: not known.
    """

    image: RecordedImage
    sequence: int
    log_ns: int
    publish_ns: int
    grabbed_ns: int


@dataclass(slots=True)
class Unused:
    """Messages of a topic that are not used.

    Attributes:
        reason: why the first is not.
        messages: how many.
    """

    reason: str
    messages: int = 0


@dataclass(slots=True, eq=False)
class Recorded:
    """What is in a recording.

    Attributes:
        about: what it tells of the whole.
        images: by topic, in the order in which they were received.
        texts: the messages in JSON, by topic.
        kinds: how many messages of each topic there are.
        unused: what is not used, by topic.
        remarks: what is used instead of stamps that cannot be true, in words.
        time_fault: why neither stamps nor the times of receipt can be true, in words; empty: one of both can.
        metadata: values by name of the whole; of several of one name the last.
        attachments: files by name.
        damages: where something is missing.
        is_complete: whether it was ended in order.
        is_ours: whether this program wrote it.
        size_bytes: how long the file is.
    """

    about: About = field(default_factory=About)
    images: dict[str, list[Shown]] = field(default_factory=dict)
    texts: dict[str, list[Message]] = field(default_factory=dict)
    kinds: dict[str, int] = field(default_factory=dict)
    unused: dict[str, Unused] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)
    time_fault: str = ""
    metadata: dict[str, Mapping[str, str]] = field(default_factory=dict)
    attachments: dict[str, StoredData] = field(default_factory=dict)
    damages: list[Damage] = field(default_factory=list)
    is_complete: bool = False
    is_ours: bool = False
    size_bytes: int = 0

    def topic_of(self, side: str) -> str:
        """Return the topic with the images of a side: ours, else by name; empty: there is none."""
        ours = [topic for topic in self.images if side_of(topic) == side]
        if ours:
            return ours[0]
        others = sorted(topic for topic in self.images if not side_of(topic))
        named = [topic for topic in others if side in topic]
        place = SIDES.index(side)
        return named[0] if len(named) == 1 else others[place] if len(others) > place else ""

    def camera(self, topic: str) -> CameraDescription:
        """Return what is known of the camera whose images a topic holds.

        Raises:
            SpoiledImageError: none of its images is one.
        """
        shown = self.images[topic]
        first, size = _first_of_known_size(shown)
        told = self.metadata.get(camera_name(side_of(topic)), {})
        return camera_of(told, size, first.pixel_format, period_ns(shown))


def size_px(image: RecordedImage) -> tuple[int, int]:
    """Return width and height of an image, px.

    Raises:
        SpoiledImageError: it is none.
    """
    if all(image.size_px):
        return image.size_px
    head = read_head(bytes(image.payload), f"an image of {image.frame_id}")
    return head.width_px, head.height_px


def _first_of_known_size(shown: Sequence[Shown]) -> tuple[RecordedImage, tuple[int, int]]:
    """Return the first image that tells its size, and that.

    Raises:
        SpoiledImageError: none does.
    """
    spoiled: SpoiledImageError | None = None
    for each in shown:
        try:
            return each.image, size_px(each.image)
        except SpoiledImageError as error:
            spoiled = spoiled or error
    assert spoiled is not None
    raise spoiled


def period_ns(shown: Sequence[Shown]) -> int:
    """Return the median time between two images' exposures, ns."""
    between = [b.image.stamp_ns - a.image.stamp_ns for a, b in pairwise(shown)]
    return max(1, round(statistics.median(between))) if between else _NEVER_NS


def read_recorded(data: StoredData, inflate: Inflate) -> Recorded:
    """Read all that is whole.

    Args:
        data: the whole file.
        inflate: for chunks that are compressed.
    """
    found, salvage = Recorded(size_bytes=len(data)), Salvage(data, inflate)
    captured: dict[int, int] = {}
    lost: dict[int, int] = defaultdict(int)
    for record in salvage.records():
        match record:
            case Message():
                _take(found, record, captured, lost)
            case Attachment(name, content):
                found.attachments[name] = content
            case Metadata(name, values):
                found.metadata[name] = values
            case Damage():
                found.damages.append(record)
            case _:
                assert_never(record)
    for count in lost.values():
        found.damages.append(
            Damage(0, 0, f"{counted(count, 'message is', 'messages are')} of an unknown topic or spoiled")
        )
    found.is_complete = salvage.is_complete
    found.is_ours = ABOUT in found.metadata
    found.about = about_of(found.metadata.get(ABOUT, {}))
    for topic, shown in found.images.items():
        is_board = side_of(topic) == found.about.board_side and not found.about.board_boot_id
        whole = [_marked(each, captured if is_board else None, is_ours=found.is_ours) for each in shown]
        found.images[topic] = sorted(whole, key=lambda each: each.log_ns)
    if not found.is_ours:
        _believe_times(found)
    return found


def _believe_times(found: Recorded) -> None:
    """Replace stamps of another program that cannot be true by the times of receipt, or those by the stamps."""
    stamps = {topic: stamp_fault([each.image.stamp_ns for each in of]) for topic, of in found.images.items()}
    logged = {topic: stamp_fault([each.log_ns for each in of]) for topic, of in found.images.items()}
    topic, fault = next(((topic, each) for topic, each in stamps.items() if each), ("", None))
    log_topic, log_fault = next(((topic, each) for topic, each in logged.items() if each), ("", None))
    if fault and log_fault:
        found.time_fault = f"the stamps of {topic} {fault.value}, the times of receipt of {log_topic} {log_fault.value}"
    elif fault:
        found.remarks.append(f"the stamps of {topic} {fault.value}: the times of receipt are used for all images")
        for each, of in found.images.items():
            found.images[each] = [retimed(shown, shown.log_ns) for shown in of]
    elif log_fault:
        found.remarks.append(
            f"the times of receipt of {log_topic} {log_fault.value}: the stamps are used for all images"
        )
        for each, of in found.images.items():
            moved = [retimed(shown, shown.image.stamp_ns) for shown in of]
            found.images[each] = sorted(moved, key=lambda shown: shown.log_ns)


def retimed(shown: Shown, at_ns: int) -> Shown:
    """Return an image with one time for all that happened to it.

    Args:
        shown: the image.
        at_ns: the time, ns since 1970.
    """
    image = replace(shown.image, stamp_ns=at_ns)
    return replace(shown, image=image, log_ns=at_ns, publish_ns=at_ns, grabbed_ns=at_ns)


def _marked(shown: Shown, captured: "Mapping[int, int] | None", *, is_ours: bool) -> Shown:
    """Add when it was grabbed."""
    if captured is None:
        return replace(shown, grabbed_ns=shown.publish_ns) if is_ours else shown
    return replace(shown, grabbed_ns=shown.image.stamp_ns + captured.get(shown.sequence, 0))


def _take(found: Recorded, message: Message, captured: dict[int, int], lost: dict[int, int]) -> None:
    channel = message.channel
    if channel is None or max(message.log_ns, message.publish_ns) >= _LARGEST_NS:
        lost[message.number] += 1
        return
    found.kinds[channel.topic] = found.kinds.get(channel.topic, 0) + 1
    if channel.topic in COMPUTED:
        return
    if channel.encoding == "json" and channel.topic in _TEXTS:
        if channel.topic == CAPTURE:
            _note_captured(captured, message.data)
        held = (
            message if message.stored is None else replace(message, data=memoryview(bytes(message.data)), stored=None)
        )
        found.texts.setdefault(channel.topic, []).append(held)
        return
    kind = image_kind(channel)
    if not kind:
        _leave_out(found, channel, f"{channel.kind or channel.encoding or 'its message'} is no image")
        return
    try:
        image = read_message(kind, channel.encoding, message)
    except (UnreadableEncodingError, NoRos1Error) as unreadable:
        _leave_out(found, channel, str(unreadable))
    except BrokenMessageError:
        lost[message.number] += 1
    else:
        shown = Shown(image, message.sequence, message.log_ns, message.publish_ns, image.stamp_ns)
        found.images.setdefault(channel.topic, []).append(shown)


def image_kind(channel: Channel) -> str:
    """Return the name of a channel's message, if it holds images: COMPRESSED_IMAGE or IMAGE; empty: it does not.

    ROS 1 names them without `msg`.
    """
    kind = channel.kind.replace("sensor_msgs/C", "sensor_msgs/msg/C").replace("sensor_msgs/I", "sensor_msgs/msg/I")
    return kind if kind in {COMPRESSED_IMAGE, IMAGE} and channel.encoding in {"cdr", ROS1} else ""


def read_message(kind: str, encoding: str, message: Message) -> RecordedImage:
    """Read the image of a message. One that is not in memory is read from its file again whenever its bytes are wanted.

    Args:
        kind: COMPRESSED_IMAGE or IMAGE.
        encoding: of the message: cdr or ros1.
        message: the message.

    Raises:
        UnreadableEncodingError: the image's encoding is none that is read.
        NoRos1Error: it is a message of ROS 1, and what reads them is not installed.
        BrokenMessageError: it is no image.
    """
    if bytes(message.data[: len(ZSTD)]) == ZSTD:
        raise UnreadableEncodingError("each message is compressed: give the folder of the bag")
    read = read_ros1_image if encoding == ROS1 else read_image
    image, stored = read(kind, message.data), message.stored
    if stored is None:
        return image
    return replace(image, content=StoredBytes(lambda: _read_again(read, kind, stored), len(image.content)))


def _read_again(read: Callable[[str, memoryview], RecordedImage], kind: str, stored: StoredMessage) -> Buffer:
    return read(kind, stored.read()).payload


def _leave_out(found: Recorded, channel: Channel, reason: str) -> None:
    if channel.kind != CAMERA_INFO or not side_of(channel.topic):
        found.unused.setdefault(channel.topic, Unused(reason)).messages += 1


def _note_captured(captured: dict[int, int], data: memoryview) -> None:
    try:
        for first, values in strict_json(bytes(data)):
            whole = [whole_number(each) for each in values]
            first_number = whole_number(first)
            captured.update(
                {first_number + at: each for at, each in enumerate(whole) if 0 <= each <= _LONGEST_CAPTURE_NS}
            )
    except (ValueError, TypeError):
        return
