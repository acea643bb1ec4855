"""What the host knows of a board over several links, and of another board at the end of one."""

from dataclasses import replace

import pytest

from common.errors import UnavailableError
from common.protocol.message import (
    BoardCounts,
    BoardHello,
    CameraDescription,
    Lane,
    Refusal,
    RefusalReason,
    Rung,
)
from common.protocol.session import MS, Outgoing, connection_name
from phone_host.stream.frame_sink import FrameSink, LinkFacts
from phone_host.stream.reception import Reception
from phone_host.stream.refusals import BoardRefusal
from tests.support.samples import CAMERA
from tests.support.talk import NAMES, Talk


class TwoLinks(Talk):
    """The same test world over two links to one board."""

    def __init__(self, *, sink: FrameSink | None = None, camera: CameraDescription = CAMERA) -> None:
        super().__init__(sink=sink, camera=camera)
        self.far = {lane: connection_name(1, lane.name.encode()) for lane in Lane}
        facts = [LinkFacts("ipc", dict(NAMES), self_paced=False), LinkFacts("serial", dict(self.far), self_paced=True)]
        self.reception = Reception(facts, "host", sink or self.queue, self.say)

    def say(self, outgoing: Outgoing) -> None:
        """Take what the host says."""
        self.said.append(outgoing)


class TwoBoards(TwoLinks):
    """The same, but from some moment on the second link leads to another board."""

    is_moved = True
    other = BoardHello(
        session="other",
        boot_id="another boot",
        camera=replace(CAMERA, name="theirs"),
        counts=BoardCounts(),
        rung=Rung(),
    )

    def say(self, outgoing: Outgoing) -> None:
        """Take what the host says; the other board gets what goes over the second link."""
        if not self.is_moved or outgoing.connection not in self.far.values():
            super().say(outgoing)

    def answer(self) -> None:
        """Deliver what was said, and the other board's hello."""
        super().answer()
        if self.is_moved:
            self.reception.receive(self.far[Lane.CONTROL], self.other, self.now_ns)


def test_a_broken_link_costs_a_change_and_no_session() -> None:
    """If the carrier breaks, the other link takes over. That is counted as lost and as a switch, in the same session."""
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


def test_links_to_two_boards_are_an_error_unless_one_was_moved(caplog: pytest.LogCaptureFixture) -> None:
    """A second link that leads to another board from the beginning is refused with the remedy; one that was right before is only reported."""
    talk = TwoBoards()
    talk.is_moved = False
    talk.run(60)
    talk.is_moved = True
    talk.run(300)
    assert "other_board" in caplog.text
    assert talk.reception.connected
    with pytest.raises(UnavailableError) as caught:
        TwoBoards().run(300)
    assert "theirs" in caught.value.problem
    assert "--link" in caught.value.remedy


def test_a_link_that_is_turned_away_is_told_once(caplog: pytest.LogCaptureFixture) -> None:
    """While one link carries, a refusal on the other is one line in the log, however often it comes, and the run continues."""
    talk = TwoLinks()
    talk.run(60)
    for _ in range(5):
        talk.reception.receive(talk.far[Lane.CONTROL], Refusal(RefusalReason.BUSY), talk.now_ns)
    assert len([record for record in caplog.records if "link_refused" in record.getMessage()]) == 1
    assert talk.reception.connected
    assert talk.reception.refused(talk.now_ns) == BoardRefusal(RefusalReason.BUSY)
    assert talk.reception.refused(talk.now_ns + 2000 * MS) is None
