"""One session over two links that are cut, restored and chosen in any order, on simulated time. The world itself checks that frames come once and in order."""

from dataclasses import dataclass, replace
from enum import Enum, auto

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.protocol.board_session import BoardSession
from common.protocol.host_carriage import STUCK_NS
from common.protocol.message import (
    BoardCounts,
    BoardHello,
    Bye,
    Credit,
    FrameMessage,
    HostHello,
    Knock,
    Lane,
    Message,
    Ping,
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
    LinkDown,
    OtherBoard,
    Outgoing,
    Refused,
    StaleReason,
    connection_name,
)
from tests.support.samples import CAMERA, FRAME
from tests.support.session_world import HostNode, World

LINKS = 2


class What(Enum):
    """What may happen to two links."""

    DELIVER = auto()
    DROP = auto()
    REPEAT = auto()
    BREAK = auto()
    CUT = auto()
    MEND = auto()
    CARRY = auto()
    RESTART_BOARD = auto()
    RESTART_HOST = auto()
    WAIT = auto()


@dataclass(frozen=True, slots=True)
class Event:
    """One failure, a recovery, or a choice by the host."""

    what: What
    link: int
    lane: Lane
    to_board: bool
    amount: int


EVENTS = st.lists(
    st.builds(
        Event,
        st.sampled_from([What.DELIVER] * 8 + [What.WAIT] * 6 + [What.CARRY] * 3 + list(What)),
        st.integers(0, LINKS - 1),
        st.sampled_from(Lane),
        st.booleans(),
        st.integers(1, 700),
    ),
    max_size=60,
)


def happen(world: World, event: Event) -> None:
    """Apply an event."""
    host, place = world.hosts[0], (event.link, event.lane)
    match event.what:
        case What.DELIVER:
            for _ in range(event.amount % 7 + 1):
                world.deliver(host, place, to_board=event.to_board)
        case What.DROP:
            world.drop(host, place, to_board=event.to_board)
        case What.REPEAT:
            world.deliver(host, place, to_board=event.to_board, keep=True)
        case What.BREAK:
            world.break_lane(host, place)
        case What.CUT:
            world.cut_link(event.link)
        case What.MEND:
            world.mend_link(event.link)
        case What.CARRY:
            world.host_does(host, host.session.carry(event.link, world.now_ns))
        case What.RESTART_BOARD:
            world.restart_board()
        case What.RESTART_HOST:
            world.restart_host(host)
        case What.WAIT:
            world.pass_time(event.amount * MS)


any_course = given(events=EVENTS, board_dials=st.booleans(), slots=st.integers(1, 4), alive=st.integers(0, LINKS))


@pytest.mark.many
@pytest.mark.long
@any_course
@settings(deadline=None, max_examples=50)
def test_frames_flow_over_any_link_that_is_up(
    *, events: list[Event], board_dials: bool, slots: int, alive: int
) -> None:
    """After any events, with one link silently dead or none, frames flow within silence plus a second; each is received or lost."""
    run_course(events, board_dials=board_dials, slots=slots, alive=alive)


@pytest.mark.slow
@any_course
@settings(deadline=None, max_examples=1000)
def test_frames_flow_over_any_link_that_is_up_in_many_courses(
    *, events: list[Event], board_dials: bool, slots: int, alive: int
) -> None:
    """The same, for a large sample."""
    run_course(events, board_dials=board_dials, slots=slots, alive=alive)


def run_course(events: list[Event], *, board_dials: bool, slots: int, alive: int) -> None:
    """Apply events, then check that frames flow and are accounted for."""
    world = World(board_dials=board_dials, links=LINKS)
    world.hosts[0].slots = slots
    for event in events:
        happen(world, event)
    for link in range(LINKS):
        world.mend_link(link)
        if alive not in {link, LINKS}:
            world.cut_link(link)
    world.settle(SILENCE_NS + 4000 * MS)
    host = world.hosts[0]
    host.slots = slots
    before = len(host.arrived)
    world.settle(200 * MS)
    assert len(host.arrived) >= before + 4
    assert host.board_session == world.board.session
    world.camera_runs = False
    world.settle(2 * STATUS_NS)
    assert world.sent[host.board_session] == host.base_sent + host.received + host.lost


def settled(*, board_dials: bool = False) -> World:
    """A world in which frames come over link 0, and link 1 is on standby."""
    world = World(board_dials=board_dials, links=LINKS)
    world.settle(1000 * MS)
    host = world.hosts[0]
    world.host_does(host, host.session.carry(0, world.now_ns))
    world.settle(100 * MS)
    assert host.session.carrier == 0
    return world


