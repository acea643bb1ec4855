"""Capture with the kernel's test driver vivid: raw formats, and failures that the driver itself injects."""

import json
import shlex
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import pytest

from tests.vm.guest import UNIT, Guest

pytestmark = pytest.mark.timeout(600)  # the first test boots the board

WIDTH_PX, HEIGHT_PX = 640, 480
PIXELS: Final = WIDTH_PX * HEIGHT_PX
DROPPED: Final = "Percentage of Dropped Buffers"


@pytest.fixture(scope="module")
def vivid(guest: Guest) -> Guest:
    """The board with one virtual capture device (single-planar, no other node) that no service has open."""
    guest.sh(f"systemctl stop {UNIT} && modprobe vivid n_devs=1 node_types=0x1 multiplanar=1 && udevadm settle")
    guest.put(Path(__file__).with_name("kernel_camera.py"), "/srv")
    return guest


def capture(guest: Guest, options: str, *orders: str) -> dict[str, Any]:
    """Follow orders with the camera; return what came."""
    words = (f"size={WIDTH_PX}x{HEIGHT_PX}&fps=10&{options}", *orders)
    shown: dict[str, Any] = json.loads(guest.sh(f"python3 -P /srv/kernel_camera.py {shlex.join(words)}"))
    assert shown["sequences"] == sorted(set(shown["sequences"]))
    return shown


@pytest.mark.parametrize(
    ("source", "send", "sent_as", "length_bytes"),
    [
        ("yuyv", "whole", "yuyv", 2 * PIXELS),
        ("yuyv", "luma", "grey", PIXELS),
        ("grey", "whole", "grey", PIXELS),
        ("nv12", "whole", "nv12", PIXELS * 3 // 2),
        ("nv12", "luma", "grey", PIXELS),
    ],
)
def test_raw_images_are_sent_whole_or_as_luma(
    vivid: Guest, source: str, send: str, sent_as: str, length_bytes: int
) -> None:
    """Each raw format has its correct length and contains the driver's colour bars, whose luma falls from left to right by their standard."""
    shown = capture(vivid, f"format={source}&send={send}", "frames=3")
    assert (shown["format"], shown["bytes"]) == (sent_as, length_bytes)
    bars = [shown["row"][(2 * bar + 1) * WIDTH_PX // 16] for bar in range(8)]  # the middle of each of eight bars
    assert all(left > right for left, right in pairwise(bars)), bars


def test_a_fatal_error_of_the_driver_is_outlived(vivid: Guest) -> None:
    """After an error that ends the stream for good (EIO) the device is reopened and frames continue, with the failure counted."""
    shown = capture(vivid, "format=grey", "frames=5", "Inject Fatal Streaming Error=1", "frames=5")
    assert shown["health"]["failures"] == 1
    assert shown["health"]["returned"] == 1
    assert shown["health"]["unplugged"] == 0


def test_a_flagged_frame_is_spoiled(vivid: Guest) -> None:
    """A buffer that the driver flags as bad is no frame; it is counted, and the next ones arrive."""
    shown = capture(vivid, "format=grey", "frames=5", "Inject V4L2_BUF_FLAG_ERROR=1", "frames=5")
    assert sum(shown["health"]["faults"].values()) == 1
    assert shown["health"]["failures"] == 0


def test_frames_that_stay_away_are_a_stall(vivid: Guest) -> None:
    """If the driver goes silent without an error, the stream is restarted until frames arrive again."""
    shown = capture(vivid, "format=grey", "frames=5", f"{DROPPED}=100", "await=stalls", f"{DROPPED}=0", "frames=5")
    assert shown["health"]["stalls"] >= 1
    assert shown["health"]["returned"] == 1


def test_gaps_in_the_drivers_numbers_are_missed_frames(vivid: Guest) -> None:
    """Frames that the driver drops are counted by the gaps that they leave, and none of those that came is lost."""
    shown = capture(vivid, "format=grey", f"{DROPPED}=50", "await=missed", f"{DROPPED}=0", "frames=5")
    assert shown["health"]["missed"] >= 1
    assert shown["health"]["stalls"] == 0
