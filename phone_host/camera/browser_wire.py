"""What a browser that gives its camera and the host say to each other. Pure: strangers' bytes as values, values as text.

Two WebSockets of one browser: on the first it says hello, sends frames and what becomes of its camera; the host gives
credit. The second carries nothing but clock echoes, so that they never queue behind frames. Whatever is not exactly as
described here is nothing.
"""

import json
import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from common.camera_identity import CameraIdentity, identity_of
from common.frame import FrameFault, PixelFormat, SpoiledImageError, find_fault
from common.imagesize.jpeg import jpeg_head
from common.orientation import UPRIGHT
from common.plain_text import printable
from common.protocol.wire_fields import MAX_SIZE_PX
from phone_host.camera.uris import BrowserSettings

VERSION: Final = 1
MOST_TEXT: Final = 16_384
"""Letters of a text message: a phone's capabilities have some 2000."""

DRIVER: Final = "browser"
"""Stands where a camera of this machine has its kernel driver."""

_HEAD: Final = struct.Struct("<BBHHHIIdddddII")
HEAD_BYTES: Final = _HEAD.size
_FORMATS: Final = {0: PixelFormat.MJPEG, 1: PixelFormat.GREY}
_TURNS: Final = frozenset({0, 90, 180, 270})
_MOST_US: Final = 4e15
"""Beyond the year 2090, and 63 bits hold its nanoseconds."""

_LONGEST_US: Final = 60e6
"""No browser keeps a frame for a minute."""

_MOST_EXPOSURE_US: Final = 10_000_000
_MOST_NUMBER: Final = 2**53
_MOST_LETTERS: Final = 300
_TRACK_LETTERS: Final = 64

Groups = Mapping[str, Mapping[str, object]]
"""Constraint values (W3C Image Capture) by group: focus, exposure, white_balance, zoom, torch."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Hello:
    """A browser offers its camera.

    Attributes:
        identity: which camera it is, as far as a browser tells.
        track: changes whenever the camera was opened anew: numbers, and perhaps the stamps' epoch, begin again.
        software: name and version of the browser, as far as it tells; empty: unknown.
        is_phone: whether its images' stamps are those of Android's camera: the beginning of the exposure.
        resolution_ns: how far a reading of the browser's clock may be off: browsers blur it.
        is_other_version: whether it speaks another version of this.
    """

    identity: CameraIdentity
    track: str
    software: str
    is_phone: bool
    resolution_ns: int
    is_other_version: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackState:
    """What has become of a browser's camera.

    Attributes:
        is_live: whether it gives images.
        words: what the browser says about it; may be empty.
    """

    is_live: bool
    words: str


@dataclass(frozen=True, slots=True)
class Locked:
    """What a browser's camera is held at.

    Attributes:
        groups: the values that were read back.
    """

    groups: Groups


@dataclass(frozen=True, slots=True)
class Bye:
    """The browser's user has ended it."""

    words: str


@dataclass(frozen=True, slots=True)
class EchoAsked:
    """A clock echo begins: its number, and the browser's time, us."""

    number: int
    t0_us: float


@dataclass(frozen=True, slots=True)
class EchoHeard:
    """A clock echo has ended: its number, and the browser's time when it began and when the answer came, us."""

    number: int
    t0_us: float
    t3_us: float


@dataclass(frozen=True, slots=True, kw_only=True)
class BrowserFrame:
    """One image as it came.

    Attributes:
        sequence: number of the image among all that the camera gave since it was opened.
        dropped: how many of these the browser has dropped.
        width_px: width, px.
        height_px: height, px.
        rotation_deg: how far the screen was turned, 0, 90, 180 or 270 degrees.
        pixel_format: MJPEG or GREY.
        stamp_ns: the browser's stamp of the image, on a clock that nobody has named, ns.
        capture_ns: when the browser says that it was captured, on the browser's clock, ns; None: it does not say.
        callback_ns: when the browser's program got it, browser's clock, ns.
        exposure_ns: exposure time, ns; None: unknown.
        payload: the image.
    """

    sequence: int
    dropped: int
    width_px: int
    height_px: int
    rotation_deg: int
    pixel_format: PixelFormat
    stamp_ns: int
    capture_ns: int | None
    callback_ns: int
    exposure_ns: int | None
    payload: bytes


Word = Hello | TrackState | Locked | Bye | EchoAsked | EchoHeard


