"""Messages when board and host meet and part, in single cases: greetings, refusals, silence, goodbyes; on simulated time."""

import pytest

from common.protocol.message import (
    BoardCounts,
    BoardHello,
    Bye,
    Credit,
    End,
    HostHello,
    Knock,
    Lane,
    Ping,
    Pong,
    Refusal,
    RefusalReason,
    Rung,
    Status,
)
from common.protocol.session import (
    MS,
    SILENCE_NS,
    STATUS_NS,
    TAKEOVER_NS,
    Accepted,
    ClockVoid,
    Counted,
    Echo,
    LinkDown,
    LinkUp,
    Outgoing,
    Refused,
    Stale,
    StaleReason,
    Unbelievable,
    Vanished,
    connection_name,
)
from tests.support.session_world import World, frame


def test_an_answer_of_a_dead_board_opens_nothing() -> None:
    """A hello of the board's old life on one lane and one of its new life on the other do not make a session."""
    world = World()
    world.pass_time(20 * MS)
    host = world.hosts[0]
    for to_board in (True, False):
        world.deliver(host, (0, Lane.CONTROL), to_board=to_board)
    world.deliver(host, (0, Lane.FRAMES), to_board=True)
    late = host.wires[0, Lane.FRAMES].to_host[-1]
    assert isinstance(late, BoardHello)
    world.restart_board()
    for lane in Lane:
        world.deliver(host, (0, lane), to_board=False)
    for to_board in (True, False):
        world.deliver(host, (0, Lane.CONTROL), to_board=to_board)
    assert not any(
        isinstance(output, Accepted) for output in host.session.receive(host.names[0, Lane.FRAMES], late, world.now_ns)
    )
    world.settle(1000 * MS)
    assert host.board_session == world.board.session
    assert host.arrived


def test_a_second_host_waits_until_the_first_is_silent() -> None:
    """While the first host is alive a second one is told busy; one second after the first one's last message the second one gets in."""
    world = World()
    world.settle(500 * MS)
    first, second = world.hosts[0], world.add_host()
    world.settle(3000 * MS)
    assert not second.arrived
    assert Refused(RefusalReason.BUSY) in second.others
    assert len(first.arrived) > 60
    for lane in Lane:  # the first host falls silent
        world.wires = {name: held for name, held in world.wires.items() if held[2] is not first.wires[0, lane]}
    silent_ns = world.now_ns
    world.hosts.remove(first)
    while not second.arrived:
        world.settle(20 * MS)
        assert world.now_ns - silent_ns < TAKEOVER_NS + 1000 * MS
    assert world.now_ns - silent_ns >= TAKEOVER_NS - 250 * MS  # its last message was a clock echo


def test_a_goodbye_makes_room_at_once() -> None:
    """After a host's goodbye the next host gets in with its next hello, long before the first would count as silent."""
    world = World()
    world.settle(500 * MS)
    first, second = world.hosts[0], world.add_host()
    world.settle(500 * MS)
    assert first.arrived
    assert not second.arrived
    world.host_does(first, first.session.leave())
    world.deliver_all()
    world.hosts.remove(first)
    world.settle(300 * MS)
    assert second.arrived


def test_a_strangers_end_is_nothing_to_the_host() -> None:
    """A connection that never belonged to the host may close without notice to the host."""
    world = World()
    world.settle(300 * MS)
    assert world.board.unreachable(b"a stranger") == []
    assert world.board.has_host


def test_a_silent_board_is_given_up() -> None:
    """A host that hears nothing for SILENCE_NS reports the board as vanished, and not a moment earlier."""
    world = World()
    world.settle(300 * MS)
    host = world.hosts[0]
    heard_ns = world.now_ns
    host.session.receive(host.names[0, Lane.CONTROL], Status(world.board.session, BoardCounts(), Rung()), heard_ns)
    for quiet_ns in range(0, SILENCE_NS, 50 * MS):
        assert Vanished(orderly=False) not in host.session.tick(heard_ns + quiet_ns)
    assert Vanished(orderly=False) not in host.session.tick(heard_ns + SILENCE_NS - 1)
    assert host.session.is_open
    assert Vanished(orderly=False) in host.session.tick(heard_ns + SILENCE_NS)


