"""Pairs of views of a target, and why a pair is not used. Values only. Pure."""

from dataclasses import dataclass
from enum import Enum

from phone_host.calibration.target.corners import Corners


class Reason(Enum):
    """Why a pair is not used."""

    NO_PARTNER = "no partner"
    UNREADABLE = "unreadable"
    OTHER_SIZE = "other image size"
    TURNED = "turned otherwise"
    NOT_FOUND_LEFT = "board not found left"
    NOT_FOUND_RIGHT = "board not found right"
    NOT_FOUND_BOTH = "board not found in both"
    CORNERS_LEFT = "corners jump left"
    CORNERS_RIGHT = "corners jump right"
    MOVED = "not the same moment"
    REPEATED = "the same pictures again"


@dataclass(frozen=True, slots=True, eq=False)
class BoardPair:
    """The corners of one pair.

    Attributes:
        name: how reports name the pair.
        left_px: (N, 2) float64.
        right_px: (N, 2) float64, in the same order.
    """

    name: str
    left_px: Corners
    right_px: Corners


@dataclass(frozen=True, slots=True)
class Rejected:
    """A pair that is not used.

    Attributes:
        name: the pair.
        reason: why.
        detail: the reason in words, with numbers.
    """

    name: str
    reason: Reason
    detail: str


@dataclass(frozen=True, slots=True, eq=False)
class FileCorners:
    """The corners found in one picture; none if the board was not found.

    Attributes:
        name: of the file.
        corners: (N, 2), or (0, 2).
    """

    name: str
    corners: Corners
