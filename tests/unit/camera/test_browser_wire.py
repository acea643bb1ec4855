"""What a browser that gives its camera says, what it is told, and its address."""

import json
import math
from dataclasses import replace
from typing import Any

import pytest

from common.camera_identity import Lock
from common.errors import SettingsError
from common.frame import FrameFault, PixelFormat
from phone_host.camera.browser_locks import groups_of, locks_of
from phone_host.camera.browser_wire import (
    HEAD_BYTES,
    MOST_TEXT,
    BrowserFrame,
    Bye,
    EchoAsked,
    EchoHeard,
    Hello,
    Locked,
    TrackState,
    credit_text,
    echo_text,
    lock_text,
    read_frame,
    read_word,
    refused_text,
    session_named,
    told_text,
    want_text,
    welcome_text,
)
from phone_host.camera.factory import camera_orientation, check_camera, open_camera
from phone_host.camera.uris import BrowserSettings, Encoding, browser_settings
from tests.support.pictures import jpeg
from tests.support.scripted_browser import LUMA, Shot

SHOT = Shot(payload=jpeg(), width=32, height=24, stamp_us=5e9, callback_us=1.7e15, exposure_us=8000)
GREY = replace(SHOT, payload=bytes(32 * 24), encoding=LUMA)


def frame(shot: Shot, sequence: int = 7, dropped: int = 3) -> BrowserFrame | FrameFault:
    """What is read of an image."""
    return read_frame(shot.packed(sequence, dropped, shot.callback_us + 5000))


def test_an_image_is_read_as_it_was_sent() -> None:
    """Numbers, size, turn and times arrive; us become ns; what is not known is None."""
    assert HEAD_BYTES == 64
    read = frame(replace(SHOT, rotation=90))
    assert read == BrowserFrame(
        sequence=7,
        dropped=3,
        width_px=32,
        height_px=24,
        rotation_deg=90,
        pixel_format=PixelFormat.MJPEG,
        stamp_ns=5_000_000_000_000,
        capture_ns=None,
        callback_ns=1_700_000_000_000_000_000,
        exposure_ns=8_000_000,
        payload=SHOT.payload,
    )
    known = frame(replace(GREY, capture_us=1.6e15, exposure_us=0))
    assert isinstance(known, BrowserFrame)
    assert (known.capture_ns, known.exposure_ns) == (1_600_000_000_000_000_000, None)
    assert known.pixel_format is PixelFormat.GREY


TURNED_JPEG = (
    jpeg()[:2]
    + bytes.fromhex("ffe1 0022 457869660000 4d4d002a00000008 0001 0112 0003 00000001 0006 0000 00000000")
    + jpeg()[2:]
)


@pytest.mark.parametrize(
    ("shot", "fault"),
    [
        (replace(SHOT, payload=b""), FrameFault.EMPTY),
        (replace(SHOT, version=2), FrameFault.NO_START),
        (replace(SHOT, encoding=2), FrameFault.NO_START),
        (replace(SHOT, rotation=45), FrameFault.NO_START),
        (replace(SHOT, width=0), FrameFault.NO_START),
        (replace(SHOT, width=33), FrameFault.OTHER_SIZE),
        (replace(SHOT, payload=SHOT.payload[:-2]), FrameFault.NO_END),
        (replace(SHOT, payload=b"\xff\xd8\xff\xd9"), FrameFault.NO_END),
        (replace(SHOT, payload=b"GIF89a\xff\xd9"), FrameFault.NO_START),
        (replace(SHOT, payload=b"\xff\xd8\xff\xc0\x00\x11\x08\xff\xd9"), FrameFault.NO_END),
        (replace(SHOT, payload=TURNED_JPEG), FrameFault.TURNED),
        (replace(GREY, payload=bytes(32 * 24 + 1)), FrameFault.WRONG_LENGTH),
        (replace(SHOT, callback_us=math.nan), FrameFault.IMPLAUSIBLE_TIME),
        (replace(SHOT, stamp_us=math.inf), FrameFault.IMPLAUSIBLE_TIME),
        (replace(SHOT, callback_us=1e300), FrameFault.IMPLAUSIBLE_TIME),
    ],
)
def test_an_image_that_is_not_what_it_claims_is_refused_by_name(shot: Shot, fault: FrameFault) -> None:
    """Sizes come from the JPEG itself, luma has exactly its bytes, and times are numbers that can be."""
    assert frame(shot) is fault


def test_an_image_that_was_sent_before_it_was_encoded_is_refused() -> None:
    """The order of a browser's own stamps is part of what must be plausible."""
    assert read_frame(SHOT.packed(0, 0, SHOT.callback_us - 10)) is FrameFault.IMPLAUSIBLE_TIME


def word(**said: Any) -> object:
    """What is understood of a text."""
    return read_word(json.dumps(said))