def read_frame(data: bytes) -> BrowserFrame | FrameFault:
    """Read a binary message.

    Returns:
        The image, whole as far as its bytes show without decoding and of the size that it claims; else what is wrong.
    """
    if len(data) <= HEAD_BYTES:
        return FrameFault.EMPTY
    version, encoding, turn, width, height, sequence, dropped, *times, exposure_us, _ = _HEAD.unpack_from(data)
    stamp_us, capture_us, callback_us, encoded_us, sent_us = times
    pixel_format, payload = _FORMATS.get(encoding), data[HEAD_BYTES:]
    sizes_fit = 1 <= width <= MAX_SIZE_PX and 1 <= height <= MAX_SIZE_PX
    if version != VERSION or pixel_format is None or turn not in _TURNS or not sizes_fit:
        return FrameFault.NO_START
    if fault := _image_fault(pixel_format, payload, (width, height)):
        return fault
    ordered = callback_us <= encoded_us <= sent_us <= callback_us + _LONGEST_US
    if not ordered or not all(abs(time) <= _MOST_US for time in (stamp_us, callback_us, sent_us)):
        return FrameFault.IMPLAUSIBLE_TIME
    has_capture = abs(capture_us) <= _MOST_US  # NaN has none
    return BrowserFrame(
        sequence=sequence,
        dropped=min(dropped, sequence),
        width_px=width,
        height_px=height,
        rotation_deg=turn,
        pixel_format=pixel_format,
        stamp_ns=round(stamp_us * 1000),
        capture_ns=round(capture_us * 1000) if has_capture else None,
        callback_ns=round(callback_us * 1000),
        exposure_ns=exposure_us * 1000 if 0 < exposure_us <= _MOST_EXPOSURE_US else None,
        payload=payload,
    )


def _image_fault(pixel_format: PixelFormat, payload: bytes, size_px: tuple[int, int]) -> FrameFault | None:
    """Return what is wrong with an image's bytes, None: nothing that shows without decoding."""
    if pixel_format is PixelFormat.GREY:
        return None if len(payload) == size_px[0] * size_px[1] else FrameFault.WRONG_LENGTH
    if fault := find_fault(pixel_format, payload):
        return fault
    try:
        head = jpeg_head(payload, "a browser's image")
    except SpoiledImageError as error:
        return error.fault
    except struct.error:
        return FrameFault.NO_END
    if head.orientation != UPRIGHT:
        return FrameFault.TURNED
    return None if head.size_px == size_px else FrameFault.OTHER_SIZE


def read_word(text: str) -> Word | None:  # noqa: PLR0911 - one return for each kind of word
    """Read a text message.

    Returns:
        What it says; None: nothing that we know.
    """
    said = _object(text)
    match said.get("kind"):
        case "hello":
            return _hello(said)
        case "track":
            is_live = said.get("live") is True and said.get("muted") is not True
            return TrackState(is_live=is_live, words=_plain(said.get("words")))
        case "locked":
            groups = _of(said.get("groups"))
            return Locked({name: _of(_of(group).get("got")) for name, group in groups.items()})
        case "bye":
            return Bye(_plain(said.get("words")))
        case "echo":
            number, t0_us = _whole(said.get("n")), _time(said.get("t0"))
            return None if number is None or t0_us is None else EchoAsked(number, t0_us)
        case "echoed":
            number, t0_us, t3_us = _whole(said.get("n")), _time(said.get("t0")), _time(said.get("t3"))
            return None if number is None or t0_us is None or t3_us is None else EchoHeard(number, t0_us, t3_us)
    return None


def session_named(text: str) -> str:
    """Return the session that the hello of a clock socket names; empty: none."""
    said = _object(text)
    return _plain(said.get("session")) if said.get("kind") == "hello" else ""


def welcome_text(session: str, settings: BrowserSettings, locks: Groups) -> str:
    """Say that a browser's camera is welcome.

    Args:
        session: what its clock socket names.
        settings: what is wanted.
        locks: what the camera shall be held at; empty: as the browser finds it.
    """
    locked = {"groups": locks} if locks else None
    return _text({"kind": "welcome", "session": session, "want": _wanted(settings), "locks": locked})


def refused_text(problem: str, remedy: str) -> str:
    """Say that a browser's camera is not taken, and what to do."""
    return _text({"kind": "refused", "problem": problem, "remedy": remedy})


def want_text(settings: BrowserSettings) -> str:
    """Say what is wanted from now on."""
    return _text({"kind": "want"} | _wanted(settings))


