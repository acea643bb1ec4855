"""Messages between board and host while frames flow, in single cases: echoes, accounts, rungs, corrections; on simulated time."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.ledger import BoardMarks
from common.protocol.board_session import STEER_REST_NS, BoardSession
from common.protocol.message import (
    BoardCounts,
    Credit,
    FrameMessage,
    HostHello,
    Lane,
    Message,
    Ping,
    Pong,
    Rung,
    Status,
    Steer,
)
from common.protocol.session import (
    MS,
    Echo,
    LinkUp,
    Outgoing,
    Output,
    Stepped,
    connection_name,
)
from common.protocol.waves import OLD_NS, SLOW_ECHO_NS, WAVE_ECHOES_EARLY, YOUNG_NS
from common.protocol.wire import decode, encode_stamped
from tests.support.samples import CAMERA
from tests.support.session_world import World, frame


def test_echoes_of_another_life_are_ignored() -> None:
    """Answers to any wave since the link came up count as echoes, even late ones, as a round trip may take longer than a wave. Those of an earlier life do not."""
    world = World()
    world.settle(300 * MS)
    host = world.hosts[0]
    control = host.names[0, Lane.CONTROL]
    [ping] = [
        output.message
        for output in host.session.tick(host.session.due_ns)
        if isinstance(output, Outgoing) and isinstance(output.message, Ping)
    ]
    sound = Pong(wave=ping.wave, t0_ns=1, t1_ns=2, t2_ns=3)
    assert Echo(wave=ping.wave, t0_ns=1, t1_ns=2, t2_ns=3, t3_ns=world.now_ns) in host.session.receive(
        control, sound, world.now_ns
    )
    assert host.session.receive(control, Pong(wave=ping.wave - 1, t0_ns=1, t1_ns=2, t2_ns=3), world.now_ns) == [
        Echo(wave=ping.wave - 1, t0_ns=1, t1_ns=2, t2_ns=3, t3_ns=world.now_ns)
    ]
    assert host.session.receive(control, Pong(wave=0, t0_ns=1, t1_ns=2, t2_ns=3), world.now_ns) == []
    world.restart_board()
    world.settle(20 * MS)
    assert host.session.is_open
    assert not any(isinstance(o, Echo) for o in host.session.receive(control, sound, world.now_ns))


@given(st.integers(0, 2**62), st.integers(0, 2**62))
@settings(deadline=None)
def test_send_times_are_set_at_the_last_moment(then_ns: int, now_ns: int) -> None:
    """Stamping sets a ping's t0, a pong's t2 and a frame's `sent` to now, keeps everything else, and leaves other messages unchanged."""

    def stamped(message: Message, now_ns: int) -> Message:
        return decode(*encode_stamped(message, lambda: now_ns))

    assert stamped(Ping(3, then_ns), now_ns) == Ping(3, now_ns)
    assert stamped(Pong(wave=3, t0_ns=1, t1_ns=2, t2_ns=then_ns), now_ns) == Pong(
        wave=3, t0_ns=1, t1_ns=2, t2_ns=now_ns
    )
    stamped_frame = stamped(frame("s", 5), now_ns)
    assert isinstance(stamped_frame, FrameMessage)
    assert stamped_frame.marks == BoardMarks(exposed_ns=0, grabbed_ns=0, sent_ns=now_ns)
    assert stamped(Credit(9), now_ns) == Credit(9)


