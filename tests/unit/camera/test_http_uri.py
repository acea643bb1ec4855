"""The address of an MJPEG server, and how irregular arrivals are reported."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import SettingsError
from phone_host.camera.jpegs import Arrivals
from phone_host.camera.uris import HttpSettings, http_settings, without_password

MS = 1_000_000


@pytest.mark.parametrize(
    ("uri", "settings"),
    [
        ("http://phone:8080/video", HttpSettings(secure=False, host="phone", port=8080, target="/video")),
        ("http://192.168.1.7", HttpSettings(secure=False, host="192.168.1.7", port=80, target="/")),
        ("HTTPS://phone/video", HttpSettings(secure=True, host="phone", port=443, target="/video")),
        ("http://[fe80::1]:4747/video", HttpSettings(secure=False, host="fe80::1", port=4747, target="/video")),
        ("http://phone/?action=stream", HttpSettings(secure=False, host="phone", port=80, target="/?action=stream")),
        (
            "http://phone/?action=stream&latency_ms=120.5&a=%20b",
            HttpSettings(secure=False, host="phone", port=80, target="/?action=stream&a=+b", latency_ns=120_500_000),
        ),
        (
            "https://me:a%3Ab%40c@phone:1/v?latency_ms=90&latency_uncertainty_ms=15&verify=0",
            HttpSettings(
                secure=True,
                host="phone",
                port=1,
                target="/v",
                user="me",
                password="a:b@c",
                latency_ns=90 * MS,
                latency_uncertainty_ns=15 * MS,
                verify=False,
            ),
        ),
    ],
)
def test_addresses(uri: str, settings: HttpSettings) -> None:
    """An address gives host, port, what the server gets, name and password, and our own options, which the server does not get."""
    assert http_settings(uri, "host") == settings


@pytest.mark.parametrize(
    ("uri", "named"),
    [
        ("http://", "not a valid address"),
        ("http://phone:99999/video", "not a valid address"),
        ("http://phone:0/video", "not a valid address"),
        ("http://[phone/video", "not a valid address"),
        ("http://phone/vi deo", "not a valid address"),
        ("http://phone/a\r\nX: y", "not a valid address"),
        ("http://phone/v?latency_ms=soon", "latency_ms=soon"),
        ("http://phone/v?latency_ms=-1", "latency_ms=-1"),
        ("http://phone/v?latency_ms=1e999999999", "latency_ms=1e999999999"),
        ("http://phone/v?verify=maybe", "verify=maybe"),
        ("http://phone/v?latency_uncertainty_ms=5", "latency_uncertainty_ms but no latency_ms"),
    ],
)
def test_what_is_no_address_is_refused(uri: str, named: str) -> None:
    """An unusable address or option is refused in one line that names it."""
    with pytest.raises(SettingsError, match=named):
        http_settings(uri, "host")


def test_a_password_is_never_shown() -> None:
    """Neither an error nor the address in logs contains the password."""
    assert "secret" not in http_settings("http://me:secret@phone/video", "host").shown
    for wrong in ("http://me:secret@phone/v?latency_ms=x", "http://me:secret@phone:99999/v", "http://me:secret@/v"):
        with pytest.raises(SettingsError) as caught:
            http_settings(wrong, "host")
        assert "secret" not in str(caught.value)


@given(st.floats(1e6, 1e9), st.integers(0, 2**40))
def test_a_steady_pace_has_no_jitter(period_ns: float, start_ns: int) -> None:
    """Arrivals at an even pace of any rate are not late, apart from rounding to ns."""
    arrivals = Arrivals()
    for number in range(40):
        arrivals.add(number, start_ns + round(number * period_ns))
    assert arrivals.jitter_ns is not None
    assert arrivals.jitter_ns <= 3


def test_jitter_is_how_late_nineteen_of_twenty_are() -> None:
    """If arrivals are evenly 0 to 20 ms late, 95 % are late by about 19 ms or less, whichever frames are missing."""
    chance, arrivals = random.Random(3), Arrivals()
    for number in range(200):
        if number % 7:
            arrivals.add(number, number * 33 * MS + chance.randrange(20 * MS))
    assert arrivals.jitter_ns is not None
    assert 15 * MS < arrivals.jitter_ns < 21 * MS
    arrivals.restart()
    assert arrivals.jitter_ns is None


@pytest.mark.parametrize(
    ("uri", "shown"),
    [
        ("http://me:secret@phone:8080/video?a=b@c", "http://phone:8080/video?a=b@c"),
        ("HTTPS://me@phone", "HTTPS://phone"),
        ("http://phone/video", "http://phone/video"),
        ("v4l2:/dev/video0?size=640x480", "v4l2:/dev/video0?size=640x480"),
        ("replay:some@where/left", "replay:some@where/left"),
    ],
)
def test_a_camera_is_named_in_files_without_its_password(uri: str, shown: str) -> None:
    """Name and password of a server are left out and the rest stays; anything that is not a server's address stays as it is."""
    assert without_password(uri) == shown
