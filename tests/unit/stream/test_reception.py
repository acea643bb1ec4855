"""What the host knows of a board over several sessions: nothing known of one is assumed of the next."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from common.ledger import BoardMarks
from common.protocol.message import (
    BoardCounts,
    Bye,
    CameraDescription,
    HostHello,
    Knock,
    Lane,
    Pacing,
    Ping,
    Pong,
    Refusal,
    RefusalReason,
    Rung,
    Status,
)
from common.protocol.session import MS
from phone_host.model import BoardFrame
from phone_host.stream.frame_sink import FrameSink, NoFrames
from phone_host.stream.refusals import BoardRefusal, refusal_text
from phone_host.sync.quarantine import Disbelief
from tests.support.samples import CAMERA
from tests.support.talk import NAMES, Talk
from tests.support.unkept import Unkept


def test_an_account_from_before_the_goodbye_is_not_the_last_one() -> None:
    """A leaving host waits for the board's answer. Counts that were then under way behind the last frame, and later frames, do not end the wait."""
    talk = Talk()
    talk.run(60)
    assert talk.reception.leave(talk.now_ns)
    under_way = Status("first", BoardCounts(talk.sent, talk.sent), Rung())
    talk.reception.receive(NAMES[Lane.FRAMES], under_way, talk.now_ns)
    known = [talk.reception.tail_known]
    talk.show(talk.frame())
    talk.reception.receive(NAMES[Lane.FRAMES], Bye(BoardCounts(talk.sent, talk.sent)), talk.now_ns)
    assert [*known, talk.reception.tail_known] == [False, True]
    (account,) = talk.reception.account.sessions
    assert account.latest.sent == talk.sent == account.received + account.lost


def test_a_goodbye_says_nothing_of_the_next_life() -> None:
    """After a board's orderly goodbye the tail of its next session is unknown until that one has said goodbye, too."""
    talk = Talk()
    talk.run()
    talk.reception.receive(NAMES[Lane.FRAMES], Bye(BoardCounts()), talk.now_ns)
    before = talk.reception.tail_known
    talk.said.clear()
    talk.begin("second")
    talk.run(60)
    assert talk.reception.connected
    assert (before, talk.reception.tail_known) == (True, False)
    assert talk.reception.leave(talk.now_ns)
    talk.reception.lose_tail()
    assert talk.reception.account.sessions[-1].vanished
    assert not talk.reception.account.sessions[0].vanished


def test_a_leaving_host_greets_nobody() -> None:
    """After its goodbye a host answers no knock: a new hello would keep the board from the next host."""
    talk = Talk()
    talk.run()
    talk.reception.leave(talk.now_ns)
    talk.said.clear()
    talk.reception.receive(NAMES[Lane.CONTROL], Knock(Lane.CONTROL, "first"), talk.now_ns)
    assert not any(isinstance(outgoing.message, HostHello) for outgoing in talk.said)


@pytest.mark.parametrize("dialled", [True, False])
def test_a_strangers_refusal_ends_no_waiting(*, dialled: bool) -> None:
    """Three bytes of another version, or a refusal, count if they come from the board that was called, and from no caller."""
    talk = Talk(dialled=dialled)
    talk.reception.refuse_version(NAMES[Lane.CONTROL], 4, talk.now_ns)
    assert talk.reception.refused(talk.now_ns) == (BoardRefusal(RefusalReason.VERSION, 4) if dialled else None)
    talk = Talk(dialled=dialled)
    talk.reception.receive(NAMES[Lane.CONTROL], Refusal(RefusalReason.BUSY), talk.now_ns)
    assert talk.reception.refused(talk.now_ns) == (BoardRefusal(RefusalReason.BUSY) if dialled else None)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"sent_index": 2**53 - 1}, Disbelief.CREDIT),
        ({"width_px": CAMERA.width_px + 1}, Disbelief.SIZE),
        ({"height_px": 16384}, Disbelief.SIZE),
        ({"marks": BoardMarks(exposed_ns=2**62, grabbed_ns=2**62, sent_ns=2**62)}, Disbelief.FUTURE),
        ({"marks": BoardMarks(exposed_ns=-(2**62), grabbed_ns=-(2**62), sent_ns=-(2**62))}, Disbelief.PAST),
        ({"marks": BoardMarks(exposed_ns=2**62, grabbed_ns=0, sent_ns=-(2**62))}, Disbelief.FUTURE),
        (
            {"marks": BoardMarks(exposed_ns=10**12 - MS, grabbed_ns=10**12 - 2 * MS, sent_ns=10**12 - 3 * MS)},
            Disbelief.MARKS,
        ),
    ],
)
def test_a_frame_that_cannot_be_is_dropped_by_name(changes: dict[str, object], reason: Disbelief) -> None:
    """One false frame is counted by its reason, and the honest ones after it are taken as usual."""
    talk = Talk()
    talk.run()
    for _ in range(2):
        talk.show(talk.frame())
        talk.run(6)
    taken = talk.queue.counts.received
    assert taken == 2
    talk.show(talk.frame(**changes))
    assert dict(talk.reception.account.disbelieved) == {reason: 1}
    talk.sent -= reason is Disbelief.CREDIT
    for _ in range(3):
        talk.run(6)
        talk.show(talk.frame())
    talk.run(6)
    assert talk.queue.counts.received == taken + 3
    assert dict(talk.reception.account.disbelieved) == {reason: 1}
    assert talk.reception.account.sessions[-1].lost == 0


