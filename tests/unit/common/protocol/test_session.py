"""Board and host sessions talk to each other through every link failure, on simulated time."""

from dataclasses import dataclass
from enum import Enum, auto

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.protocol.message import (
    FrameMessage,
    Lane,
)
from common.protocol.session import (
    MS,
    STATUS_NS,
    StaleReason,
)
from tests.support.session_world import World, frame


class What(Enum):
    """What may happen to a link."""

    DELIVER = auto()
    DROP = auto()
    REPEAT = auto()
    BREAK = auto()
    RESTART_BOARD = auto()
    RESTART_HOST = auto()
    SLEEP_BOARD = auto()
    RETURN_FRAME = auto()
    WAIT = auto()


@dataclass(frozen=True, slots=True)
class Event:
    """One failure, or a recovery."""

    what: What
    lane: Lane
    to_board: bool
    amount: int
    link: int = 0


EVENTS = st.lists(
    st.builds(
        Event,
        st.sampled_from([What.DELIVER] * 8 + [What.WAIT] * 6 + list(What)),
        st.sampled_from(Lane),
        st.booleans(),
        st.integers(1, 700),
    ),
    max_size=60,
)


def happen(world: World, event: Event, seen: list[FrameMessage]) -> None:
    """Apply an event to the first host's link."""
    host = world.hosts[0]
    match event.what:
        case What.DELIVER:
            for _ in range(event.amount % 7 + 1):
                world.deliver(host, (event.link, event.lane), to_board=event.to_board)
        case What.DROP:
            world.drop(host, (event.link, event.lane), to_board=event.to_board)
        case What.REPEAT:
            world.deliver(host, (event.link, event.lane), to_board=event.to_board, keep=True)
        case What.BREAK:
            world.break_lane(host, (event.link, event.lane))
        case What.RESTART_BOARD:
            world.restart_board()
        case What.RESTART_HOST:
            world.restart_host(host)
        case What.SLEEP_BOARD:
            world.sleep_board()
        case What.RETURN_FRAME:
            if seen:
                world.inject(host, seen[event.amount % len(seen)])
        case What.WAIT:
            world.pass_time(event.amount * MS)
    under_way = world.hosts[0].wires[0, Lane.FRAMES].to_host
    seen += [message for message in under_way if isinstance(message, FrameMessage)]


def chaos(events: list[Event], *, board_dials: bool, slots: int = 1, settled: bool = False) -> World:
    """A world after these events."""
    world = World(board_dials=board_dials)
    world.hosts[0].slots = slots
    if settled:
        world.settle(500 * MS)
    seen: list[FrameMessage] = []
    for event in events:
        happen(world, event, seen)
    return world


@pytest.mark.many
@given(events=EVENTS, board_dials=st.booleans(), slots=st.integers(1, 4), settled=st.booleans())
@settings(deadline=None, max_examples=150)
def test_frames_flow_again_and_every_one_is_accounted_for(
    *, events: list[Event], board_dials: bool, slots: int, settled: bool
) -> None:
    """Two seconds after any failure frames flow; then each frame sent in the session is received or counted as lost."""
    world = chaos(events, board_dials=board_dials, slots=slots, settled=settled)
    world.settle()
    host = world.hosts[0]
    host.slots = slots
    before = len(host.arrived)
    world.settle(200 * MS)
    assert len(host.arrived) >= before + 4
    assert (host.board_session, host.boot_id) == (world.board.session, world.boot_id)
    world.camera_runs = False
    world.settle(2 * STATUS_NS)
    assert world.sent[host.board_session] == host.base_sent + host.received + host.lost


@pytest.mark.parametrize("board_dials", [False, True])
def test_a_board_that_has_slept_is_greeted_anew(*, board_dials: bool) -> None:
    """After a sleep the host learns the clock again in the same session, and a frame that was under way then does not count for the new clock."""
    world = World(board_dials=board_dials)
    host = world.hosts[0]
    host.slots = 2
    world.settle(500 * MS)
    session, before = host.board_session, len(host.arrived)
    world.pass_time(20 * MS)  # a frame leaves
    assert world.sent[session] == host.base_sent + before + 1
    world.sleep_board()
    while host.boot_id != world.boot_id:  # the lane for frames is slow
        world.pass_time(20 * MS)
        for to_board in (True, False):
            world.deliver(host, (0, Lane.CONTROL), to_board=to_board)
    world.settle()
    assert host.board_session == session
    assert len(host.arrived) > before
    assert [stale.reason for stale in host.stale] == [StaleReason.OLD_SESSION]
    world.camera_runs = False
    world.settle(2 * STATUS_NS)
    assert world.sent[session] == host.base_sent + host.received + host.lost


@pytest.mark.many
@given(events=EVENTS, board_dials=st.booleans(), slots=st.integers(1, 4))
@settings(deadline=None, max_examples=100)
def test_frames_that_come_back_are_never_taken(*, events: list[Event], board_dials: bool, slots: int) -> None:
    """A frame that a transport delivers again, from this session or an earlier one, is reported as stale, and the world's own rules hold."""
    world = chaos(events, board_dials=board_dials, slots=slots, settled=True)
    host = world.hosts[0]
    for session, index in list(host.arrived)[-20:]:
        stale = len(host.stale)
        world.inject(host, frame(session, index))
        assert len(host.stale) == stale + 1
        # Between a board's waking and its new hello on the lane for frames, its session's frames are of the earlier clock.
        is_now = session == host.board_session and host.accepted_boot_id == host.boot_id
        assert host.stale[-1].reason is (StaleReason.DUPLICATE if is_now else StaleReason.OLD_SESSION)


@pytest.mark.parametrize("board_dials", [False, True])
@pytest.mark.parametrize("lane", Lane)
@pytest.mark.parametrize("lost_words", range(6))
def test_one_broken_lane_and_the_words_about_it_lost(lane: Lane, lost_words: int, *, board_dials: bool) -> None:
    """If one lane alone breaks and the next messages on the other one, knocks among them, are lost, frames flow again within 2 s."""
    world = World(board_dials=board_dials)
    world.settle(1000 * MS)
    host = world.hosts[0]
    world.break_lane(host, (0, lane))
    other = Lane.CONTROL if lane is Lane.FRAMES else Lane.FRAMES
    for _ in range(lost_words):
        world.deliver(host, (0, lane), to_board=board_dials)
        world.pass_time(20 * MS)
        for to_board in (True, False):
            world.drop(host, (0, other), to_board=to_board)
    before = len(host.arrived)
    world.settle()
    assert len(host.arrived) > before + 20


@pytest.mark.parametrize("board_dials", [False, True])
def test_a_lost_frame_does_not_take_its_credit_along(*, board_dials: bool) -> None:
    """If the only frame for which there was credit is lost silently, more credit follows and the loss is counted."""
    world = World(board_dials=board_dials)
    world.settle(1000 * MS)
    host = world.hosts[0]
    world.shoot()
    world.drop(host, (0, Lane.FRAMES), to_board=False)
    before = len(host.arrived)
    world.settle(1000 * MS)
    assert len(host.arrived) > before
    assert host.lost == 1
