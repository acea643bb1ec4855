"""What a recording of ours holds: its topics, and what it tells of itself. Pure.

All times are ns since 1970: those of the host's monotonic clock plus `unix_ns`. docs/recordings.md describes it for others.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from common.camera_identity import identity_of
from common.errors import SettingsError
from common.frame import PixelFormat
from common.orientation import UPRIGHT, Orientation, orientation_of
from common.protocol.message import CameraDescription, Pacing, Steering
from common.recording.mcap_writer import Topic
from common.recording.ros_messages import CAMERA_INFO, COMPRESSED_IMAGE, IMAGE, POINT_CLOUD, SCHEMAS

FORMAT_VERSION: Final = 1
SIDES: Final = ("left", "right")
DELAYS: Final = "/delays"
CLOCK: Final = "/clock_estimate"
CAPTURE: Final = "/board_capture"
"""How long after its exposure each frame of the board was grabbed: the one mark for which an image's message has no place."""

DEPTH: Final = "/depth"
CLOUD: Final = "/cloud"
COMPUTED: Final = (DEPTH, CLOUD)
"""What a run has computed, if that was asked for. Nobody here reads it: a replay computes it again."""

ABOUT: Final = "tandemscan"
"""Name of the metadata that tell of the whole."""

_IMAGE: Final = {COMPRESSED_IMAGE: "/{}/image/compressed", IMAGE: "/{}/image"}


def image_topic(side: str, kind: str) -> str:
    """Return the topic of a camera's images.

    Args:
        side: left or right.
        kind: the message, COMPRESSED_IMAGE or IMAGE.
    """
    return _IMAGE[kind].format(side)


def camera_info_topic(side: str) -> str:
    """Return the topic of what is known of a camera; `side` is left or right."""
    return f"/{side}/camera_info"


def side_of(topic: str) -> str:
    """Return left or right; empty: the topic is no image of ours."""
    return next((side for side in SIDES for form in _IMAGE.values() if form.format(side) == topic), "")


def topics() -> tuple[Topic, ...]:
    """Return all topics of a recording."""
    told = [(image_topic(side, kind), kind) for kind in _IMAGE for side in SIDES]
    told += [(camera_info_topic(side), CAMERA_INFO) for side in SIDES]
    told += [(DEPTH, IMAGE), (CLOUD, POINT_CLOUD)]
    ros = [Topic(name, "cdr", kind, "ros2msg", SCHEMAS[kind].encode()) for name, kind in told]
    return (*ros, *(Topic(name, "json") for name in (DELAYS, CLOCK, CAPTURE)))


@dataclass(frozen=True, slots=True, kw_only=True)
class About:
    """What a recording tells of the whole.

    Attributes:
        unix_ns: Unix time minus the monotonic clock of whoever recorded when it began, ns.
        board_side: left or right: which images came over the link.
        host_boot_id: of which boot of the host that clock is.
        board_boot_id: a board recorded alone, and the clock is that of this boot of it; empty: a host recorded.
        versions: of package, protocol and files, for people.
    """

    unix_ns: int = 0
    board_side: str = "left"
    host_boot_id: str = ""
    board_boot_id: str = ""
    versions: str = ""

    def values(self) -> dict[str, str]:
        """Return it as a metadata record has it."""
        return {
            "format_version": str(FORMAT_VERSION),
            "unix_ns": str(self.unix_ns),
            "board_side": self.board_side,
            "host_boot_id": self.host_boot_id,
            "board_boot_id": self.board_boot_id,
            "versions": self.versions,
        }


def about_of(values: Mapping[str, str]) -> About:
    """Read it again. What is missing or spoiled is as in a file of another program: times are Unix times."""
    side = values.get("board_side", "left")
    return About(
        unix_ns=_whole(values, "unix_ns"),
        board_side=side if side in SIDES else "left",
        host_boot_id=values.get("host_boot_id", ""),
        board_boot_id=values.get("board_boot_id", ""),
        versions=values.get("versions", ""),
    )


def camera_name(side: str) -> str:
    """Return the name of the metadata that tell of one camera."""
    return f"camera {side}"


def camera_values(camera: CameraDescription) -> dict[str, str]:
    """Return what is told of a camera as a metadata record has it."""
    return {
        "name": camera.name,
        "width_px": str(camera.width_px),
        "height_px": str(camera.height_px),
        "pixel_format": camera.pixel_format.value,
        "period_ns": str(camera.period_ns),
        "has_exact_stamps": str(int(camera.has_exact_stamps)),
        "orientation": str(camera.orientation),
        "driver": camera.identity.driver,
        "device": camera.identity.name,
        "serial": camera.identity.serial,
    }


def camera_of(
    values: Mapping[str, str], size_px: tuple[int, int], form: PixelFormat, period_ns: int
) -> CameraDescription:
    """Read what is told of a camera.

    Args:
        values: the metadata; empty: nothing is told.
        size_px: width and height of its first image: what is true if nothing else is told.
        form: encoding of its images.
        period_ns: median time between its images, for a file that does not tell.
    """
    width, height = _whole(values, "width_px"), _whole(values, "height_px")
    is_told = width > 0 and height > 0
    return CameraDescription(
        name=values.get("name", "recorded camera"),
        width_px=width if is_told else size_px[0],
        height_px=height if is_told else size_px[1],
        pixel_format=form,
        period_ns=max(1, _whole(values, "period_ns") or period_ns),
        pacing=Pacing.CLOCK,
        steering=Steering.GRID if values.get("has_exact_stamps") == "1" else Steering.NONE,
        orientation=_orientation(values.get("orientation", "")),
        identity=identity_of(values.get("driver", ""), values.get("device", ""), values.get("serial", "")),
    )


def _orientation(text: str) -> Orientation:
    options = dict(each.partition("=")[::2] for each in text.split("&"))
    try:
        return orientation_of(options, text)
    except SettingsError:
        return UPRIGHT


def _whole(values: Mapping[str, str], key: str) -> int:
    text = values.get(key, "")
    return int(text) if text.isascii() and text.isdecimal() and len(text) < 20 else 0


class CaptureRuns:
    """Collects what one message of CAPTURE tells: [first sequence, [ns, ns, ...]] for each run of frames without a gap."""

    def __init__(self) -> None:
        self._runs: list[tuple[int, list[int]]] = []

    def note(self, sequence: int, capture_ns: int) -> None:
        """Take note of a frame.

        Args:
            sequence: its number.
            capture_ns: from its exposure until it was grabbed, ns.
        """
        first, values = self._runs[-1] if self._runs else (sequence, [])
        if not self._runs or first + len(values) != sequence:
            values = []
            self._runs.append((sequence, values))
        values.append(capture_ns)

    def take(self) -> bytes:
        """Return the message of what was noted, and begin anew; empty: nothing was."""
        text = json.dumps(self._runs, separators=(",", ":")).encode() if self._runs else b""
        self._runs = []
        return text
