"""A view that a live calibration took. Values only."""

from dataclasses import dataclass

from phone_host.calibration.board_pairs import BoardPair
from phone_host.calibration.causes.looks import BoardLook
from phone_host.calibration.guide.gates import Glance


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A view that was taken.

    Attributes:
        name: how reports name it.
        glance: the board's corners in it.
        looks: how it looks, left and right.
    """

    name: str
    glance: Glance
    looks: tuple[BoardLook, BoardLook]

    @property
    def pair(self) -> BoardPair:
        """Its corners, as the calibration takes them."""
        return BoardPair(self.name, self.glance.left_px, self.glance.right_px)
