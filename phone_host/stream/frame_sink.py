"""Where a board's frames go once the border has believed them: into pairs, a recording, or a count.

A sink is told by the receiver's thread alone and must not make it wait: echoes of the clock would come late.
"""

from typing import Protocol

from common.protocol.message import CameraDescription
from phone_host.model import BoardFrame
from phone_host.sync.quarantine import Disbelief


class FrameSink(Protocol):
    """Takes the frames of one board."""

    def begin(self, camera: CameraDescription) -> None:
        """A life of the board begins; nothing of the one before will follow.

        Args:
            camera: the board's, as it is at this moment.
        """

    def change_period(self, board_period_ns: int) -> None:
        """The board's camera has this time between two frames from now on, ns; often the one that it had."""

    def void(self) -> None:
        """One of the two clocks may have stood still: stamps from before this moment and from after it must not be compared."""

    def room(self) -> int | None:
        """How many more frames the board may send, at least 0; None: as many as the link carries, the sink finds place for each."""

    def objection(self, frame: BoardFrame) -> Disbelief | None:
        """Why a frame is of no use here, by which it is dropped and counted; None: it is wanted, and `add_board` follows."""

    def add_board(self, frame: BoardFrame) -> None:
        """Take a frame of the board."""

    def tick(self) -> None:
        """Let time pass; called several times a second, also while no frame comes."""


class NoFrames:
    """The sink of a host that only asks the board something: the board is given no leave to send frames."""

    def begin(self, camera: CameraDescription) -> None:
        """See FrameSink."""

    def change_period(self, board_period_ns: int) -> None:
        """See FrameSink."""

    def void(self) -> None:
        """See FrameSink."""

    def room(self) -> int:
        """There is no place for any."""
        return 0

    def objection(self, frame: BoardFrame) -> None:
        """See FrameSink."""

    def add_board(self, frame: BoardFrame) -> None:
        """A frame that comes without leave is let go."""

    def tick(self) -> None:
        """See FrameSink."""
