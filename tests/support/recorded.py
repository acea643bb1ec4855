"""Small recordings of known content, and frames to be recorded."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from common.frame import Frame, PixelFormat
from common.ledger import BoardMarks
from common.orientation import UPRIGHT
from common.protocol.message import CameraDescription
from common.recording.layout import ABOUT, CAPTURE, About, camera_name, camera_values, topics
from common.recording.mcap_writer import McapWriter
from common.recording.ros_messages import RecordedImage, image_message
from phone_host.model import BoardFrame
from tests.support.pictures import jpeg
from tests.support.samples import FRAME, shot

PERIOD_NS = 40_000_000
ZERO_NS = 1_700_000_000_000_000_000
LATE_NS = 3_000_000
"""Each right image is exposed this much after the left one of its number."""


def payload(number: int) -> bytes:
    """The image of that number."""
    return jpeg(32, 24, seed=number % 4)


def recording(
    pairs: int,
    *,
    missing: frozenset[int] = frozenset(),
    chunk_each: int = 4,
    image: Callable[[str, int], bytes] = lambda _, number: payload(number),
    cameras: Mapping[str, CameraDescription] = MappingProxyType({}),
    rig: bytes = b"a: 1\n" * 50,
) -> bytes:
    """A recording of so many pairs, the left images of which come from the board; some left images are missing.

    Args:
        pairs: how many.
        missing: numbers of left images that are not in it.
        chunk_each: pairs in a chunk.
        image: the image of a side and a number, as JPEG.
        cameras: what is told of the camera of a side.
        rig: content of the rig.yaml in it.
    """
    data = bytearray()
    writer = McapWriter(data.extend, "a test", topics())
    writer.tell(ABOUT, About(unix_ns=ZERO_NS, board_side="left").values())
    writer.attach("rig.yaml", "text/yaml", rig, ZERO_NS)
    for side, camera in cameras.items():
        writer.tell(camera_name(side), camera_values(camera))
    for number in range(pairs):
        for side, late_ns in (("left", 0), ("right", LATE_NS)):
            if side == "left" and number in missing:
                continue
            at_ns = ZERO_NS + number * PERIOD_NS + late_ns
            shown = RecordedImage(at_ns, side, PixelFormat.MJPEG, (0, 0), image(side, number))
            log_ns = at_ns + 12_000_000
            topic = f"/{side}/image/compressed"
            writer.add(topic, image_message(shown), sequence=number, log_ns=log_ns, publish_ns=at_ns + 5_000_000)
        if number % chunk_each == chunk_each - 1:
            writer.end_chunk()
    captured = f"[[0,{[2_000_000] * pairs}]]".replace(" ", "").encode()
    end_ns = ZERO_NS + pairs * PERIOD_NS
    writer.add(CAPTURE, captured, sequence=0, log_ns=end_ns, publish_ns=end_ns)
    writer.finish()
    return bytes(data)


def recording_file(folder: Path, pairs: int, *, missing: frozenset[int] = frozenset()) -> Path:
    """The same as a file."""
    path = folder / "session.mcap"
    path.write_bytes(recording(pairs, missing=missing))
    return path


def board_frame(number: int, image: bytes, at_ns: int) -> BoardFrame:
    """A frame of the board that was received just now, exposed 30 ms ago.

    Args:
        number: its sequence.
        image: its bytes, JPEG.
        at_ns: now.
    """
    marks = BoardMarks(exposed_ns=at_ns - 30_000_000, grabbed_ns=at_ns - 20_000_000, sent_ns=at_ns - 10_000_000)
    message = replace(
        FRAME, session="s", sent_index=number, sequence=number, width_px=32, height_px=24, marks=marks, payload=image
    )
    return BoardFrame(
        message=message,
        link="tcp",
        marks=marks,
        received_ns=at_ns,
        offset_ns=0,
        uncertainty_ns=0,
        orientation=UPRIGHT,
    )


def own_frame(number: int, image: bytes, at_ns: int) -> Frame:
    """A frame of the own camera, exposed 20 ms ago; see `board_frame`."""
    return shot(number, at_ns - 20_000_000, size_px=(32, 24), payload=image)