@pytest.mark.parametrize(("round_trip_ns", "young", "old"), [(MS // 2, 3, 2), (2 * MS, 8, 3)])
def test_slow_echoes_are_repeated_while_the_skew_is_learnt(round_trip_ns: int, young: int, old: int) -> None:
    """In a young session a wave has eight echoes on a link with slow echoes and three on a fast one; then always three; after the first minute two on a fast one."""
    world = World()
    world.settle(1500 * MS)
    host = world.hosts[0]
    control = host.names[0, Lane.CONTROL]
    for begin_ns, expected in ((world.now_ns, young), (world.now_ns + YOUNG_NS, 3), (world.now_ns + OLD_NS, old)):
        now_ns, heard = begin_ns, 0
        outputs: list[Output] = []
        while not outputs:
            now_ns += MS
            host.session.receive(control, Status("", BoardCounts(), Rung()), now_ns)  # a sign of life
            outputs = host.session.tick(now_ns)
        while pings := [o.message for o in outputs if isinstance(o, Outgoing) and isinstance(o.message, Ping)]:
            t0_ns, now_ns, heard = now_ns, now_ns + round_trip_ns, heard + 1
            outputs = host.session.receive(control, Pong(wave=pings[0].wave, t0_ns=t0_ns, t1_ns=1, t2_ns=2), now_ns)
        assert heard == expected


def test_swift_echoes_are_learnt_from_when_their_wave_has_ended() -> None:
    """A wave's echoes are given with the last answer; a slow one among them gives all at once; a wave that is cut short gives its own when the next one begins. None outlives its connection."""
    world = World()
    world.settle(300 * MS)
    host = world.hosts[0]
    control = host.names[0, Lane.CONTROL]

    def heard(outputs: list[Output]) -> list[int]:
        return [output.wave for output in outputs if isinstance(output, Echo)]

    def begun() -> tuple[int, list[int]]:
        while True:
            world.now_ns += MS
            host.session.receive(control, Status("", BoardCounts(), Rung()), world.now_ns)  # a sign of life
            outputs = host.session.tick(world.now_ns)
            for output in outputs:
                if isinstance(output, Outgoing) and isinstance(output.message, Ping):
                    return output.message.wave, heard(outputs)

    def answered(wave: int, took_ns: int) -> list[Output]:
        return host.session.receive(
            control, Pong(wave=wave, t0_ns=world.now_ns - took_ns, t1_ns=1, t2_ns=2), world.now_ns
        )

    swift_ns, slow_ns = SLOW_ECHO_NS - 1, SLOW_ECHO_NS
    whole, _ = begun()
    for _ in range(WAVE_ECHOES_EARLY - 1):
        assert answered(whole, swift_ns) == [Outgoing(control, Ping(whole, 0))]
    assert heard(answered(whole, swift_ns)) == [whole] * WAVE_ECHOES_EARLY
    mixed, before = begun()
    assert before == []
    assert heard(answered(mixed, swift_ns)) == []
    outputs = answered(mixed, slow_ns)
    assert heard(outputs) == [mixed] * 2
    assert outputs[-1] == Outgoing(control, Ping(mixed, 0))
    assert heard(answered(mixed, swift_ns)) == []
    cut_short = mixed
    following, before = begun()
    assert before == [cut_short]
    assert heard(answered(following, swift_ns)) == []
    world.restart_board()
    world.settle(20 * MS)
    assert host.session.is_open
    of_another_life, before = begun()
    assert before == []
    for _ in range(WAVE_ECHOES_EARLY):
        before += heard(answered(of_another_life, swift_ns))
    assert set(before) == {of_another_life}


def test_a_wish_to_steer_is_given_once() -> None:
    """The host's request reaches the board's camera once, as less than one period, and not again before half a second has passed."""
    world = World(board_dials=False)
    world.settle()
    host = world.hosts[0]
    connection = next(name for name, (_, place, _) in world.wires.items() if place == (0, Lane.CONTROL))
    (asked,) = host.session.steer(7 * MS)
    assert isinstance(asked, Outgoing)
    for message, given_ns in ((asked.message, 7 * MS), (Steer(CAMERA.period_ns * 5 + 3), 3)):
        world.board.receive(connection, message, world.now_ns, BoardCounts())
        assert world.board.take_steering() == given_ns
        assert world.board.take_steering() == 0
        world.now_ns += STEER_REST_NS - 1
        world.board.receive(connection, Steer(5 * MS), world.now_ns, BoardCounts())
        assert world.board.take_steering() == 0
        world.now_ns += 1


@pytest.mark.parametrize(("apart_ns", "accounts"), [(33 * MS, 20), (900 * MS, 20), (1500 * MS, 10)])
def test_accounts_are_rarer_where_frames_are_far_apart(apart_ns: int, accounts: int) -> None:
    """In ten seconds the host gets twenty accounts, or ten if frames are more than a second apart, as on a line of 115200 baud."""
    board, control, now_ns = BoardSession("board", "boot", CAMERA), connection_name(0, b"control"), 10**12
    board.receive(control, HostHello("host", Lane.CONTROL), now_ns, BoardCounts())
    told, sent_ns = 0, now_ns
    for step in range(1400):
        now_ns += 10 * MS
        if now_ns - sent_ns >= apart_ns:
            sent_ns = now_ns
            board.sent(now_ns)
        board.receive(control, Ping(0, 0), now_ns, BoardCounts())  # a sign of life
        accounted = any(isinstance(said.message, Status) for said in board.tick(now_ns, BoardCounts()))
        told += accounted and step >= 400  # before that the first two frames leave
    assert told == pytest.approx(accounts, abs=2)


def test_the_host_is_told_once_of_each_rung() -> None:
    """A camera with new settings is reported at once and once, although accounts go over two lanes and repeat it; an earlier account changes nothing."""
    world = World()
    world.settle(500 * MS)
    host = world.hosts[0]
    first, second = (
        Rung(index=1, last=3, changes=1, period_ns=66 * MS),
        Rung(index=2, last=3, changes=2, period_ns=132 * MS),
    )
    for rung in (first, second):
        camera = replace(CAMERA, period_ns=rung.period_ns)
        world.board.describe(camera, rung)
        assert world.board.due_ns <= world.now_ns
        world.settle(1500 * MS)
    assert [output for output in host.others if isinstance(output, Stepped)] == [Stepped(first), Stepped(second)]
    late = Status(world.board.session, BoardCounts(), first)
    outputs = host.session.receive(host.names[0, Lane.CONTROL], late, world.now_ns)
    assert not any(isinstance(output, Stepped) for output in outputs)


def test_a_host_that_comes_later_finds_the_camera_as_it_is() -> None:
    """A hello describes the camera with its present rung; the accounts that follow are no news."""
    world = World()
    world.settle(500 * MS)
    rung = Rung(index=2, last=3, changes=2, period_ns=132 * MS, quality=45)
    world.board.describe(replace(CAMERA, period_ns=132 * MS), rung)
    host = world.restart_host(world.hosts[0])
    world.settle(3000 * MS)
    assert host.session.is_open
    hellos = [output.hello for output in host.others if isinstance(output, LinkUp)]
    assert [(hello.rung, hello.camera.period_ns) for hello in hellos] == [(rung, 132 * MS)]
    assert not any(isinstance(output, Stepped) for output in host.others)
