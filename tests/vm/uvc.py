"""What a small MJPEG webcam reports about itself: USB 2.0 and UVC 1.0 descriptors and its controls. Values only, no I/O.

Sources: USB 2.0 specification, chapter 9; USB Device Class Definition for Video Devices 1.0a, chapters 3 (descriptors) and 4 (requests).
"""

import struct
from dataclasses import dataclass
from typing import Final

PAYLOAD_BYTES: Final = 16384
"""The driver's largest transfer (32 packets of 512 bytes): one payload for each."""

_MAX_FRAME_BYTES: Final = 614400
_CLOCK_HZ: Final = 48_000_000
_VIDEO_CONTROL, _VIDEO_STREAMING, _CAMERA, _PROCESSING = 0, 1, 1, 2
_CS_INTERFACE, _CS_ENDPOINT_IN = 0x24, 0x81

SET_CUR, GET_CUR, GET_MIN, GET_MAX, GET_RES, GET_LEN, GET_INFO, GET_DEF = 0x01, 0x81, 0x82, 0x83, 0x84, 0x85, 0x86, 0x87
PROBE, COMMIT = 1, 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Control:
    """A control as requests see it.

    Attributes:
        size: bytes.
        least, most, step, default: its range.
        automatism: (unit, selector) of the control that sets this one automatically, if there is one.
        automatic: values of that control with which it does so.
        found: the value that the automatic mode finds.
    """

    size: int
    least: int
    most: int
    step: int
    default: int
    automatism: tuple[int, int] | None = None
    automatic: tuple[int, ...] = ()
    found: int = 0

    def answer(self, request: int, current: int) -> bytes:
        """The answer to a GET request."""
        values = {
            GET_CUR: current,
            GET_MIN: self.least,
            GET_MAX: self.most,
            GET_RES: self.step,
            GET_DEF: self.default,
        }
        if request == GET_LEN:
            return struct.pack("<H", self.size)
        if request == GET_INFO:  # D0: may be read, D1: may be set, D3: changes by itself (table 4-3)
            return b"\x0b" if self.automatism else b"\x03"
        return values[request].to_bytes(self.size, "little")


EXPOSURE_MODE: Final = (_CAMERA, 0x02)
EXPOSURE_PRIORITY: Final = (_CAMERA, 0x03)
EXPOSURE: Final = (_CAMERA, 0x04)
FOCUS: Final = (_CAMERA, 0x06)
FOCUS_AUTO: Final = (_CAMERA, 0x08)
POWER_LINE: Final = (_PROCESSING, 0x05)
WHITE_BALANCE: Final = (_PROCESSING, 0x0A)
WHITE_BALANCE_AUTO: Final = (_PROCESSING, 0x0B)
CONTROLS: Final = {
    EXPOSURE_MODE: Control(
        size=1, least=0, most=8, step=9, default=8
    ),  # as a bit map its "step" lists: 1 manual, 8 aperture priority
    EXPOSURE_PRIORITY: Control(size=1, least=0, most=1, step=1, default=1),  # whether the rate may fall in the dark
    EXPOSURE: Control(
        size=4, least=1, most=2000, step=1, default=100, automatism=EXPOSURE_MODE, automatic=(2, 8), found=100
    ),  # 100 us
    FOCUS: Control(size=2, least=0, most=250, step=5, default=0, automatism=FOCUS_AUTO, automatic=(1,), found=45),
    FOCUS_AUTO: Control(size=1, least=0, most=1, step=1, default=1),
    (_PROCESSING, 0x02): Control(size=2, least=0, most=255, step=1, default=128),  # brightness
    (_PROCESSING, 0x04): Control(size=2, least=0, most=255, step=1, default=64),  # gain
    POWER_LINE: Control(size=1, least=0, most=2, step=1, default=2),  # off, 50 Hz, 60 Hz
    WHITE_BALANCE: Control(
        size=2, least=2800, most=6500, step=10, default=4600, automatism=WHITE_BALANCE_AUTO, automatic=(1,), found=5100
    ),  # K
    WHITE_BALANCE_AUTO: Control(size=1, least=0, most=1, step=1, default=1),
}
"""By (unit, selector); 1.0a, tables 4-6 and following."""

_CAMERA_BITS: Final = (
    1 << 1 | 1 << 2 | 1 << 3 | 1 << 5 | 1 << 17
)  # exposure mode, priority, time; focus, automatic focus: table 3-6
_PROCESSING_BITS: Final = 1 << 0 | 1 << 6 | 1 << 9 | 1 << 10 | 1 << 12  # table 3-8


