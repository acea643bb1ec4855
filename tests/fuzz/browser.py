"""Fuzz target: what a browser that gives its camera sends."""

import json
import math
from dataclasses import replace

from common.camera_identity import CameraIdentity
from common.frame import PixelFormat
from phone_host.camera.browser_border import Believed, BrowserBorder
from phone_host.camera.browser_clock import BrowserClock
from phone_host.camera.browser_locks import groups_of, locks_of
from phone_host.camera.browser_wire import EchoAsked, EchoHeard, Hello, Locked, read_word, session_named
from tests.support.pictures import jpeg
from tests.support.scripted_browser import LUMA, Shot

_HELLO = Hello(identity=CameraIdentity(), track="t", software="", is_phone=True, resolution_ns=20_000)
_PERIOD_NS = 33_333_333
_START_NS = 10**12
_PIXELS = Shot(payload=bytes(4), width=2, height=2, encoding=LUMA)


def browser(data: bytes) -> None:
    """Texts and images in turn, each after its length. Whatever they say, only whole images with possible, growing times are believed."""
    clock, border = BrowserClock(_HELLO.resolution_ns), BrowserBorder(None)
    border.begin(_HELLO, is_same_machine=True)
    clock.asked(EchoAsked(0, 0.0), _START_NS, _START_NS + 1000)
    clock.heard(EchoHeard(0, 0.0, 500.0))
    arrived_ns, newest_ns, size_px, at = _START_NS, 0, None, 0
    while at + 2 <= len(data):
        length = int.from_bytes(data[at : at + 2], "little")
        message, at = data[at + 2 : at + 2 + length], at + 2 + length
        arrived_ns += _PERIOD_NS
        _word(message.decode("utf-8", "replace"), clock, arrived_ns)
        judged = border.judge(message, arrived_ns, clock, 5)
        if not isinstance(judged, Believed):
            continue
        image, exposed = judged.image, judged.exposed
        assert newest_ns < exposed.ns <= arrived_ns + _PERIOD_NS, "a time that cannot be"
        assert 0 <= exposed.uncertainty_ns <= exposed.bound_ns, "an uncertainty beyond its bound"
        assert size_px in {None, (image.width_px, image.height_px)}, "another size"
        luma = image.pixel_format is PixelFormat.GREY
        assert not luma or len(image.payload) == image.width_px * image.height_px, "bytes beyond the image"
        newest_ns, size_px = exposed.ns, (image.width_px, image.height_px)


def _word(text: str, clock: BrowserClock, now_ns: int) -> None:
    session_named(text)
    word = read_word(text)
    match word:
        case Locked(groups):
            locks = locks_of(groups)
            assert locks_of(groups_of(locks)) == locks, "a lock that changes on its way"
        case EchoAsked():
            assert math.isfinite(word.t0_us), "no time"
            clock.asked(word, now_ns, now_ns)
        case EchoHeard():
            clock.heard(word)


def browser_seeds() -> list[bytes]:
    words = [
        {"kind": "hello", "version": 1, "track": "t", "device": {"id": "d", "label": "l"}, "isolated": True},
        {"kind": "track", "live": True, "muted": False, "words": ""},
        {"kind": "locked", "groups": {"focus": {"got": {"focusMode": "manual", "focusDistance": 0.4}}}},
        {"kind": "bye", "words": "x"},
        {"kind": "echo", "n": 1, "t0": 33_333.0},
        {"kind": "echoed", "n": 1, "t0": 33_333.0, "t3": 33_500.0},
    ]
    film = []
    for number in range(12):
        at_us = (number + 1) * _PERIOD_NS / 1000 - 5000
        shot = replace(_PIXELS, stamp_us=_START_NS / 1000 + at_us - 5, callback_us=at_us, exposure_us=8)
        film.append(shot.packed(number, 0, at_us + 1000))
    still = Shot(payload=jpeg(), width=32, height=24).packed(9, 2, 1.0)
    return [_joined([json.dumps(word).encode() for word in words]), _joined(film), _joined([still])]


def _joined(messages: list[bytes]) -> bytes:
    return b"".join(len(message).to_bytes(2, "little") + message for message in messages)
