"""The options of a `v4l2:` URI."""

import re
from collections.abc import Mapping
from typing import Final

from common.camera.options import TRUTHS, OptionReader, exact, milliseconds, rate
from common.camera.v4l2_controls import Axis, ControlWishes, PowerLine
from common.camera.v4l2_formats import SendPart, Wanted
from common.camera.v4l2_stream import V4l2Settings
from common.frame import PixelFormat

FORMATS: Final = (PixelFormat.MJPEG, PixelFormat.YUYV, PixelFormat.GREY, PixelFormat.NV12)

_HELP: Final = {
    "size": "WIDTHxHEIGHT, such as size=640x480",
    "fps": "frames per second, such as fps=30",
    "format": f"one of {', '.join(item.value for item in FORMATS)}",
    "send": "send=whole, or send=luma for the grey part of raw images",
    "exposure_ms": "exposure time, such as exposure_ms=10",
    "gain": "gain in the camera's own unit, such as gain=32",
    "white_balance": "colour temperature in K, such as white_balance=4600",
    "focus": "focus in the camera's own unit, such as focus=20",
    "zoom": "zoom in the camera's own unit, such as zoom=100",
    "power_line": "power_line=50 or power_line=60, the mains of the lamps, or power_line=off",
    "lock": "lock=1 to hold exposure, gain, white balance, focus and zoom as found, lock=0 to leave them automatic",
    "readout_ms": "readout time of the sensor, such as readout_ms=16.7",
    "latency_ms": "constant between readout and stamp, such as latency_ms=4",
}
_LARGEST: Final = 2**31 - 1


def v4l2_settings(uri: str, path: str, options: Mapping[str, str], clock: str) -> V4l2Settings:
    """Parse the options of a camera URI.

    Args:
        uri: the whole URI, for errors.
        path: node or link; `auto` or empty for the first camera.
        options: the options after the question mark.
        clock: name of the clock of the stamps.

    Raises:
        SettingsError: an option is unknown or makes no sense.
    """
    read = OptionReader(uri, options, _HELP).read
    held = [
        (axis, value)
        for axis, value in (
            (Axis.EXPOSURE, read("exposure_ms", _exposure, None)),
            (Axis.GAIN, read("gain", _whole, None)),
            (Axis.WHITE_BALANCE, read("white_balance", _whole, None)),
            (Axis.FOCUS, read("focus", _whole, None)),
            (Axis.ZOOM, read("zoom", _whole, None)),
        )
        if value is not None
    ]
    return V4l2Settings(
        path="" if path == "auto" else path,
        wanted=Wanted(read("size", _size, None), read("fps", rate, None), read("format", _format, None)),
        wishes=ControlWishes(
            tuple(held), read("power_line", _POWER_LINES.__getitem__, None), read("lock", TRUTHS.__getitem__, _LOCK)
        ),
        part=read("send", SendPart, SendPart.WHOLE),
        readout_ns=read("readout_ms", milliseconds, None),
        latency_ns=read("latency_ms", milliseconds, 0),
        clock=clock,
    )


_LOCK: Final[bool] = True
_POWER_LINES: Final[Mapping[str, PowerLine | None]] = {
    "off": PowerLine.OFF,
    "50": PowerLine.HZ_50,
    "60": PowerLine.HZ_60,
}


def _size(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,5})[xX](\d{1,5})", text)
    if match is None or not all(map(int, match.groups())):
        raise ValueError(text)
    return int(match[1]), int(match[2])


def _format(text: str) -> PixelFormat:
    found = PixelFormat(text)
    if found not in FORMATS:
        raise ValueError(text)
    return found


def _exposure(text: str) -> int:
    """Convert milliseconds to the control's unit of 100 us, at least one."""
    units = round(exact(text) * 10)
    if not 1 <= units <= _LARGEST:
        raise ValueError(text)
    return units


def _whole(text: str) -> int:
    value = int(text)
    if abs(value) > _LARGEST:
        raise ValueError(text)
    return value
