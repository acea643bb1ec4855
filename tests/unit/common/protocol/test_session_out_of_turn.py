"""Messages out of turn: late, on the wrong lane, from the wrong side, or before any host has greeted. Board and host are called directly."""

from dataclasses import replace

import pytest

from common.frame import PixelFormat
from common.protocol.board_session import BoardSession
from common.protocol.host_session import HostSession
from common.protocol.message import (
    BoardCounts,
    BoardHello,
    Credit,
    End,
    HostHello,
    Knock,
    Lane,
    Message,
    Ping,
    Pong,
    Refusal,
    RefusalReason,
    Rung,
    Status,
    Steer,
)
from common.protocol.session import MS, SILENCE_NS, LinkDown, LinkUp, Outgoing, connection_name
from tests.support.samples import CAMERA
from tests.support.session_world import frame

NOW_NS = 10**12
NONE = BoardCounts()
NEAR, FAR = ({lane: connection_name(link, lane.name.encode()) for lane in Lane} for link in range(2))
HELLO = BoardHello(session="life", boot_id="boot", camera=CAMERA, counts=NONE, rung=Rung())


def greeted(*lanes: bytes) -> BoardSession:
    """A board that a host has greeted over these connections, each for the lane in its name."""
    board = BoardSession("life", "boot", CAMERA)
    for name in lanes:
        lane = Lane.FRAMES if name.endswith(b"FRAMES") else Lane.CONTROL
        assert board.receive(name, HostHello("host", lane), NOW_NS, NONE)
    return board


def words(said: list[Outgoing]) -> list[tuple[bytes, Message]]:
    """The messages that were sent, and on which connections."""
    return [(outgoing.connection, outgoing.message) for outgoing in said]


FROM_A_BOARD = [Knock(Lane.CONTROL, "life"), Refusal(RefusalReason.BUSY), Pong(wave=1, t0_ns=1, t1_ns=2, t2_ns=3)]
FROM_A_BOARD += [Status("life", BoardCounts(9, 9), Rung()), End("life", BoardCounts(9, 9)), HELLO, frame("life", 0)]


@pytest.mark.parametrize("word", FROM_A_BOARD, ids=lambda word: type(word).__name__)
def test_a_board_hears_no_boards_words(word: Message) -> None:
    """A board does not answer messages that only boards send. They neither end the host's part nor give credit for a frame."""
    board = greeted(*NEAR.values())
    assert board.receive(NEAR[Lane.CONTROL], word, NOW_NS, NONE) == []
    assert (board.carrier, board.has_host, board.has_credit) == (0, True, False)


@pytest.mark.parametrize("word", [HostHello("other", Lane.CONTROL), Ping(1, 2), Credit(99), Steer(MS)])
def test_a_host_hears_no_hosts_words(word: Message) -> None:
    """A host does not answer messages that only hosts send, and the link stays up."""
    host = HostSession("host", [NEAR])
    host.tick(NOW_NS)
    assert LinkUp(0, HELLO) in host.receive(NEAR[Lane.CONTROL], HELLO, NOW_NS)
    assert host.receive(NEAR[Lane.CONTROL], word, NOW_NS) == []
    host.receive(NEAR[Lane.FRAMES], HELLO, NOW_NS)
    assert host.carrier == 0


def test_a_link_that_fell_silent_is_not_spoken_on_any_more() -> None:
    """Of two links the standby falls silent: frames continue on the other, and later pings go over that one alone."""
    board = greeted(NEAR[Lane.CONTROL], NEAR[Lane.FRAMES], FAR[Lane.CONTROL])
    for now_ns in range(NOW_NS, NOW_NS + SILENCE_NS + 200 * MS, 100 * MS):
        board.receive(NEAR[Lane.CONTROL], Ping(1, now_ns), now_ns, NONE)
        board.tick(now_ns, NONE)
    assert board.carrier == 0
    asked = board.unreachable(NEAR[Lane.FRAMES])
    assert words(asked) == [(NEAR[Lane.CONTROL], Knock(Lane.FRAMES, "life"))]


def test_a_camera_that_changed_before_anybody_came_is_told_as_it_is() -> None:
    """If a board's camera got new settings while no host was there, the board reports the new camera to the next host."""
    board = BoardSession("life", "boot", CAMERA)
    grey = replace(CAMERA, pixel_format=PixelFormat.GREY, period_ns=66 * MS)
    board.describe(grey, Rung(index=1, last=2, period_ns=66 * MS))
    [(_, hello)] = words(board.receive(NEAR[Lane.CONTROL], HostHello("host", Lane.CONTROL), NOW_NS, NONE))
    assert isinstance(hello, BoardHello)
    assert (hello.camera, hello.rung.index) == (grey, 1)


def test_a_hello_for_the_wrong_lane_is_put_right_before_there_is_a_host() -> None:
    """A board that has dialled knows each connection's lane: a first hello for another lane gets a knock with the right one, and does not make its sender the host."""
    board = BoardSession("life", "boot", CAMERA, tuple(NEAR.items()))
    said = board.receive(NEAR[Lane.CONTROL], HostHello("host", Lane.FRAMES), NOW_NS, NONE)
    assert words(said) == [(NEAR[Lane.CONTROL], Knock(Lane.CONTROL, "life"))]
    assert not board.has_host


def test_a_caller_may_put_right_what_its_connection_is_for() -> None:
    """A host that is dialled corrects the lane of a connection as soon as its board names it: here from frames to control."""
    host = HostSession("host", [{}])
    caller = NEAR[Lane.CONTROL]
    host.receive(caller, Knock(Lane.FRAMES, "life"), NOW_NS)
    said = host.receive(caller, Knock(Lane.CONTROL, "life"), NOW_NS)
    assert Outgoing(caller, HostHello("host", Lane.CONTROL, reads_long=True)) in said
    assert LinkUp(0, HELLO) in host.receive(caller, HELLO, NOW_NS)


def test_a_board_that_slept_brings_its_link_down_and_up_again() -> None:
    """A hello with another life of the board's clock, on a link that is up, discards what was known of the link and starts it again."""
    host = HostSession("host", [NEAR])
    host.tick(NOW_NS)
    host.receive(NEAR[Lane.CONTROL], HELLO, NOW_NS)
    woken = replace(HELLO, boot_id="after the sleep")
    news = [
        output
        for output in host.receive(NEAR[Lane.CONTROL], woken, NOW_NS + MS)
        if isinstance(output, LinkUp | LinkDown)
    ]
    assert news == [LinkDown(0), LinkUp(0, woken)]


def test_a_late_answer_does_not_move_the_frames_back() -> None:
    """A board's answer to an older hello on another link may have moved its frames there: the host asks for them again on the link that it wants."""
    host = HostSession("host", [NEAR, FAR])
    host.tick(NOW_NS)
    for lanes in (NEAR, FAR):
        host.receive(lanes[Lane.CONTROL], HELLO, NOW_NS)
    assert Outgoing(FAR[Lane.FRAMES], HostHello("host", Lane.FRAMES, reads_long=True)) in host.carry(1, NOW_NS)
    host.receive(FAR[Lane.FRAMES], HELLO, NOW_NS)
    assert host.carrier == 1
    late = host.receive(NEAR[Lane.FRAMES], HELLO, NOW_NS)
    assert late == [Outgoing(FAR[Lane.FRAMES], HostHello("host", Lane.FRAMES, reads_long=True))]
    host.receive(FAR[Lane.FRAMES], HELLO, NOW_NS)
    assert host.carrier == 1
