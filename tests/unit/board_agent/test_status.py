"""The line that says how the board is doing."""

from board_agent.status import StatusLine
from common.camera.base import CameraState
from common.protocol.message import BoardCounts, DropReason, Pacing, Rung

SECOND_NS = 1_000_000_000


def line(pacing: Pacing = Pacing.CLOCK) -> StatusLine:
    return StatusLine("v4l2:/dev/video0", pacing, ("tcp://*:5555", "ipc:///run/x"), 0)


def test_without_a_host_it_says_where_one_is_awaited() -> None:
    """While no host is there, the links are named."""
    assert (
        line().text(SECOND_NS, BoardCounts(), has_host=False) == "waiting for a host on tcp://*:5555 and ipc:///run/x"
    )


def test_the_rate_is_that_of_the_time_since_the_last_line() -> None:
    """60 frames in the first 2 s and 10 in the next give 30 and then 5 frames a second; drops are summed over all reasons."""
    status = line()
    dropped = ((DropReason.REPLACED, 3), (DropReason.SPOILED, 2))
    assert status.text(2 * SECOND_NS, BoardCounts(60, 55, dropped), has_host=True).startswith("30.0 fps, 55 sent")
    text = status.text(4 * SECOND_NS, BoardCounts(70, 65, dropped), has_host=True)
    assert text == "5.0 fps, 65 sent to the host, 5 dropped"


def test_the_link_in_use_is_named() -> None:
    """Of several links the carrier is shown beside the rate; none is shown while none carries."""
    status = line()
    text = status.text(SECOND_NS, BoardCounts(30, 30), has_host=True, carrier=1)
    assert text == "30.0 fps over ipc:///run/x, 30 sent to the host, 0 dropped"
    assert " over " not in status.text(2 * SECOND_NS, BoardCounts(60, 60), has_host=True, carrier=None)


def test_a_lowered_camera_is_told() -> None:
    """What the camera gives instead of the requested values is at the end; nothing is there while it gives all."""
    lowered = Rung(index=1, last=2, changes=1, period_ns=200_000_000, quality=50, width_px=320, height_px=240)
    text = line().text(SECOND_NS, BoardCounts(5, 5), has_host=True, rung=lowered)
    assert text.endswith("0 dropped; lowered to 5 fps of 320x240 at quality 50 for the link (rung 1 of 2)")
    asked = Rung(index=0, last=2, changes=2, period_ns=100_000_000, quality=80, width_px=640, height_px=480)
    assert line().text(SECOND_NS, BoardCounts(5, 5), has_host=True, rung=asked).endswith("0 dropped")


def test_a_silent_camera_is_named_with_its_silence() -> None:
    """A camera that gives nothing for seconds while a host waits is named; one frame clears that."""
    status = line()
    status.text(SECOND_NS, BoardCounts(30, 30), has_host=True)
    assert "fps" in status.text(3 * SECOND_NS, BoardCounts(30, 30), has_host=True)
    text = status.text(8 * SECOND_NS, BoardCounts(30, 30), has_host=True)
    assert text == "no frame from v4l2:/dev/video0 for 7 s: is it plugged in?"
    assert "fps" in status.text(9 * SECOND_NS, BoardCounts(31, 31), has_host=True)


def test_a_camera_on_demand_may_be_silent() -> None:
    """A demand-paced replay gives nothing while the host asks for nothing: that is no fault."""
    assert line(Pacing.DEMAND).text(60 * SECOND_NS, BoardCounts(1, 1), has_host=True).startswith("0.0 fps, 1 sent")


def test_a_camera_that_rested_without_a_host_is_not_called_silent() -> None:
    """An hour without host and frames is not a silence of the camera: its silence counts from the host's arrival."""
    status = line()
    status.text(3600 * SECOND_NS, BoardCounts(), has_host=False)
    assert "fps" in status.text(3602 * SECOND_NS, BoardCounts(), has_host=True)
    assert "for 4 s" in status.text(3604 * SECOND_NS, BoardCounts(), has_host=True)


def test_a_camera_that_was_pulled_is_told_while_no_host_is_there() -> None:
    """Its address stands before the links; a camera that rests because nobody listens is no news."""
    text = line().text(SECOND_NS, BoardCounts(), has_host=False, camera=CameraState.GONE)
    assert text.startswith("the camera is gone: v4l2:/dev/video0")
    assert text.endswith("tcp://*:5555 and ipc:///run/x")
    assert (
        line()
        .text(SECOND_NS, BoardCounts(), has_host=False, camera=CameraState.PAUSED)
        .startswith("waiting for a host")
    )
