"""Takes the images of two topics of another program's MCAP file into a recording of ours."""

from collections.abc import Sequence
from pathlib import Path

from common.errors import DataError
from common.recording.layout import ABOUT, About, image_topic
from common.recording.opened import open_recorded
from common.recording.recording_file import written
from common.recording.ros_messages import RecordedImage, image_message, image_type
from common.versions import all_versions
from phone_host.recording.both_sides import topics_of

_SIDES = ("left", "right")


def import_topics(source: Path, names: Sequence[str] | None, out: Path) -> dict[str, int]:
    """Write a recording with the images of two topics.

    Args:
        source: the MCAP file.
        names: topics of the left and the right images; None: those whose names say so, else the first two.
        out: the recording; it must not exist.

    Returns:
        How many images each side has.

    Raises:
        DataError: the source cannot be read, there are no such topics, or no two at all.
        UnavailableError: the file cannot be made, or the disk is full.
    """
    found = open_recorded(source)
    chosen = list(names or topics_of(found, source).values())
    if not set(chosen) <= set(found.images) or len(set(chosen)) < len(_SIDES):
        raise DataError(
            f"{source} holds no two such image topics, but {', '.join(sorted(found.images))}",
            "give two of them as --topics LEFT RIGHT",
        )
    every = [(shown, side) for side, topic in zip(_SIDES, chosen, strict=True) for shown in found.images[topic]]
    with written(out) as file:
        file.tell(ABOUT, About(versions=all_versions()).values())
        for shown, side in sorted(every, key=lambda item: item[0].log_ns):
            image = shown.image
            moved = RecordedImage(image.stamp_ns, side, image.pixel_format, image.size_px, image.payload)
            topic = image_topic(side, image_type(image.pixel_format))
            times = {"log_ns": shown.log_ns, "publish_ns": shown.publish_ns}
            file.add(topic, image_message(moved), sequence=shown.sequence, **times)
    return {side: len(found.images[topic]) for side, topic in zip(_SIDES, chosen, strict=True)}
