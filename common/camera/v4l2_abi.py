"""The kernel's Video4Linux2 interface as ctypes structures, ioctl numbers and constants; nothing else may live here.

Source: include/uapi/linux/videodev2.h, v4l2-controls.h and asm-generic/ioctl.h of Linux 6.1. `layout` makes the sizes that depend on the machine
(pointers, `struct timeval`), so every machine's layout can be checked on any other. The kernel of a 32-bit machine accepts both sizes of time.
Debian 12 uses the 32-bit one; a kernel without it answers ENOTTY.
"""

import ctypes
from ctypes import c_char, c_int32, c_int64, c_uint8, c_uint32, c_uint64
from typing import Final

from common.value import value

_WRITE, _READ = 1, 2
_DIR_SHIFT, _SIZE_SHIFT, _TYPE_SHIFT = 30, 16, 8  # asm-generic/ioctl.h: dir 2 bits, size 14, type 8, number 8


def _request(direction: int, number: int, size_bytes: int) -> int:
    """The number of an ioctl of type 'V' (_IOC of asm-generic/ioctl.h)."""
    return direction << _DIR_SHIFT | size_bytes << _SIZE_SHIFT | ord("V") << _TYPE_SHIFT | number


def fourcc(name: str) -> int:
    """The number of a pixel format's four letters (v4l2_fourcc)."""
    return int.from_bytes(name.encode("ascii"), "little")


def fourcc_name(code: int) -> str:
    """The four letters of a pixel format; blanks and unprintable bytes are shown as dots."""
    return "".join(chr(byte) if 32 < byte < 127 else "." for byte in (code & 0x7FFFFFFF).to_bytes(4, "little"))


def _u32(names: str) -> list[tuple[str, type[c_uint32]]]:
    """Fields of 32 bits, by their names with blanks between."""
    return [(name, c_uint32) for name in names.split()]


class Capability(ctypes.Structure):
    """struct v4l2_capability, 104 bytes."""

    _fields_ = [
        ("driver", c_char * 16),
        ("card", c_char * 32),
        ("bus_info", c_char * 32),
        *_u32("version capabilities device_caps"),
        ("reserved", c_uint32 * 3),
    ]


class FormatDescription(ctypes.Structure):
    """struct v4l2_fmtdesc, 64 bytes."""

    _fields_ = [
        *_u32("index type flags"),
        ("description", c_char * 32),
        *_u32("pixelformat mbus_code"),
        ("reserved", c_uint32 * 3),
    ]


class PixelLayout(ctypes.Structure):
    """struct v4l2_pix_format, 48 bytes."""

    _fields_ = [
        *_u32(
            "width height pixelformat field bytesperline sizeimage colorspace priv flags encoding quantization xfer_func"
        )
    ]


class Fraction(ctypes.Structure):
    """struct v4l2_fract, 8 bytes."""

    _fields_ = [("numerator", c_uint32), ("denominator", c_uint32)]


class FrameSize(ctypes.Structure):
    """struct v4l2_frmsizeenum, 44 bytes. Discrete: the first two of `values`; stepwise: min, max, step of width, then of height."""

    _fields_ = [*_u32("index pixel_format type"), ("values", c_uint32 * 6), ("reserved", c_uint32 * 2)]


class FrameInterval(ctypes.Structure):
    """struct v4l2_frmivalenum, 52 bytes. Discrete: the first of `values`, in seconds; stepwise: min, max, step."""

    _fields_ = [*_u32("index pixel_format width height type"), ("values", Fraction * 3), ("reserved", c_uint32 * 2)]


class StreamParameters(ctypes.Structure):
    """struct v4l2_streamparm with v4l2_captureparm, 204 bytes."""

    _fields_ = [
        *_u32("type capability capturemode"),
        ("timeperframe", Fraction),
        *_u32("extendedmode readbuffers"),
        ("raw_data", c_uint8 * 176),
    ]


class BufferRequest(ctypes.Structure):
    """struct v4l2_requestbuffers, 20 bytes."""

    _fields_ = [*_u32("count type memory capabilities flags_and_reserved")]


class ControlValue(ctypes.Structure):
    """struct v4l2_control, 8 bytes."""

    _fields_ = [("id", c_uint32), ("value", c_int32)]


class ControlQuery(ctypes.Structure):
    """struct v4l2_query_ext_ctrl, 232 bytes."""

    _fields_ = [
        *_u32("id type"),
        ("name", c_char * 32),
        ("minimum", c_int64),
        ("maximum", c_int64),
        ("step", c_uint64),
        ("default_value", c_int64),
        *_u32("flags elem_size elems nr_of_dims"),
        ("dims", c_uint32 * 4),
        ("reserved", c_uint32 * 32),
    ]


