"""What the host knows of a board over its lives: nothing of one is believed of the next."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from common.errors import UnavailableError
from common.frame import PixelFormat
from common.ledger import BoardMarks
from common.protocol.board_session import BoardSession
from common.protocol.message import (
    BoardCounts,
    BoardHello,
    Bye,
    FrameMessage,
    HostHello,
    Knock,
    Lane,
    Message,
    Pacing,
    Ping,
    Pong,
    Refusal,
    RefusalReason,
    Rung,
)
from common.protocol.session import (
    MS,
    ClockVoid,
    OtherBoard,
    Outgoing,
    Refused,
    Stepped,
    Unbelievable,
    connection_name,
)
from phone_host.stream.pair_queue import PairQueue
from phone_host.stream.reception import LinkFacts, Reception, refusal_text
from phone_host.sync.fifo import FifoSettings
from phone_host.sync.quarantine import Disbelief
from tests.support.session_world import CAMERA
from tests.support.unheard import Unheard

NAMES = {lane: connection_name(0, lane.name.encode()) for lane in Lane}


class Talk:
    """A host's reception and a board's session that answer each other at once; board and host share a clock.

    Args:
        dialled: whether the host called the board.
    """

    def __init__(self, *, dialled: bool = True) -> None:
        self.now_ns = 10**12
        self.said: list[Outgoing] = []
        self.queue = PairQueue(FifoSettings(8), None, CAMERA.period_ns, clock=lambda: self.now_ns)
        facts = [LinkFacts("tcp", dict(NAMES) if dialled else {}, self_paced=False)]
        self.reception = Reception(facts, "host", self.queue, Unheard(), self.said.append)
        self.begin("first")

    def begin(self, session: str) -> None:
        """A new life of the board."""
        self.board = BoardSession(session, "boot", CAMERA)
        self.sent = 0

    def run(self, ticks: int = 20) -> None:
        """Let both talk for a while, without frames."""
        for _ in range(ticks):
            self.now_ns += 10 * MS
            self.reception.tick(self.now_ns)
            self.answer()

    def answer(self) -> None:
        """Let everything that was said be answered."""
        while self.said:
            outgoing = self.said.pop(0)
            message: Message = outgoing.message
            if isinstance(message, Ping):
                message = replace(message, t0_ns=self.now_ns - MS)
            for reply in self.board.receive(
                outgoing.connection, message, self.now_ns, BoardCounts(self.sent, self.sent)
            ):
                self.reception.receive(reply.connection, reply.message, self.now_ns)

    def frame(self, **changes: object) -> FrameMessage:
        """The board's next frame, exposed 5 ms ago."""
        marks = BoardMarks(self.now_ns - 5 * MS, self.now_ns - 2 * MS, self.now_ns - MS)
        size = (CAMERA.width_px, CAMERA.height_px, PixelFormat.MJPEG)
        made = FrameMessage(self.board.session, self.sent, self.sent, *size, None, marks, b"image")
        self.sent += 1
        return replace(made, **changes)  # type: ignore[arg-type]

    def show(self, frame: FrameMessage) -> None:
        """A frame comes."""
        self.reception.receive(NAMES[Lane.FRAMES], frame, self.now_ns)


def test_a_goodbye_says_nothing_of_the_next_life() -> None:
    """After a board's orderly goodbye its next life's tail is unknown until that has said goodbye, too."""
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
    """Once it has said goodbye a host answers no knock: a new hello would keep the board from the next host."""
    talk = Talk()
    talk.run()
    talk.reception.leave(talk.now_ns)
    talk.said.clear()
    talk.reception.receive(NAMES[Lane.CONTROL], Knock(Lane.CONTROL, "first"), talk.now_ns)
    assert not any(isinstance(outgoing.message, HostHello) for outgoing in talk.said)


