"""The basic scenario on a board of a BeagleBone's kind: armhf, 512 MB, one processor."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.vm.conftest import CAMERA, READOUT_MS, booted
from tests.vm.guest import UNIT, Guest
from tests.vm.machine import Architecture
from tests.vm.stream import FPS, Film, check_journal, streaming, webcam_skew
from tests.vm.webcam import Webcam

pytestmark = pytest.mark.timeout(600)  # the first test boots the board


@pytest.fixture(scope="module")
def bare_board() -> Iterator[Guest]:
    """The booted board without the package."""
    with booted(Architecture.ARMHF) as guest:
        yield guest


def test_the_basic_scenario(bare_board: Guest, package: Path, film: Film, tmp_path: Path) -> None:
    """Installed, plugged in, streaming, pulled and plugged in again, restarted: every pair is correct and every frame is accounted for."""
    board = bare_board
    assert board.sh("dpkg --print-architecture && nproc").split() == ["armhf", "1"]
    board.install(package)
    board.configure(CAMERA)
    board.until("StatusText", "waiting for the camera", "the service runs without a camera")
    webcam = Webcam(film.frames, FPS, READOUT_MS * 1_000_000)
    try:
        webcam.plug(board)
        with streaming(board, film.right, tmp_path / "out") as stream:
            stream.more(30, "of the camera that came after the service")
            webcam.unplug()
            board.until("StatusText", "is it plugged in?", "the status names the missing camera")
            webcam.plug(board, usb_port=1)
            stream.more(10, "after the plug")
            board.sh(f"systemctl restart {UNIT}")
            stream.more(10, "of the restarted service")
            report = stream.finish(webcam_skew(webcam.late_ns))
    finally:
        webcam.close()
    first, second = report["sessions"]
    # If the board gets no processor for 0.3 s while it says goodbye, its end stays unknown; test_faults shows that otherwise it is known.
    assert second["tail"] == "known"
    assert first["lost"] == second["lost"] == 0
    check_journal(board)
