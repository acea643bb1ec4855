"""A recording that is read: what is in it, in the order in which it came, however much of it is whole. Pure: bytes in.

A file of another program is read, too: any topics with CompressedImage or Image. Without our metadata its times are Unix times.
"""

import json
import statistics
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Final, assert_never

from common.imagesize.read import read_head
from common.protocol.message import CameraDescription
from common.recording.cdr import BrokenMessageError
from common.recording.layout import ABOUT, CAPTURE, COMPUTED, SIDES, About, about_of, camera_name, camera_of, side_of
from common.recording.ros_messages import COMPRESSED_IMAGE, IMAGE, RecordedImage, read_image
from common.recording.salvage import Attachment, Damage, Inflate, Message, Metadata, Salvage
from common.words import counted

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


@dataclass(slots=True, eq=False)
class Recorded:
    """What is in a recording.

    Attributes:
        about: what it tells of the whole.
        images: by topic, in the order in which they were received.
        texts: the messages in JSON, by topic.
        kinds: how many messages of each topic there are.
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
    metadata: dict[str, Mapping[str, str]] = field(default_factory=dict)
    attachments: dict[str, memoryview] = field(default_factory=dict)
    damages: list[Damage] = field(default_factory=list)
    is_complete: bool = False
    is_ours: bool = False
    size_bytes: int = 0

    def topic_of(self, side: str) -> str:
        """Return the topic with the images of a side: ours, else by name; empty: there is none.

        Args:
            side: left or right.
        """
        ours = [topic for topic in self.images if side_of(topic) == side]
        if ours:
            return ours[0]
        others = sorted(topic for topic in self.images if not side_of(topic))
        named = [topic for topic in others if side in topic]
        place = SIDES.index(side)
        return named[0] if len(named) == 1 else others[place] if len(others) > place else ""

    def camera(self, topic: str) -> CameraDescription:
        """Return what is known of the camera whose images a topic holds.

        Args:
            topic: one of `images`.

        Raises:
            SpoiledImageError: the first image is none.
        """
        shown = self.images[topic]
        first, size = shown[0].image, size_px(shown[0].image)
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


def period_ns(shown: Sequence[Shown]) -> int:
    """Return the median time between two images' exposures, ns."""
    between = [b.image.stamp_ns - a.image.stamp_ns for a, b in pairwise(shown)]
    return max(1, round(statistics.median(between))) if between else _NEVER_NS


def read_recorded(data: memoryview, inflate: Inflate) -> Recorded:
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
    return found


def _marked(shown: Shown, captured: "Mapping[int, int] | None", *, is_ours: bool) -> Shown:
    """Add when it was grabbed."""
    if captured is None:
        return replace(shown, grabbed_ns=shown.publish_ns) if is_ours else shown
    return replace(shown, grabbed_ns=shown.image.stamp_ns + captured.get(shown.sequence, 0))


def _take(found: Recorded, message: Message, captured: dict[int, int], lost: dict[int, int]) -> None:
    channel = message.channel
    if channel is None:
        lost[message.number] += 1
        return
    found.kinds[channel.topic] = found.kinds.get(channel.topic, 0) + 1
    if channel.topic in COMPUTED:
        return
    kind = channel.kind.replace("sensor_msgs/C", "sensor_msgs/msg/C").replace("sensor_msgs/I", "sensor_msgs/msg/I")
    if kind in {COMPRESSED_IMAGE, IMAGE}:
        try:
            image = read_image(kind, message.data)
        except BrokenMessageError:
            lost[message.number] += 1
            return
        shown = Shown(image, message.sequence, message.log_ns, message.publish_ns, image.stamp_ns)
        found.images.setdefault(channel.topic, []).append(shown)
    elif channel.encoding == "json":
        if channel.topic == CAPTURE:
            _note_captured(captured, message.data)
        found.texts.setdefault(channel.topic, []).append(message)


def _note_captured(captured: dict[int, int], data: memoryview) -> None:
    try:
        runs = json.loads(bytes(data))
        for first, values in runs:
            captured.update({int(first) + at: int(value) for at, value in enumerate(values)})
    except (ValueError, TypeError):
        return