def test_frames_wait_while_an_echo_lies_and_come_back_by_themselves() -> None:
    """A whole wave that is an hour off costs the frames until the next wave, counted by reason; no step is reported."""
    talk = Talk()
    talk.run(40)
    talk.show(talk.frame())
    talk.run(10)
    wave = talk.wave
    told_ns = talk.now_ns + 3_600_000_000_000
    talk.reception.receive(
        NAMES[Lane.CONTROL], Pong(wave=wave, t0_ns=talk.now_ns - MS, t1_ns=told_ns, t2_ns=told_ns), talk.now_ns
    )
    talk.show(talk.frame())
    assert dict(talk.reception.account.disbelieved) == {Disbelief.CLOCK: 1}
    talk.said.clear()
    talk.run(60)
    assert talk.reception.estimate is not None
    talk.show(talk.frame())
    talk.run(10)
    assert talk.queue.counts.received == 2
    assert talk.reception.account.clock_steps == 0
    assert talk.reception.account.clock_doubts == 1


class Choosy(Unkept):
    """Wants no frame of an odd number."""

    def __init__(self) -> None:
        super().__init__()
        self.taken: list[int] = []
        self.periods_ns: list[int] = []

    def begin(self, camera: CameraDescription) -> None:
        """A session of the board begins."""
        self.periods_ns.append(camera.period_ns)

    def objection(self, frame: BoardFrame) -> Disbelief | None:
        """An objection if the number is odd."""
        return Disbelief.PAST if frame.message.sequence % 2 else None

    def add_board(self, frame: BoardFrame) -> None:
        """Note the frame's number."""
        self.taken.append(frame.message.sequence)


def test_a_sink_gets_what_it_does_not_object_to() -> None:
    """A frame that the sink does not want is dropped and counted by the sink's reason. Each session is announced to it once, before its frames."""
    sink = Choosy()
    talk = Talk(sink=sink)
    talk.run()
    for _ in range(4):
        talk.show(talk.frame())
        talk.run()  # until an echo has proven the frame
    assert sink.taken == [0, 2]
    assert dict(talk.reception.account.disbelieved) == {Disbelief.PAST: 2}
    assert sink.periods_ns == [CAMERA.period_ns]


@pytest.mark.parametrize(("sink", "leave"), [(NoFrames(), 0), (Unkept(3), 3)])
def test_a_board_sends_what_the_sink_has_room_for(sink: FrameSink, leave: int) -> None:
    """The board's credit goes as far as the sink's room; the clock is learnt even without room."""
    talk = Talk(sink=sink)
    talk.run()
    sent = 0
    while talk.board.has_credit:
        talk.board.sent(talk.now_ns)
        sent += 1
    assert sent == leave
    assert talk.reception.estimate is not None
    assert talk.reception.hello is not None


class OnePlace(Choosy):
    """Has room for one frame, and for no other."""

    def room(self) -> int:
        """One, until a frame has come."""
        return 1 - len(self.taken)


def test_a_frame_that_waits_for_an_echo_takes_up_room() -> None:
    """A board is granted no second frame while the one that fills the last place still waits for an echo; both would come at once."""
    talk = Talk(sink=(sink := OnePlace()))
    talk.run()
    talk.board.sent(talk.now_ns)
    talk.show(talk.frame())
    for _ in range(20):
        talk.now_ns += 10 * MS
        talk.reception.tick(talk.now_ns)
        talk.said[:] = [outgoing for outgoing in talk.said if not isinstance(outgoing.message, Ping)]
        talk.answer()
    assert (sink.taken, talk.board.has_credit) == ([], False)
    talk.run(300)
    assert (sink.taken, talk.board.has_credit) == ([0], False)


def test_labels_beside_a_clock_are_dropped_by_name() -> None:
    """A board on demand cannot take part in a run whose own camera has a clock. If nothing else is wrong with the frame, that is the reason."""
    talk = Talk(camera=replace(CAMERA, pacing=Pacing.DEMAND))
    talk.run()
    talk.show(talk.frame())
    assert dict(talk.reception.account.disbelieved) == {Disbelief.PACING: 1}
    assert talk.queue.counts.received == 0


def test_a_frame_older_than_its_partners_is_dropped_and_the_next_one_awaited() -> None:
    """The host's frames are kept for two seconds and two periods. A board frame that is older finds no partner, and makes the host keep them longer."""
    talk = Talk()
    talk.run(300)
    for _ in range(2):
        talk.show(
            talk.frame(
                marks=BoardMarks(
                    exposed_ns=talk.now_ns - 2_500 * MS, grabbed_ns=talk.now_ns - 2 * MS, sent_ns=talk.now_ns - MS
                )
            )
        )
        talk.run()
    assert dict(talk.reception.account.disbelieved) == {Disbelief.PAST: 1}
    assert talk.queue.counts.received == 1


