"""Writes a recording anew: what is whole in a broken one, or a part of it."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

from common.errors import DataError
from common.recording.inflate import inflate
from common.recording.layout import topics
from common.recording.mcap_records import CHANNELS, Attachment, Channel, Damage, Message, Metadata
from common.recording.mcap_writer import MOST_TOPICS, Topic
from common.recording.opened import stored_data
from common.recording.recorded import image_kind
from common.recording.recording_file import RecordingFile, written
from common.recording.ros_messages import SCHEMAS
from common.recording.salvage import Salvage

_JSON: Final = "json"


class CopyAccount:
    """What became of the messages of a recording that was copied.

    Attributes:
        messages: how many were copied.
        images: how many of them are images.
        left_out: topics whose messages this program cannot write, with their number.
        damages: where something was missing.
    """

    def __init__(self) -> None:
        self.messages = self.images = 0
        self.left_out: dict[str, int] = {}
        self.damages: list[Damage] = []


def copy_recording(
    source: Path, out: Path, wanted: Callable[[Message], bool] = lambda _: True, *, with_captions: bool = True
) -> CopyAccount:
    """Write what is whole in a recording into another file.

    Args:
        source: the recording.
        out: the new file; it must not exist.
        wanted: whether a message is copied.
        with_captions: whether metadata and attachments are.

    Raises:
        UnavailableError: the file cannot be made, or the disk is full.
        DataError: the source cannot be read, or is no MCAP file.
    """
    data = stored_data(source)
    channels = {topic.name: topic for topic in topics()}
    account = CopyAccount()
    for record in Salvage(data, inflate).records():
        if isinstance(record, Message) and record.channel is not None and record.channel.topic not in channels:
            topic = _topic(record.channel)
            if topic is not None:
                channels[topic.name] = topic
                if len(channels) > MOST_TOPICS:
                    raise DataError(
                        f"{source} has more than {MOST_TOPICS} topics, which no MCAP file can", "give another recording"
                    )
    with written(out, tuple(channels.values())) as file:
        for record in Salvage(data, inflate).records():
            match record:
                case Message() if wanted(record):
                    _copy(file, record, channels, account)
                case Metadata(name, values) if with_captions and name != CHANNELS:
                    file.tell(name, dict(values))
                case Attachment(name, content) if with_captions:
                    file.attach(name, "application/octet-stream", bytes(content), 0)
                case Damage():
                    account.damages.append(record)
                case _:
                    pass
    return account


def _copy(file: RecordingFile, message: Message, channels: dict[str, Topic], account: CopyAccount) -> None:
    topic = message.channel.topic if message.channel is not None else "unknown"
    if message.channel is None or not _fits(message.channel, channels.get(topic)):
        account.left_out[topic] = account.left_out.get(topic, 0) + 1
        return
    file.add(topic, message.data, sequence=message.sequence, log_ns=message.log_ns, publish_ns=message.publish_ns)
    account.messages += 1
    account.images += bool(image_kind(message.channel))


def _fits(channel: Channel, topic: Topic | None) -> bool:
    """Return whether a channel's messages are those of a topic that is written: its name may be used by other programs."""
    return topic is not None and (topic.kind, topic.encoding) == (channel.kind, channel.encoding)


def _topic(channel: Channel) -> Topic | None:
    """Return what this program writes for a channel; None: its message is none that it knows."""
    if channel.encoding == _JSON and not channel.kind:
        return Topic(channel.topic, _JSON)
    if channel.kind in SCHEMAS and channel.encoding == "cdr":
        return Topic(channel.topic, "cdr", channel.kind, "ros2msg", SCHEMAS[channel.kind].encode())
    return None