def lock_text(groups: Groups) -> str:
    """Say what the camera shall be held at."""
    return _text({"kind": "lock", "groups": groups})


def credit_text(up_to: int) -> str:
    """Say how many frames may be sent, counted from the hello."""
    return _text({"kind": "credit", "up_to": up_to})


def told_text(words: str) -> str:
    """Say something to the browser's user; empty: nothing any more."""
    return _text({"kind": "told", "words": words})


IDLE_TEXT: Final = '{"kind": "idle"}'
"""Nobody needs frames now."""


def echo_text(asked: EchoAsked, t1_ns: int, t2_ns: int) -> str:
    """Answer a clock echo."""
    return _text({"kind": "echo", "n": asked.number, "t0": asked.t0_us, "t1": str(t1_ns), "t2": str(t2_ns)})


def _wanted(settings: BrowserSettings) -> dict[str, object]:
    width, height = settings.size_px or (None, None)
    return {
        "width": width,
        "height": height,
        "fps": None if settings.fps is None else float(settings.fps),
        "encoding": None if settings.encoding is None else settings.encoding.value,
        "quality": settings.quality,
    }


def _hello(said: Mapping[str, Any]) -> Hello:
    device = _of(said.get("device"))
    browser = _plain(said.get("browser"))
    identity = identity_of(DRIVER, _plain(device.get("label")), _plain(device.get("id")))
    return Hello(
        identity=identity,
        track=_plain(said.get("track"))[:_TRACK_LETTERS],
        software=browser_name(browser),
        is_phone="Android" in browser,
        # Blurred to 5 us (Chromium) or 20 us (Firefox) in a page that is isolated, else to 0.1 ms or 1 ms.
        resolution_ns=20_000 if said.get("isolated") is True else 1_000_000,
        is_other_version=said.get("version") != VERSION,
    )


def _object(text: str) -> Mapping[str, Any]:
    """Read a JSON object; an empty one stands for what is none."""
    if len(text) > MOST_TEXT:
        return {}
    try:
        return _of(json.loads(text))
    except (ValueError, RecursionError):
        return {}


def _of(value: object) -> Mapping[str, Any]:
    return value if isinstance(value, dict) else {}


def _plain(value: object) -> str:
    """Return a text of a stranger as it may be shown; empty: it is none."""
    return printable(value[:_MOST_LETTERS]) if isinstance(value, str) else ""


def _number(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) <= _MOST_NUMBER:
        return None
    return float(value)


def _whole(value: object) -> int | None:
    number = _number(value)
    return None if number is None or number < 0 or number != int(number) else int(number)


def _time(value: object) -> float | None:
    """Read a time, us."""
    number = _number(value)
    return None if number is None or not abs(number) <= _MOST_US else number


def _text(values: Mapping[str, object]) -> str:
    return json.dumps(values, allow_nan=False)


_NAMES: Final = (
    # The first that fits: Edge and Samsung's browser call themselves Chrome, too, and Chrome calls itself Safari.
    ("Edge", re.compile(r"Edg(?:A|iOS)?/(\d{1,4})")),
    ("Samsung Internet", re.compile(r"SamsungBrowser/(\d{1,4})")),
    ("Opera", re.compile(r"OPR/(\d{1,4})")),
    ("Firefox", re.compile(r"(?:Firefox|FxiOS)/(\d{1,4})")),
    ("Chrome", re.compile(r"(?:Chrome|CriOS)/(\d{1,4})")),
    ("Safari", re.compile(r"Version/(\d{1,4})\S* (?:Mobile/\S+ )?Safari/")),
)
_SYSTEMS: Final = (
    ("Android", "Android"),
    ("iPhone", "iPhone"),
    ("iPad", "iPad"),
    ("Windows", "Windows"),
    ("Macintosh", "macOS"),
    ("CrOS", "ChromeOS"),
    ("Linux", "Linux"),
)


def browser_name(agent: str) -> str:
    """Return a browser's name, its main version and its system, such as "Chrome 141 on Android".

    Browsers no longer tell the system's version nor the phone's name.

    Args:
        agent: its User-Agent.

    Returns:
        What is known of it; empty: nothing.
    """
    found = ((name, pattern.search(agent)) for name, pattern in _NAMES)
    browser = next((f"{name} {match[1]}" for name, match in found if match is not None), "")
    system = next((name for word, name in _SYSTEMS if word in agent), "")
    return f"{browser} on {system}" if browser and system else browser or system