@dataclass(frozen=True, slots=True)
class Model:
    """One make of webcam.

    Attributes:
        name: product string.
        serial: serial number, for the by-id link.
        sizes_px: widths and heights.
        rates_hz: frame rates of each size.
    """

    name: str = "Board Test Camera"
    serial: str = "TEST-A"
    sizes_px: tuple[tuple[int, int], ...] = ((640, 480), (320, 240))
    rates_hz: tuple[int, ...] = (30, 10)

    @property
    def device(self) -> bytes:
        """Device descriptor: USB 2.0, class by interface association, vendor 1d6b (Linux Foundation)."""
        return _described(1, struct.pack("<HBBBBHHHBBBB", 0x0200, 0xEF, 2, 1, 64, 0x1D6B, 0x0102, 0x0100, 1, 2, 3, 1))

    @property
    def configuration(self) -> bytes:
        """Configuration with an association of the two video interfaces; frames come by bulk transfers."""
        association = _described(0x0B, bytes((0, 2, 0x0E, 3, 0, 0)))
        body = association + self._control_interface() + self._streaming_interface()
        return _described(2, struct.pack("<HBBBBB", 9 + len(body), 2, 1, 0, 0x80, 250)) + body

    @property
    def qualifier(self) -> bytes:
        """Device qualifier: the same at the other speed."""
        return _described(6, struct.pack("<HBBBBBB", 0x0200, 0xEF, 2, 1, 64, 1, 0))

    def string(self, index: int) -> bytes:
        """String descriptor: 0 for the languages (US English), then maker, product and serial number."""
        if index == 0:
            return _described(3, struct.pack("<H", 0x0409))
        return _described(3, ("tandemscan", self.name, self.serial)[index - 1].encode("utf-16le"))

    def probe(self, frame: int, interval: int) -> bytes:
        """Probe and commit structure (table 4-47): the nearest that this model can do.

        Args:
            frame: index of the size, from 1.
            interval: 100 ns.
        """
        frame = min(max(frame, 1), len(self.sizes_px))
        nearest = min((10_000_000 // rate for rate in self.rates_hz), key=lambda known: abs(known - interval))
        return struct.pack("<HBBIHHHHHII", 1, 1, frame, nearest, 0, 0, 0, 0, 0, _MAX_FRAME_BYTES, PAYLOAD_BYTES)

    def _control_interface(self) -> bytes:
        camera = _class(
            2, _CAMERA, *_u16(0x0201), 0, 0, *_u16(0), *_u16(0), *_u16(0), 3, *_CAMERA_BITS.to_bytes(3, "little")
        )
        processing = _class(5, _PROCESSING, _CAMERA, *_u16(0), 2, *_u16(_PROCESSING_BITS), 0)
        output = _class(3, 3, *_u16(0x0101), 0, _PROCESSING, 0)
        units = camera + processing + output
        header = _class(1, *_u16(0x0100), *_u16(13 + len(units)), *_u32(_CLOCK_HZ), 1, _VIDEO_STREAMING)
        return _described(4, bytes((_VIDEO_CONTROL, 0, 0, 0x0E, 1, 0, 0))) + header + units

    def _streaming_interface(self) -> bytes:
        intervals = [10_000_000 // rate for rate in self.rates_hz]
        frames = b""
        for index, (width_px, height_px) in enumerate(self.sizes_px, 1):
            least, most = width_px * height_px * 8, width_px * height_px * 16 * 30
            rates = (word for interval in intervals for word in _u32(interval))
            sizes = (*_u16(width_px), *_u16(height_px), *_u32(least), *_u32(most), *_u32(_MAX_FRAME_BYTES))
            frames += _class(7, index, 0, *sizes, *_u32(intervals[0]), len(intervals), *rates)
        mjpeg = _class(6, 1, len(self.sizes_px), 1, 1, 0, 0, 0, 0)
        colours = _class(0x0D, 1, 1, 4)
        formats = mjpeg + frames + colours
        header = _class(1, 1, *_u16(14 + len(formats)), _CS_ENDPOINT_IN, 0, 3, 0, 0, 0, 1, 0)
        interface = _described(4, bytes((_VIDEO_STREAMING, 0, 1, 0x0E, 2, 0, 0)))
        endpoint = _described(5, struct.pack("<BBHB", _CS_ENDPOINT_IN, 2, 512, 0))
        return interface + header + formats + endpoint


def payload(data: bytes, *, odd: bool, last: bool) -> bytes:
    """One payload of a frame: header (2.4.3.3: length; end of header, end of frame, frame id) and data."""
    return bytes((2, 0x80 | last << 1 | odd)) + data


def _described(kind: int, body: bytes) -> bytes:
    return bytes((len(body) + 2, kind)) + body


def _class(*body: int) -> bytes:
    return _described(_CS_INTERFACE, bytes(body))


def _u16(value: int) -> tuple[int, ...]:
    return tuple(struct.pack("<H", value))


def _u32(value: int) -> tuple[int, ...]:
    return tuple(struct.pack("<I", value))
