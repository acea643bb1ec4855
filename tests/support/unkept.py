"""A sink for receivers that are tested alone."""

from common.protocol.message import CameraDescription
from phone_host.model import BoardFrame
from phone_host.sync.quarantine import Disbelief


class Unkept:
    """Takes every frame and keeps none: pairing is not under test.

    Args:
        slots: how many frames the board may send ahead; None: as many as the link carries.
    """

    def __init__(self, slots: int | None = None) -> None:
        self._slots = slots

    def begin(self, camera: CameraDescription) -> None:
        """A session of the board begins."""

    def change_period(self, board_period_ns: int) -> None:
        """The board's camera has another rate."""

    def void(self) -> None:
        """A clock may have stood still."""

    def room(self) -> int | None:
        """The room is always the same."""
        return self._slots

    def objection(self, frame: BoardFrame) -> Disbelief | None:
        """None: every frame is wanted."""

    def add_board(self, frame: BoardFrame) -> None:
        """The frame ends here."""

    def tick(self) -> None:
        """Time passes."""
