"""The ctypes structures have the sizes, offsets and numbers of the kernel's headers."""

import ctypes
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from common.camera import v4l2_abi as abi

_FIXED: dict[str, type[ctypes.Structure]] = {
    "v4l2_capability": abi.Capability,
    "v4l2_fmtdesc": abi.FormatDescription,
    "v4l2_pix_format": abi.PixelLayout,
    "v4l2_fract": abi.Fraction,
    "v4l2_frmsizeenum": abi.FrameSize,
    "v4l2_frmivalenum": abi.FrameInterval,
    "v4l2_streamparm": abi.StreamParameters,
    "v4l2_requestbuffers": abi.BufferRequest,
    "v4l2_control": abi.ControlValue,
    "v4l2_query_ext_ctrl": abi.ControlQuery,
    "v4l2_querymenu": abi.MenuItem,
    "v4l2_event_subscription": abi.EventSubscription,
}
# What a C compiler reports for <linux/videodev2.h> (Linux 6.1 headers) on x86-64, on armhf, and on armhf with a 64-bit time_t:
# sizes of v4l2_format, v4l2_buffer, v4l2_event; offsets of format.fmt, buffer.timestamp, .sequence, .m, .length; VIDIOC_DQBUF, VIDIOC_DQEVENT.
_MACHINES = {
    (64, 64): (208, 88, 136, 8, 24, 56, 64, 72, 0xC0585611, 0x80885659),
    (32, 32): (204, 68, 128, 4, 20, 44, 52, 56, 0xC0445611, 0x80805659),
    (32, 64): (204, 80, 136, 4, 24, 56, 64, 68, 0xC0505611, 0x80885659),
}
_NAMES = {
    "VIDIOC_QUERYCAP": "QUERYCAP",
    "VIDIOC_ENUM_FMT": "ENUM_FMT",
    "VIDIOC_REQBUFS": "REQBUFS",
    "VIDIOC_STREAMON": "STREAMON",
    "VIDIOC_STREAMOFF": "STREAMOFF",
    "VIDIOC_G_PARM": "G_PARM",
    "VIDIOC_S_PARM": "S_PARM",
    "VIDIOC_G_CTRL": "G_CTRL",
    "VIDIOC_S_CTRL": "S_CTRL",
    "VIDIOC_QUERYMENU": "QUERYMENU",
    "VIDIOC_ENUM_FRAMESIZES": "ENUM_FRAMESIZES",
    "VIDIOC_ENUM_FRAMEINTERVALS": "ENUM_FRAMEINTERVALS",
    "VIDIOC_SUBSCRIBE_EVENT": "SUBSCRIBE_EVENT",
    "VIDIOC_QUERY_EXT_CTRL": "QUERY_EXT_CTRL",
    "V4L2_CID_AUTO_WHITE_BALANCE": "CID_WHITE_BALANCE_AUTOMATIC",
    "V4L2_CID_EXPOSURE_AUTO": "CID_AUTO_EXPOSURE",
    "V4L2_CID_EXPOSURE_ABSOLUTE": "CID_EXPOSURE_TIME_ABSOLUTE",
    "V4L2_CID_EXPOSURE_AUTO_PRIORITY": "CID_EXPOSURE_DYNAMIC_FRAMERATE",
    "V4L2_CID_FOCUS_AUTO": "CID_FOCUS_AUTOMATIC_CONTINUOUS",
    "V4L2_FRMSIZE_TYPE_DISCRETE": "FRMSIZE_TYPE_DISCRETE",
    "V4L2_FRMIVAL_TYPE_DISCRETE": "FRMIVAL_TYPE_DISCRETE",
    **{
        f"V4L2_{name}": name
        for name in vars(abi)
        if re.match(r"(BUF|CAP|CTRL|EVENT|FIELD|FMT|MEMORY|CID)_", name)
        and name
        not in {
            "CID_WHITE_BALANCE_AUTOMATIC",
            "CID_AUTO_EXPOSURE",
            "CID_EXPOSURE_TIME_ABSOLUTE",
            "CID_EXPOSURE_DYNAMIC_FRAMERATE",
            "CID_FOCUS_AUTOMATIC_CONTINUOUS",
        }
    },
}


@pytest.mark.parametrize("machine", _MACHINES)
def test_the_layout_of_every_machine_is_the_compilers(machine: tuple[int, int]) -> None:
    """Sizes, offsets and ioctl numbers on 64-bit, 32-bit and 32-bit machines with 64-bit time_t are those of C compilers."""
    made = abi.layout(*machine)
    sizes = [ctypes.sizeof(kind) for kind in (made.format, made.buffer, made.event)]
    names = ("seconds", "sequence", "place", "length")
    offsets = [made.format.pix.offset, *(getattr(made.buffer, name).offset for name in names)]
    assert (*sizes, *offsets, made.dqbuf, made.dqevent) == _MACHINES[machine]


def test_this_machines_headers_agree(tmp_path: Path) -> None:
    """Every structure size, ioctl number and constant equals that of the machine's own <linux/videodev2.h>."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None or not Path("/usr/include/linux/videodev2.h").exists():
        pytest.skip("no C compiler, or no kernel headers, on this machine")
    native = abi.LAYOUTS[0]
    structures = {
        **_FIXED,
        "v4l2_format": native.format,
        "v4l2_buffer": native.buffer,
        "v4l2_event": native.event,
    }
    numbers = {c_name: getattr(abi, name) for c_name, name in _NAMES.items()} | {
        "VIDIOC_G_FMT": native.g_fmt,
        "VIDIOC_S_FMT": native.s_fmt,
        "VIDIOC_QUERYBUF": native.querybuf,
        "VIDIOC_QBUF": native.qbuf,
        "VIDIOC_DQBUF": native.dqbuf,
        "VIDIOC_DQEVENT": native.dqevent,
        "V4L2_PIX_FMT_MJPEG": abi.fourcc("MJPG"),
    }
    lines = [f'printf("{name} %zu\\n", sizeof(struct {name}));' for name in structures]
    lines += [f'printf("{name} %lu\\n", (unsigned long)(unsigned int){name});' for name in numbers]
    source = tmp_path / "sizes.c"
    body = "\n".join(lines)
    source.write_text(f"#include <stdio.h>\n#include <linux/videodev2.h>\nint main(void) {{\n{body}\n}}\n")
    subprocess.run([compiler, "-o", tmp_path / "sizes", source], check=True)
    said = subprocess.run([tmp_path / "sizes"], check=True, capture_output=True, text=True).stdout
    theirs = {name: int(value) for name, value in (line.split() for line in said.splitlines())}
    ours = {name: ctypes.sizeof(kind) for name, kind in structures.items()} | numbers
    assert ours == theirs


def test_four_letters_of_a_format() -> None:
    """A format's letters convert to its number and back; YUYV is 0x56595559 by videodev2.h's arithmetic."""
    assert abi.fourcc("YUYV") == 0x56595559
    assert abi.fourcc_name(0x56595559) == "YUYV"
    assert abi.fourcc_name(0x20203859) == "Y8.."