class MenuItem(ctypes.Structure):
    """struct v4l2_querymenu, packed, 44 bytes; for integer menus `name` holds the value's eight bytes."""

    _pack_ = 1
    _layout_ = "ms"  # what _pack_ has always meant; Python 3.14 requires it to be stated
    _fields_ = [("id", c_uint32), ("index", c_uint32), ("name", c_uint8 * 32), ("reserved", c_uint32)]


class EventSubscription(ctypes.Structure):
    """struct v4l2_event_subscription, 32 bytes."""

    _fields_ = [("type", c_uint32), ("id", c_uint32), ("flags", c_uint32), ("reserved", c_uint32 * 5)]


@value()
class Layout:
    """The structures whose size depends on the machine, with the ioctl numbers that contain their size.

    Attributes:
        format: struct v4l2_format: `type`, `pix`.
        buffer: struct v4l2_buffer: `index`, `type`, `bytesused`, `flags`, `seconds`, `microseconds`, `sequence`, `memory`, `offset`, `length`.
        event: struct v4l2_event: `type`, `pending`, `id`.
        g_fmt: VIDIOC_G_FMT.
        s_fmt: VIDIOC_S_FMT.
        querybuf: VIDIOC_QUERYBUF.
        qbuf: VIDIOC_QBUF.
        dqbuf: VIDIOC_DQBUF.
        dqevent: VIDIOC_DQEVENT.
    """

    format: type[ctypes.Structure]
    buffer: type[ctypes.Structure]
    event: type[ctypes.Structure]
    g_fmt: int
    s_fmt: int
    querybuf: int
    qbuf: int
    dqbuf: int
    dqevent: int


def _event(time: type[c_int32] | type[c_int64]) -> type[ctypes.Structure]:
    """Struct v4l2_event, with this time_t."""

    class Event(ctypes.Structure):
        # The union's longest member is data[64]; v4l2_event_ctrl holds a 64-bit value, which sets the alignment.
        _fields_ = [
            ("type", c_uint32),
            ("u", c_int64 * 8),
            *_u32("pending sequence"),
            ("seconds", time),
            ("nanoseconds", time),
            ("id", c_uint32),
            ("reserved", c_uint32 * 8),
        ]

    return Event


def layout(pointer_bits: int, time_bits: int) -> Layout:
    """Make a machine's structures.

    Args:
        pointer_bits: 32 or 64.
        time_bits: of time_t, 32 or 64 (not 32 on a 64-bit machine).
    """
    word = c_uint64 if pointer_bits == 64 else c_uint32
    time = c_int64 if time_bits == 64 else c_int32

    class Format(ctypes.Structure):
        # The union is as long as raw_data[200] and aligned as a pointer, because struct v4l2_window holds some.
        _fields_ = [("type", c_uint32), ("_align", word * 0), ("pix", PixelLayout), ("_rest", c_uint8 * 152)]

    class Place(ctypes.Union):
        _fields_ = [("offset", c_uint32), ("userptr", word), ("fd", c_int32)]

    class Buffer(ctypes.Structure):
        _anonymous_ = ("place",)
        _fields_ = [
            *_u32("index type bytesused flags field"),
            ("seconds", time),
            ("microseconds", time),
            ("timecode", c_uint32 * 4),
            *_u32("sequence memory"),
            ("place", Place),
            *_u32("length reserved2"),
            ("request_fd", c_int32),
        ]

    both, event = _READ | _WRITE, _event(time)
    format_bytes, buffer_bytes = ctypes.sizeof(Format), ctypes.sizeof(Buffer)
    return Layout(
        Format,
        Buffer,
        event,
        g_fmt=_request(both, 4, format_bytes),
        s_fmt=_request(both, 5, format_bytes),
        querybuf=_request(both, 9, buffer_bytes),
        qbuf=_request(both, 15, buffer_bytes),
        dqbuf=_request(both, 17, buffer_bytes),
        dqevent=_request(_READ, 89, ctypes.sizeof(event)),
    )


_LONG_BITS: Final = 8 * ctypes.sizeof(ctypes.c_long)
LAYOUTS: Final = (layout(64, 64),) if _LONG_BITS == 64 else (layout(32, 32), layout(32, 64))
"""This machine's layouts in the order in which to try them: the second if a kernel answers ENOTTY to the first."""

