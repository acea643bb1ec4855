"""Writes recordings anew: what is whole in a broken one, a part of one, or two as one.

Joins what a board recorded alone with what its host recorded meanwhile, into one recording that plays as any other.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from common.errors import DataError, SettingsError
from common.recording.inflate import inflate
from common.recording.layout import ABOUT, CAPTURE, CLOCK, CaptureRuns, camera_name, image_topic, topics
from common.recording.mcap_records import CHANNELS, Attachment, Channel, Damage, Message, Metadata
from common.recording.mcap_writer import MOST_TOPICS, Topic
from common.recording.opened import open_recorded, stored_data
from common.recording.recorded import Recorded, Shown, image_kind, period_ns
from common.recording.recording_file import RecordingFile, written
from common.recording.ros_messages import SCHEMAS, RecordedImage, image_parts, image_type
from common.recording.salvage import Salvage
from phone_host.model import Side
from phone_host.recording.clock_messages import ToldClock, clock_text, narrowest, told_clocks, worst_ns
from phone_host.sync.clock import ClockEstimate

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


def copy_recording(source: Path, out: Path, wanted: Callable[[Message], bool] = lambda _: True) -> CopyAccount:
    """Write what is whole in a recording into another file.

    Args:
        source: the recording.
        out: the new file; it must not exist.
        wanted: whether a message is copied.

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
                case Metadata(name, values) if name != CHANNELS:
                    file.tell(name, dict(values))
                case Attachment(name, content):
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


_LINK: Final = "joined"
_PART: Final = re.compile(r"-\d{6,9}\.mcap$")
"""How board-agent names the parts of a ring."""

_SECOND_NS: Final = 1_000_000_000
_MARGIN_NS: Final = _SECOND_NS
"""What only one of the cameras saw is left out, but for this."""

_USABLE: Final = 0.5
"""A clock known to this share of a period finds every pair."""

_TO_95: Final = 1.96 / 3.2905
"""From a half-width that holds 99.9 % to one that holds 95 %."""

_EXCHANGE: Final = "give --clock a recording that this host made over the link, near in time, with neither machine switched off or asleep in between"

_SLEPT_NS: Final = 5_000_000
"""A host whose Unix time moved by more against its own clock has slept, or its time was set: an exchange of before says nothing."""


@dataclass(frozen=True, slots=True)
class Opened:
    """A recording and where it lies."""

    path: Path
    recorded: Recorded


@dataclass(frozen=True, slots=True)
class JoinAccount:
    """What was joined.

    Attributes:
        clock: of the board.
        uncertainty_ns: half-width that holds the true offset in 95 %, where it is known worst.
        images: of each side.
        left_out: images that only one camera saw, or that the host's recording has of its own board.
        empty: parts of a ring that hold no images: their board died right after they were begun.
        seconds: how long both cameras recorded at once.
    """

    clock: ClockEstimate
    uncertainty_ns: int
    images: dict[Side, int]
    left_out: int
    seconds: float
    empty: tuple[Path, ...]


@dataclass(frozen=True, slots=True)
class _Stream:
    """A camera's images in the order of their exposure, and what was added to each time of the clock of their stamps, ns."""

    shown: Sequence[Shown]
    unix_ns: int

    @property
    def span_ns(self) -> tuple[int, int]:
        """First and last exposure on the clock of whoever recorded, ns."""
        return self.shown[0].image.stamp_ns - self.unix_ns, self.shown[-1].image.stamp_ns - self.unix_ns


