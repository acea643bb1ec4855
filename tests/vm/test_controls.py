"""Exposure, white balance and focus are held for stereo, set in the order that the driver demands, on a webcam that has all of them."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from common import now
from common.camera_identity import Lock
from common.link.factory import open_link, parse_link
from phone_host.stream.receiver import Receiver
from tests.support.numbered import saved_numbers
from tests.support.programs import ledgers, until
from tests.support.unkept import Unkept
from tests.vm import uvc
from tests.vm.conftest import CAMERA
from tests.vm.guest import Guest
from tests.vm.stream import FPS, FRAMES, Film, Skew, check_journal, streaming
from tests.vm.webcam import Webcam

pytestmark = pytest.mark.timeout(600)  # the first test boots the board

AUTOMATISMS = {
    uvc.EXPOSURE: (uvc.EXPOSURE_MODE, 1),
    uvc.WHITE_BALANCE: (uvc.WHITE_BALANCE_AUTO, 0),
    uvc.FOCUS: (uvc.FOCUS_AUTO, 0),
}
"""For each value: its automatic mode, and the setting that switches that off."""


EXPOSURE_ABSOLUTE, FOCUS_ABSOLUTE = 0x009A0902, 0x009A090A
SET = (
    'cd /usr/lib/tandemscan && python3 -c "from common.camera.v4l2_device import Device, capture_nodes; '
    'Device(capture_nodes()[0]).set_control({control}, {value})"'
)
"""Another program of the board sets a control."""


@pytest.fixture(autouse=True)
def _sound_afterwards(guest: Guest, webcam: Webcam) -> Iterator[None]:
    """After each test the service is up with its usual camera, its accounts balance and it has never shown a traceback."""
    assert webcam.plugged
    yield
    guest.configure(CAMERA)
    check_journal(guest)


def as_new(webcam: Webcam, guest: Guest) -> None:
    """Power-cycle the camera: its controls return to their defaults."""
    webcam.unplug()
    until(lambda: guest.code("test -e /dev/video0") != 0, "the node is gone")
    webcam.set_requests = []
    webcam.plug(guest)
    until(lambda: guest.code("test -e /dev/video0") == 0, "the driver has made its node")


def check_order(requests: list[tuple[tuple[int, int], int]]) -> None:
    """Each value was set after its automatic mode had been switched off, and the dynamic frame rate before any of them."""
    order = [where for where, _ in requests]
    assert order.index(uvc.EXPOSURE_PRIORITY) < min(order.index(value) for value in AUTOMATISMS)
    for value, (automatism, off) in AUTOMATISMS.items():
        assert requests.index((automatism, off)) < order.index(value), requests


def check_stamps(out: Path, webcam: Webcam, first: int) -> None:
    """From pair `first` on, the stamps lie where the webcam's own record puts them; checked only where that is known to 5 ms, which a busy machine may not give."""
    told = list(zip(saved_numbers(out), ledgers(out), strict=True))[first:]
    sharp = [
        (left, right, ledger)
        for (left, right), ledger in told
        if webcam.late_ns[left][1] - webcam.late_ns[left][0] < 5_000_000
    ]
    lap_ns = FRAMES * 10**9 // FPS
    for left, right, ledger in sharp:
        due_ns = ((left - right) * 10**9 // FPS + lap_ns // 2) % lap_ns - lap_ns // 2
        late_ns = ledger["time_skew_ns"] - due_ns
        least_ns, most_ns = webcam.late_ns[left]
        slack_ns = ledger["uncertainty_ns"] + 1_000_000  # the kernel's stamp and the period are rounded
        assert least_ns - slack_ns <= late_ns <= most_ns + slack_ns, (left, right, ledger)


def test_the_driver_refuses_what_an_automatism_rules(guest: Guest, webcam: Webcam) -> None:
    """The driver refuses to set the focus while it is automatic (EACCES): the tested order is really demanded."""
    as_new(webcam, guest)
    said = guest.sh(f"{SET.format(control=FOCUS_ABSOLUTE, value=30)} 2>&1; true")
    assert "PermissionError" in said
    assert "in set_control" in said
    assert uvc.FOCUS not in [where for where, _ in webcam.set_requests]


def test_what_the_automatisms_found_is_held(
    guest: Guest, webcam: Webcam, film: Film, skew: Skew, tmp_path: Path
) -> None:
    """Two seconds into the stream all automatic modes are off and the values are those that they had found; a replugged camera gets them, too."""
    as_new(webcam, guest)
    guest.configure(CAMERA)
    with streaming(guest, film.right, tmp_path / "out") as stream:
        until(lambda: webcam.settings[uvc.FOCUS_AUTO] == 0, "the focus is held")
        stream.more(10, "with controls held")
        check_order(webcam.set_requests)
        as_new(webcam, guest)
        stream.more(10, "after the plug")
        stream.finish(skew)
    check_order(webcam.set_requests)
    assert webcam.settings[uvc.EXPOSURE_PRIORITY] == 0
    for value, (automatism, off) in AUTOMATISMS.items():
        assert webcam.settings[automatism] == off
        assert webcam.settings[value] == uvc.CONTROLS[value].found
    assert "control_refused" not in guest.journal()


def test_what_the_user_sets_is_set_before_the_first_frame(guest: Guest, webcam: Webcam) -> None:
    """Exposure, white balance, focus and mains frequency from the URI are set in the camera when its stream begins, each within its step."""
    as_new(webcam, guest)
    before = webcam.starts
    guest.configure(f"{CAMERA}&exposure_ms=20&white_balance=3997&focus=33&power_line=50")
    until(lambda: webcam.starts > before and webcam.streaming, "the service starts the stream")
    check_order(webcam.set_requests)
    assert "control_refused" not in guest.journal()
    assert webcam.settings[uvc.EXPOSURE] == 200  # 100 us
    assert webcam.settings[uvc.WHITE_BALANCE] == 4000  # in steps of 10 K
    assert webcam.settings[uvc.FOCUS] == 35  # in steps of 5
    assert webcam.settings[uvc.POWER_LINE] == 1


def test_without_lock_the_automatisms_stay_on(
    guest: Guest, webcam: Webcam, film: Film, skew: Skew, tmp_path: Path
) -> None:
    """lock=0 leaves exposure, white balance and focus to the camera, even after the time at which they would be held."""
    as_new(webcam, guest)
    guest.configure(f"{CAMERA}&lock=0")
    with streaming(guest, film.right, tmp_path / "out") as stream:
        stream.more(40, "of four seconds")
        stream.finish(skew)
    assert webcam.settings[uvc.FOCUS_AUTO] == webcam.settings[uvc.WHITE_BALANCE_AUTO] == 1
    assert webcam.settings[uvc.EXPOSURE_MODE] == 8


def test_a_host_sets_locks_on_the_boards_camera(guest: Guest, webcam: Webcam) -> None:
    """The hello says which webcam it is and what can be held; focus is set within its step, its automatic mode first; a zoom it has not."""
    as_new(webcam, guest)
    guest.configure(CAMERA)
    receiver = Receiver([open_link(parse_link(guest.link, listens_by_default=False))], now.random_id(), Unkept())
    receiver.start()
    try:
        until(lambda: receiver.hello is not None and bool(receiver.hello.camera.controls), "the board says hello")
        hello = receiver.hello
        assert hello is not None
        assert (hello.camera.identity.driver, hello.camera.identity.serial) == ("uvcvideo", "TEST-A")
        assert {lock for lock, _ in hello.camera.controls} == {Lock.EXPOSURE, Lock.WHITE_BALANCE, Lock.FOCUS}
        asked = ((Lock.FOCUS, 33), (Lock.ZOOM, 100))
        receiver.hold(asked)
        until(lambda: receiver.locks is not None and receiver.locks.asked == asked, "the board answers")
        state = receiver.locks
        assert state is not None
        held = dict(state.held)
        assert held[Lock.FOCUS] == webcam.settings[uvc.FOCUS] == 35
        assert Lock.ZOOM not in held
        requests = [where for where, _ in webcam.set_requests]
        assert requests.index(uvc.FOCUS_AUTO) < requests.index(uvc.FOCUS)
    finally:
        receiver.stop()
    assert "control_refused" not in guest.journal()


@pytest.mark.parametrize("by_itself", [False, True], ids=["by-another-program", "by-the-camera"])
def test_stamps_follow_the_exposure_time(
    guest: Guest, webcam: Webcam, film: Film, skew: Skew, tmp_path: Path, *, by_itself: bool
) -> None:
    """Exposure goes from 10 to 24 ms during the stream, with or without a report by the driver: it is read again, or the stamps would be 7 ms late."""
    as_new(webcam, guest)
    guest.configure(f"{CAMERA}&lock=0" if by_itself else CAMERA)
    with streaming(guest, film.right, tmp_path / "out") as stream:
        if by_itself:
            stream.more(10, "with a short exposure")
            webcam.find(uvc.EXPOSURE, 240)
        else:
            until(lambda: webcam.settings[uvc.EXPOSURE_MODE] == 1, "the exposure is held")
            stream.more(10, "with a short exposure")
            guest.sh(SET.format(control=EXPOSURE_ABSOLUTE, value=240))
        assert webcam.settings[uvc.EXPOSURE] == 240
        stream.more(2 * FPS, "in which the exposure is read: once a second where nothing tells of it")
        before = stream.pairs
        stream.more(3 * FPS, "with a long exposure")
        stream.finish(skew)
    webcam.found.clear()
    check_stamps(tmp_path / "out", webcam, before)
