"""A host's reception and a board's session that answer each other at once, in simulated time."""

from dataclasses import replace

from common.ledger import BoardMarks
from common.protocol.board_session import BoardSession
from common.protocol.message import (
    BoardCounts,
    CameraDescription,
    FrameMessage,
    Lane,
    Message,
    Ping,
)
from common.protocol.session import (
    MS,
    Outgoing,
    connection_name,
)
from phone_host.stream.frame_sink import FrameSink, LinkFacts
from phone_host.stream.pair_queue import PairQueue
from phone_host.stream.reception import Reception
from phone_host.sync.fifo import FifoSettings
from tests.support.samples import CAMERA, FRAME

NAMES = {lane: connection_name(0, lane.name.encode()) for lane in Lane}
"""The connections of the only link."""


class Talk:
    """A host's reception and a board's session that answer each other at once; board and host share a clock.

    Args:
        dialled: whether the host called the board.
        sink: where frames go; None: to a pair queue beside a host camera with a clock.
        camera: the board's.
    """

    def __init__(
        self, *, dialled: bool = True, sink: FrameSink | None = None, camera: CameraDescription = CAMERA
    ) -> None:
        self.camera = camera
        self.now_ns = 10**12
        self.said: list[Outgoing] = []
        self.wave = 0
        self.queue = PairQueue(FifoSettings(8), None, CAMERA.period_ns, clock=lambda: self.now_ns)
        facts = [LinkFacts("tcp", dict(NAMES) if dialled else {}, self_paced=False)]
        self.reception = Reception(facts, "host", sink or self.queue, self.said.append)
        self.begin("first")

    def begin(self, session: str, boot_id: str = "boot") -> None:
        """Begin a new session of the board, perhaps after a reboot."""
        self.board = BoardSession(session, boot_id, self.camera)
        self.sent = 0

    def run(self, ticks: int = 20) -> None:
        """Let both talk for a while, without frames."""
        for _ in range(ticks):
            self.now_ns += 10 * MS
            self.reception.tick(self.now_ns)
            self.answer()

    def answer(self) -> None:
        """Deliver everything that was said, and the answers."""
        while self.said:
            outgoing = self.said.pop(0)
            message: Message = outgoing.message
            if isinstance(message, Ping):
                self.wave = message.wave
                message = replace(message, t0_ns=self.now_ns - MS)
            for reply in self.board.receive(
                outgoing.connection, message, self.now_ns, BoardCounts(self.sent, self.sent)
            ):
                self.reception.receive(reply.connection, reply.message, self.now_ns)

    def frame(self, **changes: object) -> FrameMessage:
        """The board's next frame, exposed 5 ms ago."""
        marks = BoardMarks(exposed_ns=self.now_ns - 5 * MS, grabbed_ns=self.now_ns - 2 * MS, sent_ns=self.now_ns - MS)
        made = replace(
            FRAME,
            session=self.board.session,
            sent_index=self.sent,
            sequence=self.sent,
            width_px=CAMERA.width_px,
            height_px=CAMERA.height_px,
            marks=marks,
            payload=b"image",
        )
        self.sent += 1
        return replace(made, **changes)  # type: ignore[arg-type]

    def show(self, frame: FrameMessage) -> None:
        """Deliver a frame."""
        self.reception.receive(NAMES[Lane.FRAMES], frame, self.now_ns)