def with_second_link_lost() -> World:
    """A settled world whose second link has just broken; the first one carries."""
    world = settled()
    for lane in Lane:
        world.break_lane(world.hosts[0], (1, lane))
    world.cut_link(1)
    world.settle(20 * MS)
    return world


def shoot(world: World) -> None:
    """Give the board credit for one frame, and let it send that frame."""
    host = world.hosts[0]
    world.host_does(host, host.session.grant(1))
    carrier = host.session.carrier
    assert carrier is not None
    while world.deliver(host, (carrier, Lane.CONTROL), to_board=True):
        pass
    sent = world.counts.sent
    world.shoot()
    assert world.counts.sent == sent + 1


@pytest.mark.parametrize("board_dials", [False, True])
def test_a_broken_link_costs_nothing_but_what_was_under_way(*, board_dials: bool) -> None:
    """If the carrier breaks, frames come over the other link: at once if the host is notified, within STUCK_NS if the board is; one is lost."""
    world = settled(board_dials=board_dials)
    host = world.hosts[0]
    before, lost, begin_ns = len(host.arrived), host.lost, world.now_ns
    shoot(world)
    for lane in Lane:
        world.break_lane(host, (0, lane))
    world.cut_link(0)
    while host.session.carrier != 1:
        world.pass_time(20 * MS)
        world.deliver_all()
    assert world.now_ns - begin_ns <= (STUCK_NS + 200 * MS if board_dials else 60 * MS)
    world.settle(200 * MS)
    assert len(host.arrived) >= before + 3
    assert host.lost == lost + 1
    assert len({session for session, _ in host.arrived}) == 1


@pytest.mark.parametrize("board_dials", [False, True])
def test_a_choice_moves_the_stream_at_the_cost_of_one_round_trip(*, board_dials: bool) -> None:
    """At the host's choice the stream switches to the other link and back in the same session; only the frame under way may be lost."""
    world = settled(board_dials=board_dials)
    host = world.hosts[0]
    for link in (1, 0, 1):
        before = len(host.arrived)
        world.host_does(host, host.session.carry(link, world.now_ns))
        world.settle(200 * MS)
        assert host.session.carrier == link
        assert len(host.arrived) >= before + 3
    assert host.lost <= 3


def test_the_old_links_last_frame_comes_late() -> None:
    """A frame on the old link that was overtaken on the new one is lost to pairing. It is reported late once, and after that as a repetition."""
    world = settled()
    host = world.hosts[0]
    shoot(world)
    [late] = [m for m in host.wires[0, Lane.FRAMES].to_host if isinstance(m, FrameMessage)]
    world.host_does(host, host.session.carry(1, world.now_ns))
    for to_board in (True, False):
        world.deliver(host, (1, Lane.FRAMES), to_board=to_board)
    assert host.session.carrier == 1
    assert host.lost == 1
    shoot(world)
    world.deliver(host, (1, Lane.FRAMES), to_board=False)
    assert host.arrived[-1][1] == late.sent_index + 1
    world.deliver(host, (0, Lane.FRAMES), to_board=False)
    world.inject(host, late)
    assert [stale.reason for stale in host.stale] == [StaleReason.LATE, StaleReason.DUPLICATE]
    world.settle(100 * MS)
    world.camera_runs = False
    world.settle(2 * STATUS_NS)
    assert world.sent[host.board_session] == host.base_sent + host.received + host.lost