@pytest.mark.parametrize("stopped", ["host", "board", "both"])
def test_silence_is_not_ones_own_absence(stopped: str) -> None:
    """A program that was stopped for ten seconds takes nobody for gone; only a running program that heard nothing does."""
    world = World()
    world.settle(2000 * MS)
    host, board = world.hosts[0], world.board
    arrived, others = len(host.arrived), len(host.others)
    awake = {"host": "board", "board": "host"}.get(stopped)
    for _ in range(500):
        world.now_ns += 20 * MS
        if awake == "board" and world.now_ns >= board.due_ns:
            world.board_says(board.tick(world.now_ns, world.counts))
        if awake == "host" and world.now_ns >= host.session.due_ns:
            world.host_does(host, host.session.tick(world.now_ns))
    assert board.has_host == (stopped != "host")
    assert host.session.is_open == (stopped != "board")
    world.settle(1000 * MS)
    assert len(host.arrived) > arrived
    told = [output for output in host.others[others:] if not isinstance(output, Echo)]
    assert told == [] if stopped == "both" else told


def test_a_board_that_forgot_its_host_voids_what_is_known_of_the_clocks() -> None:
    """If the board tells a host of its session that it does not know it, one of the two was away: clock, echoes and credit start again."""
    world = World()
    world.settle(2000 * MS)
    host = world.hosts[0]
    world.board.begin_clock(world.boot_id)  # forgets the host; the clock is the same
    before = len(host.others)
    world.settle(500 * MS)
    told = [output for output in host.others[before:] if not isinstance(output, Echo)]
    assert [type(output) for output in told] == [ClockVoid, LinkDown, Vanished, LinkUp]
    echoes = [output for output in host.others[before:] if isinstance(output, Echo)]
    assert len(echoes) > 5 * 5, "waves follow each other as in the first second"


def test_a_board_without_its_frames_lane_keeps_the_clock() -> None:
    """A board that has lost only the lane for frames still knows its host, and everything known of the clocks is kept."""
    world = World(links=2)
    world.settle(2000 * MS)
    host = world.hosts[0]
    before = len(host.arrived)
    name = world.board_name(host, (0, Lane.FRAMES))
    world.board_says(world.board.unreachable(name))
    world.settle(1000 * MS)
    assert not any(isinstance(output, ClockVoid) for output in host.others)
    assert len(host.arrived) > before


@pytest.mark.parametrize("board_dials", [False, True])
def test_a_refusal_counts_on_a_lane_that_was_dialled_only(*, board_dials: bool) -> None:
    """A stranger who dials a waiting host may say anything; only a board that was dialled can refuse."""
    world = World(board_dials=board_dials)
    host = world.hosts[0]
    names = {lane: host.names[0, lane] for lane in Lane}
    for connection in (*names.values(), connection_name(0, b"a stranger")):
        told = host.session.receive(connection, Refusal(RefusalReason.BUSY), world.now_ns)
        assert told == ([Refused(RefusalReason.BUSY)] if connection in names.values() and not board_dials else [])


def test_frames_beyond_the_credit_are_named_and_change_nothing() -> None:
    """A board that sends more than it may, or with a senseless index, uses up nothing that an honest frame needs."""
    world = World()
    world.settle(1000 * MS)
    host = world.hosts[0]
    before = len(host.arrived)
    for index in (2**53 - 1, world.counts.sent + 5):
        [told] = host.session.receive(host.names[0, Lane.FRAMES], frame(world.board.session, index), world.now_ns)
        assert isinstance(told, Stale)
        assert told.reason is StaleReason.BEYOND_CREDIT
    world.settle(1000 * MS)
    assert len(host.arrived) > before + 10
    assert host.lost == 0


def test_an_account_of_more_than_was_allowed_is_not_believed() -> None:
    """A board cannot have sent a frame without credit: a claim that it did makes no frame lost or repeated."""
    world = World()
    world.settle(1000 * MS)
    host = world.hosts[0]
    before = len(host.arrived)
    lie = BoardCounts(2**53, 2**53)
    told = host.session.receive(host.names[0, Lane.FRAMES], Status(world.board.session, lie, Rung()), world.now_ns)
    assert [type(output) for output in told] == [Unbelievable]
    world.settle(1000 * MS)
    assert len(host.arrived) > before + 10
    assert host.lost == 0


def test_a_link_that_was_only_slow_is_borne_with() -> None:
    """If a frame takes five seconds and everything else waits behind it, the board is given up at most once; then the host waits long enough."""
    world = World()
    world.settle(1000 * MS)
    host = world.hosts[0]
    for _ in range(4):
        before = len(host.arrived)
        while len(host.wires[0, Lane.FRAMES].to_host) == 0:
            world.pass_time(20 * MS)
            while world.deliver(host, (0, Lane.CONTROL), to_board=True):
                pass
            while world.deliver(host, (0, Lane.FRAMES), to_board=True):
                pass
        for _ in range(250):
            world.pass_time(20 * MS)
            for lane in Lane:
                while world.deliver(host, (0, lane), to_board=True):
                    pass
        world.deliver_all()
        assert len(host.arrived) > before
    assert host.others.count(Vanished(orderly=False)) <= 1
    world.camera_runs = False
    world.settle(2 * STATUS_NS)
    assert world.sent[host.board_session] == host.base_sent + host.received + host.lost