def join_recordings(paths: Sequence[Path], out: Path, clock: Path | None) -> JoinAccount:
    """Write one recording.

    Args:
        paths: the host's recording and the board's, or all parts of the board's, in any order.
        out: the new recording; it must not exist.
        clock: another recording of the same host that has heard the board's clock; None: there is none.

    Raises:
        SettingsError: these are not one recording of a host and one of a board.
        DataError: one cannot be read, or no stored clock exchange relates their clocks.
        UnavailableError: the file cannot be made, or the disk is full.
    """
    opened, empty = _opened(paths)
    parts, host = sorted_out(opened)
    side = Side(host.recorded.about.board_side)
    own = host.recorded.images.get(host.recorded.topic_of(side.other.value))
    if not own:
        raise DataError(f"{host.path} holds no images of the host's own camera", "record with phone-host record")
    board, stream = _board_stream(parts), _Stream(_ascending(own), host.recorded.about.unix_ns)
    estimate = _clock_of(board, stream, parts[0], host, clock)
    moved = [_moved(shown, estimate, board.unix_ns, stream.unix_ns) for shown in board.shown]
    first_ns = max(moved[0].image.stamp_ns, stream.shown[0].image.stamp_ns)
    last_ns = min(moved[-1].image.stamp_ns, stream.shown[-1].image.stamp_ns)
    if first_ns > last_ns:
        apart = f"{(first_ns - last_ns) / 1e9:.0f} s apart"
        raise DataError(f"{parts[0].path} and {host.path} were recorded {apart}", "give recordings of the same time")
    kept = {
        side: _between(moved, first_ns - _MARGIN_NS, last_ns + _MARGIN_NS),
        side.other: _between(stream.shown, first_ns - _MARGIN_NS, last_ns + _MARGIN_NS),
    }
    with written(out) as file:
        _write_begin(file, host, parts[0], estimate, first_ns)
        _write_images(file, kept, side)
    every = len(moved) + sum(map(len, host.recorded.images.values()))
    images = {each: len(shown) for each, shown in kept.items()}
    uncertainty_ns = round(worst_ns(estimate, board.span_ns) * _TO_95)
    left_out = every - sum(images.values())
    return JoinAccount(estimate, uncertainty_ns, images, left_out, (last_ns - first_ns) / 1e9, empty)


def _opened(paths: Sequence[Path]) -> tuple[list[Opened], tuple[Path, ...]]:
    """Open all, but for parts of a ring that hold nothing."""
    opened, empty = [], []
    for path in paths:
        try:
            opened.append(Opened(path, open_recorded(path)))
        except DataError:
            if not _PART.search(path.name):
                raise
            empty.append(path)
    return opened, tuple(empty)


def sorted_out(opened: Sequence[Opened]) -> tuple[list[Opened], Opened]:
    """Return the parts of the board's recording, and the host's.

    Raises:
        SettingsError: they are not one recording of a board and one of a host.
    """
    parts = [each for each in opened if each.recorded.about.board_boot_id]
    hosts = [each for each in opened if not each.recorded.about.board_boot_id]
    if not parts:
        raise SettingsError(
            "none of these was recorded by a board alone", "name one of board-agent record and one of phone-host record"
        )
    if len(hosts) != 1:
        names = " and ".join(str(each.path) for each in hosts) or "none of these"
        what = "were both recorded by a host" if hosts else "was recorded by a host"
        raise SettingsError(f"{names} {what}", "name one of phone-host record, and the board's")
    for each in parts[1:]:
        if each.recorded.about.board_boot_id != parts[0].recorded.about.board_boot_id:
            raise SettingsError(
                f"{parts[0].path} and {each.path} are of two boots of a board, each with a clock of its own",
                "join those of one boot at a time",
            )
    return parts, hosts[0]


def _board_stream(parts: Sequence[Opened]) -> _Stream:
    """Return the images of all parts, with stamps on the first one's Unix time."""
    unix_ns = parts[0].recorded.about.unix_ns
    every: list[Shown] = []
    for part in parts:
        later_ns = unix_ns - part.recorded.about.unix_ns
        shown = next(iter(part.recorded.images.values()))
        every += [_later(one, later_ns) for one in shown] if later_ns else shown
    return _Stream(_ascending(every), unix_ns)


def _clock_of(board: _Stream, own: _Stream, part: Opened, host: Opened, clock: Path | None) -> ClockEstimate:
    """Return how the board's clock relates to the host's, by the narrowest exchange that a host stored.

    Raises:
        SettingsError: the recording that --clock names does not fit the host's.
        DataError: no exchange with this boot of the board is stored, or none that finds every pair.
    """
    told = [*told_clocks(host.recorded), *_told_elsewhere(clock, host)]
    found = narrowest(told, part.recorded.about.board_boot_id, board.span_ns)
    if found is None:
        raise DataError(f"no clock exchange between {part.path} and {host.path} is stored", _EXCHANGE)
    known_ns = worst_ns(found, board.span_ns)
    if known_ns > _USABLE * max(period_ns(board.shown), period_ns(own.shown)):
        raise DataError(
            f"the clock exchange that is stored for {part.path} and {host.path} is known only to +-{known_ns / 1e6:.0f} ms",
            _EXCHANGE,
        )
    return found


def _ascending(shown: Sequence[Shown]) -> list[Shown]:
    return sorted(shown, key=lambda one: one.image.stamp_ns)


