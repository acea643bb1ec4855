"""How the host handles two links to one board: which one carries, what happens to one whose frames are stuck; and what it does before it has met a board."""

from dataclasses import replace

import pytest

from common.ledger import BoardMarks
from common.protocol.board_session import BoardSession
from common.protocol.message import BoardCounts, Lane, Ping
from common.protocol.session import MS, Outgoing, connection_name
from phone_host.stream.frame_sink import LinkFacts
from phone_host.stream.reception import Reception
from tests.support.samples import CAMERA, FRAME
from tests.support.unkept import Unkept

LANES = [{lane: connection_name(link, lane.name.encode()) for lane in Lane} for link in range(2)]


class TwoLines:
    """A reception, and a board that answers at once, apart from each line's round trip; they share a clock.

    Attributes:
        round_trips_ns: of each line.
        mute: connections on which no answer comes.
    """

    def __init__(self, *round_trips_ns: int, self_paced: bool = False) -> None:
        self.round_trips_ns = round_trips_ns
        self.mute: set[bytes] = set()
        self.now_ns = 10**12
        self.said: list[Outgoing] = []
        facts = [
            LinkFacts(kind, lanes, self_paced=self_paced) for kind, lanes in zip(("tcp", "ipc"), LANES, strict=True)
        ]
        self.reception = Reception(facts, "host", Unkept(), self.said.append)
        self.board = BoardSession("life", "boot", CAMERA)

    def run(self, duration_ns: int) -> list[str]:
        """Let both talk; returns the names of the links that carried, in order."""
        carriers = [self.reception.carrier]
        for _ in range(duration_ns // (20 * MS)):
            self.now_ns += 20 * MS
            self.reception.tick(self.now_ns)
            while self.said:
                self.reach_board(self.said.pop(0))
            if self.reception.carrier != carriers[-1]:
                carriers.append(self.reception.carrier)
        return carriers

    def reach_board(self, outgoing: Outgoing) -> None:
        """Deliver a message, and the answers to it."""
        name, message = outgoing.connection, outgoing.message
        if isinstance(message, Ping):
            message = replace(message, t0_ns=self.now_ns - self.round_trips_ns[name[0]])
        for reply in self.board.receive(name, message, self.now_ns, BoardCounts()):
            if reply.connection not in self.mute:
                self.reception.receive(reply.connection, reply.message, self.now_ns)


def test_the_swifter_line_comes_to_carry() -> None:
    """Of two lines the first one carries at once. If its echoes take 400 ms and the other one's 1 ms, the stream switches, in the same session."""
    lines = TwoLines(400 * MS, MS)
    assert lines.run(10_000 * MS) == ["", "tcp", "ipc"]
    assert lines.board.carrier == 1
    assert (lines.reception.account.switches, len(lines.reception.account.sessions)) == (1, 1)


def test_a_line_whose_frames_are_stuck_stays_in_the_choice() -> None:
    """If no answer comes on the preferred link's lane for frames, the other link carries, and the first one still counts as up; once repaired, it carries again."""
    lines = TwoLines(MS, MS)
    lines.mute = {LANES[0][Lane.FRAMES]}
    assert lines.run(2_000 * MS)[-1] == "ipc"
    tally = lines.reception.account.links[0]
    assert tally.is_up
    assert tally.lost == 1
    lines.mute = set()
    assert lines.run(10_000 * MS)[-1] == "tcp"


def test_without_a_board_nobody_is_steered() -> None:
    """A correction before any board has been met is dropped; once the board is there, a correction is sent."""
    lines = TwoLines(MS, MS)
    lines.reception.steer(5 * MS, lines.now_ns)
    assert lines.said == []
    lines.run(1_000 * MS)
    lines.reception.steer(5 * MS, lines.now_ns)
    [asked] = lines.said
    lines.reach_board(asked)
    assert lines.board.take_steering() == 5 * MS


def test_a_leave_that_was_taken_before_any_frame_has_an_open_end() -> None:
    """A board greeted, but nothing ever came on its lanes for frames: the account holds one session without a name, with zero counts."""
    lines = TwoLines(MS, MS)
    lines.mute = {lanes[Lane.FRAMES] for lanes in LANES}
    assert set(lines.run(500 * MS)) == {""}
    assert lines.reception.leave(lines.now_ns)
    lines.reception.lose_tail()
    [account] = lines.reception.account.sessions
    assert (account.session, account.vanished, account.received, account.latest) == ("", True, 0, BoardCounts())


def test_a_frame_tells_the_age_of_its_line() -> None:
    """Of two lines that pace themselves: a frame counts for the line that carried it, and makes its age known."""
    lines = TwoLines(MS, 400 * MS, self_paced=True)
    lines.run(1_000 * MS)
    marks = BoardMarks(exposed_ns=lines.now_ns - 5 * MS, grabbed_ns=lines.now_ns - 2 * MS, sent_ns=lines.now_ns - MS)
    frame = replace(
        FRAME, session="life", width_px=CAMERA.width_px, height_px=CAMERA.height_px, marks=marks, payload=b"image"
    )
    lines.reception.receive(LANES[0][Lane.FRAMES], frame, lines.now_ns)
    lines.run(1_000 * MS)
    carried, other = lines.reception.account.links
    assert (carried.frames, other.frames) == (1, 0)
    assert carried.age.spread().p50_ns == pytest.approx(5 * MS, abs=MS)  # the clock is known to half a round trip
    assert other.age.spread().count == 0
