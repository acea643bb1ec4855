"""What happens to a camera: pulled and plugged in again, spoiled frames, a plane of known depth."""

import signal
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.support.point_files import read_pfm
from tests.support.programs import PATIENCE_S, ledgers, until
from tests.vm.conftest import READOUT_MS
from tests.vm.guest import UNIT, Guest
from tests.vm.stream import FPS, NUMBER_ROWS, Film, Skew, board_accounts, check_journal, streaming
from tests.vm.webcam import Webcam

pytestmark = pytest.mark.timeout(600)  # the first test boots the board

DISPARITIES = 64
DEAD_S = 64
"""More than a minute, and not the film's length, at which every wrong pair would look right."""


@pytest.fixture(autouse=True)
def _sound_afterwards(guest: Guest, webcam: Webcam) -> Iterator[None]:
    """After each test the service is up, its accounts balance and it has never shown a traceback."""
    assert webcam.plugged
    yield
    check_journal(guest)


def test_depth_of_a_known_plane(guest: Guest, film: Film, skew: Skew, tmp_path: Path) -> None:
    """The disparity of nearly all pixels is within one pixel of the plane's true one, through webcam, driver, board, link and stereo core."""
    with streaming(guest, film.right, tmp_path / "out", ("--rectified", "--disparities", str(DISPARITIES))) as stream:
        stream.more(5, "with disparity")
        stream.finish(skew)
    maps = sorted((tmp_path / "out").glob("pair-*/disparity.pfm"))
    assert maps
    for path in maps:
        found = read_pfm(path)
        inside = np.zeros(found.shape, bool)
        inside[2 * NUMBER_ROWS : -8, DISPARITIES:-8] = True  # below the numbers, where the right view shows the same
        error_px = np.abs(found - film.truth.disparity_px)[inside]
        assert np.mean(error_px < 1.0) > 0.97, path  # NaN, no disparity, counts as wrong


def test_stamps_are_those_of_the_exposure(guest: Guest, webcam: Webcam, film: Film, skew: Skew, tmp_path: Path) -> None:
    """Both cameras expose at the same moments, and the board knows exposure and readout: the remaining time skew is the way into the driver."""
    with streaming(guest, film.right, tmp_path / "out") as stream:
        stream.more(30, "of both cameras")
        stream.finish(skew)
    skews_s = np.array([ledger["time_skew_ns"] for ledger in ledgers(tmp_path / "out")]) / 1e9
    taken_s = [(most_ns - least_ns) / 1e9 for least_ns, most_ns in webcam.late_ns.values()]
    assert 0 < np.median(taken_s) < 0.02, "the webcam's own account is sharp enough for the check of pairs"
    # Without the correction by half an exposure and half a readout the median would be 15 ms higher.
    assert abs(np.median(skews_s)) < READOUT_MS / 2 / 1e3


def test_a_pulled_camera_is_missed_and_found_again(
    guest: Guest, webcam: Webcam, film: Film, skew: Skew, tmp_path: Path
) -> None:
    """Pulled while streaming, the camera is reported as missing; in another port it continues in the same session of the same process."""
    process = guest.show("MainPID")
    with streaming(guest, film.right, tmp_path / "out") as stream:
        for usb_port in (1, 0):
            stream.more(10, "before the pull")
            webcam.unplug()
            guest.until("StatusText", "is it plugged in?", "the status names the missing camera")
            webcam.plug(guest, usb_port)
            stream.more(10, "after the plug")
        report = stream.finish(skew)
    assert len(report["sessions"]) == 1
    assert guest.show("MainPID") == process


def test_a_camera_whose_firmware_hangs_is_overcome(
    guest: Guest, webcam: Webcam, film: Film, skew: Skew, tmp_path: Path
) -> None:
    """A camera that answers nothing is given up, or holds its driver in the kernel until the watchdog restarts the service; then it streams again."""
    told = ("camera_lost", "Watchdog timeout")
    before = sum(guest.journal().count(word) for word in told)
    with streaming(guest, film.right, tmp_path / "out") as stream:
        stream.more(10, "before the hang")
        webcam.hung = True
        try:
            until(lambda: sum(guest.journal().count(word) for word in told) > before, "the hang is noticed")
        finally:
            webcam.hung = False
        stream.more(10, "after the hang")
        stream.finish(skew)


