"""When a camera is opened, given up and tried again, without a device: the automaton alone, for both kinds of camera that use it."""

import pytest

from common.camera.base import CameraState
from common.camera.life import NEVER_NS, Life, LifeSettings, Loss, Standing, Step
from tests.support.camera_lives import BOTH, DEVICE, SERVER, S


def opened(settings: LifeSettings, now_ns: int = 0, period_ns: int = 0) -> Life:
    """A camera that was opened and accepted."""
    life = Life(settings, now_ns)
    assert life.due(now_ns) is Step.OPEN
    assert life.opened(now_ns, period_ns) is Step.NONE
    life.accept()
    return life


@BOTH
def test_it_is_opened_at_once_and_once(settings: LifeSettings) -> None:
    """A new life is opened at its first moment, and not again while the outcome is awaited."""
    life = Life(settings, 5)
    assert life.due_ns == 5
    assert life.due(5) is Step.OPEN
    assert life.due(5 + 100 * S) is Step.NONE
    assert life.due_ns == NEVER_NS


@BOTH
def test_a_start_is_given_up(settings: LifeSettings) -> None:
    """Until it is accepted, a camera is given up when it is refused or its start time runs out; afterwards never. A failure during the start does not count as a lost camera."""
    silent = Life(settings, 0)
    silent.due(0)
    silent.opened(0)
    assert not silent.gives_up(settings.start_ns - 1)
    assert silent.gives_up(settings.start_ns)
    silent.lost(Loss.FAILED, 1)
    assert not silent.is_lost
    assert silent.state is CameraState.GONE
    refused = Life(settings, 0)
    refused.due(0)
    refused.refused(0)
    assert refused.gives_up(0)
    assert not opened(settings).gives_up(100 * S)


@BOTH
def test_silence_is_a_stall(settings: LifeSettings) -> None:
    """An open camera without a frame for its kind's patience is closed, and tried again after a rest; a frame in time puts that off."""
    life = opened(settings)
    life.heard(S)
    assert life.due(S + settings.silence_ns - 1) is Step.NONE
    life.heard(2 * S)
    stall_ns = 2 * S + settings.silence_ns
    assert life.due_ns == stall_ns
    assert life.due(stall_ns) is Step.CLOSE
    assert life.counts.lost == {Loss.STALLED: 1, Loss.FAILED: 0, Loss.UNPLUGGED: 0}
    assert life.state is CameraState.GONE
    assert life.due(100 * S) is Step.NONE  # nothing until it is closed
    life.closed()
    assert life.due_ns == stall_ns + settings.rest_ns
    assert life.due(life.due_ns) is Step.OPEN


