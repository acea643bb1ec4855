"""The port of a serial link: the requested speed is set, and nothing fails where pyserial cannot list ports."""

import fcntl
import os
import pty
import struct
import subprocess
import sys
from collections.abc import Iterator

import pytest

from common.link.serial import SerialLine

_TCGETS2 = 0x802C542A
"""_IOR('T', 0x2A, struct termios2): four u32, the line's discipline, 19 characters, two u32 speeds (asm-generic/termbits.h)."""

_TERMIOS2 = struct.Struct("<4IB19s2I")


@pytest.fixture
def port() -> Iterator[str]:
    """A pseudo terminal's path; the terminal keeps the speed that it is given."""
    master, slave = pty.openpty()
    yield os.ttyname(slave)
    os.close(master)
    os.close(slave)


@pytest.mark.parametrize("baud", [9600, 115_200, 3_000_000, 250_000, 1_234_567], ids="{} baud".format)
def test_a_port_runs_at_the_asked_speed(port: str, baud: int) -> None:
    """A port has the requested speed both ways, standard or not (BOTHER), and is raw: no echo, no flow control by characters."""
    line = SerialLine(port, baud)
    told = fcntl.ioctl(line.fileno(), _TCGETS2, bytes(_TERMIOS2.size))
    line.close()
    input_flags, output_flags, _, local_flags, _, _, input_baud, output_baud = _TERMIOS2.unpack(told)
    assert (input_baud, output_baud) == (baud, baud)
    ixon, icrnl, opost, icanon, echo = 0o2000, 0o400, 0o1, 0o2, 0o10
    assert not input_flags & (ixon | icrnl)
    assert not output_flags & opost
    assert not local_flags & (icanon | echo)


_AS_ON_ANDROID = """
import sys
sys.platform = "android"
from common.errors import MissingDeviceError
from common.link.serial import SerialLine
try:
    SerialLine("/dev/ttyNowhere", 115200)
except MissingDeviceError as error:
    print(error)
line = SerialLine(sys.argv[1], 115200)
line.close()
print("serial.tools.list_ports" in sys.modules)
"""


def test_android_never_meets_the_imports_that_fail_there(port: str) -> None:
    """On a system that calls itself android a port opens and a missing one is reported. pyserial's port list, which raises ImportError there, is not imported."""
    done = subprocess.run(
        [sys.executable, "-c", _AS_ON_ANDROID, port], capture_output=True, text=True, check=True, timeout=60
    )
    told, listed = done.stdout.splitlines()
    assert "/dev/ttyNowhere" in told
    assert listed == "False"