@pytest.mark.parametrize("reason", RefusalReason)
def test_every_refusal_has_a_remedy(reason: RefusalReason) -> None:
    """For every refusal by a board the user gets advice."""
    problem, remedy = refusal_text(BoardRefusal(reason))
    assert "board" in problem
    assert remedy


def test_nonsense_is_counted_and_told_ever_more_seldom(caplog: pytest.LogCaptureFixture) -> None:
    """Of a hundred invalid messages all are counted, and seven are logged: the 1st, 2nd, 4th ... 64th."""
    talk = Talk()
    talk.run()
    for _ in range(99):
        talk.reception.count_garbage("noise")
    talk.reception.receive(NAMES[Lane.CONTROL], Status("first", BoardCounts(10**6, 10**6), Rung()), talk.now_ns)
    assert talk.reception.account.garbage == 100
    assert len([record for record in caplog.records if "garbage" in record.getMessage()]) == 7


def test_a_board_that_steps_to_a_lower_rate_is_gone_by() -> None:
    """After the board has reported another rung, pairing and reports use that rung's period."""
    talk = Talk()
    talk.run()
    rung = Rung(index=2, last=3, changes=1, period_ns=2 * CAMERA.period_ns)
    talk.reception.receive(NAMES[Lane.CONTROL], Status("first", BoardCounts(), rung), talk.now_ns)
    hello = talk.reception.hello
    assert hello is not None
    assert (hello.camera.period_ns, hello.rung) == (2 * CAMERA.period_ns, rung)
    assert talk.reception.account.sessions[-1].rung == rung


def test_another_boot_is_another_clock() -> None:
    """When the board's process comes back, the host keeps what it knows of the clock; when the machine has rebooted, it begins anew."""
    talk = Talk()
    talk.run(60)
    known = {}
    for session, boot_id in (("second", "boot"), ("third", "another boot")):
        talk.begin(session, boot_id)
        seen = []
        while talk.reception.hello is None or talk.reception.hello.session != session:
            talk.run(1)
            seen.append(talk.reception.estimate is not None)
        known[session] = all(seen)
        talk.run(60)
        assert talk.reception.estimate is not None
    assert known == {"second": True, "third": False}


UPSETS: dict[str, Callable[[Talk], None]] = {
    "slept": lambda talk: talk.reception.slept(3_600_000 * MS, talk.now_ns),
    "may have slept": lambda talk: talk.reception.doubt_clock("stopped", talk.now_ns),
    "was not heard": lambda talk: talk.reception.receive(
        NAMES[Lane.CONTROL], Knock(Lane.CONTROL, "first"), talk.now_ns
    ),
}


@pytest.mark.parametrize("upset", UPSETS)
def test_a_host_that_slept_believes_no_clock_until_an_echo_has_come(upset: str) -> None:
    """After a sleep, or if one cannot be excluded, there is no estimate; the next echoes restore it."""
    talk = Talk()
    talk.run(60)
    known = [talk.reception.estimate is not None]
    UPSETS[upset](talk)
    known.append(talk.reception.estimate is not None)
    talk.run(60)
    assert [*known, talk.reception.estimate is not None] == [True, False, True]


def test_a_board_that_vanished_leaves_an_open_end() -> None:
    """Silence ends the contact: no link is up, nobody is connected, and what the board sent last is unknown."""
    talk = Talk()
    talk.run(60)
    assert talk.reception.carrier == "tcp"
    talk.reception.steer(5 * MS, talk.now_ns)
    for _ in range(100):
        talk.now_ns += 100 * MS
        talk.reception.tick(talk.now_ns)
    assert not talk.reception.connected
    assert not any(tally.is_up for tally in talk.reception.account.links)
    assert talk.reception.account.sessions[-1].vanished
    assert not talk.reception.ended
    talk.reception.close()


def test_a_board_that_went_away_and_came_back_was_absent_in_between() -> None:
    """From its goodbye to its next frames; a board that had shown its last image is done and not absent."""
    talk = Talk()
    talk.run()
    gone_ns = talk.now_ns
    talk.reception.receive(NAMES[Lane.FRAMES], Bye(BoardCounts(talk.sent, talk.sent)), gone_ns)
    account = talk.reception.account
    assert (account.left, account.absences[0].back_ns) == (1, None)
    assert account.was_away(gone_ns + 1, gone_ns + 2)
    talk.begin("second")
    talk.run(60)
    (absence,) = account.absences
    assert absence.gone_ns == gone_ns
    assert absence.back_ns is not None
    assert not account.was_away(absence.back_ns, absence.back_ns + MS)
    assert not account.was_away(0, gone_ns)
    account.sessions[-1].ended = True
    talk.reception.receive(NAMES[Lane.FRAMES], Bye(BoardCounts(talk.sent, talk.sent)), talk.now_ns)
    assert account.left == 1