@pytest.mark.parametrize(("period_ns", "patience_ns"), [(0, S), (S // 30, S), (S // 2, 5 * S)])
def test_a_slow_camera_is_given_ten_periods(period_ns: int, patience_ns: int) -> None:
    """A camera with long periods may be silent for ten of them."""
    life = opened(DEVICE)
    life.heard(7, period_ns)
    assert life.due_ns == 7 + patience_ns


@BOTH
def test_the_first_frame_may_take_longer(settings: LifeSettings) -> None:
    """The very first frame gets the start's time; the first frame after a later opening has a time of its own."""
    life = Life(settings, 0)
    life.due(0)
    life.opened(0)
    assert life.due_ns == settings.start_ns
    life.accept()
    life.heard(1)
    life.lost(Loss.FAILED, 2)
    life.closed()
    again_ns = life.due_ns
    life.due(again_ns)
    life.opened(again_ns)
    assert life.due_ns == again_ns + settings.first_frame_ns


def test_a_lost_device_is_tried_at_once_then_five_times_a_second() -> None:
    """A device that gave frames and failed is reopened at once, with a rest of a fifth of a second after each refusal."""
    life = opened(DEVICE)
    life.heard(S)
    life.lost(Loss.UNPLUGGED, 2 * S)
    life.closed()
    tries_ns = refusals(life, 4)
    assert tries_ns == [2 * S, 2 * S + S // 5, 2 * S + 2 * S // 5, 2 * S + 3 * S // 5]


def test_a_lost_server_is_tried_ever_more_rarely() -> None:
    """A server's rests start at 0.1 s and double with each refusal up to a second; a frame makes them short again."""
    life = opened(SERVER)
    life.heard(S)
    life.lost(Loss.FAILED, S)
    life.closed()
    tenths = [(try_ns - S) * 10 // S for try_ns in refusals(life, 7)]
    assert tenths == [1, 1 + 2, 3 + 4, 7 + 8, 15 + 10, 25 + 10, 35 + 10]
    now_ns = life.due_ns
    life.due(now_ns)
    life.opened(now_ns)
    life.heard(now_ns)
    life.lost(Loss.FAILED, now_ns)
    life.closed()
    assert life.due_ns == now_ns + S // 10


def refusals(life: Life, count: int) -> list[int]:
    """Refuse this many openings; return when they were tried."""
    tries_ns = []
    for _ in range(count):
        tries_ns.append(life.due_ns)
        assert life.due(life.due_ns) is Step.OPEN
        life.refused(tries_ns[-1])
    return tries_ns


@BOTH
def test_a_listener_ends_the_rest(settings: LifeSettings) -> None:
    """A listener that comes while a lost camera rests is served at once."""
    life = Life(settings, 0)
    now_ns = refusals(life, 5)[-1] + 1
    assert life.due(now_ns) is Step.NONE
    life.pause()
    assert life.resume(now_ns) is Step.NONE
    assert life.resume(now_ns) is Step.NONE
    assert life.due(now_ns) is Step.OPEN


def test_a_camera_that_opens_and_fails_at_once_is_not_opened_without_a_rest() -> None:
    """A device that opens but fails before its first frame rests as if it had been refused."""
    life = opened(DEVICE)
    life.lost(Loss.FAILED, 1)
    life.closed()
    assert life.due_ns == 1 + S // 5


@BOTH
def test_images_of_no_use_are_no_silence_and_no_return(settings: LifeSettings) -> None:
    """A lost camera that comes back with unusable images is not closed for silence, and stays lost until a usable frame comes."""
    life = opened(settings)
    life.heard(1)
    assert life.lost(Loss.FAILED, 2) is Step.CLOSE
    life.closed()
    at_ns = life.due_ns
    assert life.due(at_ns) is Step.OPEN
    life.opened(at_ns)
    for number in range(1, 100):
        life.stirred(at_ns + number * S // 10)
        assert life.due(at_ns + number * S // 10 + 1) is not Step.CLOSE
    assert life.is_lost
    life.heard(at_ns + 11 * S)
    assert not life.is_lost


@BOTH
def test_it_is_back_with_its_first_frame(settings: LifeSettings) -> None:
    """A lost camera stays lost through openings that give no frame, and is back, once, with the first frame."""
    life = opened(settings)
    for _ in range(3):
        life.lost(Loss.FAILED, life.due_ns - 1)
        life.closed()
        now_ns = life.due_ns
        life.due(now_ns)
        life.opened(now_ns)
        assert life.is_lost
        assert life.counts.returned == 0
    life.heard(life.due_ns - 1)
    assert not life.is_lost
    assert life.state is CameraState.RUNNING
    assert (life.counts.lost[Loss.FAILED], life.counts.returned) == (3, 1)


def test_a_device_that_nobody_wants_stays_open_and_is_looked_for() -> None:
    """A paused device is switched off, looked for at once and then every second, and switched on by the next listener. If it is lost meanwhile, it is back when opened."""
    life = opened(DEVICE)
    assert life.pause() is Step.STOP
    assert life.pause() is Step.NONE
    states = [life.state]
    assert [life.due(now_ns) for now_ns in (4, 4 + S - 1, 4 + S)] == [Step.LOOK, Step.NONE, Step.LOOK]
    assert life.lost(Loss.UNPLUGGED, 2 * S) is Step.CLOSE
    life.closed()
    states.append(life.state)
    assert states == [CameraState.PAUSED, CameraState.GONE]
    now_ns = life.due_ns
    assert life.due(now_ns) is Step.OPEN
    assert not life.is_wanted
    assert life.opened(now_ns) is Step.NONE
    assert life.counts.returned == 1
    assert life.resume(3 * S) is Step.START
    assert life.due_ns == 3 * S + DEVICE.first_frame_ns


def test_a_server_that_nobody_wants_is_closed_and_left_alone() -> None:
    """A paused server is closed, not retried and not counted as lost. It is called at once for the next listener, even while it is still being closed."""
    life = opened(SERVER)
    life.heard(1)
    assert life.pause() is Step.CLOSE
    assert life.lost(Loss.FAILED, 2) is Step.NONE  # the interrupted connection ends
    assert life.resume(3) is Step.NONE
    assert life.pause() is Step.NONE
    life.closed()
    assert life.due_ns == NEVER_NS
    assert life.state is CameraState.PAUSED
    life.resume(4)
    assert life.due(4) is Step.OPEN
    life.pause()
    assert life.opened(5) is Step.CLOSE  # nobody wants it any more
    assert sum(life.counts.lost.values()) == 0


@BOTH
def test_a_steered_camera_is_off_until_its_moment(settings: LifeSettings) -> None:
    """A steered camera is off until the named moment, may be steered again before then, and does not count as a stall meanwhile."""
    life = opened(settings)
    assert life.steer(50 * S) is Step.STOP
    assert life.steer(60 * S) is Step.STOP
    assert life.due(60 * S - 1) is Step.NONE
    assert life.due(60 * S) is Step.START
    assert life.phase is Standing.STREAMING
    life.lost(Loss.FAILED, 60 * S)
    assert life.steer(61 * S) is Step.NONE


@BOTH
def test_a_camera_is_renewed_without_a_rest(settings: LifeSettings) -> None:
    """A camera that is to become another is closed and opened at once, and that is no loss."""
    life = opened(settings)
    assert life.renew(9) is Step.CLOSE
    life.closed()
    assert life.due(9) is Step.OPEN
    assert life.renew(9) is Step.NONE
    assert not life.is_lost


@BOTH
def test_the_end_is_the_end(settings: LifeSettings) -> None:
    """An ended camera is closed and never opened again; one that was being opened is closed once it is open."""
    life = opened(settings)
    assert life.end() is Step.CLOSE
    life.closed()
    assert life.end() is Step.NONE
    assert life.due(100 * S) is Step.NONE
    late = Life(settings, 0)
    late.due(0)
    late.end()
    assert late.opened(1) is Step.CLOSE
