"""Capture with v4l2loopback, by which other programs pass images to users of cameras: an invalid first buffer, and an unnamed clock."""

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.vm.guest import UNIT, Guest
from tests.vm.machine import Architecture, image_of

pytestmark = pytest.mark.timeout(600)  # the first test boots the board


@pytest.fixture(scope="module")
def loopback(guest: Guest) -> Iterator[Guest]:
    """The board with such a device; a writer of its own feeds it, and no service has it."""
    module = image_of(Architecture.AMD64).folder / "v4l2loopback.ko"
    if not module.is_file():
        pytest.skip(f"no {module}: .ci/board builds it where apt has the kernel's headers")
    for path in (module, *(Path(__file__).with_name(name) for name in ("kernel_camera.py", "loopback_writer.py"))):
        guest.put(path, "/srv")
    guest.sh(f"systemctl stop {UNIT} && modprobe videodev && insmod /srv/{module.name} && udevadm settle")
    writer = guest.popen("exec python3 /srv/loopback_writer.py /dev/video0 320 240")
    yield guest
    writer.kill()
    with writer:  # closes its pipes and waits
        pass


def test_its_first_buffer_is_no_frame_and_its_stamps_are_believed(loopback: Guest) -> None:
    """The first buffer (number 0) is spoiled if it was never written, the jump in numbers after it is no loss, and plausible stamps of an unnamed clock are accepted."""
    loopback.sh("until board-agent cameras | grep -q MJPG; do sleep 0.1; done")
    order = "python3 -P /srv/kernel_camera.py 'size=320x240&fps=30&format=mjpeg' frames=20"
    shown = json.loads(loopback.sh(order))
    health = shown["health"]
    assert (shown["format"], shown["bytes"]) == ("mjpeg", 8004)
    # A reader that is held up between its start and its first look finds that buffer written, and whole.
    assert shown["sequences"][0] in {0, 1}
    assert sum(health["faults"].values()) == shown["sequences"][0]
    assert (health["missed"], health["distrusted_stamps"]) == (0, 0)
