"""What becomes of the part of a closed surface that no view measured."""

from enum import Enum
from typing import Final

UNSEEN_HELP: Final = "surface that no view measured: fill it in with colours from its border, fill it in pink, or cut it, which leaves the surface open"


class UnseenSurface(Enum):
    """The values of `--unseen`.

    Attributes:
        FILL: it is there, with colours from the border of the surface that was measured.
        PINK: it is there, in pink.
        CUT: it is not there; the surface is open.
    """

    FILL = "fill"
    PINK = "pink"
    CUT = "cut"