def test_a_boards_goodbye_gives_its_last_account() -> None:
    """A board that leaves on purpose is reported as such, with its final counts and the losses that they show, and is searched for again."""
    world = World()
    world.settle(300 * MS)
    host = world.hosts[0]
    sent = world.counts.sent
    host.session.grant(3)
    counts = BoardCounts(sent + 9, sent + 3)
    [goodbye] = world.board.leave(counts)
    assert goodbye.message == Bye(counts)
    frames = host.names[0, Lane.FRAMES]
    outputs = host.session.receive(frames, goodbye.message, world.now_ns)
    assert outputs == [Outgoing(frames, Bye()), Counted(counts, ended=False, lost=3, last=True), Vanished(orderly=True)]
    assert not host.session.is_open
    world.settle(1000 * MS)
    assert not host.session.is_open
    world.restart_board()
    world.settle(1000 * MS)
    assert host.session.is_open


def test_a_board_that_has_said_goodbye_begins_no_new_contact() -> None:
    """A hello that crosses its goodbye is not answered, nor is anything once the host has gone: that contact would only break."""
    world = World()
    world.settle(300 * MS)
    control = world.board_name(world.hosts[0], (0, Lane.CONTROL))
    world.board.leave(world.counts)
    hello = HostHello(host_id="h", lane=Lane.CONTROL)
    assert world.board.receive(control, hello, world.now_ns, world.counts) == []
    world.board.receive(control, Bye(), world.now_ns, world.counts)
    assert not world.board.has_host
    for message in (hello, Ping(1, 0), Credit(99)):
        assert world.board.receive(control, message, world.now_ns, world.counts) == []


def test_a_boards_clock_that_goes_back_delays_nothing() -> None:
    """What the board does now and then, it does as soon by a clock that was set back by an hour."""
    world = World()
    world.settle(300 * MS)
    back_ns = world.now_ns - 3600_000 * MS
    world.board.tick(back_ns, world.counts)
    assert back_ns < world.board.due_ns <= back_ns + STATUS_NS


def test_a_goodbye_counts_also_when_the_other_lane_broke_first() -> None:
    """The last account is taken even if the lane for frames was seen to break just before it, but not that of another life."""
    world = World()
    world.settle(300 * MS)
    host = world.hosts[0]
    host.session.grant(90)
    host.session.interrupted(host.names[0, Lane.FRAMES], world.now_ns)
    counts = BoardCounts(100, 90)
    control = host.names[0, Lane.CONTROL]
    assert host.session.receive(control, Bye(BoardCounts(1, 1)), world.now_ns) == []
    outputs = host.session.receive(control, Bye(counts), world.now_ns)
    assert outputs == [Outgoing(control, Bye()), Counted(counts, ended=False, last=True), Vanished(orderly=True)]


def test_the_end_is_said_until_it_is_heard() -> None:
    """The message that no frame follows is repeated, so that a host that missed it, or comes back later, gets it, too."""
    world = World()
    world.settle(300 * MS)
    host = world.hosts[0]
    world.camera_runs = False
    world.board.end(world.counts)  # these messages are lost
    heard: list[object] = []
    for _ in range(50):
        world.pass_time(20 * MS)
        heard += [message for message in host.wires[0, Lane.FRAMES].to_host if isinstance(message, End)]
        world.deliver_all()
    assert End(world.board.session, world.counts) in heard


def test_a_refusal_for_the_version_reaches_the_host() -> None:
    """A host that is refused, as the board is busy or for its version, gets the reason and keeps asking."""
    for reason in RefusalReason:
        world = World()
        host = world.hosts[0]
        assert host.session.receive(host.names[0, Lane.CONTROL], Refusal(reason), world.now_ns) == [Refused(reason)]
        assert not host.session.is_open
        assert any(
            isinstance(output, Outgoing) and isinstance(output.message, HostHello)
            for output in host.session.tick(host.session.due_ns)
        )


def test_strangers_are_asked_who_they_are() -> None:
    """Messages of a host from before a restart are answered with a knock, except its goodbye; none of them counts."""
    world = World()
    knock = [Outgoing(b"x", Knock(Lane.CONTROL, world.board.session))]
    for message in (Ping(1, 2), Credit(10**6), Pong(wave=1, t0_ns=2, t1_ns=3, t2_ns=4)):
        assert world.board.receive(b"x", message, world.now_ns, BoardCounts()) == knock
    assert world.board.receive(b"x", Bye(), world.now_ns, BoardCounts()) == []
    assert not world.board.has_credit