@pytest.mark.parametrize("dialled", [True, False])
def test_a_strangers_refusal_ends_no_waiting(*, dialled: bool) -> None:
    """Three bytes of another version, or a refusal, count from the board that was called, and from no caller."""
    talk = Talk(dialled=dialled)
    talk.reception.refuse_version(NAMES[Lane.CONTROL], "another version", talk.now_ns)
    assert talk.reception.refused(talk.now_ns) is (RefusalReason.VERSION if dialled else None)
    talk = Talk(dialled=dialled)
    talk.reception.receive(NAMES[Lane.CONTROL], Refusal(RefusalReason.BUSY), talk.now_ns)
    assert talk.reception.refused(talk.now_ns) is (RefusalReason.BUSY if dialled else None)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"sent_index": 2**53 - 1}, Disbelief.CREDIT),
        ({"width_px": CAMERA.width_px + 1}, Disbelief.SIZE),
        ({"height_px": 16384}, Disbelief.SIZE),
        ({"marks": BoardMarks(2**62, 2**62, 2**62)}, Disbelief.FUTURE),
        ({"marks": BoardMarks(-(2**62), -(2**62), -(2**62))}, Disbelief.PAST),
        ({"marks": BoardMarks(2**62, 0, -(2**62))}, Disbelief.FUTURE),
        ({"marks": BoardMarks(10**12 - MS, 10**12 - 2 * MS, 10**12 - 3 * MS)}, Disbelief.MARKS),
    ],
)
def test_a_frame_that_cannot_be_is_dropped_by_name(changes: dict[str, object], reason: Disbelief) -> None:
    """One false frame is counted by its reason, and the honest ones after it are taken as ever."""
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
    """A whole wave an hour off costs the frames until the next one, by name; no step is told."""
    talk = Talk()
    talk.run(40)
    talk.show(talk.frame())
    talk.run(10)
    wave = talk.reception._session._paths[0].waves._wave
    told_ns = talk.now_ns + 3_600_000_000_000
    talk.reception.receive(NAMES[Lane.CONTROL], Pong(wave, talk.now_ns - MS, told_ns, told_ns), talk.now_ns)
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


class TwoLinks(Talk):
    """The same over two links to one board."""

    def __init__(self, **camera: object) -> None:
        self.camera = replace(CAMERA, **camera)  # type: ignore[arg-type]
        super().__init__()
        self.far = {lane: connection_name(1, lane.name.encode()) for lane in Lane}
        on_demand = self.camera.pacing is Pacing.DEMAND
        self.queue = PairQueue(FifoSettings(8), None, CAMERA.period_ns, clock=lambda: self.now_ns, on_demand=on_demand)
        facts = [LinkFacts("ipc", dict(NAMES), self_paced=False), LinkFacts("serial", dict(self.far), self_paced=True)]
        self.reception = Reception(facts, "host", self.queue, Unheard(), self.said.append)

    def begin(self, session: str) -> None:
        """A new life of the board."""
        self.board = BoardSession(session, "boot", self.camera)
        self.sent = 0


def test_a_broken_link_costs_a_change_and_no_session() -> None:
    """When the carrier breaks the other link takes over: counted as lost and as a switch, in the same session."""
    talk = TwoLinks()
    talk.run(60)
    assert [tally.is_up for tally in talk.reception.account.links] == [True, True]
    before = talk.reception.carrier
    broken = NAMES if before == talk.reception.account.links[0].name else talk.far
    for name in broken.values():
        talk.reception.interrupted(name, talk.now_ns)
        talk.board.unreachable(name)
    talk.said = [outgoing for outgoing in talk.said if outgoing.connection not in broken.values()]
    talk.answer()
    assert talk.reception.carrier not in {"", before}
    assert sum(tally.lost for tally in talk.reception.account.links) == 1
    assert talk.reception.account.switches == 1
    assert len(talk.reception.account.sessions) == 1


def test_links_to_two_boards_are_an_error_unless_one_was_moved() -> None:
    """A second link that leads to another board from the beginning is refused with the remedy; one that was right before is only told."""
    talk = TwoLinks()
    other = BoardHello("other", "another boot", replace(CAMERA, name="theirs"), BoardCounts(), Rung())
    talk.run(60)
    moved = OtherBoard(1, other)
    talk.reception.account.links[1].lost = 1
    talk.reception._handle([moved], talk.now_ns)
    talk.reception.account.links[1].lost = 0
    with pytest.raises(UnavailableError) as caught:
        talk.reception._handle([moved], talk.now_ns)
    assert "theirs" in caught.value.problem
    assert "--link" in caught.value.remedy