def _later(shown: Shown, by_ns: int) -> Shown:
    image = shown.image
    moved = replace(image, stamp_ns=image.stamp_ns + by_ns)
    return Shown(moved, shown.sequence, shown.log_ns + by_ns, shown.publish_ns + by_ns, shown.grabbed_ns + by_ns)


def _moved(shown: Shown, clock: ClockEstimate, board_unix_ns: int, host_unix_ns: int) -> Shown:
    """Return an image of the board with the host's times."""
    board_ns = shown.image.stamp_ns - board_unix_ns
    return _later(shown, board_ns + clock.offset_at(board_ns) + host_unix_ns - shown.image.stamp_ns)


def _between(shown: Sequence[Shown], first_ns: int, last_ns: int) -> list[Shown]:
    return [one for one in shown if first_ns <= one.image.stamp_ns <= last_ns]


def _told_elsewhere(clock: Path | None, host: Opened) -> list[ToldClock]:
    """Return what another recording of the same host tells of boards' clocks.

    Raises:
        SettingsError: it is of another host, or the host has slept in between.
    """
    if clock is None:
        return []
    other, about = open_recorded(clock), host.recorded.about
    if other.about.host_boot_id != about.host_boot_id or not about.host_boot_id:
        raise SettingsError(
            f"{clock} and {host.path} are of two boots of a host",
            "name one that the host recorded since it was switched on",
        )
    if abs(other.about.unix_ns - about.unix_ns) > _SLEPT_NS:
        raise SettingsError(
            f"between {clock} and {host.path} the host slept, or its time was set",
            "name one that the host recorded after that",
        )
    return told_clocks(other)


def _write_begin(file: RecordingFile, host: Opened, board: Opened, clock: ClockEstimate, at_ns: int) -> None:
    """Write all that is no image: what the host's recording tells, the board's camera, and how they were joined."""
    board_about, side = board.recorded.about, host.recorded.about.board_side
    for name, values in host.recorded.metadata.items():
        if name not in {CHANNELS, "clock", camera_name(side)}:
            file.tell(name, dict(values))
    if ABOUT not in host.recorded.metadata:
        file.tell(ABOUT, host.recorded.about.values())
    camera = dict(board.recorded.metadata.get(camera_name(board_about.board_side), {}))
    file.tell(camera_name(side), {**camera, "link": _LINK, "began_ns": "0"})
    file.tell(_LINK, {"board_file": board.path.name, "board_boot_id": board_about.board_boot_id})
    for name, data in host.recorded.attachments.items():
        file.attach(name, "application/octet-stream", bytes(data), at_ns)
    if "settings.json" in board.recorded.attachments:
        settings = bytes(board.recorded.attachments["settings.json"])
        file.attach("board-settings.json", "application/json", settings, at_ns)
    for record in Salvage(stored_data(host.path), inflate).records():
        if isinstance(record, Message) and record.channel is not None and record.channel.topic.endswith("camera_info"):
            file.add(record.channel.topic, record.data, sequence=0, log_ns=record.log_ns, publish_ns=record.publish_ns)
    text = clock_text(clock, board_about.board_boot_id).encode()
    file.add(CLOCK, text, sequence=0, log_ns=at_ns - _MARGIN_NS, publish_ns=at_ns - _MARGIN_NS)


def _write_images(file: RecordingFile, kept: dict[Side, list[Shown]], board: Side) -> None:
    """Write the images of both sides in the order in which they were there."""
    runs, due_ns, grabbed_ns = CaptureRuns(), 0, 0

    def write_runs() -> None:
        if text := runs.take():
            file.add(CAPTURE, text, sequence=0, log_ns=grabbed_ns, publish_ns=grabbed_ns)

    for side, shown in _merged(kept):
        image = shown.image
        moved = RecordedImage(image.stamp_ns, side.value, image.pixel_format, image.size_px, image.payload)
        topic = image_topic(side.value, image_type(image.pixel_format))
        file.add(topic, *image_parts(moved), sequence=shown.sequence, log_ns=shown.log_ns, publish_ns=shown.publish_ns)
        if side is board:
            grabbed_ns = shown.grabbed_ns
            runs.note(shown.sequence, grabbed_ns - image.stamp_ns)
            if grabbed_ns >= due_ns:
                write_runs()
                due_ns = grabbed_ns + _SECOND_NS
    write_runs()


def _merged(kept: dict[Side, list[Shown]]) -> Iterator[tuple[Side, Shown]]:
    every = [(shown.log_ns, side.value, side, shown) for side, of in kept.items() for shown in of]
    for _, _, side, shown in sorted(every, key=lambda item: item[:2]):
        yield side, shown
