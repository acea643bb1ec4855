"""board-agent doctor on a booted board: what it reports about each thing that keeps a board from streaming."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.programs import until
from tests.vm.doctor import doctor
from tests.vm.guest import UNIT, Guest
from tests.vm.stream import Film, Skew, check_journal, streaming
from tests.vm.webcam import Webcam

pytestmark = pytest.mark.timeout(600)  # the first test boots the board


@pytest.fixture(autouse=True)
def _sound_afterwards(guest: Guest, webcam: Webcam) -> Iterator[None]:
    """After each test the service is up, its accounts balance and it has never shown a traceback."""
    assert webcam.plugged
    yield
    guest.sh(f"systemctl start {UNIT}")
    check_journal(guest)


def test_a_board_that_streams_is_well(guest: Guest, film: Film, skew: Skew, tmp_path: Path) -> None:
    """While the service streams nothing fails: the doctor finds its camera and port, reports its rate, and does not disturb it."""
    with streaming(guest, film.right, tmp_path / "out") as stream:
        stream.more(10, "before the doctor")
        guest.until("StatusText", "sent to the host", "the status tells the rate")
        code, checks = doctor(guest)
        stream.more(10, "after the doctor")
        report = stream.finish(skew)
    assert code == 0, checks
    assert "our own service has it" in checks["stream"]["finding"]
    assert "sent to the host" in checks["stream"]["finding"]
    assert "our own service has it" in checks["link"]["finding"]
    assert "tcp://10.0.3.15:5555 (eth1)" in checks["network"]["finding"]  # where the host of this test dials
    assert "user tandemscan may open" in checks["permission"]["finding"]
    assert checks["settings"]["finding"] == "/etc/tandemscan/board-agent.toml"
    assert len(report["sessions"]) == 1


def test_a_free_camera_is_proven_by_streaming(guest: Guest, webcam: Webcam) -> None:
    """With the service stopped frames are taken, at the requested rate, with trusted stamps, over a bus that can carry them."""
    guest.sh(f"systemctl stop {UNIT}")
    code, checks = doctor(guest)
    assert code == 0, checks
    assert checks["service"]["verdict"] == "warn"
    assert "320x240 at 10 frames/s is offered" in checks["format"]["finding"]
    assert "of 10 a second" in checks["stream"]["finding"]
    assert "CLOCK_MONOTONIC, first packet" in checks["stamps"]["finding"]
    assert "480 Mbit/s" in checks["usb"]["finding"]
    assert not webcam.streaming


def test_a_format_that_is_not_offered_fails(guest: Guest) -> None:
    """If the camera lacks the requested size, the doctor lists the available ones."""
    code, checks = doctor(guest, "--camera 'v4l2:auto?size=1280x720'")
    assert code == 4
    assert checks["format"]["verdict"] == "fail"
    assert "640x480, 320x240" in checks["format"]["remedy"]


def test_spoiled_frames_are_seen(guest: Guest, webcam: Webcam) -> None:
    """If a camera truncates every third frame, the doctor says how many were spoiled."""
    guest.sh(f"systemctl stop {UNIT}")
    webcam.truncate_every = 3
    code, checks = doctor(guest)
    webcam.truncate_every = 0
    assert code == 0
    assert checks["stream"]["verdict"] == "warn"
    assert "no_end" in checks["stream"]["finding"]


def test_an_absent_camera_fails(guest: Guest, webcam: Webcam) -> None:
    """If the camera is unplugged, it is missing, the other checks are made all the same, and the kernel's log shows the unplugging."""
    webcam.unplug()
    try:
        until(lambda: guest.code("test -e /dev/video0") != 0, "the node is gone")
        code, checks = doctor(guest)
    finally:
        webcam.plug(guest)
    assert code == 4
    assert "none is plugged in" in checks["camera"]["finding"]
    assert checks["clock"]["verdict"] == "ok"
    assert "unplugged" in checks["usb-log"]["finding"]


def test_a_camera_without_driver_is_told_apart(guest: Guest) -> None:
    """If the webcam is on the bus but no driver is bound to it, the remedy is the driver."""
    guest.sh(f"systemctl stop {UNIT}")
    guest.sh("cd /sys/bus/usb/drivers/uvcvideo && for i in *:1.0; do echo $i > unbind; done")
    try:
        code, checks = doctor(guest)
    finally:
        guest.sh(
            "for d in /sys/bus/usb/devices/*:1.0; do grep -q 0e $d/bInterfaceClass && echo ${d##*/} > /sys/bus/usb/drivers/uvcvideo/bind; done; true"
        )
        until(lambda: guest.code("test -e /dev/video0") == 0, "the driver is back")
    assert code == 4
    assert "has no driver" in checks["camera"]["finding"]


def test_wrong_permissions_fail_for_the_service_user(guest: Guest) -> None:
    """A node that only root may open fails although root asks: the service could not open it."""
    guest.sh("chmod 600 /dev/video0")
    try:
        code, checks = doctor(guest)
    finally:
        guest.sh("chmod 660 /dev/video0")
    assert code == 4
    assert "user tandemscan may not open /dev/video0" in checks["permission"]["finding"]


def test_a_taken_port_is_told_with_its_owner(guest: Guest) -> None:
    """If another program has the link's port, the doctor names it."""
    guest.sh(f"systemctl stop {UNIT}")
    listen = "import socket; s = socket.create_server(('', 5555)); print(flush=True); input()"
    with guest.popen(f'python3 -u -c "{listen}"') as taker:
        assert taker.stdout is not None
        taker.stdout.readline()
        code, checks = doctor(guest)
        taker.communicate(b"\n")
    assert code == 4
    assert "python3 (pid" in checks["link"]["finding"]


def test_a_getty_on_the_serial_link_fails(guest: Guest) -> None:
    """A getty on the port of a serial link is named with the command that stops it; a missing port fails, too."""
    code, checks = doctor(guest, "--link serial:/dev/ttyGS7")
    assert code == 4
    assert checks["link"]["verdict"] == "fail"
    # The guest's console is its first serial port.
    code, checks = doctor(guest, "--link serial:/dev/ttyS0")
    assert code == 4
    assert "ttyS0" in checks["link"]["remedy"]


def test_under_voltage_in_the_kernel_log_warns(guest: Guest) -> None:
    """A Raspberry Pi kernel's message about a weak supply, written into this kernel's log, is found with its age."""
    before = doctor(guest)[1]["power"]
    assert before["verdict"] == "ok"
    guest.sh("echo 'hwmon hwmon1: Undervoltage detected!' > /dev/kmsg")
    code, checks = doctor(guest)
    assert code == 0, checks
    assert checks["power"]["verdict"] == "warn"
    assert "under-voltage once" in checks["power"]["finding"]