def test_a_half_dead_link_is_given_up() -> None:
    """A link whose control lane works and whose lane for frames leaves hello unanswered is reported as stuck after STUCK_NS; the stream stays."""
    world = settled()
    host = world.hosts[0]
    world.cut.add((1, Lane.FRAMES))
    begin_ns = world.now_ns
    before = len(host.arrived)
    world.host_does(host, host.session.carry(1, world.now_ns))
    while LinkDown(1, stuck=True) not in host.others:
        world.settle(20 * MS)
        assert world.now_ns - begin_ns < STUCK_NS + 300 * MS
    world.settle(200 * MS)
    assert host.session.carrier == 0
    assert len(host.arrived) >= before + (STUCK_NS // (40 * MS))


def test_a_link_that_comes_up_later_stands_by() -> None:
    """A link that starts to work later is greeted then, and carries no frame unless it is chosen; then it does."""
    world = World(links=LINKS)
    world.cut_link(0)
    world.settle(2000 * MS)
    host = world.hosts[0]
    assert host.carriers == [1]
    world.mend_link(0)
    world.settle(500 * MS)
    assert host.carriers == [1]
    world.host_does(host, host.session.carry(0, world.now_ns))
    world.settle(100 * MS)
    assert host.carriers == [1, 0]


def test_another_board_on_the_second_link_is_told_and_left_alone() -> None:
    """A link that leads to another board while ours is alive is reported within two seconds and gets a goodbye; none of its frames is taken."""
    world = with_second_link_lost()
    host = world.hosts[0]
    other = BoardHello(session="other", boot_id="another boot", camera=CAMERA, counts=BoardCounts(), rung=Rung())
    control = host.names[1, Lane.CONTROL]
    begin_ns = world.now_ns
    while OtherBoard(1, other) not in host.others:
        world.host_does(host, host.session.receive(control, other, world.now_ns))
        world.settle(200 * MS)
        assert world.now_ns - begin_ns < TAKEOVER_NS + 500 * MS
    foreign = replace(
        FRAME,
        session="other",
        sent_index=3,
        sequence=3,
    )
    world.host_does(host, host.session.receive(host.names[1, Lane.FRAMES], foreign, world.now_ns))
    assert host.stale[-1].reason is StaleReason.OLD_SESSION
    assert host.session.receive(control, Bye(BoardCounts(99, 99)), world.now_ns) == []
    before = len(host.arrived)
    world.settle(200 * MS)
    assert len(host.arrived) >= before + 4
    assert host.board_session == world.board.session


def test_a_busy_board_on_the_second_link_is_asked_calmly() -> None:
    """A link whose board is busy with another host is reported with its number and asked again every five seconds, while the first link carries."""
    world = with_second_link_lost()
    host = world.hosts[0]
    ours, other = host.names[0, Lane.CONTROL], host.names[1, Lane.CONTROL]
    account = Status(world.board.session, world.counts, Rung())
    told: list[Refused] = []
    hellos = 0
    for now_ns in range(world.now_ns, world.now_ns + 60_000 * MS, 100 * MS):
        host.session.receive(ours, account, now_ns)
        for output in host.session.tick(now_ns):
            if isinstance(output, Outgoing) and output.connection == other and isinstance(output.message, HostHello):
                hellos += 1
                answer = host.session.receive(other, Refusal(RefusalReason.BUSY), now_ns)
                told += [item for item in answer if isinstance(item, Refused)]
    assert set(told) == {Refused(RefusalReason.BUSY, 1)}
    assert 11 <= hellos <= 14


@pytest.mark.parametrize("same_host", [False, True])
def test_a_hello_on_the_wrong_lane_harms_no_other_host(*, same_host: bool) -> None:
    """A board that dials announces the right lane. A host's stream continues whatever a second host says; the second one is told that the board is busy."""
    lanes = tuple((lane, connection_name(0, lane.name.encode())) for lane in Lane)
    board = BoardSession("session", "boot", CAMERA, lanes)
    names, now_ns, counts = dict(lanes), 10**9, BoardCounts()
    for lane in Lane:
        board.receive(names[lane], HostHello("first", lane), now_ns, counts)
    board.receive(names[Lane.CONTROL], Credit(3), now_ns, counts)
    assert board.has_credit
    wrong = HostHello("first" if same_host else "second", Lane.FRAMES)
    (answer,) = board.receive(names[Lane.CONTROL], wrong, now_ns, counts)
    if same_host:
        assert answer.message == Knock(Lane.CONTROL, "session")
        knocks = board.tick(now_ns + 1000 * MS, counts)
        assert Outgoing(names[Lane.FRAMES], Knock(Lane.FRAMES, "session")) in knocks
    else:
        assert answer.message == Refusal(RefusalReason.BUSY)
        assert board.has_credit


def test_a_goodbye_is_said_on_every_link() -> None:
    """A leaving host says goodbye once on all open links, and the board's last account comes once, after its last frame."""
    world = settled()
    host = world.hosts[0]
    farewell = host.session.leave()
    assert [o.message for o in farewell if isinstance(o, Outgoing)] == [Bye(), Bye()]
    world.host_does(host, farewell)
    world.deliver(host, (1, Lane.CONTROL), to_board=True)
    assert not world.board.has_host
    world.deliver_all()
    assert world.sent[host.board_session] == host.base_sent + host.received + host.lost


def test_a_standby_costs_few_words() -> None:
    """A link that carries no frames gets no credit and no account; after ten seconds it gets one wave of three echoes a second."""
    world = settled()
    world.settle(12_000 * MS)
    said: list[object] = []
    sends = world.host_sends

    def listen(host: HostNode, connection: bytes, message: Message) -> None:
        if connection[0] == 1:
            said.append(message)
        sends(host, connection, message)

    world.host_sends = listen  # type: ignore[method-assign]  # only listens
    world.settle(4000 * MS)
    assert not any(isinstance(message, Credit | HostHello) for message in said)
    assert 9 <= sum(isinstance(message, Ping) for message in said) <= 15
    assert not world.hosts[0].lost