QUERYCAP: Final = _request(_READ, 0, ctypes.sizeof(Capability))
ENUM_FMT: Final = _request(_READ | _WRITE, 2, ctypes.sizeof(FormatDescription))
REQBUFS: Final = _request(_READ | _WRITE, 8, ctypes.sizeof(BufferRequest))
STREAMON: Final = _request(_WRITE, 18, 4)
STREAMOFF: Final = _request(_WRITE, 19, 4)
G_PARM: Final = _request(_READ | _WRITE, 21, ctypes.sizeof(StreamParameters))
S_PARM: Final = _request(_READ | _WRITE, 22, ctypes.sizeof(StreamParameters))
G_CTRL: Final = _request(_READ | _WRITE, 27, ctypes.sizeof(ControlValue))
S_CTRL: Final = _request(_READ | _WRITE, 28, ctypes.sizeof(ControlValue))
QUERYMENU: Final = _request(_READ | _WRITE, 37, ctypes.sizeof(MenuItem))
ENUM_FRAMESIZES: Final = _request(_READ | _WRITE, 74, ctypes.sizeof(FrameSize))
ENUM_FRAMEINTERVALS: Final = _request(_READ | _WRITE, 75, ctypes.sizeof(FrameInterval))
SUBSCRIBE_EVENT: Final = _request(_WRITE, 90, ctypes.sizeof(EventSubscription))
QUERY_EXT_CTRL: Final = _request(_READ | _WRITE, 103, ctypes.sizeof(ControlQuery))

BUF_TYPE_VIDEO_CAPTURE: Final = 1
MEMORY_MMAP: Final = 1
FIELD_NONE: Final = 1

CAP_VIDEO_CAPTURE: Final = 0x00000001
CAP_VIDEO_CAPTURE_MPLANE: Final = 0x00001000
CAP_META_CAPTURE: Final = 0x00800000
CAP_STREAMING: Final = 0x04000000
CAP_DEVICE_CAPS: Final = 0x80000000
CAP_TIMEPERFRAME: Final = 0x1000

FRMSIZE_TYPE_DISCRETE: Final = 1
FRMIVAL_TYPE_DISCRETE: Final = 1

BUF_FLAG_ERROR: Final = 0x00000040
BUF_FLAG_TIMESTAMP_MASK: Final = 0x0000E000
BUF_FLAG_TIMESTAMP_MONOTONIC: Final = 0x00002000
BUF_FLAG_TIMESTAMP_COPY: Final = 0x00004000
BUF_FLAG_TSTAMP_SRC_MASK: Final = 0x00070000
BUF_FLAG_TSTAMP_SRC_SOE: Final = 0x00010000

CTRL_FLAG_DISABLED: Final = 0x0001
CTRL_FLAG_GRABBED: Final = 0x0002
CTRL_FLAG_READ_ONLY: Final = 0x0004
CTRL_FLAG_INACTIVE: Final = 0x0010
CTRL_FLAG_WRITE_ONLY: Final = 0x0040
CTRL_FLAG_NEXT_CTRL: Final = 0x80000000

CTRL_TYPE_INTEGER: Final = 1
CTRL_TYPE_BOOLEAN: Final = 2
CTRL_TYPE_MENU: Final = 3
CTRL_TYPE_CTRL_CLASS: Final = 6

EVENT_CTRL: Final = 3
EVENT_SUB_FL_ALLOW_FEEDBACK: Final = 2

CID_WHITE_BALANCE_AUTOMATIC: Final = 0x0098090C
CID_AUTOGAIN: Final = 0x00980912
CID_GAIN: Final = 0x00980913
CID_POWER_LINE_FREQUENCY: Final = 0x00980918
CID_WHITE_BALANCE_TEMPERATURE: Final = 0x0098091A
CID_AUTO_EXPOSURE: Final = 0x009A0901
CID_EXPOSURE_TIME_ABSOLUTE: Final = 0x009A0902
CID_EXPOSURE_DYNAMIC_FRAMERATE: Final = 0x009A0903
CID_FOCUS_ABSOLUTE: Final = 0x009A090A
CID_FOCUS_AUTOMATIC_CONTINUOUS: Final = 0x009A090C
CID_ZOOM_ABSOLUTE: Final = 0x009A090D
CID_JPEG_COMPRESSION_QUALITY: Final = 0x009D0903

EXPOSURE_MANUAL: Final = 1
EXPOSURE_SHUTTER_PRIORITY: Final = 2
EXPOSURE_UNIT_NS: Final = 100_000
"""V4L2_CID_EXPOSURE_ABSOLUTE counts in 100 us units (ext-ctrls-camera)."""
