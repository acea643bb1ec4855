"""A view that a live calibration took. Values only."""

from dataclasses import dataclass

from phone_host.calibration.guide.gates import Glance
from phone_host.calibration.target.pairs import BoardPair
from phone_host.calibration.target.sharpness import BoardLook


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
