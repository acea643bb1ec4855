"""The images of both cameras of a recording, and how one of them is decoded."""

from collections.abc import Mapping
from pathlib import Path

from common.errors import DataError
from common.protocol.message import CameraDescription
from common.recording.recorded import Recorded, Shown, size_px
from common.words import listed
from phone_host.model import Side
from phone_host.stereo.raw_images import EncodedImage


def topics_of(recorded: Recorded, file: Path) -> Mapping[Side, str]:
    """Return the topics with the left and with the right images.

    Raises:
        DataError: it holds the images of one camera only.
    """
    topics = {side: recorded.topic_of(side.value) for side in Side}
    if not all(topics.values()):
        held = listed(sorted(recorded.images))
        raise DataError(
            f"{file} holds the images of one camera only ({held})",
            "record both cameras, or join two recordings: phone-host sessions join",
        )
    return topics


def encoded(shown: Shown, camera: CameraDescription, name: str) -> EncodedImage:
    """Return an image as it is decoded. Its bytes stay where they are.

    Raises:
        SpoiledImageError: it is none.
    """
    width, height = size_px(shown.image)
    return EncodedImage(
        payload=memoryview(shown.image.payload),
        pixel_format=shown.image.pixel_format,
        width_px=width,
        height_px=height,
        name=name,
        orientation=camera.orientation,
    )
