"""Where a board's frames go once the border believes them: into pairs, a recording or a count.

What the reception must know of the links stands here, too.

Only the receiver's thread calls a frame sink. The sink must not make it wait, or the clock's echoes would be late.
"""

from dataclasses import dataclass
from typing import Protocol

from common.protocol.message import CameraDescription, Lane
from phone_host.model import BoardFrame
from phone_host.sync.quarantine import Disbelief


@dataclass(frozen=True, slots=True)
class LinkFacts:
    """What the reception must know of a link.

    Attributes:
        kind: the transport's name.
        dialled: the connections that this side opened, with names unique over all links; empty if the board dials.
        self_paced: whether the link itself holds the next frame back until the previous one has left.
    """

    kind: str
    dialled: dict[Lane, bytes]
    self_paced: bool


class FrameSink(Protocol):
    """Takes the frames of one board."""

    def begin(self, camera: CameraDescription) -> None:
        """Begin a board session. No frame of the previous one will follow."""

    def change_period(self, board_period_ns: int) -> None:
        """Take note of the board camera's frame period from now on, ns. It is often the same as before."""

    def void(self) -> None:
        """One of the two clocks may have stood still: do not compare stamps from before and after this moment."""

    def room(self) -> int | None:
        """Return how many more frames the board may send, 0 or more. None: there is room for all the link carries."""

    def objection(self, frame: BoardFrame) -> Disbelief | None:
        """Return the reason to drop and count a frame. None: the frame is wanted, and `add_board` follows."""

    def add_board(self, frame: BoardFrame) -> None:
        """Take a frame of the board."""

    def tick(self) -> None:
        """Let time pass. Called several times a second, even while no frame comes."""


class NoFrames:
    """The frame sink of a host that only queries the board. The board gets no credit to send frames."""

    def begin(self, camera: CameraDescription) -> None:
        """See FrameSink."""

    def change_period(self, board_period_ns: int) -> None:
        """See FrameSink."""

    def void(self) -> None:
        """See FrameSink."""

    def room(self) -> int:
        """Return 0: there is no room for frames."""
        return 0

    def objection(self, frame: BoardFrame) -> None:
        """See FrameSink."""

    def add_board(self, frame: BoardFrame) -> None:
        """Ignore a frame that comes without credit."""

    def tick(self) -> None:
        """See FrameSink."""