def test_each_word_is_understood() -> None:
    """A hello tells the camera, its track and how the browser's clock is blurred; a muted track is not live."""
    hello = word(
        kind="hello",
        version=1,
        track="t",
        browser="Linux; Android 15",
        isolated=True,
        device={"id": "i" * 99, "label": "back\x1b[0m"},
    )
    assert isinstance(hello, Hello)
    assert (hello.track, hello.software, hello.is_phone, hello.resolution_ns) == ("t", "Android", True, 20_000)
    assert (hello.identity.driver, hello.identity.name, hello.identity.serial) == ("browser", "back\\x1b[0m", "i" * 48)
    assert not hello.is_other_version
    other = word(kind="hello", version=2)
    assert isinstance(other, Hello)
    assert (other.is_other_version, other.resolution_ns, other.identity.name) == (True, 1_000_000, "")
    assert word(kind="track", live=True, muted=False, words="x") == TrackState(is_live=True, words="x")
    assert word(kind="track", live=True, muted=True) == TrackState(is_live=False, words="")
    assert word(kind="locked", groups={"zoom": {"got": {"zoom": 2}}, "focus": 3}) == Locked(
        {"zoom": {"zoom": 2}, "focus": {}}
    )
    assert word(kind="bye", words="stopped") == Bye("stopped")
    assert word(kind="echo", n=1, t0=2.5) == EchoAsked(1, 2.5)
    assert word(kind="echoed", n=1, t0=2.5, t3=4) == EchoHeard(1, 2.5, 4.0)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[1]",
        "{",
        "[" * 10_000,
        " " * (MOST_TEXT + 1),
        '{"kind": "?"}',
        '{"kind": "echo", "n": -1, "t0": 1}',
        '{"kind": "echo", "n": 1.5, "t0": 1}',
        '{"kind": "echo", "n": true, "t0": 1}',
        '{"kind": "echo", "n": 1, "t0": NaN}',
        '{"kind": "echo", "n": 1, "t0": "1"}',
        '{"kind": "echoed", "n": 1, "t0": 1}',
        '{"kind": "echoed", "n": 1, "t0": 1, "t3": 1e300}',
    ],
)
def test_nonsense_is_nothing(text: str) -> None:
    """What is no word of ours is None, whatever it is."""
    assert read_word(text) is None


def test_what_the_host_says_is_json_as_described() -> None:
    """Times of the host's clock are texts, because JSON's readers round large numbers."""
    settings = BrowserSettings(size_px=(640, 480), encoding=Encoding.LUMA, quality=0.8)
    want = {"width": 640, "height": 480, "fps": None, "encoding": "luma", "quality": 0.8}
    assert json.loads(welcome_text("s", settings, {})) == {
        "kind": "welcome",
        "session": "s",
        "want": want,
        "locks": None,
    }
    locks = {"zoom": {"zoom": 1}}
    assert json.loads(welcome_text("s", settings, locks))["locks"] == {"groups": locks}
    assert json.loads(want_text(settings)) == {"kind": "want"} | want
    assert json.loads(lock_text(locks)) == {"kind": "lock", "groups": locks}
    assert json.loads(credit_text(5)) == {"kind": "credit", "up_to": 5}
    assert json.loads(told_text("x")) == {"kind": "told", "words": "x"}
    assert json.loads(refused_text("p", "r")) == {"kind": "refused", "problem": "p", "remedy": "r"}
    assert json.loads(echo_text(EchoAsked(3, 2.5), 2**60, 2**60 + 1)) == {
        "kind": "echo",
        "n": 3,
        "t0": 2.5,
        "t1": str(2**60),
        "t2": str(2**60 + 1),
    }
    assert session_named('{"kind": "hello", "session": "abc"}') == "abc"
    assert session_named('{"kind": "echo", "session": "abc"}') == ""


def test_locks_are_constraints_and_back() -> None:
    """The rig's whole numbers (us, K, mm, hundredths) and the browser's constraint values tell the same."""
    locks = ((Lock.EXPOSURE, 10_000), (Lock.WHITE_BALANCE, 4600), (Lock.FOCUS, 350), (Lock.ZOOM, 150))
    groups = groups_of(locks)
    assert groups == {
        "exposure": {"exposureMode": "manual", "exposureTime": 100},
        "white_balance": {"whiteBalanceMode": "manual", "colorTemperature": 4600},
        "focus": {"focusMode": "manual", "focusDistance": 0.35},
        "zoom": {"zoom": 1.5},
    }
    assert locks_of(groups) == locks
    automatic: dict[str, dict[str, object]] = {
        "focus": {"focusMode": "continuous", "focusDistance": 0.35},
        "zoom": {"zoom": math.nan},
    }
    assert locks_of(automatic | {"exposure": {"exposureMode": "manual", "exposureTime": True}}) == ()


def test_an_address_is_read() -> None:
    """All options, none, and a camera that is mounted turned."""
    full = browser_settings("browser:?w=640&h=480&fps=30&encoding=luma&quality=0.8", "c")
    assert full == BrowserSettings(size_px=(640, 480), fps=full.fps, encoding=Encoding.LUMA, quality=0.8, clock="c")
    assert full.fps == 30
    assert browser_settings("browser:", "host") == BrowserSettings()
    check_camera("browser:?rotate=90&w=640&h=480")
    assert camera_orientation("browser:?rotate=90").rotate_deg == 90


@pytest.mark.parametrize(
    "uri",
    [
        "browser:phone",
        "browser:?w=640",
        "browser:?w=640&h=4",
        "browser:?w=640&h=x",
        "browser:?fps=0",
        "browser:?quality=nan",
        "browser:?quality=7777777777777",
        "browser:?encoding=png",
        "browser:?w",
        "browser:?w=640&w=640&h=480",
        "browser:?size=640x480",
        "browser:?rotate=45",
    ],
)
def test_a_wrong_address_is_refused_in_one_line(uri: str) -> None:
    """The error says what to give instead."""
    with pytest.raises(SettingsError) as caught:
        check_camera(uri)
    assert "\n" not in str(caught.value)


def test_without_a_page_there_is_no_browser() -> None:
    """The remedy names both ways to have a page."""
    with pytest.raises(SettingsError, match="--serve") as caught:
        open_camera("browser:", "host", 0)
    assert caught.value.exit_code == 2
