"""How a camera is mounted: by which turn and mirroring its images become upright. Values only; the host turns the pixels."""

from collections.abc import Mapping
from enum import Enum
from typing import Final

from common.errors import SettingsError
from common.value import value


class Flip(Enum):
    """By which mirroring an image becomes right, after its turn."""

    NONE = "none"
    H = "h"
    V = "v"


@value()
class Orientation:
    """A turn, then a mirroring, that make a camera's images upright.

    Attributes:
        rotate_deg: clockwise turn: 0, 90, 180 or 270 degrees.
        flip: afterwards: none, h (left and right change places) or v (top and bottom do).
    """

    rotate_deg: int = 0
    flip: Flip = Flip.NONE

    def turned_size(self, size_px: tuple[int, int]) -> tuple[int, int]:
        """Return width and height of the upright image, given those of the camera's."""
        return size_px[::-1] if self.rotate_deg in {90, 270} else size_px

    def __str__(self) -> str:
        turn = [f"rotate={self.rotate_deg}"] if self.rotate_deg else []
        return "&".join([*turn, *([f"flip={self.flip.value}"] if self.flip is not Flip.NONE else [])])


ORIENTING: Final = frozenset({"rotate", "flip"})
"""The options of every camera URI that say how the camera is mounted."""

UPRIGHT = Orientation()
"""The images are used as the camera gives them."""


def orientation_of(options: Mapping[str, str], uri: str) -> Orientation:
    """Read the options `rotate` and `flip` of a camera URI.

    Args:
        options: the URI's options; all others are ignored.
        uri: the whole URI, for errors.

    Raises:
        SettingsError: a value is none of those allowed.
    """
    rotate, flip = options.get("rotate", "0"), options.get("flip", "none")
    if rotate not in {"0", "90", "180", "270"}:
        raise SettingsError(f"camera {uri!r} has rotate={rotate}", "give rotate=90, 180 or 270 (clockwise)")
    if flip not in {choice.value for choice in Flip}:
        raise SettingsError(f"camera {uri!r} has flip={flip}", "give flip=h (left-right) or flip=v (top-bottom)")
    return Orientation(int(rotate), Flip(flip))