def test_a_camera_that_comes_after_the_service_is_served(
    guest: Guest, webcam: Webcam, film: Film, skew: Skew, tmp_path: Path
) -> None:
    """A service that was started without any camera streams as soon as one is plugged in; so does one whose driver was never loaded."""
    webcam.unplug()
    # Unload down to the layer that owns the device number: then the kernel no longer knows of cameras.
    unload = "modprobe -r uvcvideo; rmmod videobuf2_vmalloc videobuf2_v4l2 videobuf2_memops videobuf2_common videodev"
    guest.sh(f"until ! grep -q video4linux /proc/devices; do {unload}; sleep 0.2; done 2>/dev/null")
    guest.sh(f"systemctl restart {UNIT}")
    guest.until("StatusText", "waiting for the camera", "the service runs without a camera")
    with streaming(guest, film.right, tmp_path / "out") as stream:
        webcam.plug(guest)
        stream.more(10, "of the camera that came late")
        stream.finish(skew)


def test_truncated_frames_are_dropped_and_counted(
    guest: Guest, webcam: Webcam, film: Film, skew: Skew, tmp_path: Path
) -> None:
    """Frames cut in half in the camera are never paired; the board counts them as spoiled, and the others keep streaming."""
    guest.sh(f"systemctl restart {UNIT}")
    webcam.truncated, webcam.truncate_every = 0, 3
    with streaming(guest, film.right, tmp_path / "out") as stream:
        stream.more(20, "with every third frame cut")
        webcam.truncate_every = 0
        stream.more(10, "of whole frames")
        stream.finish(skew)
    sent = ledgers(tmp_path / "out")[-1]["session"]
    guest.sh(f"systemctl restart {UNIT}")
    until(lambda: sent in board_accounts(guest.journal()), "the account is in the journal")
    assert webcam.truncated >= 20 // 2 - 1
    assert 1 <= board_accounts(guest.journal())[sent]["spoiled"] <= webcam.truncated


def test_a_host_dead_for_a_minute_is_served_again(
    guest: Guest, webcam: Webcam, film: Film, skew: Skew, tmp_path: Path
) -> None:
    """A host that is stopped for more than a minute is given up and the camera rests; when it continues, it gets fresh frames of the same session."""
    with streaming(guest, film.right, tmp_path / "out") as stream:
        stream.more(10, "before the stop")
        before = webcam.starts
        stream.receiver.send(signal.SIGSTOP)
        dead_until = time.monotonic() + DEAD_S
        try:
            guest.until("StatusText", "waiting for a host", "the board gives the host up")
            until(lambda: not webcam.streaming, "the stream is switched off")
            assert webcam.starts == before
            time.sleep(max(0.0, dead_until - time.monotonic()))  # the length of the fault, not a wait for something
        finally:
            stream.receiver.send(signal.SIGCONT)
        stream.more(10, "after the minute")
        report = stream.finish(skew)
    assert webcam.starts > before
    assert len(report["sessions"]) == 1


def test_a_camera_out_of_step_is_steered_by_restarting_it(
    guest: Guest, webcam: Webcam, film: Film, skew: Skew, tmp_path: Path
) -> None:
    """A webcam that exposes 37 ms after the host's is restarted by the board at the right moment: the pairs' time skew falls to a few ms."""
    until(lambda: not webcam.streaming, "the camera rests, so that the host's coming starts it")
    webcam.start_with_phase(37_000_000)
    starts = webcam.starts
    with streaming(guest, film.right, tmp_path / "out", ("--align-phase", "board")) as stream:
        # Twelve tries of a few seconds, if starts scatter.
        stream.until_said("state=aligned", "both cameras are in step", patience_s=2 * PATIENCE_S)
        period_ms = 1000 / FPS
        phase_ms = (webcam.phase_ns / 1e6 + period_ms / 2) % period_ms - period_ms / 2
        stream.more(5, "in step")
        alignment = stream.finish(skew)["phase"]["alignment"]
    assert abs(alignment["before_ms"]) > 25  # 37, and some ms on the way into the driver
    # A few ms; an emulated processor may stamp later by as much again while the last frames come.
    assert abs(alignment["after_ms"]) < abs(alignment["before_ms"]) / 2
    assert webcam.starts >= starts + 2
    # What the stamps cannot show: the way into the driver of a board with an emulated processor.
    assert abs(phase_ms) < 15