def test_a_link_that_is_turned_away_is_told_once(caplog: pytest.LogCaptureFixture) -> None:
    """While one link carries, a refusal on the other is one line of the log, however often it comes, and the run goes on."""
    talk = TwoLinks()
    talk.run(60)
    for _ in range(5):
        talk.reception._handle([Refused(RefusalReason.BUSY, 1)], talk.now_ns)
    assert len([record for record in caplog.records if "link_refused" in record.getMessage()]) == 1
    assert talk.reception.connected
    assert talk.reception.refused(talk.now_ns) is RefusalReason.BUSY
    assert talk.reception.refused(talk.now_ns + 2000 * MS) is None


@pytest.mark.parametrize("reason", RefusalReason)
def test_every_refusal_has_a_remedy(reason: RefusalReason) -> None:
    """Whatever a board refuses for, the user is told what to do."""
    problem, remedy = refusal_text(reason)
    assert "board" in problem
    assert remedy


def test_nonsense_is_counted_and_told_ever_more_seldom(caplog: pytest.LogCaptureFixture) -> None:
    """Of a hundred messages that are none all are counted, and seven fill the log: the 1st, 2nd, 4th ... 64th."""
    talk = Talk()
    talk.run()
    for _ in range(99):
        talk.reception.count_garbage("noise")
    talk.reception._handle([Unbelievable("noise")], talk.now_ns)
    assert talk.reception.account.garbage == 100
    assert len([record for record in caplog.records if "garbage" in record.getMessage()]) == 7


def test_a_board_that_steps_to_a_lower_rate_is_gone_by() -> None:
    """After the board has told of another rung its period is the rung's, for pairing and for the reports."""
    talk = Talk()
    talk.run()
    rung = Rung(2, 3, period_ns=2 * CAMERA.period_ns)
    talk.reception._handle([Stepped(rung)], talk.now_ns)
    hello = talk.reception.hello
    assert hello is not None
    assert (hello.camera.period_ns, hello.rung) == (2 * CAMERA.period_ns, rung)
    assert talk.reception.account.sessions[-1].rung == rung


def test_a_board_that_shows_images_on_demand_gets_credit_for_the_room_there_is() -> None:
    """Such a board is granted as many frames as pairs have places, and each of its frames is told with its number."""
    talk = TwoLinks(pacing=Pacing.DEMAND)
    numbers: list[int | None] = []

    class Heard(Unheard):
        """Takes down the numbers."""

        def frame_arrived(self, exposed_ns: int, index: int | None) -> None:
            """A frame arrived."""
            assert exposed_ns
            numbers.append(index)

    talk.reception._listener = Heard()
    talk.run(60)
    assert talk.reception._session.outstanding == 8
    talk.show(talk.frame(sequence=5))
    talk.run(20)
    assert numbers == [5]


UPSETS: dict[str, Callable[[Talk], None]] = {
    "slept": lambda talk: talk.reception.slept(3_600_000 * MS, talk.now_ns),
    "may have slept": lambda talk: talk.reception.doubt_clock("stopped", talk.now_ns),
    "was not heard": lambda talk: talk.reception._handle([ClockVoid()], talk.now_ns),
}


@pytest.mark.parametrize("upset", UPSETS)
def test_a_host_that_slept_believes_no_clock_until_an_echo_has_come(upset: str) -> None:
    """After a sleep, or where one cannot be excluded, there is no estimate; the next echoes bring it back."""
    talk = Talk()
    talk.run(60)
    known = [talk.reception.estimate is not None]
    UPSETS[upset](talk)
    known.append(talk.reception.estimate is not None)
    talk.run(60)
    assert [*known, talk.reception.estimate is not None] == [True, False, True]


def test_a_board_that_vanished_leaves_an_open_end() -> None:
    """Silence ends the contact: no link is up, nobody is connected, and what the board sent last is not known."""
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
