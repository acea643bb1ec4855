"""What the host knows of a board over its lives: nothing of one is believed of the next."""

from dataclasses import replace

import pytest

from common.frame import PixelFormat
from common.ledger import BoardMarks
from common.protocol.board_session import BoardSession
from common.protocol.message import (
    BoardCounts,
    Bye,
    CameraDescription,
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
    Status,
)
from common.protocol.session import MS, Outgoing, connection_name
from phone_host.model import BoardFrame
from phone_host.stream.frame_sink import FrameSink, NoFrames
from phone_host.stream.pair_queue import PairQueue
from phone_host.stream.reception import LinkFacts, Reception
from phone_host.sync.fifo import FifoSettings
from phone_host.sync.quarantine import Disbelief
from tests.support.session_world import CAMERA
from tests.support.unkept import Unkept

NAMES = {lane: connection_name(0, lane.name.encode()) for lane in Lane}


class Talk:
    """A host's reception and a board's session that answer each other at once; board and host share a clock.

    Args:
        dialled: whether the host called the board.
        sink: where frames go; None: to a pair queue beside an own camera with a clock.
        camera: the board's.
    """

    def __init__(
        self, *, dialled: bool = True, sink: FrameSink | None = None, camera: CameraDescription = CAMERA
    ) -> None:
        self.camera = camera
        self.now_ns = 10**12
        self.said: list[Outgoing] = []
        self.queue = PairQueue(FifoSettings(8), None, CAMERA.period_ns, clock=lambda: self.now_ns)
        facts = [LinkFacts("tcp", dict(NAMES) if dialled else {}, self_paced=False)]
        self.reception = Reception(facts, "host", sink or self.queue, self.said.append)
        self.begin("first")

    def begin(self, session: str) -> None:
        """A new life of the board."""
        self.board = BoardSession(session, "boot", self.camera)
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
        marks = BoardMarks(exposed_ns=self.now_ns - 5 * MS, grabbed_ns=self.now_ns - 2 * MS, sent_ns=self.now_ns - MS)
        made = FrameMessage(
            session=self.board.session,
            sent_index=self.sent,
            sequence=self.sent,
            width_px=CAMERA.width_px,
            height_px=CAMERA.height_px,
            pixel_format=PixelFormat.MJPEG,
            exposure_ns=None,
            marks=marks,
            payload=b"image",
        )
        self.sent += 1
        return replace(made, **changes)  # type: ignore[arg-type]

    def show(self, frame: FrameMessage) -> None:
        """A frame comes."""
        self.reception.receive(NAMES[Lane.FRAMES], frame, self.now_ns)


def test_an_account_from_before_the_goodbye_is_not_the_last_one() -> None:
    """A leaving host waits for the board's answer: an account that was under way behind the last frame then, and frames after it, do not end the wait."""
    talk = Talk()
    talk.run(60)
    assert talk.reception.leave(talk.now_ns)
    under_way = Status("first", BoardCounts(talk.sent, talk.sent), Rung())
    talk.reception.receive(NAMES[Lane.FRAMES], under_way, talk.now_ns)
    assert not talk.reception.tail_known
    talk.show(talk.frame())
    talk.reception.receive(NAMES[Lane.FRAMES], Bye(BoardCounts(talk.sent, talk.sent)), talk.now_ns)
    assert talk.reception.tail_known
    (account,) = talk.reception.account.sessions
    assert account.latest.sent == talk.sent == account.received + account.lost


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
        """A life of the board begins."""
        self.periods_ns.append(camera.period_ns)

    def objection(self, frame: BoardFrame) -> Disbelief | None:
        """Whether the number is odd."""
        return Disbelief.PAST if frame.message.sequence % 2 else None

    def add_board(self, frame: BoardFrame) -> None:
        """Note the number."""
        self.taken.append(frame.message.sequence)


def test_a_sink_gets_what_it_does_not_object_to() -> None:
    """A frame that the sink has no use for is dropped and counted by the sink's reason; each life is told once, before its frames."""
    sink = Choosy()
    talk = Talk(sink=sink)
    talk.run()
    for _ in range(4):
        talk.show(talk.frame())
        talk.run()  # until an echo has proven it
    assert sink.taken == [0, 2]
    assert dict(talk.reception.account.disbelieved) == {Disbelief.PAST: 2}
    assert sink.periods_ns == [CAMERA.period_ns]


@pytest.mark.parametrize(("sink", "leave"), [(NoFrames(), 0), (Unkept(3), 3)])
def test_a_board_sends_what_the_sink_has_room_for(sink: FrameSink, leave: int) -> None:
    """The board's leave goes as far as the sink's room, and the clock is learnt also where there is none."""
    talk = Talk(sink=sink)
    talk.run()
    sent = 0
    while talk.board.has_credit:
        talk.board.sent(talk.now_ns)
        sent += 1
    assert sent == leave
    assert talk.reception.estimate is not None
    assert talk.reception.hello is not None


def test_labels_beside_a_clock_are_dropped_by_name() -> None:
    """A board on demand has no part in a run whose own camera has a clock; with nothing else in the frame that is wrong, that is the reason."""
    talk = Talk(camera=replace(CAMERA, pacing=Pacing.DEMAND))
    talk.run()
    talk.show(talk.frame())
    assert dict(talk.reception.account.disbelieved) == {Disbelief.PACING: 1}
    assert talk.queue.counts.received == 0


def test_a_frame_older_than_its_partners_is_dropped_and_the_next_one_awaited() -> None:
    """Own frames are kept for two seconds and two periods; a frame that is older has no partner, and lets them be kept for longer."""
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
