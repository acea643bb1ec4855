"""Two webcams on one board: persistent names tell them apart, wherever and in whatever order they are plugged in."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.support.programs import until
from tests.vm import uvc
from tests.vm.conftest import CAMERA, READOUT_MS
from tests.vm.guest import UNIT, Guest
from tests.vm.stream import FPS, Film, Skew, check_journal, streaming
from tests.vm.webcam import Webcam

pytestmark = pytest.mark.timeout(600)  # the first test boots the board

BY_ID = "/dev/v4l/by-id/usb-tandemscan_Board_Test_Camera_{}-video-index0"
FIRST, SECOND = BY_ID.format("TEST-A"), BY_ID.format("TEST-B")
OPTIONS = CAMERA.partition("?")[2]


@pytest.fixture(scope="module")
def second(guest: Guest, film: Film) -> Iterator[Webcam]:
    """Another camera of the same make, with a serial number that sorts after the first one's; it shows the same images."""
    camera = Webcam(film.frames, FPS, READOUT_MS * 1_000_000, uvc.Model(serial="TEST-B"))
    camera.plug(guest, usb_port=4)
    yield camera
    camera.close()


@dataclass(frozen=True, slots=True)
class Pair:
    """Both cameras."""

    first: Webcam
    second: Webcam


@pytest.fixture
def pair(webcam: Webcam, second: Webcam) -> Pair:
    """Both cameras."""
    return Pair(webcam, second)


@pytest.fixture(autouse=True)
def _sound_afterwards(guest: Guest, webcam: Webcam, second: Webcam) -> Iterator[None]:
    """After each test the service is up with its usual camera, its accounts balance and it has never shown a traceback."""
    assert webcam.plugged
    assert second.plugged
    until(lambda: guest.code(f"test -e {FIRST} -a -e {SECOND}") == 0, "both cameras have their names")
    yield
    guest.configure(CAMERA)
    check_journal(guest)


def test_both_are_listed_by_their_lasting_names(guest: Guest) -> None:
    """`board-agent cameras` lists the two capture nodes among four nodes, in the order of their names."""
    assert len(guest.sh("ls /dev | grep '^video'").split()) == 4  # each has a metadata node, too
    listed = json.loads(guest.sh("board-agent cameras --json"))["cameras"]
    assert [camera["path"] for camera in listed] == [FIRST, SECOND]
    assert len({camera["node"] for camera in listed}) == 2


def test_auto_takes_the_first_name_not_the_first_number(
    guest: Guest, pair: Pair, film: Film, skew: Skew, tmp_path: Path
) -> None:
    """With the second camera at the lowest node number, v4l2:auto still streams from the one whose name comes first."""
    guest.sh(f"systemctl stop {UNIT}")
    pair.first.unplug()
    pair.second.unplug()
    until(lambda: guest.code("ls /dev/video*") != 0, "no camera is left")
    pair.second.plug(guest, usb_port=4)
    until(lambda: guest.code(f"test -e {SECOND}") == 0, "the second camera has its name")
    pair.first.plug(guest)
    until(lambda: guest.code(f"test -e {FIRST}") == 0, "the first camera has its name")
    assert guest.sh(f"readlink -f {SECOND}").strip() == "/dev/video0"
    guest.sh(f"systemctl start {UNIT}")
    with streaming(guest, film.right, tmp_path / "out") as stream:
        stream.more(10, "of the camera that auto takes")
        assert pair.first.streaming
        assert not pair.second.streaming
        stream.finish(skew)


def test_a_name_means_one_camera_and_outlives_another_port(
    guest: Guest, pair: Pair, film: Film, tmp_path: Path
) -> None:
    """By its by-id name the service streams from the second camera; when it is pulled, the service waits for that one, in whatever port it returns."""
    guest.configure(f"v4l2:{SECOND}?{OPTIONS}")
    with streaming(guest, film.right, tmp_path / "out") as stream:
        stream.more(10, "of the second camera")
        assert pair.second.streaming
        assert not pair.first.streaming
        pair.second.unplug()
        guest.until("StatusText", "is it plugged in?", "the status names the missing camera")
        assert not pair.first.streaming, "the first camera does not stand in for it"
        pair.second.plug(guest, usb_port=5)
        stream.more(10, "after the plug")
        report = stream.receiver
        assert report.stop() == 0
    assert len(report.json()["sessions"]) == 1


def test_both_stream_at_once_and_one_is_pulled(
    guest: Guest, pair: Pair, film: Film, skew: Skew, tmp_path: Path
) -> None:
    """Two agents stream from one camera each; replugging one at another port does not disturb the other one's stream."""
    guest.configure(f"v4l2:{FIRST}?{OPTIONS}")
    guest.sh("rm -f /run/second")
    other = f"board-agent run --camera 'v4l2:{SECOND}?{OPTIONS}' --link ipc:///run/second --json > /run/second.json"
    starts = pair.second.starts
    # The test before has just plugged it in: a camera that is not ready yet is awaited, as the service does.
    settings = "BOARD_AGENT_IDLE_AFTER=0 BOARD_AGENT_WAIT_FOR_CAMERA=true"
    agent = guest.popen(f"{settings} {other} & echo $!; wait; cat /run/second.json")
    assert agent.stdout is not None
    pid = agent.stdout.readline().decode().strip()
    with streaming(guest, film.right, tmp_path / "out") as stream:
        stream.more(10, "beside the other camera")
        # A camera streams before its agent has taken it over; the agent's door opens after that.
        until(lambda: guest.code("test -S /run/second") == 0, "the second agent serves")
        until(lambda: pair.second.starts > starts and pair.second.streaming, "the second camera streams")
        until(lambda: pair.first.streaming, "the first camera streams beside it")
        losses = pair.second.starts
        pair.second.unplug()
        stream.more(10, "while the other camera is away")
        pair.second.plug(guest, usb_port=6)
        until(lambda: pair.second.starts > losses and pair.second.streaming, "the other one streams again")
        stream.more(10, "beside the other camera again")
        report = stream.finish(skew)
    guest.sh(f"kill {pid}")
    account = json.loads(agent.communicate(timeout=60)[0])
    assert account["camera"]["unplugged"] == account["camera"]["returned"] == 1
    assert account["grabbed"] > 10
    assert len(report["sessions"]) == 1
    assert report["sessions"][0]["lost"] == 0
