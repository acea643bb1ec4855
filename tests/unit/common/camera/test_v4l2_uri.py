"""The options of a `v4l2:` URI."""

from fractions import Fraction

import pytest

from common.camera.factory import open_camera
from common.camera.v4l2_controls import Axis, ControlWishes, PowerLine
from common.camera.v4l2_formats import SendPart, Wanted
from common.camera.v4l2_stream import V4l2Settings
from common.camera.v4l2_uri import v4l2_settings
from common.errors import SettingsError, UnavailableError
from common.frame import PixelFormat


def test_every_option_is_read() -> None:
    """Each option gets to its setting, in the units of the code."""
    options = {
        "size": "1280x720",
        "fps": "29.97",
        "format": "yuyv",
        "send": "luma",
        "exposure_ms": "12.5",
        "gain": "3",
        "white_balance": "4600",
        "focus": "20",
        "power_line": "50",
        "lock": "0",
        "readout_ms": "16.7",
        "latency_ms": "4",
    }
    held = ((Axis.EXPOSURE, 125), (Axis.GAIN, 3), (Axis.WHITE_BALANCE, 4600), (Axis.FOCUS, 20))
    assert v4l2_settings("v4l2:x", "/dev/video0", options, "host") == V4l2Settings(
        path="/dev/video0",
        wanted=Wanted((1280, 720), Fraction(2997, 100), PixelFormat.YUYV),
        wishes=ControlWishes(held, PowerLine.HZ_50, lock=False),
        part=SendPart.LUMA,
        readout_ns=16_700_000,
        latency_ns=4_000_000,
        clock="host",
    )


@pytest.mark.parametrize("path", ["auto", ""])
def test_auto_and_nothing_mean_the_first_camera(path: str) -> None:
    """`v4l2:auto` and `v4l2:` leave the choice of the camera open."""
    assert v4l2_settings("v4l2:", path, {}, "host") == V4l2Settings(clock="host")


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("size", "640"),
        ("size", "0x480"),
        ("fps", "0"),
        ("fps", "1/0"),
        ("format", "h264"),
        ("format", "png"),
        ("send", "half"),
        ("exposure_ms", "0"),
        ("exposure_ms", "1e99"),
        ("exposure_ms", "1e999999999"),
        ("latency_ms", "1e999999999"),
        ("fps", "1e-999999999"),
        ("gain", "much"),
        ("gain", "2147483648"),  # one more than a control's 32 bits hold
        ("white_balance", "-99999999999999999999"),
        ("power_line", "55"),
        ("lock", "yes"),
        ("readout_ms", "-1"),
        ("latency_ms", "2000"),
    ],
)
def test_a_value_of_no_use_is_refused_with_a_remedy(option: str, value: str) -> None:
    """A bad value is an error of one line that names the option and shows a valid one."""
    with pytest.raises(SettingsError) as caught:
        v4l2_settings("v4l2:/dev/video0", "/dev/video0", {option: value}, "host")
    text = str(caught.value)
    assert f"{option}={value}" in text
    assert "\n" not in text


def test_an_unknown_option_is_refused_with_the_list() -> None:
    """A misspelt option is named, and all options are listed."""
    with pytest.raises(SettingsError, match="'sice'") as caught:
        v4l2_settings("v4l2:x?sice=1", "x", {"sice": "1"}, "host")
    assert "size, fps" in caught.value.remedy


@pytest.mark.parametrize(
    ("uri", "said"),
    [("v4l2:/dev/there-is-none", "cannot be opened"), ("v4l2:/dev/null", "not a V4L2 device")],
)
def test_what_is_no_camera_is_refused_in_words(uri: str, said: str) -> None:
    """A missing node and a node of another kind are unavailable, each with its reason."""
    with pytest.raises(UnavailableError, match=said):
        open_camera(uri, "host", 0)
