"""Takes the images of two topics of another program's MCAP file into a recording of ours."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import starmap
from pathlib import Path

from common.errors import DataError
from common.frame import SpoiledImageError
from common.imagesize.head import size_text
from common.recording.layout import ABOUT, About, image_topic
from common.recording.opened import open_recorded
from common.recording.recorded import Recorded, Shown, retimed, size_px
from common.recording.recording_file import written
from common.recording.ros_messages import image_message, image_type
from common.versions import all_versions
from common.words import counted, listed
from phone_host.recording.both_sides import topics_of
from phone_host.recording.given_times import EPOCH_NS, at_rate
from phone_host.recording.image_sizes import Size, usual_size
from phone_host.recording.import_account import ImportAccount

_SIDES = ("left", "right")


@dataclass(frozen=True, slots=True)
class ImportOptions:
    """What is taken from a recording, and when it was.

    Attributes:
        topics: those of the left and of the right images; None: those whose names say so, else the first two.
        fps: images per second, instead of all times in it; None: its own times.
    """

    topics: Sequence[str] | None = None
    fps: float | None = None


def import_topics(source: Path, options: ImportOptions, out: Path) -> ImportAccount:
    """Write a recording with the images of two topics.

    Args:
        source: the MCAP file.
        options: what is taken from it.
        out: the recording; it must not exist.

    Raises:
        DataError: the source cannot be read, every image of a topic is spoiled, there are no such topics, or no two at all, or no time can be true.
        UnavailableError: the file cannot be made, or the disk is full.
    """
    found = open_recorded(source, needs_times=options.fps is None)
    chosen = list(options.topics or topics_of(found, source).values())
    if not set(chosen) <= set(found.images) or len(set(chosen)) < len(_SIDES):
        raise DataError(
            f"{source} holds no two such image topics, but {listed(sorted(found.images))}",
            "give two of them as --topics LEFT RIGHT",
        )
    for topic in chosen:
        found.camera(topic)  # refuses a stream all of whose images are spoiled
    remarks = [f"the images are taken for {options.fps:g} a second"] if options.fps else found.remarks
    streams = [_timed(_of_one_size(found.images[topic], topic, remarks), options.fps) for topic in chosen]
    every = [(shown, side) for side, stream in zip(_SIDES, streams, strict=True) for shown in stream]
    with written(out) as file:
        file.tell(ABOUT, About(versions=all_versions()).values())
        for shown, side in sorted(every, key=lambda item: item[0].log_ns):
            image = shown.image
            moved = replace(image.loaded(), frame_id=side)
            topic = image_topic(side, image_type(image.pixel_format))
            times = {"log_ns": shown.log_ns, "publish_ns": shown.publish_ns}
            file.add(topic, image_message(moved), sequence=shown.sequence, **times)
    counts = dict(zip(_SIDES, map(len, streams), strict=True))
    return ImportAccount(counts, tuple(remarks), _unused(found, chosen), tuple(found.damages))


def _of_one_size(stream: Sequence[Shown], topic: str, remarks: list[str]) -> list[Shown]:
    """Return the images that have the size which most of a topic's images have.

    Args:
        stream: the images.
        topic: whose they are.
        remarks: takes how many are left out, for each other size.
    """
    sizes_px = [_size(shown) for shown in stream]
    usual = usual_size(sizes_px)
    others = Counter(size for size in sizes_px if size is not None and size != usual)
    for size, count in others.items():
        assert usual is not None
        words = f"{counted(count, 'image')} of {topic} left out: {size_text(size)} instead of {size_text(usual)}"
        remarks.append(words)
    return [shown for shown, size in zip(stream, sizes_px, strict=True) if size not in others]


def _size(shown: Shown) -> Size | None:
    """Return an image's width and height, px; None: it is spoiled, which whoever decodes it reports."""
    try:
        return size_px(shown.image)
    except SpoiledImageError:
        return None


def _timed(shown: Sequence[Shown], fps: float | None) -> list[Shown]:
    if fps is None:
        return list(shown)
    return list(starmap(retimed, zip(shown, at_rate(range(len(shown)), fps, EPOCH_NS), strict=True)))


def _unused(found: Recorded, chosen: Sequence[str]) -> dict[str, str]:
    """Return why each topic is not used."""
    reasons = {topic: each.reason for topic, each in found.unused.items()}
    others = dict.fromkeys(set(found.images) - set(chosen), "another camera; --topics names the two that are taken")
    return dict(sorted((reasons | others).items()))
